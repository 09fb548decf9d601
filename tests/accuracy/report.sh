#!/bin/sh
# report.sh PROGRAM DATA [REPEATS]: runs the experiments into the folder DATA, draws the pictures
# beside this file and fills its template's tables in. PROGRAM "": with the figures that DATA has.
# ./dev report calls it.
set -eu
here=$(dirname "$0")
program=$1 data=$2
mkdir -p "$data"
[ -z "$program" ] || "$program" "$here/scenes" "$data" "${3:-5}" 2>"$data/log" || { cat "$data/log" >&2; exit 1; }
gnuplot -e "data='$data'; out='$here'" "$here/plots.gp"
awk -v data="$data" -f "$here/tables.awk" "$here/report.in.md" >"$data/report.md"
{ cat "$data/report.md"
  printf '\n%s, %s, %s runs of each.\n' \
    "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" "$(uname -m)" "${3:-5}"
} >"$here/report.md"
