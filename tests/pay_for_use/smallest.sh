#!/bin/sh
# SPDX-License-Identifier: MIT
# Builds the smallest servers, one of each model and nothing else, into build/smallest-surface,
# build/smallest-voxel and build/smallest-plane, and looks what they say: they run what they know and
# refuse the rest by name. The test pay_for_use_cost compares their ticks with those of a build of everything.
#
# smallest.sh [cmake options...]
set -eu
cd "$(dirname "$0")/../.."
work=$(mktemp -d "${TMPDIR:-/tmp}/pliant-smallest-XXXXXX")
trap 'rm -rf "$work"' EXIT
failed=0

complain() {
    echo "smallest: $*" >&2
    failed=1
}

# runs NAME PLIANTD SCENE: says what it checked and how it ran.
runs() {
    "$2" --check "$3" >"$work/out" 2>&1 && "$2" --offline 0.05 "$3" >>"$work/out" 2>&1 &&
        grep -q '^ticks: 50$' "$work/out" || {
        cat "$work/out" >&2
        complain "$1 does not run $3"
    }
}

# refuses NAME WORDS PLIANTD ARGUMENTS...: one line with these words, exit code 2.
refuses() {
    name=$1 words=$2
    shift 2
    code=0
    "$@" >"$work/out" 2>"$work/err" || code=$?
    if [ $code -ne 2 ] || ! grep -qF "$words" "$work/err" || [ "$(wc -l <"$work/err")" -ne 1 ]; then
        cat "$work/err" >&2
        complain "$name: exit $code, not one line with '$words': $*"
    fi
}

cat >"$work/surface.cfg" <<'TEXT'
bodies = ( { name = "ball";  mesh = { generator = "ico_sphere";  nodes = 42; };  cuttable = true; } );
TEXT
cat >"$work/voxel.cfg" <<'TEXT'
bodies = ( { name = "box";  model = "voxel";  cuttable = true;
             voxels = { generator = "box";  count = [4, 4, 4];  size = 0.01; }; } );
TEXT
cat >"$work/plane.cfg" <<'TEXT'
bodies = ( { name = "disc";  model = "voxel";  cuttable = true;
             voxels = { generator = "disc";  radius = 0.05;  size = 0.01; }; } );
TEXT
cat >"$work/initial-surface.cfg" <<'TEXT'
bodies = ( { name = "ball";  mesh = { generator = "ico_sphere";  nodes = 42; };  initial = "a.h5"; } );
TEXT
for model in voxel plane; do
    sed 's/cuttable = true/initial = "a.h5"/' "$work/$model.cfg" >"$work/initial-$model.cfg"
done

# build MODEL cmake-options...
build() {
    model=$1
    shift
    folder=build/smallest-$model
    mkdir -p build
    cmake -S . -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPLIANT_WERROR=ON \
        -DPLIANT_SURFACE=OFF -DPLIANT_VOXEL=OFF -DPLIANT_PLANE=OFF \
        "-DPLIANT_$(echo "$model" | tr a-z A-Z)=ON" \
        -DPLIANT_HDF5=OFF -DPLIANT_CLIENTS=OFF -DPLIANT_STUDY=OFF -DPLIANT_TESTS=OFF "$@" \
        >"$folder.log" 2>&1 || { cat "$folder.log" >&2; exit 1; }
    touch "$folder/started"
    cmake --build "$folder" -j "$(nproc)"
    mv "$folder/started" "$folder/built"
    pliantd=$folder/bin/pliantd
    echo "$model: $pliantd has $(wc -c <"$pliantd") bytes"
    runs "$model" "$pliantd" "$work/$model.cfg"
    for other in surface voxel plane; do
        [ "$other" = "$model" ] ||
            refuses "$model" "built without $other bodies" "$pliantd" --check "$work/$other.cfg"
    done
    scene=$work/$model.cfg
    refuses "$model" 'built without HDF5' "$pliantd" --offline 1 --record "$work/a.h5" "$scene"
    refuses "$model" 'built without HDF5' "$pliantd" --offline 1 --checkpoint "$work/a.h5" "$scene"
    refuses "$model" 'built without HDF5' "$pliantd" --offline 1 --resume "$work/a.h5" "$scene"
    refuses "$model" 'built without HDF5' "$pliantd" --offline 1 --prepared "$work/a.h5" "$scene"
    refuses "$model" 'built without HDF5' "$pliantd" --check "$work/initial-$model.cfg"
    refuses "$model" 'built without HDF5' "$folder/bin/pliant-prepare" -o "$work/a.h5" "$scene"
    [ ! -e "$work/a.h5" ] || complain "$model left a file that it cannot write"
}

for model in surface voxel plane; do
    build "$model" "$@"
done
[ $failed -eq 0 ] && echo "smallest: all build, run and refuse what they lack"
exit $failed
