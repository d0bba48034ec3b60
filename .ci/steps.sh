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

print_times() {
    [ -z "$running" ] || note_time ": FAILED"
    printf '\n== times\n'
    printf '%s\n' "${times_of_steps[@]}" "$(printf '%5d s  total' "$SECONDS")"
}
trap print_times EXIT
