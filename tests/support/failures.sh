#!/bin/bash
# What failed in the last ctest run of a build folder: the end of each failed test's output, and whether the test
# passes alone. That tells a fault from a machine that was too busy; a failure it remains.
#
# failures.sh BUILD [LINES]: after `ctest --test-dir BUILD -O BUILD/ctest.log` failed
set -euo pipefail

folder=$1 lines=${2:-40}
log=$folder/Testing/Temporary/LastTest.log

failed=$(sed -n '/(Skipped)\|(Disabled)/!s/^\t *[0-9]* - \([^ ]*\) (.*/\1/p' "$folder/ctest.log" | sort -u)
[ -n "$failed" ] || { echo "ctest failed and names no test: $folder/ctest.log"; exit 1; }

for test in $failed; do
    echo "-- $test failed; its last lines:"
    awk -v test="$test" '/^ *[0-9]+\/[0-9]+ Test(ing)?: / { mine = $3 == test }
        /^<end of output>/ { mine = 0 }
        mine' "$log" | tail -n "$lines"
done

# After all outputs: another run replaces the log.
for test in $failed; do
    if ctest --test-dir "$folder" --output-on-failure -R "^$test\$" >"$folder/again.log" 2>&1; then
        echo "-- $test passes alone"
    else
        echo "-- $test fails alone, too: $folder/again.log"
    fi
done
