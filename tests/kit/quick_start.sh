#!/bin/sh
# SPDX-License-Identifier: MIT
# The quick starts of clients/kit/README.md, as they stand there, against the real server: built and run on what
# is installed, nothing else; in C by pkg-config and by CMake, with the shared library and the static one.
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
# Starts a server, in place of the one before.
fresh() {
    [ -z "$server" ] || { kill $server && wait $server || true; }
    pliant/bin/pliantd "$scene" >server.log 2>&1 &
    server=$!
}

# A line "N nodes, T s, F N" of a ball that pushes back.
pushes() {
    cat "$1"
    awk '$2 != "nodes," || $1 != 162 || !($3 > 0.5) || !($5 > 0.02 && $5 < 10) { bad = 1 }
         END { exit bad || NR != 1 }' "$1" || die "$2: not what the ball does (see above)"
}

block c >start.c
[ "$(wc -l <start.c)" -ge 10 ] || die "no C in $readme"
export PKG_CONFIG_PATH="$libraries/pkgconfig"
flags="-std=c17 -Wall -Wextra -Werror"
# shellcheck disable=SC2046,SC2086 # one option a word
{
    ${CC:-cc} $flags -o shared start.c $(pkg-config --cflags --libs pliant-client)
    ${CC:-cc} $flags -o static start.c $(pkg-config --cflags pliant-client) -L"$libraries" -l:libpliant-client.a \
        $(pkg-config --libs-only-l --static pliant-client | sed 's/-lpliant-client//')
}
cat >CMakeLists.txt <<'END'
cmake_minimum_required(VERSION 3.18)
project(start C)
find_package(pliant REQUIRED)
foreach(kind client client_static)
    add_executable(by_cmake_${kind} start.c)
    target_link_libraries(by_cmake_${kind} pliant::${kind})
endforeach()
END
{ cmake -S . -B by_cmake -DCMAKE_PREFIX_PATH="$work/pliant" && cmake --build by_cmake; } >cmake.log 2>&1 ||
    { cat cmake.log >&2; die "find_package(pliant) fails"; }
for program in shared by_cmake/by_cmake_client; do
    readelf -d $program | grep -q 'NEEDED.*libpliant-client.so.0' || die "$program does not load the library"
done
for program in static by_cmake/by_cmake_client_static; do
    ! readelf -d $program | grep 'NEEDED.*libpliant' || die "$program is not static"
done
for program in shared static by_cmake/by_cmake_client by_cmake/by_cmake_client_static; do
    fresh
    ./$program >c.txt || { cat server.log >&2; die "the quick start in C fails: $program"; }
    pushes c.txt "C ($program)"
done

block python >start.py
[ "$(wc -l <start.py)" -ge 8 ] || die "no Python in $readme"
front=$(dirname "$readme")/../../README.md # shows the same
[ "$(readme=$front block python)" = "$(cat start.py)" ] || die "$front has another quick start in Python"
fresh
python3 start.py >python.txt || { cat server.log >&2; die "the quick start in Python fails"; }
pushes python.txt Python

# Each leaves its server in lockstep.
for python in python3 /usr/bin/python3; do
    "$python" -c 'import numpy' 2>/dev/null || continue
    fresh
    "$python" "$script" || { cat server.log >&2; die "the Python module fails"; }
    break
done
fresh
python3 "$script" plain || { cat server.log >&2; die "the Python module without numpy fails"; }
