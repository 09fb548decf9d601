#!/bin/sh
# SPDX-License-Identifier: MIT
# reality.sh PROGRAMS DATA: the tables and pictures of reality.md, with the programs in the folder PROGRAMS. ./dev report calls
# it.
set -eu
here=$(dirname "$0")
programs=$1 data=$2
mkdir -p "$data"
"$programs/pliant-voxel-accuracy" "$here/scenes" "$data" 1 reality reality-fine reality-fit 2>"$data/log" || {
    cat "$data/log" >&2
    exit 1
}
"$programs/pliant-strip-accuracy" "$here/scenes" "$data" 1 2>"$data/log" || {
    cat "$data/log" >&2
    exit 1
}
gnuplot -e "data='$data'; out='$here'" "$here/reality.gp"
sh "$here/keep.sh" reality "$data" ""
