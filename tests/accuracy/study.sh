#!/bin/sh
# study.sh PROGRAMS DATA [REPEATS]: studies the scenes with pliant-study of the folder PROGRAMS, into the
# folder DATA, and fills study.in.md. PROGRAMS "": with the figures that DATA has. ./dev report calls it.
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

if [ -n "$programs" ]; then
    study fabric "$here/scenes/fabric.cfg"
    # Their fine meshes only at the longest stable step.
    for name in sphere stomach; do study $name "$here/scenes/$name.cfg" --only bound; done
    for name in sphere stomach fabric; do study_coarse $name; done
    study block "$here/scenes/block.cfg"
    sh "$here/study_outside.sh" "$programs" "$data/outside"
    sh "$here/study_live.sh" "$programs" "$data"
fi
cp "$data/outside/swing.tsv" "$data/outside/beam.tsv" "$data/"

# All runs as one table; what a later study repeats of an earlier one is left out.
for name in sphere stomach fabric; do
    awk -F '\t' 'FNR == 1 && NR > 1 { next }
        NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c }
        $at["name"] in seen { next }
        { seen[$at["name"]] = 1; print }' "$data/$name-coarse/runs.tsv" "$data/$name/runs.tsv" \
        "$data/$name-double/runs.tsv" >"$data/$name-all.tsv"
done

# figures KIND TABLE
figures() {
    for name in sphere stomach fabric; do
        awk -F '\t' -v what="$1" -v limit=0.01 -v scene=$name -f "$here/study_figures.awk" \
            "$data/$name-all.tsv"
    done >>"$data/$2.tsv"
}

printf 'scene\tmesh\tleapfrog, single [ms]\trk4, single [ms]\trk4, double [ms]\trk4 with step doubling [ms]\tover rk4, single\tover rk4, double\tover step doubling\n' >"$data/study-time.tsv"
figures time study-time
printf 'scene\tadaptive body\ttotal error\tcost [ms]\twholly refined, same error [ms]\tadaptive over refined\n' >"$data/study-detail.tsv"
figures detail study-detail

# What each reference says about itself.
{
    printf 'scene\treference of\twhat it is\tobserved order\town error\n'
    for name in sphere stomach fabric block; do
        awk -F '\t' -v scene=$name 'NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
            {   what = $at["what"]
                of = $at["of"] == "all" ? "total error" : "time, " (what ~ /,/ ? mesh(what) : "?")
                printf "%s\t%s\t%s\t%s\t%s\n", scene, of, what, order($at["order"]), $at["own_error"] == "-" ? "unknown" : sprintf("%.2g %%", 100 * $at["own_error"]) }
            function order(o) { return o == "-" ? "not monotone" : sprintf("%.2f", o) }
            function mesh(w) { sub(/^[^,]*, [^,]*, /, "", w); return w }' "$data/$name/references.tsv"
    done
} >"$data/study-references.tsv"

# The advice, as the program says it.
{
    printf 'scene\tadvice within 1 %%, at its own rate\n'
    for name in sphere stomach fabric block; do
        printf '%s\t%s\n' $name "$(grep -E '^(The cheapest choice|Nothing here|No advice)' "$data/$name.txt")"
    done
} >"$data/study-advice.tsv"

for name in sphere stomach fabric block sphere-coarse stomach-coarse fabric-coarse; do
    for picture in time total; do
        case $name-$picture in *-coarse-total | sphere-time | stomach-time) continue ;; esac
        [ ! -f "$data/$name/$picture.png" ] || cp "$data/$name/$picture.png" "$here/study-$name-$picture.png"
    done
done
gnuplot -e "data='$data'; out='$here'" "$here/study.gp"
awk -v data="$data" -f "$here/tables.awk" "$here/study.in.md" >"$data/study.md"
{ cat "$data/study.md"
  printf '\n%s, %s, %s runs of each, one at a time.\n' \
    "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" "$(uname -m)" "$repeats"
} >"$here/study.md"
