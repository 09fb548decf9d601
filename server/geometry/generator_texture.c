// Texture coordinates for what generators make, so that an image can be seen on it. Load time only.
#include "geometry/generator.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>

static const double PI = 3.14159265358979323846;

void generate_texture(TriMesh *mesh, bool closed)
{
    mesh->uv = calloc((size_t)mesh->node_count + 1, sizeof *mesh->uv);
    ASSERT(mesh->uv != NULL);
    Vec3 low = mesh->position[0], high = low;
    for (int i = 1; i < mesh->node_count; i++) {
        Vec3 x = mesh->position[i];
        low = vec3(fmin(low.x, x.x), fmin(low.y, x.y), fmin(low.z, x.z));
        high = vec3(fmax(high.x, x.x), fmax(high.y, x.y), fmax(high.z, x.z));
    }
    Vec3 size = vec3_sub(high, low), middle = vec3_scale(0.5, vec3_add(low, high));
    for (int i = 0; i < mesh->node_count; i++) {
        Vec3 x = vec3_sub(mesh->position[i], low), from = vec3_sub(mesh->position[i], middle);
        mesh->uv[i][0] = closed ? fabs(atan2(from.y, from.x)) / PI : x.x / size.x;
        mesh->uv[i][1] = closed ? x.z / size.z : x.y / size.y;
    }
}
