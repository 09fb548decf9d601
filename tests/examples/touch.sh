#!/bin/sh
# SPDX-License-Identifier: MIT
# An example against the real daemon: the ball resists what the example pushes into it, and yields.
#   touch.sh PLIANTD PLIANT-MONITOR SCENE COMMAND...
pliantd=$1 monitor=$2 scene=$3
shift 3
out=$(mktemp -d) || exit 1
trap 'kill "$daemon" 2>/dev/null; wait; rm -rf "$out"' EXIT
"$pliantd" "$scene" >"$out/daemon" 2>&1 &
daemon=$!
tries=0
until "$monitor" --once >"$out/monitor" 2>&1; do # waits up to 3 s itself
    tries=$((tries + 1))
    if [ $tries = 20 ] || ! kill -0 $daemon; then
        cat "$out/daemon" "$out/monitor"
        exit 1
    fi
done
# The tip of 10 mm comes along -y, onto node 0 at (-26, 43, 0) mm.
"$@" ball -0.026 0.07 0 0 -0.03 0 >"$out/felt" || exit 1
cat "$out/felt"
# Lines: tool x y z m force x y z N node 0 x y z m. What was felt is between first and last line.
awk '
    NF != 16 { wrong = "line " NR " has " NF " words" }
    $3 < tool || NR == 2 { tool = $3 }
    $8 > force { force = $8 }
    $14 > 0 && ($14 < node || !node) { node = $14 }
    END {
        if (NR < 41) wrong = "only " NR " lines"
        if (!(tool <= 0.05)) wrong = "the tool came to y = " tool " m only"
        if (!(force >= 0.05)) wrong = "the ball pushed back with " force " N at most"
        if (!(node > 0.03 && node <= 0.042)) wrong = "node 0 came to y = " node " m"
        if (wrong) { print wrong; exit 1 }
    }' "$out/felt"
