#!/bin/sh
# SPDX-License-Identifier: MIT
# The example that reads packets, which shares no code with ours: as many nodes as the floats beside them, at most half a
# step of the grid away. points_py.sh LCM-GEN TOP PLIANTD SCENE. Skipped (77) as touch_py.sh.
lcm_gen=$1 top=$2 pliantd=$3
if ! python3 -c 'import ctypes; ctypes.CDLL("liblcm.so.1")' 2>/dev/null; then
    echo "skipped: no python3 with ctypes, or no liblcm.so.1"
    exit 77
fi
out=$(mktemp -d) || exit 1
PYTHONPATH=$out PYTHONDONTWRITEBYTECODE=1
export PYTHONPATH PYTHONDONTWRITEBYTECODE
trap 'kill "$daemon" 2>/dev/null; wait; rm -rf "$out"' EXIT
"$lcm_gen" -p --ppath "$out" "$top"/lcmtypes/*.lcm || exit 1
sed 's/^publish = {/publish = { positions = "both"; /' "$4" >"$out/scene.cfg"
"$pliantd" "$out/scene.cfg" >"$out/daemon" 2>&1 &
daemon=$!
timeout 60 python3 "$top/clients/examples/points.py" ball 5 >"$out/read" || { cat "$out/daemon"; exit 1; }
cat "$out/read"
# frame N: P packets, N of 162 nodes, node 0 at x y z, off by D m at most. Half of 2^-17 m; a float beside it is exact.
awk '
    NR > 1 && ($5 != 162 || $7 != 162) { wrong = "frame " $2 " has " $5 " nodes" } # the first may have begun before
    !($17 <= 3.9e-6) { wrong = "frame " $2 " is off by " $17 " m" }
    $17 > 0 { floats = 1 }
    END { if (NR != 5 || !floats) wrong = NR " frames"
          if (wrong) { print wrong; exit 1 } }' "$out/read"
