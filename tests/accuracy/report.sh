#!/bin/sh
# SPDX-License-Identifier: MIT
# report.sh PROGRAM DATA [REPEATS]: runs the experiments into the folder DATA, draws the pictures beside this file and
# replaces the tables in results/. PROGRAM "": with the figures that DATA has. ./dev report calls it.
set -eu
here=$(dirname "$0")
program=$1 data=$2
mkdir -p "$data"
[ -z "$program" ] || "$program" "$here/scenes" "$data" "${3:-5}" 2>"$data/log" || { cat "$data/log" >&2; exit 1; }
gnuplot -e "data='$data'; out='$here'" "$here/plots.gp"
sh "$here/keep.sh" report "$data" "${3:-5} runs of each"
