// SPDX-License-Identifier: MIT
// pliant-error-solids [CELLS] [NAME]: estimated and true errors of solids (BodyOps.estimate), a
// line for each scene whose name contains NAME, for errors.md. The truth is the same body
// with all cells divided once and, if that makes fewer than CELLS (115000), twice, without levels.
#include "voxel_error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DIVIDED = 2 };

// Returns what finer bodies say v tends to; `factor`: on its first difference.
static double limit(const double v[DIVIDED + 1], int count, double factor)
{
    return count == 1 ? v[0] + factor * (v[1] - v[0]) : v[2] + (factor - 1.0) * (v[2] - v[1]);
}

// Factor on the first difference: 1 / (1 - 1/ratio) of differences that fall by `ratio`, between
// first order and second; where only one is known that of the median order of the others, 1.5.
static double beyond(const double differ[DIVIDED], int count)
{
    const double second = 4.0 / 3.0, first = 2.0, usual = 1.55;
    if (count < 2)
        return usual;
    const double ratio = differ[0] / differ[1];
    return ratio <= 1.0 ? first : fmin(first, fmax(second, ratio / (ratio - 1.0)));
}

static void study(const ErrorScene *scene, double most)
{
    ErrorRun run[DIVIDED + 1];
    error_run(&run[0], scene, 0);
    const BodyError error = error_run_estimate(&run[0], scene, 1 << 20);
    const double cells = (double)lattice_solid(&run[0].world.lattice);
    const double moved = error_run_rms(&run[0]);
    double differ[DIVIDED] = {0.0}, force[DIVIDED + 1] = {run[0].force[0]};
    int count = 0;
    for (int k = 1; k <= DIVIDED && (k == 1 || cells * pow(8.0, k) < most); k++) {
        error_run(&run[k], scene, k);
        differ[k - 1] = error_run_differ(&run[0], 0, &run[k - 1], k - 1, &run[k], k) / moved;
        force[k] = run[k].force[0];
        count = k;
    }
    const double factor = beyond(differ, count), truth = factor * differ[0];
    printf("%s\t%.0f\t%d\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f", scene->name, cells, scene->levels,
           100.0 * differ[0], 100.0 * truth, 100.0 * error.relative, error.relative / differ[0],
           error.relative / truth);
    if (force[0] > 0.0) {
        const double missing = limit(force, count, factor) / force[0] - 1.0;
        printf("\t%+.2f\t%.2f\n", 100.0 * missing, 100.0 * error.force[0]);
    } else {
        printf("\t-\t-\n");
    }
    fflush(stdout);
    for (int k = 0; k <= count; k++)
        error_run_end(&run[k]);
}

int main(int argc, char **argv)
{
    const double most = argc > 1 ? atof(argv[1]) : 115000.0;
    const char *part = argc > 2 ? argv[2] : "";
    printf("scene\tcells\tlevels\tdivided once [%%]\ttrue [%%]\testimated [%%]\tover divided "
           "once\tover true\tforce missing [%%]\testimated [%%]\n");
    for (int s = 0; s < ERROR_SCENE_COUNT; s++)
        if (strstr(ERROR_SCENES[s].name, part) != NULL)
            study(&ERROR_SCENES[s], most);
    return 0;
}
