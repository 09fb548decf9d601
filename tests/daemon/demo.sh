#!/bin/bash
# SPDX-License-Identifier: MIT
# ./dev demo with a mesh, without its building: in a network of its own (in_namespace.sh), with the
# programs of the folder $1. It presses what it can reach, and fails where no contact is reported.
set -u
programs=$1
dev=$(dirname "$0")/../../dev
command -v gnuplot >/dev/null || { echo "skipped: no gnuplot for the pictures"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir "$folder/bin"
ln -s "$programs"/pliant{d,-prepare,-monitor,-probe} "$folder/bin/"

fail() { cat "$folder/log"; echo "FAILED: $*"; exit 1; }

# demo FILE OPTIONS: its exit status; what it said is in $folder/log
demo() {
    PLIANT_BIN=$folder/bin PLIANT_OUT=$folder/out WEB_SOCKET='' STAY=no \
        timeout 120 bash "$dev" demo-inside 8080 "$@" >"$folder/log" 2>&1 </dev/null
}

# Two tetrahedra of 10 cm, the upper one far above what holds the lower one.
cat >"$folder/pair.obj" <<'MESH'
v 0 0 0
v 100 0 0
v 0 100 0
v 0 0 100
v 0 0 200
v 100 0 200
v 0 100 200
v 0 0 300
f 1 3 2
f 1 2 4
f 2 3 4
f 3 1 4
f 5 7 6
f 5 6 8
f 6 7 8
f 7 5 8
MESH
demo "$folder/pair.obj" --units mm --model voxel || fail "the demo of two solids ended with $?"
# Loose, the upper one weighs 0.17 kg and is pushed away with less than 0.01 N.
awk '/^force max/ { felt = $3 } END { exit !(felt >= 0.05) }' "$folder/log" ||
    fail "the press was not felt"
[ -s "$folder/out/force.png" ] || fail "there is no picture of the force"

# A mesh that can be neither is refused with the reason.
printf 'v 0 0 0\nv 1e-6 0 0\nv 0 1e-6 0\nf 1 2 3\n' >"$folder/dust.obj"
demo "$folder/dust.obj" --units m && fail "a mesh of no use was taken"
grep -q 'no scene can be made from' "$folder/log" || fail "it does not say why"

# A probe without contact from any side is a failure.
rm "$folder/bin/pliant-probe"
cat >"$folder/bin/pliant-probe" <<'PROBE'
#!/bin/bash
while [ "$1" != --log ]; do shift; done
printf '# time\n0 0 0 0 0 0 0 0\n' >"$2"
PROBE
chmod +x "$folder/bin/pliant-probe"
demo "$folder/pair.obj" --units mm && fail "a press without a force ended as a success"
grep -q 'the probe felt nothing from any side' "$folder/log" || fail "it does not say so"
echo "the demo presses what it reaches"
