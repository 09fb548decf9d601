#!/bin/sh
# SPDX-License-Identifier: MIT
# Each test of a build is in one tier, each round has tests, and the tests that CMake's lists name are there:
# check_labels.sh BUILD TEST...
set -eu
build=$1
shift
# Lists through a folder of its own: ctest would replace the log of the run that this is a test of.
shadow=$(mktemp -d)
trap 'rm -rf "$shadow"' EXIT
ln -s "$build"/* "$shadow"
rm -f "$shadow/Testing"
names() { ctest --test-dir "$shadow" -N ${1:+-L "^$1\$"} | sed -n 's/^ *Test *#[0-9]*: //p' | sort; }
all=$(names "")
[ "$(echo "$all" | wc -l)" -ge 100 ] || { echo "too few tests: ctest lists no more?"; exit 1; }
in_tiers=$(for tier in unit system slow; do names $tier; done | sort)
if [ "$all" != "$in_tiers" ]; then
    echo "tests in no tier, or in two (pliant_tests_are in the folder's CMakeLists.txt):"
    printf '%s\n' "$all" "$in_tiers" | sort | uniq -c | awk '$1 != 2 { print "  " $2 }'
    exit 1
fi
for round in quick asan tsan clang_rest; do
    [ "$(names $round | wc -l)" -ge 20 ] || { echo "too few tests in the round $round"; exit 1; }
done
for test in "$@"; do
    echo "$all" | grep -qx "$test" || { echo "tests/CMakeLists.txt names a test '$test', which is not there"; exit 1; }
done
