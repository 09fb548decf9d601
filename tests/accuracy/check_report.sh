#!/bin/sh
# Runs the experiments whose figures do not depend on the machine's speed again, and compares them with the
# committed reports: check_report.sh PROGRAMS [REPORTS]. The others (Table 1, thresholds, presses of 32^3 cells) take
# minutes.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
programs=$1 reports=${2:-$here}
work=$(mktemp -d "${TMPDIR:-/tmp}/pliant-report-XXXXXX")
trap 'rm -rf "$work"' EXIT
"$programs/pliant-accuracy" "$here/scenes" "$work" 1 masses collapse damping fabric region constant 2>"$work/log" ||
    { cat "$work/log" >&2; exit 1; }
"$programs/pliant-voxel-accuracy" "$here/scenes" "$work" 1 disc cube beams organ cuts reality 2>"$work/log" ||
    { cat "$work/log" >&2; exit 1; }
"$programs/pliant-strip-accuracy" "$here/scenes" "$work" 1 2>"$work/log" || { cat "$work/log" >&2; exit 1; }
awk -f "$here/check_report.awk" "$reports/report.md" "$reports/voxel.md" "$reports/reality.md" "$work"/*.tsv || {
    echo "the reports are not those of this build: ./dev report surface voxel reality" >&2
    exit 1
}
# The study's beams: deflections of the affine element over that of the finest, from rows that give them over
# CalculiX's. Both are rounded to 1e-4 of themselves, so their ratio to 2e-4.
"$programs/pliant-study-beam" >"$work/beam"
awk -F '\t' 'NR == FNR { if ($1 == "affine") { of[$2] = $3; n++ } next }
    /^\| affine \|/ { split($0, cell, / *\| */); says[cell[3]] = 1 + cell[4] / 100; m++ }
    END {
        for (k in of) {
            off = says[k] / says[8] - of[k] / of[8]
            if (off > 2e-4 || off < -2e-4) { print "study.md: affine, " k ": off by " off; failed = 1 }
        }
        exit failed || n != 4 || m != 4
    }' "$work/beam" "$reports/study.md" || { echo "study.md is not that of this build" >&2; exit 1; }

# It can fail: one figure of each report altered is found.
for report in report voxel reality; do
    mkdir -p "$work/altered"
    cp "$reports/report.md" "$reports/voxel.md" "$reports/reality.md" "$work/altered"
    line=$(grep -n '^| [a-z].*[0-9]' "$work/altered/$report.md" | head -n 1 | cut -d: -f1)
    sed -i "$line s/[0-9]/&7/" "$work/altered/$report.md"
    ! awk -f "$here/check_report.awk" "$work/altered/report.md" "$work/altered/voxel.md" "$work/altered/reality.md" \
        "$work"/*.tsv \
        >/dev/null 2>&1 || { echo "an altered figure of $report.md was not found" >&2; exit 1; }
done
