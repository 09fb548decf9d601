#!/bin/sh
# SPDX-License-Identifier: MIT
# Certifies every shipped scene that has a tool to press with, and writes touch.md: report.sh PROGRAM FOLDER JOBS.
set -eu
program=$1 folder=$2 jobs=$3
here=$(dirname "$0")
config=$here/../../config
mkdir -p "$folder"
rm -f "$folder"/*.md "$folder"/*.json
for scene in $(grep -lE 'kind = "(probe|grasper)"' "$config"/*.cfg); do
    body=
    case $scene in */gallbladder.cfg | */rest.cfg) body=--body=gall ;; esac
    echo "$body -o $folder/$(basename "$scene" .cfg) $scene" # a blank at the end would join lines
done | xargs -P "$jobs" -L 1 "$program"
{
    cat <<TEXT
# Touch

How each shipped scene feels to a simulated hand: \`./dev report touch\` writes this table,
[pliant-touch](../../clients/README.md#a-certificate-of-touch) the page of a scene, which says what each figure is. What
misses its bar is bold; empty: the scene has none, or the tool felt nothing there.

TEXT
    awk -f "$here/table.awk" "$folder"/*.md
} >"$folder/table.new"
mv "$folder/table.new" "$here/touch.md"
