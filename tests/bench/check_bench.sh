#!/bin/sh
# SPDX-License-Identifier: MIT
# The benchmark runs and its table has the form that others read: five tab-separated columns, a
# header, finite values, every case that can run here. Says nothing of speed.
set -u
table=$(mktemp) || exit 1
trap 'rm -f "$table"' EXIT
"$1" --quick --tsv "$table" >/dev/null || { echo "pliant-bench failed"; exit 1; }
"$1" --compare "$table" "$table" | awk -F '\t' 'NR > 1 && $6 != "1.000" { print; bad = 1 }
    END { exit bad || NR < 30 }' || { echo "a table differs from itself"; exit 1; }
awk -F '\t' '
    NR == 1 { if ($0 != "case\tsize\tmetric\tvalue\tunit") { print "header: " $0; bad = 1 }; next }
    NF != 5 || $1 == "" || $2 !~ /^[1-9][0-9]*$/ || $3 == "" || $5 == "" ||
        $4 !~ /^-?[0-9]+(\.[0-9]+)?(e[-+]?[0-9]+)?$/ { print "row " NR ": " $0; bad = 1 }
    { seen[$1]++ }
    END {
        n = split("spring.textbook.rk4 spring.double.rk4 spring.double.leapfrog contact.sphere " \
                  "contact.capsule load.start spring.single.rk4 spring.single.leapfrog levels.sphere.1N " \
                  "levels.sphere.0.2N levels.stomach levels.topology " \
                  "implicit.soft implicit.stiff implicit.leapfrog " \
                  "guard.surface.rk4 guard.surface.leapfrog", wanted, " ")
        for (i = 1; i <= n; i++) if (!seen[wanted[i]]) { print "no row of " wanted[i]; bad = 1 }
        exit bad
    }' "$table"

# The committed table is that of this program, as far as that does not depend on the machine: memory, and
# instructions of a step as valgrind counts them. 3 %: work that meant to change neither has moved them by up to
# 1 %; beyond, the table is another program's.
[ -n "${2-}" ] && command -v valgrind >/dev/null || exit 0
for case in bytes pair.tool; do
    "$1" --case $case --tsv "$table" >/dev/null || { echo "pliant-bench --case $case failed"; exit 1; }
    awk -F '\t' '
        $3 !~ /^(bytes_per_node|instructions_per_step)$/ { next }
        NR == FNR { stands[$1, $2, $3] = $4; next }
        {
            seen++
            off = $4 / stands[$1, $2, $3] - 1
            if (off > 0.03 || off < -0.03) { print $1 " " $3 ": " stands[$1, $2, $3] " in the committed table, now " $4; bad = 1 }
        }
        END { exit bad || !seen }' "$2" "$table" || { echo "results.tsv is old: ./dev report bench"; exit 1; }
done
