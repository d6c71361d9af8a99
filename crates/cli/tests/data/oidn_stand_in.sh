#!/bin/sh
# Takes the arguments of Open Image Denoise's oidnDenoise and denoises nothing: its answer is the albedo, or without one the
# noisy image. Appends its arguments to $STAND_IN_LOG; fails if $STAND_IN_FAILS says why.
if [ -n "$STAND_IN_FAILS" ]; then
    echo "Error: $STAND_IN_FAILS" >&2
    exit 3
fi
[ -z "$STAND_IN_LOG" ] || echo "$@" >>"$STAND_IN_LOG"
while [ $# -gt 0 ]; do
    case "$1" in
        --hdr) noisy=$2 ;;
        --alb) albedo=$2 ;;
        --nrm) ;;
        -o) output=$2 ;;
        *) exit 4 ;;
    esac
    shift 2
done
cp "${albedo:-$noisy}" "$output"
