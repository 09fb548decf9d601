// Load time. Masses by area lumping, stiffness by the areas beside an edge (Van Gelder 1998), or
// the paper's uniform values; bounds for the time step.
#include "surface/network.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

static void *zeroed(int count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    ASSERT(memory != NULL);
    return memory;
}

static void measure_areas(SpringNetwork *network, const TriMesh *mesh)
{
    for (int f = 0; f < mesh->triangle_count; f++) {
        const int *node = mesh->triangle[f];
        const Vec3 *x = mesh->position;
        Vec3 normal =
            vec3_cross(vec3_sub(x[node[1]], x[node[0]]), vec3_sub(x[node[2]], x[node[0]]));
        network->face_area[f] = 0.5 * vec3_length(normal);
        for (int k = 0; k < 3; k++)
            network->node_area[node[k]] += network->face_area[f] / 3.0;
    }
}

static void set_springs(SpringNetwork *network, const TriMesh *mesh, const WingedMesh *winged,
                        const SurfaceOptions *options)
{
    const SurfaceMaterial *material = &options->material;
    for (int e = 0; e < winged->edge_count; e++) {
        const WingedEdge *edge = &winged->edge[e];
        double length =
            vec3_length(vec3_sub(mesh->position[edge->node[0]], mesh->position[edge->node[1]]));
        network->rest_length[e] = length * (1.0 - options->prestress);
        if (material->uniform) {
            network->stiffness[e] = material->spring_stiffness;
            continue;
        }
        for (int side = 0; side < 2; side++)
            if (edge->face[side] >= 0)
                network->stiffness[e] += material->youngs_modulus_2d *
                                         network->face_area[edge->face[side]] / (length * length);
    }
}

static void set_nodes(SpringNetwork *network, const SurfaceOptions *options, int node_count)
{
    const SurfaceMaterial *material = &options->material;
    const SurfaceShape *shape = &options->shape;
    double w = shape->angular_frequency;
    for (int i = 0; i < node_count; i++) {
        double m = material->uniform ? material->node_mass
                                     : material->areal_density * network->node_area[i];
        network->mass[i] = m;
        network->total_mass += m;
        if (!shape->wanted)
            continue;
        network->shape_stiffness[i] = shape->per_node ? shape->stiffness : m * w * w;
        network->shape_damping[i] =
            shape->per_node ? shape->damping : 2.0 * shape->damping_ratio * w * m;
    }
}

static bool contains(const FixedRegion *region, Vec3 x)
{
    if (region->kind == FIXED_BOX)
        return x.x >= region->low.x && x.y >= region->low.y && x.z >= region->low.z &&
               x.x <= region->high.x && x.y <= region->high.y && x.z <= region->high.z;
    return vec3_length(vec3_sub(x, region->center)) <= region->radius;
}

static bool fix_nodes(SpringNetwork *network, const TriMesh *mesh, const SurfaceOptions *options,
                      Status *status)
{
    for (int r = 0; r < options->fixed_count; r++) {
        const FixedRegion *region = &options->fixed[r];
        if (region->kind == FIXED_NODES) {
            for (int k = 0; k < region->node_count; k++) {
                int node = mesh_node_of_file(mesh, region->node[k]);
                if (node < 0)
                    return status_fail(status, STATUS_INVALID,
                                       "fixed: node %d is not a node of the mesh (%d in its file)",
                                       region->node[k], mesh->file_node_count);
                network->fixed[node] = true;
            }
            continue;
        }
        for (int i = 0; i < mesh->node_count; i++)
            if (contains(region, mesh->position[i]))
                network->fixed[i] = true;
    }
    // Copies, the last nodes, have no number of their own in the file.
    for (int c = 0; c < mesh->copy_count; c++)
        if (network->fixed[mesh_node_of_file(mesh, mesh->copy_of[c])])
            network->fixed[mesh->node_count - mesh->copy_count + c] = true;
    return true;
}

// lambda = max over free nodes of (2 sum k_e + k'_s) / m_i bounds M^-1 K by its row sums
// (surface.md section 3); c likewise. The springs' damping time is k_d / k_s, so their share of c
// is its multiple.
static void set_bounds(SpringNetwork *network, const WingedMesh *winged,
                       const SurfaceOptions *options)
{
    const SurfaceMaterial *material = &options->material;
    double springs = 0.0, drag = 0.0;
    for (int i = 0; i < winged->node_count; i++)
        network->free_count += !network->fixed[i];
    for (int i = 0; i < winged->node_count; i++) {
        // Fixed nodes do not vibrate; of a body wholly fixed only the contact stiffness needs
        // lambda.
        if (network->fixed[i] && network->free_count > 0)
            continue;
        double sum = 0.0;
        for (int k = winged->node_edge_start[i]; k < winged->node_edge_start[i + 1]; k++)
            sum += network->stiffness[winged->node_edge[k]];
        double m = network->mass[i];
        springs = fmax(springs, 2.0 * sum / m);
        network->lambda = fmax(network->lambda, (2.0 * sum + network->shape_stiffness[i]) / m);
        drag = fmax(drag, (network->shape_damping[i] + material->node_damping) / m);
    }

    if (material->uniform) {
        network->damping_time = material->spring_stiffness > 0.0
                                    ? material->spring_damping / material->spring_stiffness
                                    : 0.0;
    } else {
        // Longer than 0.8 of the stiffest vibration's time, damping alone would dictate the step.
        double longest = springs > 0.0 ? 0.8 / sqrt(springs) : material->damping_time;
        network->clamped = material->damping_time > longest;
        network->damping_time = network->clamped ? longest : material->damping_time;
    }
    network->damping = network->damping_time * springs + drag;
}

bool network_create(SpringNetwork *network, const TriMesh *mesh, const WingedMesh *winged,
                    const SurfaceOptions *options, Status *status)
{
    *network = (SpringNetwork){
        .rest_length = zeroed(winged->edge_count, sizeof(double)),
        .stiffness = zeroed(winged->edge_count, sizeof(double)),
        .face_area = zeroed(mesh->triangle_count, sizeof(double)),
        .node_area = zeroed(mesh->node_count, sizeof(double)),
        .mass = zeroed(mesh->node_count, sizeof(double)),
        .shape_stiffness = zeroed(mesh->node_count, sizeof(double)),
        .shape_damping = zeroed(mesh->node_count, sizeof(double)),
        .fixed = zeroed(mesh->node_count, sizeof(bool)),
    };
    measure_areas(network, mesh);
    set_springs(network, mesh, winged, options);
    set_nodes(network, options, mesh->node_count);
    if (!fix_nodes(network, mesh, options, status)) {
        network_destroy(network);
        return false;
    }
    set_bounds(network, winged, options);
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
    free(network->fixed);
    *network = (SpringNetwork){0};
}
