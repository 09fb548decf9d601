#!/bin/sh
# The quick starts of clients/kit/README.md, as they stand there, against the real server: built and run on what
# is installed, nothing else.
#
# Then a test of the Python module, which runs once with numpy, if it is there, and once without.
#
# quick_start.sh BUILD README SCENE PYTHON-TEST
set -eu
build=$1 readme=$(realpath "$2") scene=$(realpath "$3") script=$(realpath "$4")
work=$(mktemp -d "${TMPDIR:-/tmp}/pliant-kit-XXXXXX")
server=
trap '[ -z "$server" ] || kill $server 2>/dev/null; wait; rm -rf "$work"' EXIT
die() { echo "quick_start: $*" >&2; exit 1; }

for need in python3 pkg-config; do
    command -v $need >/dev/null || { echo "skipped: no $need"; exit 77; }
done
# Prints the first block of a language.
block() { awk -v start="\`\`\`$1" '$0 == start { on = 1; next } on && /^```/ { exit } on' "$readme"; }

cmake --install "$build" --prefix "$work/pliant" >"$work/log" 2>&1 || { cat "$work/log" >&2; die "cannot install"; }
cd "$work" # none of it may lean on where it was built
libraries=$(dirname "$(find "$work/pliant" -name libpliant-client.so)")
export LD_LIBRARY_PATH="$libraries" PYTHONPATH="$work/pliant/lib/python3/dist-packages" PYTHONDONTWRITEBYTECODE=1
if pliant/bin/pliantd --offline 0.5 --record run.h5 "$scene" >server.log 2>&1; then
    export RECORDING="$work/run.h5"
else
    grep -q 'built without' server.log || { cat server.log >&2; die "cannot record"; }
fi
pliant/bin/pliantd "$scene" >server.log 2>&1 &
server=$!

# A line "N nodes, T s, F N" of a ball that pushes back.
pushes() {
    cat "$1"
    awk '$2 != "nodes," || $1 != 162 || !($3 > 0.5) || !($5 > 0.02 && $5 < 10) { bad = 1 }
         END { exit bad || NR != 1 }' "$1" || die "$2: not what the ball does (see above)"
}

block c >start.c
[ "$(wc -l <start.c)" -ge 10 ] || die "no C in $readme"
# shellcheck disable=SC2046 # one option a word
${CC:-cc} -std=c17 -Wall -Wextra -Werror -o start start.c \
    $(PKG_CONFIG_PATH="$libraries/pkgconfig" pkg-config --cflags --libs pliant-client)
./start >c.txt || { cat server.log >&2; die "the quick start in C fails"; }
pushes c.txt C

block python >start.py
[ "$(wc -l <start.py)" -ge 8 ] || die "no Python in $readme"
front=$(dirname "$readme")/../../README.md # shows the same
[ "$(readme=$front block python)" = "$(cat start.py)" ] || die "$front has another quick start in Python"
python3 start.py >python.txt || { cat server.log >&2; die "the quick start in Python fails"; }
pushes python.txt Python

# Each leaves its server in lockstep.
for python in python3 /usr/bin/python3; do
    "$python" -c 'import numpy' 2>/dev/null || continue
    "$python" "$script" || { cat server.log >&2; die "the Python module fails"; }
    kill $server && wait $server || true
    pliant/bin/pliantd "$scene" >server.log 2>&1 &
    server=$!
    break
done
python3 "$script" plain || { cat server.log >&2; die "the Python module without numpy fails"; }
