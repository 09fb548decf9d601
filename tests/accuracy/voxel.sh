#!/bin/sh
# SPDX-License-Identifier: MIT
# voxel.sh PROGRAMS DATA [REPEATS]: the same for voxel bodies, with the programs in the folder
# PROGRAMS and, where it is installed, CalculiX. PROGRAMS "": with the figures that DATA has.
# ./dev report calls it.
set -eu
here=$(dirname "$0")
programs=$1 data=$2 repeats=${3:-5}
mkdir -p "$data"

experiments()
{
    "$programs/pliant-voxel-accuracy" "$here/scenes" "$data" "$repeats"
    "$programs/pliant-plane-cost" "$data" $((4 * repeats))
    code=0
    sh "$here/cantilever_ccx.sh" 0 0.3 >"$data/ccx.md" || code=$?
    [ $code -eq 0 ] || [ $code -eq 77 ] || return $code
}
[ -z "$programs" ] || experiments 2>"$data/log" || { cat "$data/log" >&2; exit 1; }

# The cantilever's own columns and CalculiX's, by nu and elements; "-": it is not installed.
awk -F '\t' -v OFS='\t' -v ccx="$data/ccx.md" '
    BEGIN {
        while ((getline line < ccx) > 0) {
            gsub(/[| ]+/, " ", line)
            n = split(line, word, " ")
            if (word[1] == "sagging,") nu = word[1]
            if (word[1] == "nu") { nu = word[3]; sub(/,/, "", nu) }
            else if (word[1] ~ /^[0-9]+$/) { modes[nu, word[1]] = word[2]; full[nu, word[1]] = word[3] }
        }
    }
    NR == 1 { print $0, "C3D8I", "C3D8"; next }
    { k = $1 SUBSEP $2; print $0, k in modes ? modes[k] : "-", k in full ? full[k] : "-" }
    ' "$data/cantilever-own.tsv" >"$data/cantilever.tsv"

# Fig. 11: a name and the percentages of a to e.
awk -F '\t' -v OFS='\t' '
    function bar(name, a, b, c, d, e,    all) {
        all = a + b + c + d + e
        print name, 100 * a / all, 100 * b / all, 100 * c / all, 100 * d / all, 100 * e / all
    }
    BEGIN {
        bar("paper: Pentium 4, OO", 0.52, 0.33, 0.15, 0.94, 1.39)
        bar("paper: Pentium 4, fast", 0.26, 0.23, 0.12, 0.08, 0.38)
        bar("paper: Athlon 64, fast", 0.16, 0.24, 0.05, 0.06, 0.26)
    }
    FNR > 1 && FILENAME ~ /plane/ && $2 == 172 { bar("plane: " $1, $4, $5, $6 + 0, $7, $8) }
    FNR > 1 && FILENAME ~ /space/ && $1 !~ /miyazaki/ { bar("space: " $1, $4, $5, $6 + 0, $7, $8) }
    ' "$data/plane1.tsv" "$data/cost-space.tsv" >"$data/bars.dat"

gnuplot -e "data='$data'; out='$here'" "$here/voxel.gp"
sh "$here/keep.sh" voxel "$data" "$repeats runs of each; CalculiX: $(
    [ -s "$data/ccx.md" ] && ccx -v | grep -o '[0-9][0-9.]*' | head -n 1 || echo not installed)"
