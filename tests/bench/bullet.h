// SPDX-License-Identifier: MIT
// Bullet's soft body as a peer: the same nodes and links, one whole step at a time. Built only when
// Bullet is there (PLIANT_BULLET).
#ifndef PLIANT_TESTS_BENCH_BULLET_H
#define PLIANT_TESTS_BENCH_BULLET_H

#ifdef __cplusplus
extern "C" {
#endif

typedef struct BulletBody BulletBody;

typedef struct BulletOptions {
    int node_count, link_count;
    const double (*position)[3]; // [node_count] [m]
    const double (*velocity)[3]; // [node_count] [m/s]
    const double *mass;          // [node_count] [kg]
    const int (*link)[2];        // [link_count]
    int iterations;              // of the position solver
} BulletOptions;

// Links of stiffness kLST 0.5; no collisions, no pose matching, no gravity, in a world of its own.
BulletBody *bullet_create(const BulletOptions *options);
void bullet_destroy(BulletBody *body);
// One whole step of h seconds: predictMotion (which also keeps Bullet's tree of nodes) and
// solveConstraints (which ends with the velocities).
void bullet_step(BulletBody *body, double h);
// Position of a node [m].
void bullet_position(const BulletBody *body, int node, double position[3]);

#ifdef __cplusplus
}
#endif

#endif
