#!/bin/sh
# SPDX-License-Identifier: MIT
# Every case that the table of README.md names has a row in the committed results: check_names.sh [TABLE]. `.large`
# after `grasp.small` is grasp.large or grasp.small.large.
cd "$(dirname "$0")" || exit 1
missing=$(awk -F '|' '/^## /{ on = $0 == "## Cases" } on && /^\| `/ { print $2 }' README.md | grep -o '`[^`]*`' | tr -d '`' |
    awk '/^\./ { print before $0, whole $0; next } { print; before = whole = $0; sub(/\.[^.]*$/, "", before) }' |
    sed 's/\.\*$//; s/FEATURE.*//' | while read -r name other; do
    case $name in [!a-z]* | *[!a-zA-Z0-9._]*) continue ;; esac
    awk -F '\t' -v name="$name" -v other="${other:-$name}" 'index($1, name) == 1 || index($1, other) == 1 { found = 1 } END { exit !found }' "${1:-results.tsv}" || echo "$name"
done)
[ -z "$missing" ] || { printf 'no rows in the results, but named in README.md:\n%s\n' "$missing"; exit 1; }
