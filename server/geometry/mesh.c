// SPDX-License-Identifier: MIT
// Triangle meshes: creation, placement, equal nodes, measures, and the rules of a mesh that is fit
// for simulation, one function per rule. Load time only; never on the step thread.
#include "geometry/mesh.h"

#include "base/check.h"
#include "geometry/edges.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void mesh_create(TriMesh *mesh, int node_count, int triangle_count)
{
    ASSERT(node_count >= 0 && node_count <= MESH_COUNT_MAX);
    ASSERT(triangle_count >= 0 && triangle_count <= MESH_COUNT_MAX);
    *mesh = (TriMesh){
        .node_count = node_count, .triangle_count = triangle_count, .file_node_count = node_count};
    // One element more than needed, so that an empty mesh has arrays too.
    mesh->position = calloc((size_t)node_count + 1, sizeof *mesh->position);
    mesh->triangle = calloc((size_t)triangle_count + 1, sizeof *mesh->triangle);
    mesh->file_index = calloc((size_t)node_count + 1, sizeof *mesh->file_index);
    ASSERT(mesh->position != NULL && mesh->triangle != NULL && mesh->file_index != NULL);
    for (int i = 0; i < node_count; i++)
        mesh->file_index[i] = i;
}

void mesh_destroy(TriMesh *mesh)
{
    free(mesh->position);
    free(mesh->triangle);
    free(mesh->file_index);
    free(mesh->file_node);
    free(mesh->copy_of);
    free(mesh->uv);
    *mesh = (TriMesh){0};
}

void mesh_place(TriMesh *mesh, double scale, Vec3 rotation, Vec3 translation)
{
    Quat turn = quat_from_rotation(rotation);
    // Without a rotation all bits are kept, so that nodes bit-equal in a file stay recognisable.
    bool turned = rotation.x != 0.0 || rotation.y != 0.0 || rotation.z != 0.0;
    for (int i = 0; i < mesh->node_count; i++) {
        Vec3 x = vec3_scale(scale, mesh->position[i]);
        if (turned)
            x = quat_rotate(turn, x);
        mesh->position[i] = vec3_add(x, translation);
    }
}

// The bits that decide whether two nodes are equal; adding zero turns -0 into 0.
static void position_key(Vec3 x, uint64_t key[3])
{
    double part[3] = {x.x + 0.0, x.y + 0.0, x.z + 0.0};
    memcpy(key, part, sizeof part);
}

static uint64_t hash_key(const uint64_t key[3])
{
    uint64_t hash = 0;
    for (int i = 0; i < 3; i++) {
        hash = (hash ^ key[i]) * UINT64_C(0x9e3779b97f4a7c15);
        hash ^= hash >> 29;
    }
    return hash * UINT64_C(0xbf58476d1ce4e5b9) >> 20;
}

void mesh_find_equal(const Vec3 *position, int count, int *first)
{
    size_t slots = 16; // at least twice as many as nodes: short chains
    while (slots < 2 * (size_t)count)
        slots *= 2;
    int *slot = malloc(slots * sizeof *slot); // the first node with this hash, or -1
    ASSERT(slot != NULL);
    memset(slot, 0xff, slots * sizeof *slot);
    // Each position goes to its slot of the table, or to the next free one.
    for (int i = 0; i < count; i++) {
        uint64_t key[3], other[3];
        position_key(position[i], key);
        size_t at = (size_t)hash_key(key) & (slots - 1);
        while (slot[at] >= 0) {
            position_key(position[slot[at]], other);
            if (memcmp(key, other, sizeof key) == 0)
                break;
            at = (at + 1) & (slots - 1);
        }
        // New here: later nodes that are equal find this one.
        if (slot[at] < 0)
            slot[at] = i;
        first[i] = slot[at];
    }
    free(slot);
}

int mesh_node_of_file(const TriMesh *mesh, int file_index)
{
    if (file_index < 0 || file_index >= mesh->file_node_count)
        return -1;
    return mesh->file_node != NULL ? mesh->file_node[file_index] : file_index;
}

int mesh_file_row(const TriMesh *mesh, int node)
{
    int index = mesh->file_index[node];
    return index < mesh->file_node_count ? index : mesh->copy_of[index - mesh->file_node_count];
}

