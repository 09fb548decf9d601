#!/bin/sh
# SPDX-License-Identifier: MIT
# study_live.sh PROGRAMS DATA: takes the advice of `pliant-study --quick` for three scenes and studies the advised
# scenes again, with references that are finer. That for the stiff fabric, which moves without a tool, also runs live
# for five seconds in a private network. Writes DATA/live.tsv. "-": not permitted here, or not run.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
programs=$(cd "$1" && pwd)
mkdir -p "$2/live"
cd "$2/live"

quietly() { "$@" >run.txt 2>run.err || { cat run.err >&2; exit 1; }; }
# column FILE NAME [OF]: of the scene's own run, or of the reference OF
column() {
    awk -F '\t' -v name="$2" -v is="${3-}" 'NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
        (is == "" ? $at["is_scene"] == 1 : $at["of"] == is) && !done++ { print $at[name] }' "$1"
}

# Prints ticks, late ticks and their p99 [us] of what the daemon says at its end.
run_live() {
    code=0
    "$here/../daemon/in_namespace.sh" "$programs/pliantd" --duration 5 advised/advised.cfg >live.txt 2>live.err || code=$?
    [ $code -eq 0 ] || [ $code -eq 77 ] || { cat live.err >&2; exit 1; }
    awk '/^ticks:/ { ticks = $2 + 0; for (i = 1; i < NF; i++) if ($i ~ /^late/) late = $(i + 1) + 0 }
        /^late ticks:/ { late = $3 + 0 }
        /^step time:/ { for (i = 1; i < NF; i++) if ($i == "p99") p99 = $(i + 1) + 0 }
        END { if (ticks == "") print "- - -"; else print ticks, late + 0, p99 }' live.txt
}

# verify NAME SCENE live|offline [options of the study]
verify() {
    name=$1 scene=$2 live=$3
    shift 3
    quietly "$programs/pliant-study" --quick "$@" --out advised "$scene"
    advice=$(grep -E '^(The cheapest choice|Nothing here|No advice)' run.txt)
    promised=$(printf '%s' "$advice" | grep -o ' error [0-9.e+-]* %' | head -n 1)
    below=$(printf '%s' "$advice" | sed -n 's/.*ticks below \([0-9.e+-]*\) us.*/\1/p')
    ran='- - -'
    [ "$live" != live ] || ran=$(run_live)

    # The promise covers all errors, or those of the steps alone.
    kind='time, scene' error=time_patch
    case $advice in *'": total error'*) kind=all error=total_patch ;; esac
    # The whole grid's budget; of all errors with levels above those of the advised mesh.
    cp advised/advised.cfg finer.cfg
    [ "$kind" != all ] || grep -q 'adapt =' finer.cfg || sed 's/levels = [0-9];/levels = 2;/' advised/advised.cfg >finer.cfg
    quietly "$programs/pliant-study" --rate 1000 --only 'no such case' --repeat 1 --out finer finer.cfg
    set -- $ran
    printf '%s: %s\t%s\t%s\t%s\t%s\t%s\t%s\t%s\t%s\n' "$name" \
        "$(printf '%s' "$advice" | sed 's/^[^"]*"\([^"]*\)".*/\1/')" "${promised# error }" \
        "$(column finer/runs.tsv $error | awk '{ printf "%.3g %%", 100 * $1 }')" \
        "$(column finer/references.tsv what "$kind")" "$below" \
        "$(column finer/runs.tsv tick_p99 | awk '{ printf "%.3g", 1e6 * $1 }')" "$3" "$1" "$2"
}

{
    printf 'advised scene\tpromised error\tagainst a finer reference\tthat reference\tp99 of a tick, promised [us]\tmeasured again [us]\tlive [us]\tticks in 5 s\tlate ticks\n'
    verify fabric "$here/scenes/fabric.cfg" live --rate 1000 --error 5%
    verify block "$here/../../config/block.cfg" offline
    verify adaptive-organ "$here/../../config/adaptive-organ.cfg" offline
} >../live.tsv
