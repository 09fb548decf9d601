// SPDX-License-Identifier: MIT
#include "cut_blades.h"

#include "base/check.h"
#include "random.h"

#include <math.h>

Vec3 blade_corner(const CutModel *model, int face, int k)
{
    return model->x[model->corner[face][k]];
}

Vec3 blade_centroid(const CutModel *model, int face)
{
    Vec3 sum = vec3_add(blade_corner(model, face, 0), blade_corner(model, face, 1));
    return vec3_scale(1.0 / 3.0, vec3_add(sum, blade_corner(model, face, 2)));
}

Vec3 blade_normal(const CutModel *model, int face)
{
    Vec3 a = blade_corner(model, face, 0);
    return vec3_unit(vec3_cross(vec3_sub(blade_corner(model, face, 1), a),
                                vec3_sub(blade_corner(model, face, 2), a)));
}

Vec3 blade_direction(uint64_t *seed)
{
    for (;;) {
        Vec3 v = random_vec3(seed);
        double length = vec3_length(v);
        if (length > 0.1 && length < 1.0)
            return vec3_scale(1.0 / length, v);
    }
}

void blade_add(Blade *blade, Vec3 middle, Vec3 half)
{
    ASSERT(blade->edges < BLADE_EDGES);
    blade->edge[blade->edges++] = (BladeEdge){{vec3_sub(middle, half), vec3_add(middle, half)}};
}

Blade blade_plane(Vec3 through, Vec3 normal, uint64_t *seed)
{
    Vec3 u = vec3_unit(vec3_cross(normal, blade_direction(seed))), v = vec3_cross(normal, u);
    Blade blade = {0};
    blade_add(&blade, vec3_madd(through, -0.5, v), vec3_scale(0.5, u));
    blade_add(&blade, vec3_madd(through, 0.5, v), vec3_scale(0.5, u));
    return blade;
}

Blade blade_arc(const CutModel *model, int face, double r, double from, double to, int quads,
                double depth, uint64_t *seed)
{
    Vec3 n = blade_normal(model, face), at = blade_centroid(model, face);
    Vec3 u = vec3_unit(vec3_cross(n, blade_direction(seed))), v = vec3_cross(n, u);
    Blade blade = {0};
    for (int k = 0; k <= quads; k++) {
        double angle = from + (to - from) * k / quads;
        Vec3 place = vec3_madd(vec3_madd(at, r * cos(angle), u), r * sin(angle), v);
        blade_add(&blade, place, vec3_scale(depth, n));
    }
    if (fabs(fabs(to - from) - 6.283185307179586) < 1e-9)
        blade.edge[quads] = blade.edge[0];
    return blade;
}

Blade blade_straight(Vec3 from, Vec3 to, Vec3 half)
{
    Blade blade = {0};
    blade_add(&blade, from, half);
    blade_add(&blade, to, half);
    return blade;
}
