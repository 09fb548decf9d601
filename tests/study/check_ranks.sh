#!/bin/sh
# SPDX-License-Identifier: MIT
# check_ranks.sh PROGRAM [MPIRUN]: one study by several processes gives the same tables as by one process, but for
# the times: interrupted and continued, shared by four, and by two ranks of MPI, of which one is killed.
set -eu
program=$1 mpirun=${2-}
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
set -- ball.cfg --quick --duration 0.5 --repeat 8 --only leapfrog
"$program" "$@" --out one >one.txt 2>one.err || { cat one.err; exit 1; }

# All columns but those of times.
without_times() {
    awk -F '\t' 'NR == 1 { for (c = 1; c <= NF; c++) keep[c] = $c !~ /^(cpu_|tick_)/ }
        { line = ""
          for (c = 1; c <= NF; c++) if (keep[c]) line = line "\t" $c
          print line }' "$1"
}
without_times one/runs.tsv >one.runs
[ "$(wc -l <one.runs)" -gt 5 ] || { echo "too few cases to compare"; cat one.txt; exit 1; }

# expect_same FOLDER
expect_same() {
    without_times "$1/runs.tsv" >"$1.runs"
    cmp one.runs "$1.runs" && cmp one/references.tsv "$1/references.tsv" && [ -f "$1/study.gp" ] ||
        { echo "$1: not the tables of one process"; exit 1; }
}

# wait_for PATTERN: until a file of that name is there, for at most a minute.
wait_for() {
    tries=0
    until ls $1 >/dev/null 2>&1; do
        tries=$((tries + 1))
        [ $tries -lt 3000 ] || { echo "no $1"; exit 1; }
        sleep 0.02
    done
}

if [ -z "$mpirun" ]; then
    # Killed among its references, and among its cases, whose table has grown that far.
    "$program" "$@" --out cut >cut.txt 2>&1 & killed=$!
    wait_for 'cut/parts/reference-*.part'
    kill -9 $killed
    wait $killed || true
    "$program" "$@" --continue --out cut >cut.txt 2>&1 & killed=$!
    wait_for 'cut/parts/case-001.part'
    wait_for cut/runs.tsv
    kill -9 $killed
    wait $killed || true
    "$program" "$@" --continue --out cut >cut.txt 2>&1 || { cat cut.txt; exit 1; }
    expect_same cut
    "$program" "$@" --continue --out cut | grep -q '^cut: complete' || { echo "a complete study runs again"; exit 1; }
    # As the jobs of an array do: each continues what another may have begun.
    jobs=
    for job in 1 2 3 4; do
        "$program" "$@" --continue --out shared >job$job.txt 2>&1 & jobs="$jobs $!"
    done
    for job in $jobs; do wait $job || { cat job*.txt; exit 1; }; done
    expect_same shared
    # Another completes the study while this one has only some of the runs of a reference.
    "$program" "$@" --out late >late.txt 2>&1 & late=$!
    wait_for late/parts/reference-003.part
    touch late/parts/complete
    wait $late || { cat late.txt; echo "a process dies when others complete its study"; exit 1; }
    exit
fi

export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
"$mpirun" --oversubscribe -n 2 "$program" "$@" --out two >two.txt 2>two.err || { cat two.err; exit 1; }
expect_same two
# Each rank in turn is killed; the other goes on alone.
cat >dying.sh <<'DYING'
[ "$OMPI_COMM_WORLD_RANK" != "$1" ] || { echo $$ >victim; }
shift
exec "$@"
DYING
for rank in 0 1; do
    rm -rf victim died
    "$mpirun" --enable-recovery --oversubscribe -n 2 sh dying.sh $rank "$program" "$@" --out died >died.txt 2>died.err &
    ranks=$!
    wait_for 'died/parts/reference-*.part'
    kill -9 "$(cat victim)"
    wait $ranks || { cat died.err; exit 1; }
    expect_same died
done
# Without --enable-recovery mpirun ends the others, too, and any process continues.
rm -rf victim died
"$mpirun" --oversubscribe -n 2 sh dying.sh 1 "$program" "$@" --out died >died.txt 2>died.err & ranks=$!
wait_for 'died/parts/reference-*.part'
kill -9 "$(cat victim)"
! wait $ranks || { echo "mpirun says nothing of a rank that died"; exit 1; }
"$program" "$@" --continue --out died >died.txt 2>&1 || { cat died.txt; exit 1; }
expect_same died
# A bad scene ends all ranks, with its code, and is told once.
code=0
"$mpirun" --oversubscribe -n 2 "$program" nowhere.cfg >bad.txt 2>bad.err || code=$?
[ $code -eq 2 ] || { echo "exit code $code for a bad scene"; exit 1; }
[ "$(grep -c '^nowhere.cfg' bad.err)" -eq 1 ] || { cat bad.err; exit 1; }
