// How long a tick takes on this machine, for --check: measured, not counted. Main thread, in place
// of a run; the world is of no use afterwards.
#include "run/modes.h"

#include "base/check.h"

#include <stdlib.h>

enum {
    TICKS_MOST = 400,
    TICKS_LEAST = 5,
    TICKS_WARM_UP = 3, // caches, and contacts that settle
};
static const double BUDGET = 0.5; // of a measurement [s]
// What the ticks of a scene may take of the time that they have: presses add up to a third, and
// whatever else the machine does needs the rest.
static const double FITS = 0.5, TIGHT = 0.9;

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Steps a world at rest for a while; returns the median of a tick [s].
static double measure(Sim *sim)
{
    double time[TICKS_MOST];
    const int64_t begin = clock_now_ns();
    int count = 0;
    for (int i = -TICKS_WARM_UP; i < TICKS_MOST; i++) {
        const int64_t start = clock_now_ns();
        sim_step(sim);
        const int64_t end = clock_now_ns();
        if (i >= 0)
            time[count++] = 1e-9 * (double)(end - start);
        if (count >= TICKS_LEAST && 1e-9 * (double)(end - begin) > BUDGET)
            break;
    }
    qsort(time, (size_t)count, sizeof *time, by_size);
    return time[count / 2];
}

// The same of a world whose bodies are held at their finest level; 0: none of them adapts, or they
// cannot be built so.
static double measure_refined(const Scene *scene, const BuildOptions *options)
{
    Scene refined = *scene;
    bool any = false;
    double time = 0.0;
    refined.body = calloc((size_t)scene->body_count, sizeof *refined.body);
    ASSERT(refined.body != NULL);
    for (int i = 0; i < scene->body_count; i++) {
        refined.body[i] = scene->body[i];
        SurfaceOptions *surface = &refined.body[i].surface;
        if (scene->body[i].model != MODEL_SURFACE || !surface->adaptive)
            continue;
        surface->start_level = surface->adapt.coarsest = surface->body.levels;
        any = true;
    }
    World world = {0};
    Status status = {0};
    if (any && world_build(&world, &refined, options, &status))
        time = measure(world.sim);
    if (any)
        world_destroy(&world);
    free(refined.body);
    return time;
}

// Returns what to do about a scene that is too slow.
static const char *advice(World *world, const Scene *scene, double refined)
{
    if (refined > 0.0)
        return "fewer levels, a smaller capacity or a lower rate_hz";
    for (int i = 0; i < sim_body_count(world->sim); i++)
        if (scene->body[i].model == MODEL_SURFACE && sim_body(world->sim, i)->substeps > 4 &&
            sim_body(world->sim, i)->integrator != INTEGRATOR_IMPLICIT)
            return "a coarser mesh, integrator = \"implicit\" or a lower rate_hz";
    return scene->threads > 1 ? "coarser meshes, larger elements inside (levels) or a lower rate_hz"
                              : "coarser meshes, larger elements inside (levels), threads or a "
                                "lower rate_hz";
}

void explain_time(World *world, const Scene *scene, const BuildOptions *options, FILE *out)
{
    const double tick = sim_tick(world->sim), rest = measure(world->sim),
                 refined = measure_refined(scene, options);
    const double share = fmax(rest, refined) / tick;
    fprintf(out, "time of a tick on this machine: %.3g ms at rest", 1e3 * rest);
    if (refined > 0.0)
        fprintf(out, ", %.3g ms with all faces at the finest level", 1e3 * refined);
    fprintf(out, ", of %.3g ms: %s", 1e3 * tick,
            share <= FITS    ? "fits"
            : share <= TIGHT ? "tight, pressing adds up to a third: try "
                             : "misses: try ");
    fprintf(out, "%s\n", share <= FITS ? "" : advice(world, scene, refined));
}
