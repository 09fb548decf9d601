#!/bin/sh
# SPDX-License-Identifier: MIT
# study_adaptive.sh PROGRAMS DATA [SCENE...]: error against run time of solids with and without elements that follow the
# tool, by pliant-adaptive-curves of the folder PROGRAMS: a table, results/study-adaptive.tsv, and a picture for each scene,
# study-adaptive-SCENE.png. PROGRAMS "": with the figures that DATA has. All scenes take about ten minutes, the small ones
# (block, organ-volume) seconds: `SCENE...` replaces only their rows.
set -eu
here=$(dirname "$0")
programs=$1 data=$2
shift 2
mkdir -p "$data"
[ $# -gt 0 ] || set -- block organ-volume cube cube-64 liver-fine
table=$here/results/study-adaptive.tsv

for scene in "$@"; do
    if [ -n "$programs" ]; then
        "$programs/pliant-adaptive-curves" "$here/../../config" "$scene" |
            awk -F '\t' -v scene="$scene" 'NR == 1 || $1 == scene' >"$data/adaptive-$scene.tsv"
    fi
    gnuplot -e "table='$data/adaptive-$scene.tsv'; scene='$scene'; picture='$here/study-adaptive-$scene.png'" \
        "$here/study_adaptive.gp"
done

# The rows of these scenes, and of the others as they are.
set -- block organ-volume cube cube-64 liver-fine
for scene in "$@"; do
    if [ -f "$data/adaptive-$scene.tsv" ]; then
        cat "$data/adaptive-$scene.tsv"
    elif [ -f "$table" ]; then
        awk -F '\t' -v scene="$scene" 'NR == 1 || $1 == scene' "$table"
    fi
done | awk 'NR == 1 { head = $0; print } $0 != head' >"$data/study-adaptive.tsv"
cp "$data/study-adaptive.tsv" "$table"
