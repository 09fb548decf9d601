#!/bin/sh
# study_live.sh PROGRAMS DATA: takes the advice for the stiff fabric within 5 % at 1000 Hz, runs the advised scene live
# for five seconds in a private network, and studies it again with a reference that is a level finer.
# Writes DATA/live.tsv. Without permission for a private network the live figures are "-".
set -eu
here=$(cd "$(dirname "$0")" && pwd)
programs=$(cd "$1" && pwd) data=$2
mkdir -p "$data/live"
cd "$data/live"

quietly() { "$@" >run.txt 2>run.err || { cat run.err >&2; exit 1; }; }
column() {
    awk -F '\t' -v name="$2" -v is="$3" 'NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
        (is == "" ? $at["is_scene"] == 1 : $at["of"] == is) && !done++ { print $at[name] }' "$1"
}

quietly "$programs/pliant-study" --quick --rate 1000 --error 5% --out advised "$here/scenes/fabric.cfg"
advice=$(grep -E '^(The cheapest choice|Nothing here|No advice)' run.txt)
promised=$(printf '%s' "$advice" | sed -n 's/.* error \([0-9.e+-]*\) %.*/\1/p')
below=$(printf '%s' "$advice" | sed -n 's/.*ticks below \([0-9.e+-]*\) us.*/\1/p')

code=0
"$here/../daemon/in_namespace.sh" "$programs/pliantd" --duration 5 advised/advised.cfg >live.txt 2>live.err || code=$?
[ $code -eq 0 ] || [ $code -eq 77 ] || { cat live.err >&2; exit 1; }
# "ticks late p99" of what the daemon says at its end
live=$(awk '/^ticks:/ { ticks = $2 + 0; for (i = 1; i < NF; i++) if ($i ~ /^late/) late = $(i + 1) + 0 }
    /^late ticks:/ { late = $3 + 0 }
    /^step time:/ { for (i = 1; i < NF; i++) if ($i == "p99") p99 = $(i + 1) + 0 }
    END { if (ticks == "") print "- - -"; else print ticks, late + 0, p99 }' live.txt)

# Levels above those of its mesh, and the whole grid's budget: the finest reference is of level 3.
cp advised/advised.cfg finer.cfg
grep -q 'adapt =' finer.cfg || sed 's/levels = [0-9];/levels = 2;/' advised/advised.cfg >finer.cfg
quietly "$programs/pliant-study" --rate 1000 --only 'no such case' --repeat 1 --out finer finer.cfg
finer=$(column finer/runs.tsv total_patch '' | awk '{ printf "%.3g %%", 100 * $1 }')
own=$(column finer/references.tsv what all)
set -- $live
{
    printf 'advised scene\tpromised error\tagainst a finer reference\tthat reference\tp99 of a tick, promised [us]\tlive [us]\tticks in 5 s\tlate ticks\n'
    printf '%s\t%s %%\t%s\t%s\t%s\t%s\t%s\t%s\n' "$(printf '%s' "$advice" | sed 's/^[^"]*"\([^"]*\)".*/\1/')" \
        "$promised" "$finer" "$own" "$below" "$3" "$1" "$2"
} >../live.tsv
