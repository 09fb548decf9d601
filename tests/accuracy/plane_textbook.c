// SPDX-License-Identifier: MIT
#include "plane_textbook.h"
#include "scoped.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>

static Vec2 add(Vec2 a, Vec2 b)
{
    return (Vec2){a.x + b.x, a.y + b.y};
}

static Vec2 sub(Vec2 a, Vec2 b)
{
    return (Vec2){a.x - b.x, a.y - b.y};
}

static Vec2 scale(double s, Vec2 a)
{
    return (Vec2){s * a.x, s * a.y};
}

static double dot(Vec2 a, Vec2 b)
{
    return a.x * b.x + a.y * b.y;
}

static double cross(Vec2 a, Vec2 b)
{
    return a.x * b.y - a.y * b.x;
}

static Vec2 rotate(double angle, Vec2 a)
{
    return (Vec2){cos(angle) * a.x - sin(angle) * a.y, sin(angle) * a.x + cos(angle) * a.y};
}

static Vec2 center_of(const TextbookElement *element)
{
    Vec2 sum = {0.0, 0.0};
    for (int i = 0; i < element->count; i++)
        sum = add(sum, element->vertex[i]->position);
    return scale(1.0 / element->count, sum);
}

static void create_element(Textbook *book, TextbookElement *element, const PlaneElement *from,
                           const int *vertex, unsigned present, double size, double e,
                           double density)
{
    PlaneShape shape;
    PlaneStiffness stiffness = {.law = PLANE_MIYAZAKI2004};
    plane_shape_create(&shape, PLANE_MIYAZAKI2004, from->quarters, present);
    plane_stiffness(&stiffness, &shape, e, 0.0, size, 0.0);
    const double edge = size * (1 << from->level);
    const double mass = density * shape.extent * edge * edge * size;
    element->count = shape.count;
    element->stiffness = stiffness.residual / shape.count;
    for (int i = 0; i < shape.count; i++) {
        TextbookVertex *v = &book->vertex[vertex[shape.at[i]]];
        element->vertex[i] = v;
        element->rest[i] = (Vec2){edge * shape.rest[i][0], edge * shape.rest[i][1]};
        v->mass += mass / shape.count;
        ASSERT(v->use_count < 4);
        v->use[v->use_count++] = (struct TextbookUse){element, i};
    }
}

void textbook_create(Textbook *book, const PlaneLayout *layout, const PlaneMesh *mesh, double size,
                     double youngs_modulus, double density)
{
    book->vertex_count = mesh->vertex_count;
    book->element_count = mesh->element_count;
    book->vertex = zeroed((size_t)mesh->vertex_count + 1, sizeof *book->vertex);
    book->element = zeroed((size_t)mesh->element_count + 1, sizeof *book->element);
    for (int v = 0; v < mesh->vertex_count; v++) {
        book->vertex[v].position =
            (Vec2){size * (mesh->point[v][0] - 0.5 * layout->lattice_count[0]),
                   size * (mesh->point[v][1] - 0.5 * layout->lattice_count[1])};
        book->vertex[v].fixed = mesh->point[v][1] == 0;
    }
    for (int e = 0; e < mesh->element_count; e++)
        create_element(book, &book->element[e], &layout->element[e], mesh->vertex[e],
                       plane_mesh_present(mesh, e), size, youngs_modulus, density);
}

void textbook_destroy(Textbook *book)
{
    free(book->vertex);
    free(book->element);
}

// f_i = k (R_i - r_i); the angle is the one for which sum r_i x R_i = 0 (equation 1).
static void find_forces(TextbookElement *element)
{
    Vec2 center = center_of(element);
    double along = 0.0, across = 0.0;
    for (int i = 0; i < element->count; i++) {
        Vec2 r = sub(element->vertex[i]->position, center);
        along += dot(element->rest[i], r);
        across += cross(element->rest[i], r);
    }
    double angle = atan2(across, along);
    for (int i = 0; i < element->count; i++) {
        Vec2 r = sub(element->vertex[i]->position, center);
        Vec2 goal = rotate(angle, element->rest[i]);
        element->force[i] = scale(element->stiffness, sub(goal, r));
    }
}

void textbook_elastic_forces(Textbook *book)
{
    for (int e = 0; e < book->element_count; e++)
        find_forces(&book->element[e]);
}

void textbook_sum_forces(Textbook *book)
{
    for (int v = 0; v < book->vertex_count; v++) {
        TextbookVertex *vertex = &book->vertex[v];
        vertex->force = (Vec2){0.0, 0.0};
        for (int u = 0; u < vertex->use_count; u++)
            vertex->force = add(vertex->force, vertex->use[u].element->force[vertex->use[u].at]);
    }
}

void textbook_update(Textbook *book, double dt, double drag, Vec2 gravity)
{
    for (int v = 0; v < book->vertex_count; v++) {
        TextbookVertex *vertex = &book->vertex[v];
        if (vertex->fixed)
            continue;
        Vec2 acceleration = add(scale(1.0 / vertex->mass, vertex->force), gravity);
        acceleration = sub(acceleration, scale(drag, vertex->velocity));
        vertex->velocity = add(vertex->velocity, scale(dt, acceleration));
        vertex->position = add(vertex->position, scale(dt, vertex->velocity));
    }
}

// "Collision force is applied to element vertices to push them outside the manipulator when the
// vertices are inside": the force that has them on its edge after a step.
void textbook_collide(Textbook *book, Vec2 center, double radius, double dt)
{
    for (int v = 0; v < book->vertex_count; v++) {
        TextbookVertex *vertex = &book->vertex[v];
        Vec2 away = sub(vertex->position, center);
        double distance = sqrt(dot(away, away));
        if (vertex->fixed || distance >= radius || distance == 0.0)
            continue;
        Vec2 push = scale((radius - distance) / distance, away);
        vertex->position = add(vertex->position, push);
        vertex->velocity = add(vertex->velocity, scale(1.0 / dt, push));
    }
}
