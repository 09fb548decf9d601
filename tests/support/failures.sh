#!/bin/bash
# What failed in the last ctest run of a build folder: the end of each failed test's output, and whether the test
# passes alone, three times. Exits with 0 if the round may pass all the same: at most two tests of real programs,
# which share two cores with other tests and with builds, were unsteady, and none of them crashed.
#
# failures.sh BUILD [LINES]: after `ctest --test-dir BUILD -O BUILD/ctest.log` failed
set -euo pipefail

folder=$1 lines=${2:-40} most=2
log=$folder/Testing/Temporary/LastTest.log

failed=$(sed -n '/(Skipped)\|(Disabled)/!s/^\t *[0-9]* - \([^ ]*\) (.*/\1/p' "$folder/ctest.log" | sort -u)
[ -n "$failed" ] || { echo "ctest failed and names no test: $folder/ctest.log"; exit 1; }

# The output of one test of the last run.
output_of() {
    awk -v test="$1" '/^ *[0-9]+\/[0-9]+ Test(ing)?: / { mine = $3 == test }
        /^<end of output>/ { mine = 0 }
        mine' "$log"
}

# In one process nothing competes; and what a sanitizer saw once, or a signal ended, is a fault.
is_a_fault() {
    ctest --test-dir "$folder" -N -L '^unit$' | grep -q ": $1\$" ||
        ! grep -q "^[[:space:]]*[0-9]* - $1 (\(Failed\|Timeout\))" "$folder/ctest.log" ||
        output_of "$1" | grep -q 'Sanitizer\|runtime error:\|Segmentation\|signal [0-9]'
}

faults=' '
for test in $failed; do
    echo "-- $test failed; its last lines:"
    output_of "$test" | tail -n "$lines"
    ! is_a_fault "$test" || faults+="$test "
done

# After all outputs: another run replaces the log.
status=0
for test in $failed; do
    if ! ctest --test-dir "$folder" --output-on-failure -R "^$test\$" --repeat until-fail:3 >"$folder/again.log" 2>&1; then
        echo "-- $test fails alone, too: $folder/again.log"
        status=1
    elif [[ $faults == *" $test "* ]]; then
        echo "-- $test passes alone, but what it shows is a fault"
        status=1
    else
        echo "-- $test is unsteady: it passes alone"
    fi
done
[ "$(wc -w <<<"$failed")" -le $most ] || { echo "-- more than $most tests failed"; status=1; }
exit $status
