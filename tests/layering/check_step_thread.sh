#!/bin/sh
# SPDX-License-Identifier: MIT
# The files of server/run that only the step thread executes call nothing of io and scene, where functions may
# wait, allocate memory or read files.
#
# check_step_thread.sh NM LIBRUN LIBRARY...
set -u
nm=$1 run=$2
shift 2
files='exchange governor input loop realtime requests'

dir=$(mktemp -d) || exit 1
trap 'rm -r "$dir"' EXIT
"$nm" "$@" 2>/dev/null | awk '$2 == "T" { print $3 }' | sort -u >"$dir/barred"
failed=0
for file in $files; do
    "$nm" "$run" | awk -v file="$file.c.o:" '/:$/ { here = $0 == file } here && $1 == "U" { print $2 }' |
        sort -u >"$dir/called"
    "$nm" "$run" | grep -q "^$file.c.o:" || { echo "step_thread: there is no run/$file.c"; failed=1; }
    found=$(comm -12 "$dir/called" "$dir/barred")
    [ -z "$found" ] || { echo "step_thread: run/$file.c calls" $found; failed=1; }
done
# Other files do call them, so that the lists are what they should be.
"$nm" "$run" | awk '$1 == "U" { print $2 }' | sort -u >"$dir/called"
[ -n "$(comm -12 "$dir/called" "$dir/barred")" ] || { echo "step_thread: nothing was tried"; failed=1; }
exit $failed
