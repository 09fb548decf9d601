#!/bin/sh
# SPDX-License-Identifier: MIT
# A scene certified twice gives the same bytes, and what touch.md says: check.sh PROGRAM SCENE...
set -eu
program=$1
shift
here=$(dirname "$0")
work=$(mktemp -d "${TMPDIR:-/tmp}/pliant-touch-XXXXXX")
trap 'rm -rf "$work"' EXIT
failed=0

# The rows of a table with the column of one scene alone.
column() {
    awk -F ' *[|] *' -v scene="$2" '/^[|]/ {
        if (!column) for (k = 6; k <= NF; k++) if ($k == scene) column = k
        if (column && $2 !~ /---/) print $2, "|", $3, "|", $4, "|", $5, "|", $column }' "$1"
}

for scene in "$@"; do
    for run in 1 2; do
        "$program" "$here/../../config/$scene.cfg" -o "$work/$run"
    done
    for file in md json; do
        cmp "$work/1.$file" "$work/2.$file" || failed=1
    done
    awk -f "$here/table.awk" "$work/1.md" >"$work/table.md"
    column "$here/touch.md" "$scene" >"$work/kept"
    column "$work/table.md" "$scene" >"$work/made"
    [ "$(wc -l <"$work/made")" -gt 20 ] || { echo "$scene: the page has no figures"; failed=1; }
    diff "$work/kept" "$work/made" ||
        { echo "$scene: touch.md (<) says otherwise; if that is meant, ./dev report touch"; failed=1; }
done
exit $failed
