#!/bin/sh
# SPDX-License-Identifier: MIT
# study.sh PROGRAMS DATA [REPEATS]: studies the scenes with pliant-study of the folder PROGRAMS, into the
# folder DATA, and replaces the tables in results/. PROGRAMS "": with the figures that DATA has. ./dev report calls it.
set -eu
here=$(dirname "$0")
programs=$1 data=$2 repeats=${3:-3}
mkdir -p "$data"

# study NAME SCENE [options]
study() {
    name=$1 scene=$2
    shift 2
    "$programs/pliant-study" --repeat "$repeats" --out "$data/$name" "$@" "$scene" >"$data/$name.txt" \
        2>"$data/$name.err" || { cat "$data/$name.err" >&2; exit 1; }
}

# The coarse mesh of NAME alone, at all steps, in both precisions.
study_coarse() {
    sed '/^ *adapt = /d' "$here/scenes/$1.cfg" >"$data/$1-coarse.cfg"
    study "$1-coarse" "$data/$1-coarse.cfg" --only 'single, level 0'
    { echo 'precision = "double";'; cat "$data/$1-coarse.cfg"; } >"$data/$1-double.cfg"
    study "$1-double" "$data/$1-double.cfg" --only 'double, level 0'
}

# NAME with a wall of 2 mm that bends.
study_bent() {
    sed 's/areal_density = 4.2;/&  thickness = 0.002;/' "$here/scenes/$1.cfg" >"$data/$1-bends.cfg"
    study "$1-bends" "$data/$1-bends.cfg" --only bound
}

# What --quick advises for a shipped scene, of the steps and of the total error, and how long it took: a row of
# study-shipped.tsv.
study_shipped() {
    shipped=$(basename "$1" .cfg)
    begin=$(date +%s)
    study "shipped-$shipped" "$1" --quick
    printf '%s\t%s\t%s\t%s\n' "$shipped" "$(advice_of "$data/shipped-$shipped.txt")" \
        "$(awk -F '\t' '$1 == "total" { print $5 }' "$data/shipped-$shipped/advice.tsv")" $(($(date +%s) - begin))
}

advice_of() { grep -m 1 -E '^(The cheapest choice|Nothing here|No advice)' "$1"; }

if [ -n "$programs" ]; then
    study fabric "$here/scenes/fabric.cfg"
    # Their fine meshes only at the longest stable step.
    for name in sphere stomach; do study $name "$here/scenes/$name.cfg" --only bound; done
    for name in sphere stomach; do study_bent $name; done
    for name in sphere stomach fabric; do study_coarse $name; done
    study block "$here/scenes/block.cfg"
    sh "$here/study_outside.sh" "$programs" "$data/outside"
    {
        printf 'scene\tadvice within 1 %%, at its own rate\tadvice in all\tthe study took [s]\n'
        for scene in "$here"/../../config/*.cfg; do study_shipped "$scene"; done
    } >"$data/study-shipped.tsv"
    sh "$here/study_live.sh" "$programs" "$data"
fi
cp "$data/outside/swing.tsv" "$data/outside/beam.tsv" "$data/"

# All runs as one table; what a later study repeats of an earlier one is left out.
for name in sphere sphere-bends stomach stomach-bends fabric; do
    set --
    for part in -coarse '' -double; do
        [ ! -f "$data/$name$part/runs.tsv" ] || set -- "$@" "$data/$name$part/runs.tsv"
    done
    awk -F '\t' 'FNR == 1 && NR > 1 { next }
        NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c }
        $at["name"] in seen { next }
        { seen[$at["name"]] = 1; print }' "$@" >"$data/$name-all.tsv"
done

# figures KIND TABLE SCENES...
figures() {
    kind=$1 table=$2
    shift 2
    for name in "$@"; do
        awk -F '\t' -v what="$kind" -v limit=0.01 -v scene=$name -f "$here/study_figures.awk" \
            "$data/$name-all.tsv"
    done >>"$data/$table.tsv"
}

printf 'scene\tmesh\tleapfrog, single [ms]\trk4, single [ms]\trk4, double [ms]\trk4 with step doubling [ms]\tover rk4, single\tover rk4, double\tover step doubling\n' >"$data/study-time.tsv"
figures time study-time sphere stomach fabric
printf 'scene\tadaptive body\ttotal error\tcost [ms]\twholly refined, same error [ms]\tadaptive over refined\n' >"$data/study-detail.tsv"
figures detail study-detail sphere sphere-bends stomach stomach-bends fabric

# What each reference says about itself.
{
    printf 'scene\treference of\twhat it is\tobserved order\town error\n'
    for name in sphere sphere-bends stomach stomach-bends fabric block; do
        awk -F '\t' -v scene=$name 'NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
            {   what = $at["what"]
                if (what ~ /^none/) next # a rule that this wall refuses
                of = $at["of"] == "all" ? "total error" : "time, " (what ~ /,/ ? mesh(what) : "?")
                printf "%s\t%s\t%s\t%s\t%s\n", scene, of, what, order($at["order"]), $at["own_error"] == "-" ? "unknown" : sprintf("%.2g %%", 100 * $at["own_error"]) }
            function order(o) { return o == "-" ? "not monotone" : sprintf("%.2f", o) }
            function mesh(w) { sub(/^[^,]*, [^,]*, /, "", w); return w }' "$data/$name/references.tsv"
    done
} >"$data/study-references.tsv"

# The advice, as the program says it.
{
    printf 'scene\tadvice within 1 %%, at its own rate\n'
    for name in sphere sphere-bends stomach stomach-bends fabric block; do
        printf '%s\t%s\n' $name "$(advice_of "$data/$name.txt")"
    done
} >"$data/study-advice.tsv"

for name in sphere sphere-bends stomach stomach-bends fabric block sphere-coarse stomach-coarse fabric-coarse; do
    for picture in time total; do
        case $name-$picture in *-coarse-total | sphere-time | stomach-time | *-bends-time) continue ;; esac
        [ ! -f "$data/$name/$picture.png" ] || cp "$data/$name/$picture.png" "$here/study-$name-$picture.png"
    done
done
# Total error against run time, a picture for each shipped scene.
for scene in "$here"/../../config/*.cfg; do
    name=$(basename "$scene" .cfg)
    [ ! -f "$data/shipped-$name/total.png" ] || cp "$data/shipped-$name/total.png" "$here/study-config-$name.png"
done
sh "$here/study_adaptive.sh" "$programs" "$data"
gnuplot -e "data='$data'; out='$here'" "$here/study.gp"
sh "$here/keep.sh" study "$data" "$repeats runs of each, one at a time"
