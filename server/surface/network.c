// SPDX-License-Identifier: MIT
// Springs and masses of a mesh at rest, the bounds of the time step, and the fixed nodes. Load
// time, but for the pure functions of the rules.
#include "surface/network.h"

#include "base/check.h"
#include "surface/law.h"

#include <stdlib.h>

// ---------------------------------------------------------------------------------------------
// Rules of the material and the levels

static double edge_length(const Vec3 *x, const int end[2])
{
    return vec3_length(vec3_sub(x[end[0]], x[end[1]]));
}

static double measure_areas(LevelRules *rules, const Vec3 *x, const int (*face)[3])
{
    double total = 0.0;
    // Half the cross product of two edges.
    for (int f = 0; f < rules->face_count; f++) {
        const int *node = face[f];
        Vec3 normal =
            vec3_cross(vec3_sub(x[node[1]], x[node[0]]), vec3_sub(x[node[2]], x[node[0]]));
        rules->area[f] = 0.5 * vec3_length(normal);
        total += rules->area[f];
    }
    return total;
}

// Returns the mean stiffness of the springs of level 0 by the continuum rule [N/m].
static double mean_stiffness(const LevelRules *rules)
{
    const Level *level = &rules->levels->level[0];
    double sum = 0.0;
    for (int e = 0; e < level->edge_count; e++)
        for (int side = 0; side < 2; side++)
            if (level->edge_face[e][side] >= 0)
                sum += level_rules_face_stiffness(
                    rules, rules->area[level->edge_face[e][side]],
                    edge_length(rules->levels->position, level->edge[e]));
    return sum / level->edge_count;
}

// Sets the properties of all levels, if there are levels.
static void set_levels(LevelRules *rules, double total_area)
{
    const SurfaceMaterial *material = &rules->options->material;
    const Levels *levels = rules->levels;
    int nodes = levels->level[0].node_count;
    // The total mass is the same at every level.
    double mass =
        material->uniform ? material->node_mass * nodes : material->areal_density * total_area;
    rules->mean_mass = mass / nodes;
    rules->areal_density = material->uniform ? mass / total_area : material->areal_density;
    rules->same_nodes = rules->options->adjust == ADJUST_CHOI2005;
    rules->same_springs = rules->same_nodes || material->uniform;
    if (!rules->same_springs)
        return;
    // What all springs or nodes of a level have in common.
    double stiffness = material->uniform ? material->spring_stiffness : mean_stiffness(rules);
    for (int l = 0; l <= levels->finest; l++) {
        double share = (double)nodes / levels->level[l].node_count; // of a node's mass
        rules->mass[l] = rules->mean_mass * share;
        rules->stiffness[l] = rules->same_nodes ? ldexp(stiffness, l) * share : stiffness;
    }
}

void level_rules_create(LevelRules *rules, const TriMesh *mesh, const SurfaceOptions *options)
{
    const Levels *levels = options->hierarchy;
    const SurfaceMaterial *material = &options->material;
    *rules = (LevelRules){.levels = levels, .options = options};
    rules->face_count = levels != NULL ? levels->level[0].face_count : mesh->triangle_count;
    rules->area = malloc((size_t)rules->face_count * sizeof *rules->area + 1);
    ASSERT(rules->area != NULL);
    // Areas of level 0, from which all levels follow.
    double total =
        levels != NULL
            ? measure_areas(rules, levels->position, (const int(*)[3])levels->level[0].face)
            : measure_areas(rules, mesh->position, (const int(*)[3])mesh->triangle);
    if (levels != NULL) {
        set_levels(rules, total);
        return;
    }
    // One level: the material as given.
    rules->same_springs = rules->same_nodes = material->uniform;
    rules->stiffness[0] = material->spring_stiffness;
    rules->mass[0] = material->node_mass;
    rules->areal_density = material->areal_density;
}

void level_rules_destroy(LevelRules *rules)
{
    free(rules->area);
    *rules = (LevelRules){0};
}

double level_rules_area(const LevelRules *rules, int level, int face)
{
    static const double quarter[LEVELS_MAX + 1] = {1.0,     0x1p-2,  0x1p-4,  0x1p-6, 0x1p-8,
                                                   0x1p-10, 0x1p-12, 0x1p-14, 0x1p-16};
    return quarter[level] * rules->area[face >> 2 * level];
}