double mesh_volume(const TriMesh *mesh)
{
    double six_volumes = 0.0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        // Relative to a node of the mesh: a mesh far from the origin loses no digits.
        Vec3 origin = mesh->position[0];
        const int *corner = mesh->triangle[t];
        Vec3 a = vec3_sub(mesh->position[corner[0]], origin);
        Vec3 b = vec3_sub(mesh->position[corner[1]], origin);
        Vec3 c = vec3_sub(mesh->position[corner[2]], origin);
        six_volumes += vec3_dot(a, vec3_cross(b, c));
    }
    return six_volumes / 6.0;
}

double mesh_area(const TriMesh *mesh)
{
    double area = 0.0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *corner = mesh->triangle[t];
        Vec3 u = vec3_sub(mesh->position[corner[1]], mesh->position[corner[0]]);
        Vec3 v = vec3_sub(mesh->position[corner[2]], mesh->position[corner[0]]);
        area += 0.5 * vec3_length(vec3_cross(u, v));
    }
    return area;
}

Box mesh_box(const TriMesh *mesh)
{
    Box box = box_empty();
    for (int i = 0; i < mesh->node_count; i++)
        box_add(&box, mesh->position[i]);
    return box;
}

double mesh_extent(const TriMesh *mesh)
{
    const Box box = mesh_box(mesh);
    return box_extent(&box);
}

// --- the rules of a valid mesh ---

