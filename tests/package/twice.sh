#!/bin/sh
# SPDX-License-Identifier: MIT
# Builds the Debian packages of a source folder twice, in copies of other names and at other times: they have the
# same bytes. Takes as long as two builds. twice.sh SOURCE_FOLDER [cmake-options...]
set -eu
source=$(realpath "$1")
shift
work=$(mktemp -d "${TMPDIR:-/tmp}/pliant-twice-XXXXXX")
trap 'rm -rf "$work"' EXIT
export SOURCE_DATE_EPOCH=1767225600
for copy in first the-second; do
    mkdir "$work/$copy"
    (cd "$source" && git ls-files -z | xargs -0 cp --parents -t "$work/$copy")
    [ ! -d "$source/build/web" ] || { mkdir "$work/$copy/build" && cp -r "$source/build/web" "$work/$copy/build"; }
    cd "$work/$copy"
    { cmake -S . -B build/package -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr -DPLIANT_TESTS=OFF "$@" &&
        cmake --build build/package && cd build/package && cpack -G DEB; } >"$work/$copy.log" 2>&1 ||
        { tail -30 "$work/$copy.log" >&2; exit 1; }
done
failed=0
for package in "$work"/first/build/package/*.deb; do
    other=$work/the-second/build/package/$(basename "$package")
    if cmp "$package" "$other"; then
        sha256sum "$package" | sed "s|$work/first/build/package/||"
    else
        failed=1
    fi
done
exit $failed
