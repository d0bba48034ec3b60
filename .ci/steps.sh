# What .ci/run and .ci/long have in common: steps, and at the end how long each took. To be sourced.

cd "$(dirname "${BASH_SOURCE[0]}")/.."

times_of_steps=()

# Runs a command, which has to succeed.
step() {
    printf '\n== %s\n' "$*"
    local begun_s=$SECONDS
    "$@"
    times_of_steps+=("$(printf '%5d s  %s' $((SECONDS - begun_s)) "$*")")
}

told() {
    local status=$?
    [ "$status" = 0 ] || times_of_steps+=("failed, after $SECONDS s in all")
    printf '\n== times\n'
    printf '%s\n' "${times_of_steps[@]}" "$(printf '%5d s  in all' "$SECONDS")"
}
trap told EXIT
