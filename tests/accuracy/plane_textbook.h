// SPDX-License-Identifier: MIT
// The plane model as one writes it from Miyazaki et al. 2004, for its Table 1: objects that own
// their parts, one element and one vertex at a time, double precision, the processes of Fig. 11
// one after the other. Not the authors' program, which is lost: what section 2.2 says, plainly.
#ifndef PLIANT_TESTS_ACCURACY_PLANE_TEXTBOOK_H
#define PLIANT_TESTS_ACCURACY_PLANE_TEXTBOOK_H

#include "plane/mesh.h"

#include <stdbool.h>

typedef struct Vec2 {
    double x, y;
} Vec2;

typedef struct TextbookVertex {
    Vec2 position, velocity, force; // [m], [m/s], [N]
    double mass;                    // [kg]
    bool fixed;
    int use_count; // elements that have it, and where
    struct TextbookUse {
        struct TextbookElement *element;
        int at;
    } use[4];
} TextbookVertex;

typedef struct TextbookElement {
    int count;
    TextbookVertex *vertex[PLANE_PLACES];
    Vec2 rest[PLANE_PLACES];  // R0_i, from the centre of gravity [m]
    Vec2 force[PLANE_PLACES]; // on its vertices [N]
    double stiffness;         // k [N/m]
} TextbookElement;

typedef struct Textbook {
    int vertex_count, element_count;
    TextbookVertex *vertex;   // owned
    TextbookElement *element; // owned
} Textbook;

// `size` of a cell [m], which is the thickness too; E [Pa], density [kg/m3]. Vertices at the lowest
// row are fixed.
void textbook_create(Textbook *book, const PlaneLayout *layout, const PlaneMesh *mesh, double size,
                     double youngs_modulus, double density);
void textbook_destroy(Textbook *book);

// The processes of Table 1.
void textbook_elastic_forces(Textbook *book);                                 // a
void textbook_sum_forces(Textbook *book);                                     // c
void textbook_update(Textbook *book, double dt, double drag, Vec2 gravity);   // d; drag [1/s]
void textbook_collide(Textbook *book, Vec2 center, double radius, double dt); // e

#endif
