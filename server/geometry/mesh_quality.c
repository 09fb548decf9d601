// SPDX-License-Identifier: MIT
#include "geometry/mesh.h"

#include "base/check.h"
#include "geometry/edges.h"

#include <stdlib.h>
#include <string.h>

// Labels the components; returns the labels by triangle, owned by the caller.
static int *label_components(const TriMesh *mesh, const HalfEdges *half, int *count)
{
    size_t triangles = (size_t)mesh->triangle_count; // of all arrays
    int *label = malloc((triangles + 1) * sizeof *label);
    int *queue = malloc((triangles + 1) * sizeof *queue);
    ASSERT(label != NULL && queue != NULL);
    memset(label, 0xff, (triangles + 1) * sizeof *label);
    *count = 0;
    // Each triangle that no walk has reached begins a component.
    for (int t = 0; t < mesh->triangle_count; t++) {
        if (label[t] >= 0)
            continue;
        int found = 0;
        // Breadth-first over edges with a twin.
        queue[found++] = t;
        label[t] = *count;
        for (int i = 0; i < found; i++)
            for (int k = 0; k < 3; k++) {
                int twin = half->twin[3 * queue[i] + k];
                if (twin < 0 || label[twin / 3] >= 0)
                    continue;
                label[twin / 3] = *count;
                queue[found++] = twin / 3;
            }
        ++*count;
    }
    free(queue);
    return label;
}

// Returns the border half-edge that begins where border half-edge h ends.
static int next_on_border(const HalfEdges *half, int h)
{
    h = half_edge_next(h);
    while (half->twin[h] >= 0)
        h = half_edge_next(half->twin[h]);
    return h;
}

static void count_loops(const HalfEdges *half, const int *label, MeshQuality *quality)
{
    bool *walked = calloc((size_t)half->count + 1, sizeof *walked);
    ASSERT(walked != NULL);
    // Each border edge that no walk has reached begins a loop.
    for (int h = 0; h < half->count; h++) {
        if (half->twin[h] >= 0 || walked[h])
            continue;
        quality->border_loops++;
        quality->component[label[h / 3]].border_loops++;
        for (int at = h; !walked[at]; at = next_on_border(half, at)) {
            walked[at] = true;
            quality->border_edges++;
        }
    }
    free(walked);
}

static void measure_edges(const TriMesh *mesh, const HalfEdges *half, const int *label,
                          MeshQuality *quality)
{
    double sum = 0.0;
    for (int h = 0; h < half->count; h++) {
        if (half->twin[h] > h)
            continue; // counted once, at its twin
        // Remember the shortest and the longest, so that a report can name them.
        int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
        double length = vec3_length(vec3_sub(mesh->position[a], mesh->position[b]));
        if (quality->edge_count == 0 || length < quality->edge_min) {
            quality->edge_min = length;
            quality->shortest[0] = a;
            quality->shortest[1] = b;
        }
        if (quality->edge_count == 0 || length > quality->edge_max) {
            quality->edge_max = length;
            quality->longest[0] = a;
            quality->longest[1] = b;
        }
        // For the means, and for the component's Euler characteristic.
        sum += length;
        quality->edge_count++;
        quality->component[label[h / 3]].edge_count++;
    }
    quality->edge_mean = sum / quality->edge_count;
}

// Returns the angle of a triangle at the start of half-edge h [rad].
static double angle_at(const TriMesh *mesh, int h)
{
    Vec3 x = mesh->position[half_edge_from(mesh, h)];
    Vec3 u = vec3_sub(mesh->position[half_edge_to(mesh, h)], x);
    Vec3 v = vec3_sub(mesh->position[half_edge_from(mesh, half_edge_previous(h))], x);
    return atan2(vec3_length(vec3_cross(u, v)), vec3_dot(u, v));
}

static void measure_angles(const TriMesh *mesh, MeshQuality *quality)
{
    double sum = 0.0;
    // The smallest angle tells how bad a triangle is.
    for (int t = 0; t < mesh->triangle_count; t++) {
        const double angle[3] = {angle_at(mesh, 3 * t), angle_at(mesh, 3 * t + 1),
                                 angle_at(mesh, 3 * t + 2)};
        double smallest = fmin(angle[0], fmin(angle[1], angle[2]));
        if (t == 0 || smallest < quality->angle_min) {
            quality->angle_min = smallest;
            quality->sharpest = t;
        }
        quality->angle_max = fmax(quality->angle_max, fmax(angle[0], fmax(angle[1], angle[2])));
        quality->sharp_triangles += smallest < MESH_SHARP_ANGLE;
        sum += smallest;
    }
    quality->angle_mean = sum / mesh->triangle_count;
}

static void measure_faces(const TriMesh *mesh, const int *label, MeshQuality *quality)
{
    // Relative to a node: a mesh far from the origin loses no digits.
    Vec3 origin = mesh->position[0];
    for (int t = 0; t < mesh->triangle_count; t++) {
        MeshComponent *component = &quality->component[label[t]];
        const int *corner = mesh->triangle[t];
        Vec3 a = vec3_sub(mesh->position[corner[0]], origin);
        Vec3 b = vec3_sub(mesh->position[corner[1]], origin);
        Vec3 c = vec3_sub(mesh->position[corner[2]], origin);
        component->triangle_count++;
        component->area += 0.5 * vec3_length(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)));
        component->volume += vec3_dot(a, vec3_cross(b, c)) / 6.0;
    }
}

// Nodes belong to the component of any of their triangles: a valid mesh has one fan per node.
static void count_nodes(const TriMesh *mesh, const int *label, MeshQuality *quality)
{
    bool *seen = calloc((size_t)mesh->node_count + 1, sizeof *seen);
    ASSERT(seen != NULL);
    for (int h = 0; h < 3 * mesh->triangle_count; h++) {
        int node = half_edge_from(mesh, h);
        quality->component[label[h / 3]].node_count += !seen[node]; // once
        seen[node] = true;
    }
    free(seen);
}

void mesh_quality_measure(const TriMesh *mesh, MeshQuality *quality)
{
    *quality = (MeshQuality){0};
    // Components first: all other figures are also counted for each of them.
    HalfEdges half;
    half_edge_create(&half, mesh);
    int *label = label_components(mesh, &half, &quality->component_count);
    quality->component = calloc((size_t)quality->component_count, sizeof *quality->component);
    ASSERT(quality->component != NULL);
    quality->box = mesh_box(mesh);
    measure_angles(mesh, quality);
    measure_edges(mesh, &half, label, quality);
    measure_faces(mesh, label, quality);
    count_nodes(mesh, label, quality);
    count_loops(&half, label, quality);
    // Genus from the Euler characteristic; only closed components enclose a volume.
    for (int i = 0; i < quality->component_count; i++) {
        MeshComponent *component = &quality->component[i];
        int euler = component->node_count - component->edge_count + component->triangle_count;
        component->genus = (2 - component->border_loops - euler) / 2;
        component->volume = component->border_loops == 0 ? component->volume : 0.0;
        quality->area += component->area;
        quality->volume += component->volume;
    }
    free(label);
    half_edge_destroy(&half);
}

void mesh_quality_destroy(MeshQuality *quality)
{
    free(quality->component);
    *quality = (MeshQuality){0};
}
