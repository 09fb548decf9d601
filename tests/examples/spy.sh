#!/bin/sh
# SPDX-License-Identifier: MIT
# lcm-spy starts and has a class for each of our types: spy.sh TOP. Skipped (77) where what it needs
# is not installed: a JDK is too large to ask for.
top=$1
XDG_CACHE_HOME=$(mktemp -d) || exit 1
export XDG_CACHE_HOME
trap 'rm -rf "$XDG_CACHE_HOME"' EXIT
if ! jar=$("$top/clients/examples/lcm-spy" --types 2>"$XDG_CACHE_HOME/why"); then
    cat "$XDG_CACHE_HOME/why"
    grep -q 'as root run: apt-get install' "$XDG_CACHE_HOME/why" && exit 77
    exit 1
fi
for type in "$top"/lcmtypes/*.lcm; do
    class=pliant/$(basename "$type" .lcm).class
    jar tf "$jar" | grep -qx "$class" || { echo "$jar has no $class"; exit 1; }
done
"$top/clients/examples/lcm-spy" --help 2>&1 | grep -q '^usage: lcm-spy' || { echo "lcm.spy.Spy does not start"; exit 1; }
