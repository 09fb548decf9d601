// Texture coordinates for generated meshes, so that images can be displayed on them. Load time
// only.
#include "geometry/generator.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>

static const double PI = 3.14159265358979323846;

void generate_texture(TriMesh *mesh, bool closed)
{
    mesh->uv = calloc((size_t)mesh->node_count + 1, sizeof *mesh->uv);
    ASSERT(mesh->uv != NULL);
    const Box box = mesh_box(mesh);
    Vec3 low = box_low(&box), size = box_size(&box), middle = box_middle(&box);
    for (int i = 0; i < mesh->node_count; i++) {
        Vec3 x = vec3_sub(mesh->position[i], low), from = vec3_sub(mesh->position[i], middle);
        mesh->uv[i][0] = closed ? fabs(atan2(from.y, from.x)) / PI : x.x / size.x;
        mesh->uv[i][1] = closed ? x.z / size.z : x.y / size.y;
    }
}
