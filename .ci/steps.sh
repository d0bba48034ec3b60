# What .ci/run and .ci/long have in common: steps, and at the end how long each took. To be sourced.

cd "$(dirname "${BASH_SOURCE[0]}")/.."

times_of_steps=() running=

# Runs a command, which has to succeed.
step() {
    printf '\n== %s\n' "$*"
    running=$* begun_s=$SECONDS
    "$@"
    took ""
}

took() {
    times_of_steps+=("$(printf '%5d s  %s' $((SECONDS - begun_s)) "$running$1")")
    running=
}

tell_times() {
    [ -z "$running" ] || took ": FAILED"
    printf '\n== times\n'
    printf '%s\n' "${times_of_steps[@]}" "$(printf '%5d s  in all' "$SECONDS")"
}
trap tell_times EXIT
