// SPDX-License-Identifier: MIT
#include "picture.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>

unsigned colour_mix(unsigned from, unsigned to, double share)
{
    unsigned mixed = 0;
    for (int shift = 0; shift < 24; shift += 8) {
        double a = from >> shift & 255, b = to >> shift & 255;
        mixed |= (unsigned)lround(a + fmin(1.0, fmax(0.0, share)) * (b - a)) << shift;
    }
    return mixed;
}

void picture_create(Picture *picture, Vec3 eye)
{
    *picture = (Picture){.eye = vec3_scale(1.0 / vec3_length(eye), eye)};
    Vec3 right = vec3_cross(vec3(0.0, 0.0, 1.0), picture->eye);
    picture->right = vec3_scale(1.0 / vec3_length(right), right);
    picture->up = vec3_cross(picture->eye, picture->right);
}

void picture_destroy(Picture *picture)
{
    free(picture->patch);
    *picture = (Picture){0};
}

void picture_add(Picture *picture, const Vec3 *corner, int count, unsigned colour)
{
    Vec3 normal = {0.0, 0.0, 0.0}, middle = {0.0, 0.0, 0.0};
    for (int i = 0; i < count; i++) {
        normal = vec3_add(normal, vec3_cross(corner[i], corner[(i + 1) % count]));
        middle = vec3_madd(middle, 1.0 / count, corner[i]);
    }
    double slope = vec3_dot(normal, picture->eye) / fmax(vec3_length(normal), 1e-300);
    if (slope <= 0.0)
        return;
    if (picture->count == picture->capacity) {
        picture->capacity = 2 * picture->capacity + 256;
        picture->patch =
            realloc(picture->patch, (size_t)picture->capacity * sizeof *picture->patch);
        ASSERT(picture->patch != NULL);
    }
    // Light from above and from behind the viewer's shoulder.
    Vec3 light = vec3_add(picture->eye, vec3_add(vec3(0.0, 0.0, 0.7), picture->right));
    double lit = vec3_dot(normal, light) / (vec3_length(normal) * vec3_length(light));
    PicturePatch *patch = &picture->patch[picture->count++];
    patch->count = count;
    patch->colour = colour_mix(0x303038, colour, 0.45 + 0.55 * fmax(0.0, lit));
    patch->depth = vec3_dot(middle, picture->eye);
    for (int i = 0; i < count; i++) {
        patch->x[i] = vec3_dot(corner[i], picture->right);
        patch->y[i] = vec3_dot(corner[i], picture->up);
    }
}

static int nearer(const void *a, const void *b)
{
    const PicturePatch *p = a, *q = b;
    return (p->depth > q->depth) - (p->depth < q->depth);
}

void picture_write(Picture *picture, bool edge, FILE *out)
{
    double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
    qsort(picture->patch, (size_t)picture->count, sizeof *picture->patch, nearer);
    for (int p = 0; p < picture->count; p++) {
        const PicturePatch *patch = &picture->patch[p];
        fprintf(out, "set object %d polygon", p + 1);
        for (int i = 0; i <= patch->count; i++) {
            double x = patch->x[i % patch->count], y = patch->y[i % patch->count];
            fprintf(out, "%s %.6g,%.6g", i == 0 ? " from" : " to", x, y);
            low[0] = fmin(low[0], x), low[1] = fmin(low[1], y);
            high[0] = fmax(high[0], x), high[1] = fmax(high[1], y);
        }
        fprintf(out, " fillcolor rgb '#%06x' fillstyle solid border lc rgb '#%06x' lw 0.4\n",
                patch->colour, colour_mix(patch->colour, 0x101018, edge ? 0.5 : 0.0));
    }
    fprintf(out, "set xrange [%.6g:%.6g]\nset yrange [%.6g:%.6g]\n", low[0], high[0], low[1],
            high[1]);
}
