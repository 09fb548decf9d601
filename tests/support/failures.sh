#!/bin/bash
# SPDX-License-Identifier: MIT
# What failed in the last ctest run of a build folder: the end of each failed test's output. A test that fails beside
# others and passes alone has failed, too: it waits for a time in place of an event, or a program has a race.
#
# failures.sh BUILD [LINES]: after `ctest --test-dir BUILD -O BUILD/ctest.log` failed
set -euo pipefail
folder=$1 lines=${2:-40}
log=$folder/Testing/Temporary/LastTest.log
failed=$(sed -n '/(Skipped)\|(Disabled)/!s/^\t *[0-9]* - \([^ ]*\) (.*/\1/p' "$folder/ctest.log" | sort -u)
for test in $failed; do
    echo "-- $test failed; its last lines:"
    awk -v test="$test" '/^ *[0-9]+\/[0-9]+ Test(ing)?: / { mine = $3 == test }
        /^<end of output>/ { mine = 0 }
        mine' "$log" | tail -n "$lines"
done