double level_rules_face_stiffness(const LevelRules *rules, double area, double length)
{
    return rules->options->material.youngs_modulus_2d * area / (length * length);
}

double level_rules_node_mass(const LevelRules *rules, int level, double area)
{
    return rules->same_nodes ? rules->mass[level] : rules->areal_density * area;
}

double level_rules_mixed_mass(const LevelRules *rules, const int *edges)
{
    double sum = 0.0;
    int count = 0;
    for (int l = 0; l <= rules->levels->finest; l++) {
        sum += edges[l] * rules->mass[l];
        count += edges[l];
    }
    return sum / count;
}

// Scales a value that the scene gives per node to a node of that mass.
static double by_mass(const LevelRules *rules, double value, double mass)
{
    return rules->mean_mass > 0.0 ? value * (mass / rules->mean_mass) : value;
}

double level_rules_shape_stiffness(const LevelRules *rules, double mass)
{
    const SurfaceShape *shape = &rules->options->shape;
    double w = shape->angular_frequency;
    if (!shape->wanted)
        return 0.0;
    return shape->per_node ? by_mass(rules, shape->stiffness, mass) : mass * w * w;
}

double level_rules_shape_damping(const LevelRules *rules, double mass)
{
    const SurfaceShape *shape = &rules->options->shape;
    if (!shape->wanted)
        return 0.0;
    return shape->per_node ? by_mass(rules, shape->damping, mass)
                           : 2.0 * shape->damping_ratio * shape->angular_frequency * mass;
}

double level_rules_node_damping(const LevelRules *rules, double mass)
{
    return by_mass(rules, rules->options->material.node_damping, mass);
}

LevelBounds level_rules_bounds(const LevelRules *rules, int level, const bool *fixed)
{
    const Level *at = &rules->levels->level[level];
    size_t nodes = (size_t)at->node_count;
    double *sum = calloc(nodes, sizeof *sum), *area = calloc(nodes, sizeof *area);
    ASSERT(sum != NULL && area != NULL);
    // A node stands for a third of the faces around it.
    for (int f = 0; f < at->face_count; f++)
        for (int k = 0; k < 3; k++)
            area[at->face[f][k]] += level_rules_area(rules, level, f) / 3.0;
    // Each edge adds its stiffness to the row sums of both ends.
    for (int e = 0; e < at->edge_count; e++) {
        double stiffness = rules->same_springs ? rules->stiffness[level] : 0.0;
        double length = edge_length(rules->levels->position, at->edge[e]);
        for (int side = 0; side < 2 && !rules->same_springs; side++)
            if (at->edge_face[e][side] >= 0)
                stiffness += level_rules_face_stiffness(
                    rules, level_rules_area(rules, level, at->edge_face[e][side]), length);
        for (int k = 0; k < 2; k++)
            sum[at->edge[e][k]] += stiffness;
    }

    // The bound is over free nodes; over all if every node is fixed.
    bool any_free = false;
    for (int i = 0; i < at->node_count; i++)
        any_free |= !fixed[i];
    const double rigidity = law_rigidity(&rules->options->material);
    LevelBounds bounds = {0.0, 0.0, 0.0};
    for (int i = 0; i < at->node_count; i++) {
        if (fixed[i] && any_free)
            continue;
        double mass = level_rules_node_mass(rules, level, area[i]);
        double shape = level_rules_shape_stiffness(rules, mass);
        bounds.springs = fmax(bounds.springs, 2.0 * sum[i] / mass);
        bounds.linear = fmax(bounds.linear, (2.0 * sum[i] + shape) / mass);
        bounds.lambda = fmax(bounds.lambda, (rigidity * (2.0 * sum[i]) + shape) / mass);
    }
    free(sum);
    free(area);
    return bounds;
}

void level_rules_raise_bounds(const LevelRules *rules, int level, double lambda_0, double damping_0,
                              double *lambda, double *damping)
{
    if (rules->levels == NULL || rules->options->adjust != ADJUST_CHOI2005)
        return;
    *lambda =
        fmax(*lambda, ldexp(lambda_0, 2 * level)); // the step is proportional to 1 / sqrt(lambda)
    *damping = fmax(*damping, ldexp(damping_0, level));
}

