// SPDX-License-Identifier: MIT
// Builds the rivals of a server's body from the same rules. Load time only.
#include "twin.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

static int compare_springs(const void *a, const void *b)
{
    const TextbookSpring *x = a, *y = b;
    return x->a != y->a ? (x->a > y->a) - (x->a < y->a) : (x->b > y->b) - (x->b < y->b);
}

void twin_textbook(Textbook *textbook, const TriMesh *mesh, const Body *like, const Vec3 *velocity,
                   Vec3 force)
{
    const SurfaceMaterial material = bench_material();
    const SurfaceShape shape = bench_shape();
    textbook_create(textbook, mesh->node_count, like->spring_count);
    double area = 0.0;
    for (int i = 0; i < mesh->node_count; i++)
        area += like->surface.node_area[i];
    for (int i = 0; i < mesh->node_count; i++) {
        TextbookNode *n = &textbook->node[i];
        Vec3 x = mesh->position[i], v = velocity[i];
        Vec3 f = vec3_scale(like->surface.node_area[i] / area, force);
        double m = like->surface.node_mass[i], w = shape.angular_frequency;
        *n = (TextbookNode){.x = {x.x, x.y, x.z},
                            .v = {v.x, v.y, v.z},
                            .rest = {x.x, x.y, x.z},
                            .external = {f.x, f.y, f.z},
                            .mass = m,
                            .shape_stiffness = m * w * w,
                            .shape_damping = 2.0 * shape.damping_ratio * w * m};
    }
    // Every edge of a closed mesh is met twice: once from its lower node.
    int count = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            int a = mesh->triangle[t][k], b = mesh->triangle[t][(k + 1) % 3];
            if (a < b)
                textbook->spring[count++] = (TextbookSpring){.a = a, .b = b};
        }
    ASSERT(count == like->spring_count);
    qsort(textbook->spring, (size_t)count, sizeof *textbook->spring, compare_springs);
    for (int f = 0; f < mesh->triangle_count; f++)
        for (int k = 0; k < 3; k++) {
            int a = mesh->triangle[f][k], b = mesh->triangle[f][(k + 1) % 3];
            TextbookSpring key = {.a = a < b ? a : b, .b = a < b ? b : a};
            TextbookSpring *spring = bsearch(&key, textbook->spring, (size_t)count,
                                             sizeof *textbook->spring, compare_springs);
            double length = vec3_length(vec3_sub(mesh->position[a], mesh->position[b]));
            spring->rest_length = length;
            spring->stiffness +=
                material.youngs_modulus_2d * body_face_area(&like->surface, f) / (length * length);
            spring->damping = material.damping_time * spring->stiffness;
        }
}

#ifdef PLIANT_BENCH_BULLET
BulletBody *twin_bullet(const Textbook *textbook, int iterations)
{
    size_t nodes = (size_t)textbook->node_count, links = (size_t)textbook->spring_count;
    double(*position)[3] = calloc(nodes, sizeof *position);
    double(*velocity)[3] = calloc(nodes, sizeof *velocity);
    double *mass = calloc(nodes, sizeof *mass);
    int(*link)[2] = calloc(links, sizeof *link);
    ASSERT(position != NULL && velocity != NULL && mass != NULL && link != NULL);
    for (size_t i = 0; i < nodes; i++) {
        memcpy(position[i], textbook->node[i].x, sizeof position[i]);
        memcpy(velocity[i], textbook->node[i].v, sizeof velocity[i]);
        mass[i] = textbook->node[i].mass;
    }
    for (size_t k = 0; k < links; k++) {
        link[k][0] = textbook->spring[k].a;
        link[k][1] = textbook->spring[k].b;
    }
    BulletBody *body = bullet_create(&(BulletOptions){
        .node_count = textbook->node_count,
        .link_count = textbook->spring_count,
        .position = (const double(*)[3])position,
        .velocity = (const double(*)[3])velocity,
        .mass = mass,
        .link = (const int(*)[2])link,
        .iterations = iterations,
    });
    free(position);
    free(velocity);
    free(mass);
    free(link);
    return body;
}
#endif
