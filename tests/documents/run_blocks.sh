#!/bin/bash
# SPDX-License-Identifier: MIT
# Runs the blocks of a document that begin with one of our programs, as they are printed, each in a folder of its own
# with the files that documents name. A comment before a block, which a reader does not see, says what is different:
#
#   <!-- not run: REASON -->
#   <!-- line by line -->      each line is a command of its own, ended after some seconds if it goes on
#
# run_blocks.sh BIN TOP DOCUMENT: the folder of the programs, the top of the sources, and the document below it. Called
# by in_namespace.sh, since most of them use the network.
set -u
bin=$1 top=$2 document=$3
work=$(mktemp -d "${TMPDIR:-/tmp}/pliant-blocks-XXXXXX") || exit 1
trap 'rm -rf "$work"' EXIT
failed=0 count=0

# Writes each block to a file BEGINNING-AT-LINE.MODE, MODE being block, lines or not.
awk -v out="$work" '
    /^<!-- not run: ..* -->$/ { mode = "not"; next }
    /^<!-- line by line -->$/ { mode = "lines"; next }
    /^```/ && !inside { inside = 1; begun = NR + 1; body = ""; next }
    /^```/ {
        inside = 0
        if (body ~ /^(build\/release\/bin\/)?pliant(d|-[a-z]+)[ \n]/)
            printf "%s", body >(out "/" begun "." (mode == "" ? "block" : mode))
        mode = ""
        next
    }
    inside { body = body $0 "\n"; next }
    /./ { mode = "" }' "$top/$document"

# What documents name: an organ in millimetres, label volumes, recordings of one session, a folder of programs.
provide() {
    mkdir -p build/release
    ln -s "$bin" build/release/bin
    cp -r "$top/config" config
    mkdir -p tests && ln -s "$top/tests/bench" tests/bench
    cp config/liver.nrrd labels.nrrd
    cp config/liver.nrrd liver.nrrd
    awk 'BEGIN { # a ball of 100 mm, as an OBJ file: formats are recognised by content
        pi = 3.14159265358979; n = 12
        print "v 0 0 50"
        for (i = 1; i < n; i++) for (k = 0; k < 2 * n; k++)
            printf "v %.9g %.9g %.9g\n", 50 * sin(pi * i / n) * cos(pi * k / n), 50 * sin(pi * i / n) * sin(pi * k / n),
                50 * cos(pi * i / n)
        print "v 0 0 -50"
        for (k = 0; k < 2 * n; k++) {
            l = (k + 1) % (2 * n)
            print "f 1", 2 + k, 2 + l
            for (i = 0; i < n - 2; i++) {
                a = 2 + 2 * n * i + k; b = 2 + 2 * n * i + l
                print "f", a, a + 2 * n, b + 2 * n; print "f", a, b + 2 * n, b
            }
            print "f", 2 + 2 * n * (n - 2) + k, 2 + 2 * n * (n - 1), 2 + 2 * n * (n - 2) + l
        } }' >organ.stl
    cp config/stomach.cfg scene.cfg
    if grep -q '\<organ\.cfg' "$1" && ! grep -q 'propose' "$1"; then # else the block writes it
        "$bin/pliant-prepare" --propose organ.stl --units mm -o organ.cfg >provide.log 2>&1 || cat provide.log
    fi
    cp scene.cfg judge.cfg
    # Parts of one session, of 16 s; and a log of the messages of a second.
    if grep -q 'run-2\.h5' "$1"; then
        "$bin/pliantd" --offline 15 --record run.h5 --checkpoint end.h5 scene.cfg >provide.log 2>&1 || cat provide.log
        for run in run-2 run-3; do
            "$bin/pliantd" --offline 0.3 --resume end.h5 --record $run.h5 --checkpoint end.h5 scene.cfg >provide.log 2>&1 ||
                cat provide.log
        done
        cp run.h5 network.h5
    fi
    if grep -q 'lcmlog-2026-01-31\.00' "$1" && command -v lcm-logger >/dev/null; then
        lcm-logger lcmlog-2026-01-31.00 >provide.log 2>&1 &
        local logger=$!
        "$bin/pliantd" scene.cfg >provide.log 2>&1 &
        local server=$!
        timeout 100 sh -c 'until "$1" --once; do sleep 0.1; done; exec "$1" --duration 1' sh "$bin/pliant-monitor" \
            >/dev/null 2>&1
        kill $server $logger
        wait
    fi
}

for file in "$work"/*.block "$work"/*.lines "$work"/*.not; do
    [ -f "$file" ] || continue
    line=$(basename "${file%.*}")
    count=$((count + 1))
    case $file in *.not) echo "$document:$line: not run"; continue ;; esac
    mkdir "$work/in"
    cd "$work/in" || exit 1
    provide "$file"
    # A server that is started for others is waited for, as people do.
    sed 's|/usr/share/pliant/||g; /pliantd .*&/a until pliant-monitor --once >/dev/null 2>\&1; do sleep 0.1; done' "$file" >../commands
    if [ "${file##*.}" = lines ]; then
        while IFS= read -r command; do
            command -v lcm-logger >/dev/null || [[ $command != *lcmlog* ]] || continue
            # Ended as by Ctrl-C: 124 is that of timeout itself.
            printf 'timeout -s INT 4 %s || [ $? -eq 124 ] || exit\n' "${command%%#*}"
        done < <(grep -E '^(build/release/bin/)?pliant' ../commands) >../each && mv ../each ../commands
    fi
    server=
    if grep -q "\<pliant-record " ../commands; then
        "$bin/pliantd" scene.cfg >provide.log 2>&1 &
        server=$!
    fi
    PATH=$bin:$PATH timeout 250 bash -c '
        trap "kill \$(jobs -p) 2>/dev/null || true; wait || true" EXIT
        set -e
        . ../commands' >../log 2>&1 </dev/null
    code=$?
    [ -z "$server" ] || { kill $server; wait $server; }
    if [ $code -ne 0 ]; then
        echo "$document:$line: exit $code"
        cat ../commands ../log
        failed=1
    else
        echo "$document:$line: runs"
    fi
    cd "$top" || exit 1
    rm -r "$work/in"
done
[ $count -gt 0 ] || { echo "$document has no block of ours"; failed=1; }
exit $failed
