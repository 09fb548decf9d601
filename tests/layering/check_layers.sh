#!/bin/sh
# SPDX-License-Identifier: MIT
# Each module of the server sees itself and the modules below it, and no other: a wrong include does not
# compile. The study, a client, sees all of them. Compiles one line per pair of modules with the include folders of the build.
#
# check_layers.sh COMPILER MODULES.txt SERVER-FOLDER
set -u
compiler=$1 modules=$2 server=$3
failed=0 compiled=0 refused=0

header_of() {
    case $1 in
    base) echo base/vec.h ;;
    geometry) echo geometry/mesh.h ;;
    body) echo body/body.h ;;
    sim) echo sim/sim.h ;;
    surface) echo surface/surface.h ;;
    voxel) echo voxel/voxel.h ;;
    plane) echo plane/plane.h ;;
    io) echo io/hdf.h ;;
    scene) echo scene/scene.h ;;
    run) echo run/bus.h ;;
    study) echo study/study.h ;;
    esac
}

# What each module sees besides itself. A model sees bodies alone, neither the tick nor another model.
seen_by() {
    case $1 in
    geometry) echo base ;;
    body) echo base geometry ;;
    sim | surface | voxel | plane) echo base geometry body ;;
    io) echo base geometry body sim ;;
    scene) echo base geometry body sim surface voxel plane io ;;
    run) echo base geometry body sim surface voxel plane io scene ;;
    study) echo base geometry body sim surface voxel plane io scene run ;;
    esac
}

may_see() {
    case " $1 $(seen_by "$1") " in
    *" $2 "*) true ;;
    *) false ;;
    esac
}

complain() {
    echo "layering: $*" >&2
    failed=1
}

while read -r module folders; do
    options=
    for folder in $folders; do
        options="$options -I$folder"
    done
    for other in base geometry body sim surface voxel plane io scene run study; do
        header=$(header_of "$other")
        [ -f "$server/$header" ] || [ -f "$server/../clients/$header" ] || complain "there is no $header to try"
        # shellcheck disable=SC2086 # one option a word
        if printf '#include "%s"\nextern int used;\n' "$header" |
            "$compiler" -std=c17 -D_GNU_SOURCE $options -fsyntax-only -x c - 2>/dev/null; then
            compiled=$((compiled + 1))
            may_see "$module" "$other" || complain "module $module can include $header"
        else
            refused=$((refused + 1))
            may_see "$module" "$other" && complain "module $module cannot include $header"
        fi
    done
done <"$modules"

# System headers are reachable from every module, so the text is searched for these.
only_in() {
    pattern=$1
    shift
    found=$(cd "$server" && grep -rlE "#include [<\"]$pattern" --include='*.[ch]' . |
        grep -vE "^\./($(echo "$*" | tr ' ' '|'))/")
    [ -z "$found" ] || complain "$pattern is included by" $found
}
only_in '(hdf5|on_demand/)' io
only_in 'libconfig' scene
only_in 'teem/' io
only_in '(nifti|znz)' io
only_in 'zlib' io
only_in 'lcm/' run
only_in 'pliant_[a-z_]*_t\.h' run

echo "layering: $compiled includes compile, $refused do not"
[ "$compiled" -gt 0 ] && [ "$refused" -gt 0 ] || complain "nothing was tried"
exit $failed
