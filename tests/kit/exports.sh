#!/bin/sh
# The shared object exports the functions of its header, and nothing else: exports.sh NM LIBRARY HEADER SONAME
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$1" -D --defined-only "$2" | awk '{ print $3 }' | sort >"$work/exported"
sed -n 's/^PLIANT_API .*[ *]\(pliant_[a-z_]*\)(.*/\1/p' "$3" | sort >"$work/declared"
[ "$(wc -l <"$work/declared")" -ge 20 ] || { echo "hardly any function was seen in $3"; exit 1; }
diff "$work/declared" "$work/exported" || { echo "header (<) and library (>) differ"; exit 1; }
readelf -d "$2" | grep -q "SONAME.*\[$4\]" || { echo "the library is not $4"; exit 1; }
