// SPDX-License-Identifier: MIT
#include "run.h"
#include "scoped.h"

#include "base/check.h"
#include "base/clock.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const Model MODEL_COARSE = {"coarse", MODEL_HELD, 0};
const Model MODEL_REFINED_1 = {"refined 1", MODEL_HELD, 1};
const Model MODEL_REFINED_2 = {"refined 2", MODEL_HELD, 2};
const Model MODEL_ADAPTIVE_1 = {"adaptive 1", MODEL_ADAPTIVE, 1};
const Model MODEL_ADAPTIVE_2 = {"adaptive 2", MODEL_ADAPTIVE, 2};

static _Noreturn void give_up(const Status *status)
{
    fprintf(stderr, "pliant-accuracy: %s\n", status->text);
    exit(1);
}

void run_read(const char *folder, const char *name, Scene *scene)
{
    char path[4096];
    Status status = {0};
    snprintf(path, sizeof path, "%s/%s.cfg", folder, name);
    if (!scene_read(path, scene, &status))
        give_up(&status);
}

void scene_scale_loads(Scene *scene, double factor)
{
    for (int k = 0; k < scene->load_count; k++)
        scene->load[k].load.force = vec3_scale(factor, scene->load[k].load.force);
}

void run_build(const Scene *scene, const Model *model, World *world)
{
    const BuildOptions options = {.isa = "auto"};
    const bool held = model->kind == MODEL_HELD;
    SceneBody body = scene->body[0];
    Scene changed = *scene;
    Status status = {0};
    body.surface.adaptive = !held;
    body.surface.start_level = held ? model->levels : body.surface.adapt.coarsest;
    // There are no rules of levels without levels, and a body held at level 0 shall have them.
    body.surface.body.levels = model->levels > 0 ? model->levels : 1;
    changed.body = &body;
    if (!world_build(world, &changed, &options, &status))
        give_up(&status);
}

int64_t run_step(World *world)
{
    int64_t begin = clock_thread_ns();
    sim_step(world->sim);
    return clock_thread_ns() - begin;
}

// ---------------------------------------------------------------------------------------------
// What is measured

void probe_create(const Scene *scene, Probe *probe)
{
    SCOPED(world_destroy) World world;
    run_build(scene, &MODEL_COARSE, &world);
    const TriMesh *mesh = &world.mesh[0];
    const double *area = sim_body(world.sim, 0)->surface.node_area;
    *probe = (Probe){.mesh = *mesh, .weight = calloc((size_t)mesh->node_count, sizeof(double))};
    ASSERT(probe->weight != NULL);
    Vec3 force = {0};
    for (int k = 0; k < scene->load_count; k++) {
        const LoadOptions *load = &scene->load[k].load;
        double sum = 0.0, size = vec3_length(load->force);
        for (int pass = 0; pass < 2; pass++)
            for (int i = 0; i < mesh->node_count; i++) {
                if (vec3_length(vec3_sub(mesh->position[i], load->center)) > load->radius)
                    continue;
                if (pass == 0)
                    sum += area[i];
                else
                    probe->weight[i] += size * area[i] / sum;
            }
        force = vec3_add(force, load->force);
    }
    double total = 0.0;
    for (int i = 0; i < mesh->node_count; i++)
        total += probe->weight[i];
    for (int i = 0; i < mesh->node_count; i++)
        probe->weight[i] /= total;
    probe->direction = vec3_scale(1.0 / vec3_length(force), force);
    world.mesh[0] = (TriMesh){0}; // the probe's now
}

void probe_destroy(Probe *probe)
{
    mesh_destroy(&probe->mesh);
    free(probe->weight);
}

// Nodes of level 0 have the same number in every model.
static double read_probe(const Body *body, const Probe *probe)
{
    double sum = 0.0;
    for (int i = 0; i < probe->mesh.node_count; i++) {
        if (probe->weight[i] == 0.0)
            continue;
        Vec3 now;
        body->ops->read_nodes(body->model, &i, 1, &now, NULL);
        Vec3 moved = vec3_sub(now, probe->mesh.position[i]);
        sum += probe->weight[i] * vec3_dot(moved, probe->direction);
    }
    return sum;
}

static void widen(int range[2], int value)
{
    range[0] = value < range[0] ? value : range[0];
    range[1] = value > range[1] ? value : range[1];
}

int run_node_count(const Body *body)
{
    int nodes = 0;
    for (int s = 0; s < body->mesh.node_count; s++)
        nodes += body->mesh.id[s] >= 0;
    return nodes;
}

static void count(const Body *body, Trace *trace)
{
    widen(trace->nodes, run_node_count(body));
    widen(trace->springs, body->spring_count);
}

void run_steps(World *world, const Probe *probe, double seconds, Trace *trace)
{
    const Sim *sim = world->sim;
    const Body *body = sim_body(world->sim, 0);
    int ticks = (int)lround(seconds / sim_tick(sim));
    ASSERT(ticks <= TRACE_MOST);
    trace->nodes[0] = trace->springs[0] = body->surface.node_count + body->spring_count;
    trace->nodes[1] = trace->springs[1] = 0;
    trace->cpu_ns = 0;
    count(body, trace);
    for (trace->count = 0; trace->count < ticks; trace->count++) {
        trace->cpu_ns += run_step(world);
        trace->time[trace->count] = sim_time(sim);
        trace->displacement[trace->count] = read_probe(body, probe);
        count(body, trace);
    }
    trace->resets = sim_resets(sim);
}

void run_trace(const Scene *scene, const Model *model, const Probe *probe, double seconds,
               Trace *trace)
{
    SCOPED(world_destroy) World world;
    run_build(scene, model, &world);
    run_steps(&world, probe, seconds, trace);
}

double trace_difference(const Trace *trace, const Trace *reference)
{
    double difference = 0.0, size = 0.0;
    for (int i = 0; i < reference->count; i++) {
        double u = reference->displacement[i], d = trace->displacement[i] - u;
        difference += d * d;
        size += u * u;
    }
    return sqrt(difference / size);
}

void run_displacements(const World *world, const Levels *levels, Vec3 *displacement)
{
    const Body *body = sim_body(world->sim, 0);
    const BodyMesh *mesh = &body->mesh;
    int finest = levels->level[levels->finest].node_count;
    size_t slots = (size_t)mesh->node_count;
    FREED Vec3 *x = zeroed(slots, sizeof *x), *v = zeroed(slots, sizeof *v);
    FREED bool *known = zeroed((size_t)finest, sizeof *known);
    body->ops->read_state(body->model, NULL, x, v);
    for (int s = 0; s < mesh->node_count; s++) {
        int node = mesh->id[s]; // of a generated mesh: the number in the hierarchy
        if (node < 0)
            continue;
        displacement[node] = vec3_sub(x[s], levels->position[node]);
        known[node] = true;
    }
    for (int i = 0; i < finest; i++) {
        if (known[i])
            continue;
        int parent[2];
        levels_parents(levels, i, parent);
        displacement[i] =
            vec3_scale(0.5, vec3_add(displacement[parent[0]], displacement[parent[1]]));
    }
}
