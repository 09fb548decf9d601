#!/bin/sh
# SPDX-License-Identifier: MIT
# A header that is there but lacks another package's header ends the configuration, with the names of the
# packages (that it configures otherwise, this build has shown): headers.sh SOURCE_FOLDER NIFTI_INCLUDE_DIR
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir "$folder/alone"
cp "$2/nifti1_io.h" "$folder/alone" # and not nifti1.h, which it includes
if cmake -S "$1" -B "$folder/build" -DNIFTI_INCLUDE_DIR="$folder/alone" >"$folder/log" 2>&1; then
    echo "configured with a header that does not compile"
    exit 1
fi
grep -q '<nifti1_io.h> is missing or does not compile' "$folder/log" && grep -q libnifti2-dev "$folder/log" ||
    { cat "$folder/log"; exit 1; }
