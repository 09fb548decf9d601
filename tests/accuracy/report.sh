#!/bin/sh
# report.sh PROGRAM DATA [REPEATS]: runs the experiments into the folder DATA, draws the pictures
# beside this file and fills its templates' tables in. PROGRAM "": with the figures that DATA has.
# pliant-plane-cost is beside PROGRAM. ./dev report calls it.
set -eu
here=$(dirname "$0")
program=$1 data=$2
mkdir -p "$data"
[ -z "$program" ] || "$program" "$here/scenes" "$data" "${3:-5}" 2>"$data/log" || { cat "$data/log" >&2; exit 1; }
[ -z "$program" ] || "$(dirname "$program")/pliant-plane-cost" "$data"
gnuplot -e "data='$data'; out='$here'" "$here/plots.gp"

# A line "@table NAME" becomes the table DATA/NAME.tsv: from NAME.in.md to NAME.md, with the machine
# and WORDS below.
fill() { # NAME WORDS
    awk -v data="$data" -F '\t' '
        function cells(line,    n, cell, i, row) {
            n = split(line, cell, "\t")
            row = "|"
            for (i = 1; i <= n; i++) row = row " " cell[i] " |"
            return row
        }
        !/^@table / { print; next }
        {
            file = data "/" substr($0, 8) ".tsv"
            for (row = 0; (getline line < file) > 0; row++) {
                print cells(line)
                if (row == 0) { gsub(/[^\t]+/, "---", line); print cells(line) }
            }
            if (row < 2) { print "report.sh: no table " file > "/dev/stderr"; exit 1 }
            close(file)
        }' "$here/$1.in.md" >"$data/$1.md"
    { cat "$data/$1.md"
      printf '\n%s, %s%s.\n' \
        "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" "$(uname -m)" "$2"
    } >"$here/$1.md"
}
fill report ", ${3:-5} runs of each"
fill plane ""
