#!/bin/sh
# SPDX-License-Identifier: MIT
# study_outside.sh PROGRAMS DATA: figures that no run of ours is the reference of.
# DATA/swing.tsv: a ball on its shape springs under a gravity that begins at once moves as one, like a
# damped oscillator; error of the steps in time from its closed form, beside what pliant-study says.
# DATA/beam.tsv: bending of a cantilever by solid bodies and by CalculiX, and what either costs.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
programs=$(cd "$1" && pwd) data=$2
mkdir -p "$data"
cd "$data"

# --- the oscillator ---

write_swing() {
    cat <<SCENE
name = "swing";  rate_hz = 1000.0;  gravity = [0.0, 0.0, -2.0];  precision = "$3";
publish = { nodes_hz = 1000.0; };
bodies = ( { name = "ball";  mesh = { generator = "sphere";  nodes = 114;  radius = 0.05; };
    shape = { angular_frequency = 50.0;  damping_ratio = 0.1; };
    integrator = "$1";  time_step = $2; } );
SCENE
}

# L2 over half a second of the distance of node 0 from x(t) of x'' + 2 z w x' + w^2 x = g, over that of x.
swing_error() {
    rm -f swing.h5 swing.h5.xdmf
    "$programs/pliantd" --offline 0.5 --record swing.h5 swing.cfg >swing.log
    h5dump -d /bodies/ball/position -s "0,2" -S "114,1" -c "501,1" -y -m %.9g swing.h5 |
        awk '/^ *-?[0-9.]+(e-?[0-9]+)?,? *$/ { sub(/,/, ""); z[n++] = $1 }
            END {
                g = -2; w = 50; d = 0.1; v = w * sqrt(1 - d * d)
                for (i = 0; i < n; i++) {
                    t = i / 1000
                    x = g / (w * w) * (1 - exp(-d * w * t) * (cos(v * t) + d * w / v * sin(v * t)))
                    off += (z[i] - z[0] - x) ^ 2; all += x * x
                }
                if (n != 501) exit 1
                printf "%.3g", 100 * sqrt(off / all)
            }'
}

# What pliant-study says of the same: "error in time [%]<tab>cost [ms]".
study_says() {
    awk -F '\t' -v integrator="$1" -v step="$2" -v precision="$3" '
        NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
        $at["integrator"] == integrator && $at["precision"] == precision && $at["step_doubling"] == 0 &&
            $at["time_step_asked"] + 0 == step + 0 && $at["verdict"] == "ok" && !done++ {
            printf "%.3g\t%.3g", 100 * $at["time_patch"], 1000 * $at["cpu_median"]
        }' "swing-$3/runs.tsv"
}

{
    printf 'method\tstep [ms]\terror from the closed form [%%]\terror by pliant-study [%%]\tcost of a simulated second [ms]\n'
    for precision in single double; do
        write_swing leapfrog 0.001 $precision >swing.cfg
        "$programs/pliant-study" --duration 0.5 --only "$precision, level 0" --out "swing-$precision" \
            swing.cfg >swing.txt 2>swing.err || { cat swing.err >&2; exit 1; }
        for integrator in leapfrog symplectic_euler rk4; do
            for step in 0.001 0.0005 0.00025 0.0001; do
                write_swing $integrator $step $precision >swing.cfg
                printf '%s, %s\t%s\t%s\t%s\n' $integrator $precision \
                    "$(awk -v s=$step 'BEGIN { print 1000 * s }')" "$(swing_error)" \
                    "$(study_says $integrator $step $precision)"
            done
        done
    done
} >swing.tsv

# --- the beam ---

write_beam() {
    cat <<SCENE
name = "beam";  rate_hz = 1000.0;  gravity = [0.0, 0.0, -0.01];
bodies = ( { name = "beam";  model = "voxel";
    voxels = { generator = "box";  count = [$((4 * $2)), $2, $2];  size = $(awk -v n="$2" 'BEGIN { print 0.05 / n }'); };
    levels = 0;  law = "$1";
    material = { youngs_modulus = 1.0e4;  poisson_ratio = $3;  density = 1000.0; };
    fixed = ( { box = ([-1.0, -1.0, -1.0], [-0.0999, 1.0, 1.0]); } ); } );
SCENE
}

# Milliseconds of a simulated second: of a study's run of the scene as it is.
beam_cost() {
    write_beam "$@" >beam.cfg
    "$programs/pliant-study" --quick --repeat 3 --duration 0.2 --only 'no such case' --out beam beam.cfg \
        >beam.txt 2>beam.err || { cat beam.err >&2; exit 1; }
    awk -F '\t' 'NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
        $at["is_scene"] == 1 { printf "%.3g", 1000 * $at["cpu_median"] }' beam/runs.tsv
}

"$programs/pliant-study-beam" 0.3 >beam-own.tsv
code=0
sh "$here/cantilever_ccx.sh" --times 0.3 >beam-ccx.tsv || code=$?
[ $code -eq 0 ] || [ $code -eq 77 ] || exit $code
{
    printf 'elements\tthrough the thickness\tdeflection over that of 8 C3D8I [%%]\twhat it costs [ms]\n'
    # The finest of the elements that bend well; without CalculiX, Timoshenko.
    finest=$(awk -F '\t' '$1 == "C3D8I" { r = $3 } END { print r == "" ? 1 : r }' beam-ccx.tsv)
    while IFS='	' read -r law n ratio; do
        nu=0.3
        of=$finest
        # The paper's element has no Poisson ratio: Timoshenko is exact then.
        [ "$law" = affine ] || { nu=0.0; of=1; }
        printf '%s\t%s\t%s\t%s a simulated second\n' "$law" "$n" \
            "$(awk -v r="$ratio" -v of="$of" 'BEGIN { printf "%+.2f", 100 * (r / of - 1) }')" \
            "$(beam_cost "$law" "$n" $nu)"
    done <beam-own.tsv
    awk -F '\t' -v of="$finest" '{ printf "CalculiX %s\t%s\t%+.2f\t%.0f once, at rest\n", $1, $2, 100 * ($3 / of - 1), 1000 * $4 }' beam-ccx.tsv
} >beam.tsv
