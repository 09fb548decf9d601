#!/bin/sh
# SPDX-License-Identifier: MIT
# The cantilever of tests/voxel/test_voxel_cantilever.c by CalculiX (Debian's calculix-ccx): deflection of
# the end over Timoshenko's with the shear coefficient 5/6, for bricks with incompatible modes
# (C3D8I), full (C3D8) and reduced (C3D8R) integration, with 1, 2, 4 and 8 elements through the
# thickness. Then the mean move of the end [mm] of the same beam with E = 1 MPa that sags under its
# own weight, with large rotations (NLGEOM, C3D8I). Prints tables in Markdown. Exit code 77: ccx is
# not installed.
#
# With --times, for one ratio: a row an element type and number of elements with the ratio to
# Timoshenko's deflection and the seconds that ccx took, separated by tabs.
#
# usage: cantilever_ccx.sh [poisson's ratio ...]
#        cantilever_ccx.sh --times [poisson's ratio]
set -eu

command -v ccx >/dev/null || exit 77
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export OMP_NUM_THREADS=1 CCX_NPROC=1

# Writes $folder/beam.inp: element type, elements through the thickness, nu, load (end or weight).
write_input()
{
    awk -v type="$1" -v n="$2" -v nu="$3" -v load="$4" '
    function node(i, j, k) { return 1 + i + (4 * n + 1) * (j + (n + 1) * k) }
    BEGIN {
        h = 0.05 / n
        print "*NODE, NSET=ALL"
        for (k = 0; k <= n; k++) for (j = 0; j <= n; j++) for (i = 0; i <= 4 * n; i++)
            printf "%d, %.15g, %.15g, %.15g\n", node(i, j, k), i * h, j * h, k * h
        print "*ELEMENT, TYPE=" type ", ELSET=BEAM"
        for (k = 0; k < n; k++) for (j = 0; j < n; j++) for (i = 0; i < 4 * n; i++)
            printf "%d, %d, %d, %d, %d, %d, %d, %d, %d\n", ++e, node(i, j, k), node(i + 1, j, k),
                node(i + 1, j + 1, k), node(i, j + 1, k), node(i, j, k + 1),
                node(i + 1, j, k + 1), node(i + 1, j + 1, k + 1), node(i, j + 1, k + 1)
        print "*NSET, NSET=CLAMP"
        for (k = 0; k <= n; k++) for (j = 0; j <= n; j++) print node(0, j, k) ","
        print "*NSET, NSET=END"
        for (k = 0; k <= n; k++) for (j = 0; j <= n; j++) print node(4 * n, j, k) ","
        print "*MATERIAL, NAME=M\n*ELASTIC\n" (load == "end" ? "10000." : "1000000.") ", " nu
        print "*DENSITY\n1000."
        print "*SOLID SECTION, ELSET=BEAM, MATERIAL=M"
        print "*STEP" (load == "end" ? "" : ", NLGEOM") "\n*STATIC\n*BOUNDARY\nCLAMP, 1, 3"
        print load == "end" ? "*CLOAD" : "*DLOAD\nBEAM, GRAV, 9.81, 0., 0., -1."
        if (load == "end") for (k = 0; k <= n; k++) for (j = 0; j <= n; j++)
            printf "%d, 3, %.15g\n", node(4 * n, j, k), 1e-3 * weight(j) * weight(k) / (n * n)
        print "*NODE PRINT, NSET=END\nU\n*END STEP"
    }
    function weight(i) { return i == 0 || i == n ? 0.5 : 1 }' >"$folder/beam.inp"
}

# The mean move of the end, weighted as the load, [m].
end_move()
{
    write_input "$1" "$2" "$3" "$4"
    (cd "$folder" && ccx beam >log 2>&1) || { cat "$folder/log" >&2; exit 1; }
    awk -v n="$2" '
    NF == 4 && $1 + 0 > 0 {
        at = $1 - 1 - 4 * n
        row = at / (4 * n + 1)
        j = row % (n + 1); k = int(row / (n + 1))
        w = (j == 0 || j == n ? 0.5 : 1) * (k == 0 || k == n ? 0.5 : 1) / (n * n)
        sum = (row in seen ? 0 : sum) + w * $4
        if (row in seen) delete seen
        seen[row] = 1
    }
    END { printf "%.9g", sum }' "$folder/beam.dat"
}

ratio()
{
    end_move "$1" "$2" "$3" end | awk -v nu="$3" '{
        b = 0.05; l = 0.2; e = 1e4; g = e / (2 * (1 + nu))
        printf "%.4f", $1 / (1e-3 * (l ^ 3 / (3 * e * b ^ 4 / 12) + l / (5 / 6 * g * b ^ 2)))
    }'
}

# The best of three runs, the start of the program included.
seconds()
{
    best=
    for _ in 1 2 3; do
        start=$(date +%s%N)
        (cd "$folder" && ccx beam >log 2>&1)
        end=$(date +%s%N)
        best=$(awk -v ns=$((end - start)) -v best="$best" \
            'BEGIN { s = ns / 1e9; printf "%.3f", (best == "" || s < best ? s : best) }')
    done
    echo "$best"
}

if [ "${1-}" = --times ]; then
    for type in C3D8I C3D8; do
        for n in 1 2 4 8; do
            printf '%s\t%s\t%s\t' $type $n "$(ratio $type $n "${2-0.3}")"
            write_input $type $n "${2-0.3}" end
            seconds
        done
    done
    exit 0
fi

[ $# -gt 0 ] || set -- 0 0.3 0.45
for nu in "$@"; do
    printf '| nu = %s, elements | C3D8I | C3D8 | C3D8R |\n|---|---|---|---|\n' "$nu"
    for n in 1 2 4 8; do
        printf '| %s | %s | %s | %s |\n' $n "$(ratio C3D8I $n "$nu")" "$(ratio C3D8 $n "$nu")" \
            "$(ratio C3D8R $n "$nu")"
    done
    echo
done

printf '| sagging, elements |'
printf ' nu = %s |' "$@"
printf '\n|---|'
printf -- '---|%.0s' "$@"
echo
for n in 2 4; do
    printf '| %s |' $n
    for nu in "$@"; do
        printf ' %.3f |' "$(end_move C3D8I $n "$nu" weight | awk '{ print 1000 * $1 }')"
    done
    echo
done
