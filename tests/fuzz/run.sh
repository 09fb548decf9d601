#!/bin/bash
# SPDX-License-Identifier: MIT
# Runs fuzzers and prints a table:
#   run.sh PROGRAMS KEPT (seconds=S | runs=N) [CORPUS...]
# PROGRAMS: folder of the programs fuzz_<harness>; KEPT: folder for what is found; S seconds of each,
# or N inputs of each (of slow ones a fifth), the same ones each time. Two run at a time. Fails if
# one of them found a crash, a hang or a leak, and says where the input lies.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

# Corpora whose harness has another name.
harness_of() {
    case $1 in
    obj | off | ply | stl | vtk | vtkxml | msh | tetgen) echo mesh ;;
    nifti | nrrd) echo volume ;;
    *) echo "$1" ;;
    esac
}

# Those whose inputs are files of HDF5 or many ticks.
is_slow() {
    case $1 in
    checkpoint | initial | log | prepared | recording | session) true ;;
    *) false ;;
    esac
}

# The words of a scene are those of its reference.
write_words() {
    sed -n 's/^| `\([a-z0-9_]*\)` |.*/"\1"/p; s/^.*`"\([a-z0-9_]*\)"`.*/"\\"\1\\""/p' \
        "$here/../../config/README.md" | sort -u >"$1"
}

# A program that did not get to its statistics has not run; leaks may be found after them.
is_whole() { grep -q 'stat::number_of_executed_units' "$1" && ! grep -q 'ERROR: .*Sanitizer' "$1"; }

fuzz_one() {
    local programs=$1 kept=$2 bound=$3 corpus=$4 program words=() limit new log folder
    program=$programs/fuzz_$(harness_of "$corpus")
    log=$kept/$corpus.log
    new=$kept/$corpus
    case $bound in
    seconds=*) limit=(-max_total_time="${bound#*=}") ;;
    # From the committed inputs alone, so that every run is the same.
    runs=*)
        local runs=${bound#*=}
        is_slow "$corpus" && runs=$((runs / 5))
        limit=(-runs="$runs" -seed=1)
        new=$kept/$corpus.once
        rm -rf "$new"
        ;;
    esac
    mkdir -p "$new" "$kept/found/$corpus"
    [ -f "$here/words/$corpus.dict" ] && words=(-dict="$here/words/$corpus.dict")
    [ "$corpus" = scene ] && write_words "$kept/scene.dict" && words=(-dict="$kept/scene.dict")
    # HDF5 keeps memory from one file to the next: looking for leaks after each input takes most of the
    # time, and the end of the program is soon enough.
    is_slow "$corpus" && limit+=(-detect_leaks=0)
    # Files of inputs; whatever a crash leaves goes with the folder.
    folder=$(mktemp -d "${TMPDIR:-/dev/shm}/fuzz.XXXXXX")
    local start=$SECONDS
    # 1 GB in all and half of that at a time: inputs of some kilobytes must not take more.
    TMPDIR=$folder nice -n 10 "$program" "${limit[@]}" ${words[@]+"${words[@]}"} -print_final_stats=1 \
        -rss_limit_mb=1024 -malloc_limit_mb=512 -timeout=60 -report_slow_units=60 -max_len=6000 \
        -artifact_prefix="$kept/found/$corpus/" "$new" "$here/corpus/$corpus" >"$log" 2>&1 ||
        true
    rm -rf "$folder"
    local crashes features
    crashes=$(find "$kept/found/$corpus" -type f | wc -l)
    is_whole "$log" || [ "$crashes" -gt 0 ] || crashes=1
    features=$(sed -n 's/.* ft: \([0-9]*\) .*/\1/p' "$log" | tail -1)
    awk -v name="$corpus" -v features="${features:-0}" -v crashes="$crashes" \
        -v seconds=$((SECONDS - start)) '
        /stat::number_of_executed_units/ { executed = $2 }
        /stat::new_units_added/ { added = $2 }
        /stat::peak_rss_mb/ { memory = $2 }
        END {
            printf "%-12s %10d %8d %8d %8d %7d %9d %8d\n", name, executed,
                executed / (seconds > 0 ? seconds : 1), features, added, memory, seconds, crashes
        }' "$log" >"$kept/$corpus.row"
}

if [ "${1:-}" = one ]; then
    shift
    fuzz_one "$@"
    exit
fi

[ $# -ge 3 ] || { echo "run.sh PROGRAMS KEPT seconds=S|runs=N [CORPUS...]" >&2; exit 2; }
programs=$1 kept=$2 bound=$3
shift 3
[ $# -gt 0 ] || set -- $(ls "$here/corpus")
mkdir -p "$kept"
for corpus in "$@"; do
    [ -d "$here/corpus/$corpus" ] || { echo "run.sh: no corpus '$corpus'; there are:" \
        $(ls "$here/corpus") >&2; exit 2; }
    rm -f "$kept/$corpus.row"
    rm -rf "$kept/found/$corpus"
done
printf '%s\n' "$@" | xargs -P 2 -I{} bash "$here/run.sh" one "$programs" "$kept" "$bound" {}
printf '%-12s %10s %8s %8s %8s %7s %9s %8s\n' name executed 'a second' features new 'peak MB' \
    seconds crashes
for corpus in "$@"; do
    cat "$kept/$corpus.row"
done
found=0
for corpus in "$@"; do
    while read -r file; do
        echo "found: $file (what it is: $kept/$corpus.log)"
        found=1
    done < <(find "$kept/found/$corpus" -type f)
    if ! is_whole "$kept/$corpus.log"; then
        echo "$corpus did not run to a clean end: $kept/$corpus.log"
        found=1
    fi
done
exit $found
