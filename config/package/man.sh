#!/bin/sh
# SPDX-License-Identifier: MIT
# Makes manual pages of what programs say with --help: man.sh PROGRAM-FOLDER OUT-FOLDER NAME...
set -eu
programs=$1 out=$2
shift 2
mkdir -p "$out"
for name in "$@"; do
    # The first sentence of the description, without its full stop, is the line that `man -k` shows.
    what=$("$programs/$name" --help | awk '!/^(Usage:|  or:)/ { text = text " " $0; if (/[.:]( |$)/) exit } /^$/ { exit }
        END { sub(/^ */, "", text); sub(/[.:]( .*)?$/, "", text); print tolower(substr(text, 1, 1)) substr(text, 2) }')
    SOURCE_DATE_EPOCH=1767225600 help2man --no-info --name "$what" --output "$out/$name.1" \
        "$programs/$name"
    gzip -9nf "$out/$name.1"
done
