// SPDX-License-Identifier: MIT
#include "voxel_error.h"
#include "base/clock.h"
#include "voxel/error.h"
#include "voxel/model.h"
#include "sim_steps.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(int argc, char **argv)
{
    const int most = argc > 1 ? atoi(argv[1]) : 400000; // cells
    const char *only = argc > 2 ? argv[2] : "";
    const int part = argc > 3 ? atoi(argv[3]) : 0, parts = argc > 4 ? atoi(argv[4]) : 1;
    for (int s = 0; s < ERROR_SCENE_COUNT; s++) {
        const ErrorScene *scene = &ERROR_SCENES[s];
        if (strstr(scene->name, only) == NULL || s % parts != part)
            continue;
        ErrorRun run[3];
        int64_t t0 = clock_thread_ns();
        error_run(&run[0], scene, 0);
        double cells = (double)lattice_solid(&run[0].world.lattice);
        BodyError err = error_run_estimate(&run[0], scene, 1 << 30);
        BodyMeasure m = measure_of(run[0].world.body);
        double rms = error_run_rms(&run[0]);
        printf("%-24s\test %.5e\tfest %.5e\tcells %.0f\tU %.4e\trms %.4e\tF %.5f\tkin %.1e",
               scene->name, err.relative, err.force[0], cells, m.elastic, rms, run[0].force[0],
               run[0].kinetic);
        int runs = 1;
        double d[2] = {0, 0};
        for (int k = 1; k < 3 && cells * (1 << 3 * k) < most; k++, runs++) {
            error_run(&run[k], scene, k);
            d[k - 1] = error_run_differ(&run[0], 0, &run[k - 1], k - 1, &run[k], k);
            BodyMeasure mk = measure_of(run[k].world.body);
            printf("\td%d %.4e\tF%d %.5f\tU%d %.4e\tkin %.1e", k, d[k - 1] / rms, k,
                   run[k].force[0], k, mk.elastic, run[k].kinetic);
        }
        printf("\tt %.1f", 1e-9 * (double)(clock_thread_ns() - t0));
        printf("\n");
        fflush(stdout);
        for (int k = 0; k < runs; k++)
            error_run_end(&run[k]);
    }
    return 0;
}