double level_rules_damping_time(const LevelRules *rules, double springs)
{
    const SurfaceMaterial *material = &rules->options->material;
    if (material->uniform)
        return material->spring_stiffness > 0.0
                   ? material->spring_damping / material->spring_stiffness
                   : 0.0;
    double longest = springs > 0.0 ? 0.8 / sqrt(springs) : material->damping_time;
    return fmin(material->damping_time, longest);
}

// ---------------------------------------------------------------------------------------------
// Springs and nodes of a mesh

static void *zeroed(int count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    ASSERT(memory != NULL);
    return memory;
}

static void measure_faces(SpringNetwork *network, const TriMesh *mesh, const LevelRules *rules,
                          int level)
{
    for (int f = 0; f < mesh->triangle_count; f++) {
        network->face_area[f] = level_rules_area(rules, level, f);
        for (int k = 0; k < 3; k++)
            network->node_area[mesh->triangle[f][k]] += network->face_area[f] / 3.0;
    }
}

static void set_springs(SpringNetwork *network, const TriMesh *mesh, const WingedMesh *winged,
                        const LevelRules *rules, int level)
{
    for (int e = 0; e < winged->edge_count; e++) {
        const WingedEdge *edge = &winged->edge[e];
        double length =
            vec3_length(vec3_sub(mesh->position[edge->node[0]], mesh->position[edge->node[1]]));
        network->rest_length[e] = length * (1.0 - rules->options->prestress);
        // Uniform springs, or a part from each face at the edge.
        if (rules->same_springs) {
            network->stiffness[e] = rules->stiffness[level];
            continue;
        }
        for (int side = 0; side < 2; side++)
            if (edge->face[side] >= 0)
                network->stiffness[e] +=
                    level_rules_face_stiffness(rules, network->face_area[edge->face[side]], length);
    }
}

static void set_nodes(SpringNetwork *network, const LevelRules *rules, int level, int node_count)
{
    for (int i = 0; i < node_count; i++) {
        double m = level_rules_node_mass(rules, level, network->node_area[i]);
        network->mass[i] = m;
        network->total_mass += m;
        network->shape_stiffness[i] = level_rules_shape_stiffness(rules, m);
        network->shape_damping[i] = level_rules_shape_damping(rules, m);
        network->node_damping[i] = level_rules_node_damping(rules, m);
    }
}

// Sets the bounds: lambda = max over free nodes of (2 sum k_e + k'_s) / m_i bounds M^-1 K by its
// row sums (README.md, "Stability bounds"); the damping bound likewise. The springs' damping time
// is k_d / k_s, so that their part of it is a multiple of theirs. With levels the damping time is
// that of the finest level, whichever level the body is at.
static void set_bounds(SpringNetwork *network, const WingedMesh *winged, const LevelRules *rules)
{
    // Largest row sums over the free nodes.
    const double rigidity = law_rigidity(&rules->options->material);
    double springs = 0.0, linear = 0.0, drag = 0.0;
    for (int i = 0; i < winged->node_count; i++)
        network->free_count += !network->fixed[i];
    for (int i = 0; i < winged->node_count; i++) {
        // Fixed nodes do not vibrate; a body that is entirely fixed needs lambda for the contact
        // stiffness only.
        if (network->fixed[i] && network->free_count > 0)
            continue;
        double sum = 0.0;
        for (int k = winged->node_edge_start[i]; k < winged->node_edge_start[i + 1]; k++)
            sum += network->stiffness[winged->node_edge[k]];
        double m = network->mass[i];
        springs = fmax(springs, 2.0 * sum / m);
        linear = fmax(linear, (2.0 * sum + network->shape_stiffness[i]) / m);
        network->lambda =
            fmax(network->lambda, (rigidity * (2.0 * sum) + network->shape_stiffness[i]) / m);
        drag = fmax(drag, (network->shape_damping[i] + network->node_damping[i]) / m);
    }
    // A body with levels must be stable at the finest one.
    LevelBounds finest = {springs, linear, network->lambda}, coarsest = finest;
    if (rules->levels != NULL) {
        finest = level_rules_bounds(rules, rules->levels->finest, network->fixed);
        coarsest = level_rules_bounds(rules, 0, network->fixed);
    }
    // The damping time is that of the finest level.
    network->contact_lambda = coarsest.linear;
    network->damping_time = level_rules_damping_time(rules, finest.springs);
    const SurfaceMaterial *material = &rules->options->material;
    network->asked_damping_time =
        material->uniform ? network->damping_time : material->damping_time;
    network->clamped = network->damping_time < network->asked_damping_time;
    network->damping = network->damping_time * springs + drag;
    // The paper's rule may ask for more.
    level_rules_raise_bounds(rules, rules->options->start_level, coarsest.lambda,
                             network->damping_time * coarsest.springs + drag, &network->lambda,
                             &network->damping);
    network->finest_lambda = fmax(finest.lambda, network->lambda);
    network->finest_linear = rigidity > 1.0 ? finest.linear : network->finest_lambda;
    network->finest_damping = fmax(network->damping_time * finest.springs + drag, network->damping);
}

