#!/bin/sh
# check_ranks.sh MPIRUN PROGRAM: a study by two ranks of MPI gives the same table as by one process,
# but for the times.
set -eu
mpirun=$1 program=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
cat >ball.cfg <<'SCENE'
name = "ball";  rate_hz = 500.0;
bodies = ( { name = "ball";
    mesh = { generator = "ico_sphere";  nodes = 42;  radius = 0.05; };
    levels = 1;  start_level = 0;
    shape = { angular_frequency = 50.0;  damping_ratio = 0.1; }; } );
loads = ( { center = [0.0, 0.0, 0.05];  radius = 0.03;  force = [0.0, 0.0, -0.3];
            start = 0.002;  duration = 0.05; } );
SCENE
set -- ball.cfg --quick --duration 0.1 --repeat 1 --only leapfrog
"$program" "$@" --out one >one.txt 2>one.err || { cat one.err; exit 1; }
OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "$mpirun" --oversubscribe -n 2 \
    "$program" "$@" --out two >two.txt 2>two.err || { cat two.err; exit 1; }

# All columns but those of times.
without_times() {
    awk -F '\t' 'NR == 1 { for (c = 1; c <= NF; c++) keep[c] = $c !~ /^(cpu_|tick_)/ }
        { line = ""
          for (c = 1; c <= NF; c++) if (keep[c]) line = line "\t" $c
          print line }' "$1"
}
without_times one/runs.tsv >one.runs
without_times two/runs.tsv >two.runs
[ "$(wc -l <one.runs)" -gt 5 ] || { echo "too few cases to compare"; cat one.txt; exit 1; }
cmp one.runs two.runs
cmp one/references.tsv two/references.tsv
# A bad option ends all ranks, with its code.
code=0
OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "$mpirun" --oversubscribe -n 2 \
    "$program" nowhere.cfg >bad.txt 2>bad.err || code=$?
[ $code -eq 2 ] || { echo "exit code $code for a bad scene"; exit 1; }
