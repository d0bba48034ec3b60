# Functions for .ci/run and .ci/long, to be sourced: run steps, and print their durations at the end.

cd "$(dirname "${BASH_SOURCE[0]}")/.."

times_of_steps=() running=

# Runs a command, which must succeed.
step() {
    printf '\n== %s\n' "$*"
    running=$* begun_s=$SECONDS
    "$@"
    note_time ""
}

note_time() {
    times_of_steps+=("$(printf '%5d s  %s' $((SECONDS - begun_s)) "$running$1")")
    running=
}

# Runs functions at the same time, and prints the output and the times of each. Fails if one of them fails.
at_the_same_time() {
    local lane lanes=() out status=0
    out=$(mktemp -d)
    for lane in "$@"; do
        (
            times_of_steps=() SECONDS=0
            trap print_times EXIT
            "$lane"
        ) >"$out/$lane" 2>&1 &
        lanes+=($!)
    done
    for lane in "${lanes[@]}"; do
        wait "$lane" || status=1
    done
    cat "$out"/*
    rm -r "$out"
    return "$status"
}

print_times() {
    [ -z "$running" ] || note_time ": FAILED"
    printf '\n== times\n'
    printf '%s\n' "${times_of_steps[@]}" "$(printf '%5d s  total' "$SECONDS")"
}
trap print_times EXIT