bool network_create(SpringNetwork *network, const TriMesh *mesh, const WingedMesh *winged,
                    const SurfaceOptions *options, Status *status)
{
    const Levels *levels = options->hierarchy;
    int level = levels != NULL ? options->start_level : 0;
    int most_nodes = levels != NULL ? levels->level[levels->finest].node_count : mesh->node_count;
    // All arrays start at zero.
    *network = (SpringNetwork){
        .rest_length = zeroed(winged->edge_count, sizeof(double)),
        .stiffness = zeroed(winged->edge_count, sizeof(double)),
        .face_area = zeroed(mesh->triangle_count, sizeof(double)),
        .node_area = zeroed(mesh->node_count, sizeof(double)),
        .mass = zeroed(mesh->node_count, sizeof(double)),
        .shape_stiffness = zeroed(mesh->node_count, sizeof(double)),
        .shape_damping = zeroed(mesh->node_count, sizeof(double)),
        .node_damping = zeroed(mesh->node_count, sizeof(double)),
        .fixed = zeroed(most_nodes, sizeof(bool)),
    };
    // Fixed nodes before bounds: only free nodes count there.
    if (!fixed_mark(mesh, options, network->fixed, status)) {
        network_destroy(network);
        return false;
    }
    // Then values by the rules of the material.
    LevelRules rules;
    level_rules_create(&rules, mesh, options);
    measure_faces(network, mesh, &rules, level);
    set_springs(network, mesh, winged, &rules, level);
    set_nodes(network, &rules, level, mesh->node_count);
    set_bounds(network, winged, &rules);
    level_rules_destroy(&rules);
    return true;
}

void network_destroy(SpringNetwork *network)
{
    free(network->rest_length);
    free(network->stiffness);
    free(network->face_area);
    free(network->node_area);
    free(network->mass);
    free(network->shape_stiffness);
    free(network->shape_damping);
    free(network->node_damping);
    free(network->fixed);
    *network = (SpringNetwork){0};
}

// ---------------------------------------------------------------------------------------------
// Fixed nodes

bool fixed_mark(const TriMesh *mesh, const SurfaceOptions *options, bool *fixed, Status *status)
{
    const Levels *levels = options->hierarchy;
    int nodes = levels != NULL ? levels->level[0].node_count : mesh->node_count;
    for (int r = 0; r < options->body.fixed_count; r++) {
        const FixedRegion *region = &options->body.fixed[r];
        if (region->kind == FIXED_NODES) {
            for (int k = 0; k < region->node_count; k++) {
                int node = mesh_node_of_file(mesh, region->node[k]);
                if (node < 0)
                    return status_fail(status, STATUS_INVALID,
                                       "fixed: node %d is not a node of the mesh (%d in its file)",
                                       region->node[k], mesh->file_node_count);
                fixed[node] = true;
            }
            continue;
        }
        for (int i = 0; i < nodes; i++)
            if (fixed_contains(region, mesh->position[i]))
                fixed[i] = true;
    }
    // Copies, the last nodes of the mesh, have no number of their own in the file: they follow
    // their originals.
    for (int c = 0; c < mesh->copy_count; c++)
        if (fixed[mesh_node_of_file(mesh, mesh->copy_of[c])])
            fixed[nodes - mesh->copy_count + c] = true;
    // A midpoint is fixed when both its parents are.
    for (int l = 0; levels != NULL && l < levels->finest; l++) {
        const Level *level = &levels->level[l];
        for (int e = 0; e < level->edge_count; e++)
            fixed[level->node_count + e] = fixed[level->edge[e][0]] && fixed[level->edge[e][1]];
    }
    return true;
}
