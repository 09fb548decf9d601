#!/bin/sh
# SPDX-License-Identifier: MIT
# The smallest example beside the real daemon: frame by frame the ball is where its scene has it.
#   watch.sh PLIANTD SCENE WATCH
"$1" "$2" >/dev/null 2>&1 &
daemon=$!
trap 'kill "$daemon"; wait' EXIT
felt=$(timeout 60 "$3" ball 5) || { echo "no five frames within a minute"; exit 1; }
echo "$felt"
# T s: N nodes from (x y z) to (x y z) m; node 0 and its likes lie 50 mm from the centre, on no axis
# further out.
echo "$felt" | tr -d '()' | awk '
    NF != 13 || $3 != 162 { wrong = "line " NR ": " $0 }
    { for (i = 6; i <= 8; i++) if ($i < -0.0501 || $i > -0.04) wrong = "low end " $i
      for (i = 10; i <= 12; i++) if ($i > 0.0501 || $i < 0.04) wrong = "high end " $i }
    NR > 1 && $1 <= time { wrong = "time stands still at " $1 }
    { time = $1 }
    END { if (NR != 5) wrong = NR " frames"
          if (wrong) { print wrong; exit 1 } }'
