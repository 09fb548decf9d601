// Triangle meshes: creation, placement, equal nodes, measures. Load time only; never on the step
// thread. mesh_check.c has the rules of a valid mesh.
#include "geometry/mesh.h"

#include "base/check.h"

#include <stdint.h>
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
