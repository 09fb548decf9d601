#!/bin/sh
# SPDX-License-Identifier: MIT
# Runs the experiments whose figures do not depend on the machine's speed again, and compares them with the
# committed tables: check_report.sh PROGRAMS figures|strip [RESULTS]. `strip`, pulls until what relaxes has relaxed, takes
# twice as long as the others together. What is left (Table 1, thresholds, presses of 32^3 cells) takes minutes.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
programs=$1 part=$2 results=${3:-$here/results}
work=$(mktemp -d "${TMPDIR:-/tmp}/pliant-report-XXXXXX")
trap 'rm -rf "$work"' EXIT
if [ "$part" = strip ]; then
    tables=strip
    "$programs/pliant-strip-accuracy" "$here/scenes" "$work" 1 2>"$work/log" || { cat "$work/log" >&2; exit 1; }
else
    tables="fig8 disc"
    "$programs/pliant-accuracy" "$here/scenes" "$work" 1 masses collapse damping fabric region constant 2>"$work/log" ||
        { cat "$work/log" >&2; exit 1; }
    "$programs/pliant-voxel-accuracy" "$here/scenes" "$work" 1 disc cube beams organ cuts reality 2>"$work/log" ||
        { cat "$work/log" >&2; exit 1; }
fi
compare() { awk -v results="$1" -f "$here/check_report.awk" "$work"/*.tsv; }
compare "$results" || {
    echo "the figures are not those of this build: ./dev report surface voxel reality" >&2
    exit 1
}
# It can fail: one figure altered is found.
for table in $tables; do
    rm -rf "$work/altered"
    cp -r "$results" "$work/altered"
    sed -i '2 s/[0-9]/&7/' "$work/altered/$table.tsv"
    ! compare "$work/altered" >/dev/null 2>&1 || { echo "an altered figure of $table.tsv was not found" >&2; exit 1; }
done

[ "$part" = figures ] || exit 0
# The study's beams: deflections of the affine element over that of the finest, from rows that give them over
# CalculiX's. Both are rounded to 1e-4 of themselves, so their ratio to 2e-4.
"$programs/pliant-study-beam" >"$work/beam"
awk -F '\t' 'NR == FNR { if ($1 == "affine") { of[$2] = $3; n++ } next }
    $1 == "affine" { says[$2] = 1 + $3 / 100; m++ }
    END {
        for (k in of) {
            off = says[k] / says[8] - of[k] / of[8]
            if (off > 2e-4 || off < -2e-4) { print "beam.tsv: affine, " k ": off by " off; failed = 1 }
        }
        exit failed || n != 4 || m != 4
    }' "$work/beam" "$results/beam.tsv" || { echo "beam.tsv is not that of this build" >&2; exit 1; }
