// SPDX-License-Identifier: MIT
// The kernel of the textbook, to compare with: an array of node structures, springs that add their
// force to both ends, double precision, one square root and one division a spring.
#ifndef PLIANT_TESTS_BENCH_TEXTBOOK_H
#define PLIANT_TESTS_BENCH_TEXTBOOK_H

typedef struct TextbookNode {
    double x[3], v[3], f[3];
    double rest[3], external[3];
    double mass, shape_stiffness, shape_damping;
} TextbookNode;

typedef struct TextbookSpring {
    int a, b;
    double rest_length, stiffness, damping;
} TextbookSpring;

typedef struct TextbookSlope {
    double dx[3], dv[3];
} TextbookSlope;

typedef struct Textbook {
    int node_count, spring_count;
    TextbookNode *node;     // [node_count], in mesh order
    TextbookSpring *spring; // [spring_count], by their lower node
    TextbookSlope *start;   // scratch [node_count]: x and v when the step began
    TextbookSlope *sum;     // scratch [node_count]
} Textbook;

void textbook_create(Textbook *textbook, int node_count, int spring_count);
void textbook_destroy(Textbook *textbook);
// One classic Runge-Kutta step of h seconds.
void textbook_step(Textbook *textbook, double h);

#endif
