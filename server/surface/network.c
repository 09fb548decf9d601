// Applies level_rules.h to every spring and node of a mesh, and computes bounds for the time step.
// Load time.
#include "surface/network.h"

#include "base/check.h"
#include "surface/fixed.h"
#include "surface/level_rules.h"

#include <stdlib.h>

static void *zeroed(int count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    ASSERT(memory != NULL);
    return memory;
}

static void measure_areas(SpringNetwork *network, const TriMesh *mesh, const LevelRules *rules,
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
    double springs = 0.0, drag = 0.0;
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
        network->lambda = fmax(network->lambda, (2.0 * sum + network->shape_stiffness[i]) / m);
        drag = fmax(drag, (network->shape_damping[i] + network->node_damping[i]) / m);
    }
    // A body with levels must be stable at the finest one.
    LevelBounds finest = {springs, network->lambda}, coarsest = {springs, network->lambda};
    if (rules->levels != NULL) {
        finest = level_rules_bounds(rules, rules->levels->finest, network->fixed);
        coarsest = level_rules_bounds(rules, 0, network->fixed);
    }
    network->contact_lambda = coarsest.lambda;
    network->damping_time = level_rules_damping_time(rules, finest.springs);
    const SurfaceMaterial *material = &rules->options->material;
    network->asked_damping_time =
        material->uniform ? network->damping_time : material->damping_time;
    network->clamped = network->damping_time < network->asked_damping_time;
    network->damping = network->damping_time * springs + drag;
    level_rules_raise_bounds(rules, rules->options->start_level, coarsest.lambda,
                             network->damping_time * coarsest.springs + drag, &network->lambda,
                             &network->damping);
    network->finest_lambda = fmax(finest.lambda, network->lambda);
    network->finest_damping = fmax(network->damping_time * finest.springs + drag, network->damping);
}

bool network_create(SpringNetwork *network, const TriMesh *mesh, const WingedMesh *winged,
                    const SurfaceOptions *options, Status *status)
{
    const Levels *levels = options->hierarchy;
    int level = levels != NULL ? options->start_level : 0;
    int most_nodes = levels != NULL ? levels->level[levels->finest].node_count : mesh->node_count;
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
    if (!fixed_mark(mesh, options, network->fixed, status)) {
        network_destroy(network);
        return false;
    }
    LevelRules rules;
    level_rules_create(&rules, mesh, options);
    measure_areas(network, mesh, &rules, level);
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
