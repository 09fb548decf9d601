// SPDX-License-Identifier: MIT
#include "textbook.h"

#include "base/check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void textbook_create(Textbook *textbook, int node_count, int spring_count)
{
    *textbook = (Textbook){
        .node_count = node_count,
        .spring_count = spring_count,
        .node = calloc((size_t)node_count, sizeof *textbook->node),
        .spring = calloc((size_t)spring_count, sizeof *textbook->spring),
        .start = calloc((size_t)node_count, sizeof *textbook->start),
        .sum = calloc((size_t)node_count, sizeof *textbook->sum),
    };
    ASSERT(textbook->node != NULL && textbook->spring != NULL && textbook->start != NULL &&
           textbook->sum != NULL);
}

void textbook_destroy(Textbook *textbook)
{
    free(textbook->node);
    free(textbook->spring);
    free(textbook->start);
    free(textbook->sum);
    *textbook = (Textbook){0};
}

static void add_forces(Textbook *textbook)
{
    for (int i = 0; i < textbook->node_count; i++) {
        TextbookNode *n = &textbook->node[i];
        for (int c = 0; c < 3; c++)
            n->f[c] = n->external[c] - n->shape_stiffness * (n->x[c] - n->rest[c]) -
                      n->shape_damping * n->v[c];
    }
    for (int s = 0; s < textbook->spring_count; s++) {
        const TextbookSpring *spring = &textbook->spring[s];
        TextbookNode *a = &textbook->node[spring->a], *b = &textbook->node[spring->b];
        double d[3] = {a->x[0] - b->x[0], a->x[1] - b->x[1], a->x[2] - b->x[2]};
        double u[3] = {a->v[0] - b->v[0], a->v[1] - b->v[1], a->v[2] - b->v[2]};
        double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        if (length < 1e-12)
            continue;
        double inverse = 1.0 / length;
        double approach = (u[0] * d[0] + u[1] * d[1] + u[2] * d[2]) * inverse;
        double pull =
            (spring->stiffness * (length - spring->rest_length) + spring->damping * approach) *
            inverse;
        for (int c = 0; c < 3; c++) {
            a->f[c] -= pull * d[c];
            b->f[c] += pull * d[c];
        }
    }
}

void textbook_step(Textbook *textbook, double h)
{
    static const double weight[4] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
    static const double ahead[4] = {0.5, 0.5, 1.0, 0.0};
    for (int i = 0; i < textbook->node_count; i++) {
        memcpy(textbook->start[i].dx, textbook->node[i].x, sizeof textbook->start[i].dx);
        memcpy(textbook->start[i].dv, textbook->node[i].v, sizeof textbook->start[i].dv);
        textbook->sum[i] = (TextbookSlope){{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    }
    for (int stage = 0; stage < 4; stage++) {
        add_forces(textbook);
        for (int i = 0; i < textbook->node_count; i++) {
            TextbookNode *n = &textbook->node[i];
            const TextbookSlope *start = &textbook->start[i];
            TextbookSlope *sum = &textbook->sum[i];
            double inverse_mass = 1.0 / n->mass;
            for (int c = 0; c < 3; c++) {
                double dx = h * n->v[c], dv = h * n->f[c] * inverse_mass;
                sum->dx[c] += weight[stage] * dx;
                sum->dv[c] += weight[stage] * dv;
                n->x[c] = start->dx[c] + (stage < 3 ? ahead[stage] * dx : sum->dx[c]);
                n->v[c] = start->dv[c] + (stage < 3 ? ahead[stage] * dv : sum->dv[c]);
            }
        }
    }
}
