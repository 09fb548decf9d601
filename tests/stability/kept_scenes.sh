#!/bin/sh
# SPDX-License-Identifier: MIT
# kept_scenes.sh FUZZ_SCENES FOLDER [OPTIONS]: runs each scene of the folder (SEED.cfg) under the inputs of its seed.
program=$1 folder=$2 failed=''
shift 2
for scene in "$folder"/*.cfg; do
    seed=$(basename "$scene" .cfg)
    echo "-- scene $seed"
    "$program" --first "$seed" --count 1 --scene "$scene" "$@" || failed="$failed $seed"
done
[ -z "$failed" ] || { echo "failed:$failed"; exit 1; }