static bool fault_set(MeshFault *fault, int node, int triangle, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

static bool fault_set(MeshFault *fault, int node, int triangle, const char *format, ...)
{
    fault->node = node;
    fault->triangle = triangle;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(fault->text, sizeof fault->text, format, arguments);
    va_end(arguments);
    return false;
}

// Returns the index by which the user knows a node: the one in the file.
static int name_of(const TriMesh *mesh, int node)
{
    return mesh->file_index != NULL ? mesh->file_index[node] : node;
}

static bool nodes_are_finite(const TriMesh *mesh, MeshFault *fault)
{
    for (int i = 0; i < mesh->node_count; i++) {
        Vec3 x = mesh->position[i];
        if (!vec3_finite(x))
            return fault_set(fault, i, -1, "node %d has a position (%g, %g, %g) that is not finite",
                             name_of(mesh, i), x.x, x.y, x.z);
    }
    return true;
}

double mesh_relative_height(const Vec3 *position, const int corner[3])
{
    // Scale first: neither tiny nor huge triangles may under- or overflow.
    Vec3 edge[3];
    double scale = 0.0;
    for (int k = 0; k < 3; k++) {
        edge[k] = vec3_sub(position[corner[(k + 1) % 3]], position[corner[k]]);
        scale = fmax(scale, fmax(fabs(edge[k].x), fmax(fabs(edge[k].y), fabs(edge[k].z))));
    }
    // A point, or something that is not finite, has no height.
    if (scale == 0.0)
        return 0.0;
    if (!isfinite(scale))
        return (double)NAN;
    // Twice the area over the square of the longest side.
    double longest = 0.0; // squared
    for (int k = 0; k < 3; k++) {
        edge[k] = vec3(edge[k].x / scale, edge[k].y / scale, edge[k].z / scale);
        longest = fmax(longest, vec3_dot(edge[k], edge[k]));
    }
    return vec3_length(vec3_cross(edge[0], edge[1])) / longest;
}

static bool triangles_are_valid(const TriMesh *mesh, MeshFault *fault)
{
    if (mesh->triangle_count < 1)
        return fault_set(fault, -1, -1, "the mesh has no triangles");
    for (int t = 0; t < mesh->triangle_count; t++) {
        // The corners are three different nodes of the mesh.
        const int *corner = mesh->triangle[t];
        for (int k = 0; k < 3; k++)
            if (corner[k] < 0 || corner[k] >= mesh->node_count)
                return fault_set(fault, -1, t, "triangle %d names node %d outside [0, %d]", t,
                                 corner[k], mesh->node_count - 1);
        for (int k = 0; k < 3; k++)
            if (corner[k] == corner[(k + 1) % 3])
                return fault_set(fault, corner[k], t, "triangle %d has node %d twice", t,
                                 name_of(mesh, corner[k]));
        // It must have an area, or it has no normal.
        double height = mesh_relative_height(mesh->position, corner);
        if (isnan(height))
            return fault_set(fault, -1, t, "triangle %d is too large to measure", t);
        if (!(height > MESH_SMALLEST_HEIGHT))
            return fault_set(fault, -1, t, "triangle %d (nodes %d, %d, %d) has no area", t,
                             name_of(mesh, corner[0]), name_of(mesh, corner[1]),
                             name_of(mesh, corner[2]));
    }
    return true;
}

// True if every edge is in one or two triangles that run through it in opposite directions.
static bool edges_are_manifold(const TriMesh *mesh, const HalfEdges *half, MeshFault *fault)
{
    for (int first = 0; first < half->count;) {
        // All half-edges from `first` to `end` are of one edge, between a and b.
        int end = half_edge_group_end(half, mesh, first);
        int h = half->order[first];
        int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
        if (end - first > 2)
            return fault_set(fault, a, half->order[first + 2] / 3,
                             "edge between nodes %d and %d belongs to %d triangles, more than two",
                             name_of(mesh, a), name_of(mesh, b), end - first);
        // Two triangles with one orientation run through their edge in opposite directions.
        if (end - first == 2 && half_edge_from(mesh, half->order[first + 1]) == a)
            return fault_set(
                fault, a, half->order[first + 1] / 3,
                "triangles %d and %d both run from node %d to node %d: opposite orientations",
                h / 3, half->order[first + 1] / 3, name_of(mesh, a), name_of(mesh, b));
        // Divided, two such triangles would share the edges inside them as well.
        if (end - first == 2 &&
            half_edge_from(mesh, half_edge_previous(h)) ==
                half_edge_from(mesh, half_edge_previous(half->order[first + 1])))
            return fault_set(fault, a, h / 3, "triangles %d and %d have the same three nodes",
                             h / 3, half->order[first + 1] / 3);
        first = end;
    }
    return true;
}

// Counts the triangles around the start of h, first one way, then the other if there is a border.
static int fan_size(const HalfEdges *half, int h)
{
    // One way round, until the start or a border.
    int size = 1;
    int at = h;
    while ((at = half->twin[half_edge_previous(at)]) >= 0 && at != h)
        size++;
    if (at == h)
        return size;
    // A border: from the start the other way.
    at = h;
    while (half->twin[at] >= 0) {
        at = half_edge_next(half->twin[at]);
        size++;
    }
    return size;
}

// True if every node is used and all its triangles form one fan: two cones that touch in a point
// are refused.
static bool nodes_have_one_fan(const TriMesh *mesh, const HalfEdges *half, MeshFault *fault)
{
    // How many triangles each node has, and one of them to begin with.
    int *corners = calloc((size_t)mesh->node_count + 1, sizeof *corners);
    int *first = malloc(((size_t)mesh->node_count + 1) * sizeof *first);
    ASSERT(corners != NULL && first != NULL);
    for (int h = half->count - 1; h >= 0; h--) {
        corners[half_edge_from(mesh, h)]++;
        first[half_edge_from(mesh, h)] = h;
    }
    bool sound = true;
    // One fan has all triangles of its node.
    for (int i = 0; sound && i < mesh->node_count; i++) {
        if (corners[i] == 0)
            sound = fault_set(fault, i, -1, "node %d belongs to no triangle", name_of(mesh, i));
        else if (fan_size(half, first[i]) != corners[i])
            sound = fault_set(fault, i, first[i] / 3,
                              "the %d triangles round node %d touch only in that node: they form "
                              "more than one fan",
                              corners[i], name_of(mesh, i));
    }
    free(corners);
    free(first);
    return sound;
}

bool mesh_check(const TriMesh *mesh, MeshFault *fault)
{
    *fault = (MeshFault){.node = -1, .triangle = -1};
    if (!nodes_are_finite(mesh, fault) || !triangles_are_valid(mesh, fault))
        return false;
    HalfEdges half;
    half_edge_create(&half, mesh);
    bool sound = edges_are_manifold(mesh, &half, fault) && nodes_have_one_fan(mesh, &half, fault);
    half_edge_destroy(&half);
    return sound;
}
