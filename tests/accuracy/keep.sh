#!/bin/sh
# SPDX-License-Identifier: MIT
# keep.sh PAGE DATA HOW: replaces the tables in results/ to which the page links by those of the folder DATA, and says on
# which machine and how they were made.
set -eu
here=$(dirname "$0")
page=$1 data=$2 how=$3
for table in $(grep -o '](results/[^)]*\.tsv)' "$here/$page.md" | sed 's|.*/||; s|)||' | sort -u); do
    case $table in *-machine.tsv | *-paper.tsv) continue ;; esac
    cp "$data/$table" "$here/results/$table"
done
grep -q "$page-machine.tsv" "$here/$page.md" || exit 0
printf 'processor\tarchitecture\thow\n%s\t%s\t%s\n' \
    "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" "$(uname -m)" "$how" >"$here/results/$page-machine.tsv"
