#!/bin/bash
# SPDX-License-Identifier: MIT
# Names what the last ctest run of a build folder skipped: tests (exit code 77), claims in them (cmocka's skip()),
# cases of the benchmark. A skip that is not on the list below is a failure, where all that tests need is permitted
# (root, private networks); elsewhere it is only named. And a run of no test at all is a failure.
#
# skips.sh BUILD: after `ctest --test-dir BUILD -O BUILD/ctest.log`
set -euo pipefail

# What may be skipped, a name and the reason a line.
allowed='lcm_spy: needs a JDK of 400 MB, which no other test does'

log=$1/ctest.log claims=$1/Testing/Temporary/LastTest.log
grep -q '^Total Test time' "$log" || { echo "skips: ctest did not end: $log"; exit 1; }
! grep -q '^No tests were found' "$log" || { echo "skips: no test was run"; exit 1; }

# ./dev test installs no browser and no gnuplot.
[ -x "${CHROMIUM:-/usr/bin/chromium}" ] || allowed+=$'\n''web_work: there is no chromium'
command -v gnuplot >/dev/null || allowed+=$'\n''study_tell gnuplot_draws_all_four: there is no gnuplot'

# "NAME" or "NAME CLAIM" a line.
skipped=$({
    sed -n 's/^\t *[0-9]* - \([^ ]*\) (\(Skipped\|Disabled\|Not Run\)).*/\1/p' "$log"
    awk '/^ *[0-9]+\/[0-9]+ Test: / { test = $3 }
        /^\[  SKIPPED \] [^ ]+$/ { print test, $4 }
        /^pliant-bench: .* skipped: / { print test, $2 }' "$claims"
} | sort -u)
[ -n "$skipped" ] || exit 0

status=0
while read -r test claim; do
    if reason=$(grep "^$test${claim:+ $claim}: " <<<"$allowed"); then
        echo "skipped: $reason"
    else
        echo "skipped without a reason that is known: $test${claim:+, $claim}"
        status=1
    fi
done <<<"$skipped"
if [ $status -ne 0 ] && ! { [ "$(id -u)" -eq 0 ] && unshare -n true 2>/dev/null; }; then
    echo "(not counted as failures: no root, or no private networks here)"
    status=0
fi
exit $status
