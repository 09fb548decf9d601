// SPDX-License-Identifier: MIT
// Twins of a server's body for its rivals: the textbook kernel and Bullet, from the same mesh.
#ifndef PLIANT_TESTS_BENCH_TWIN_H
#define PLIANT_TESTS_BENCH_TWIN_H

#include "bullet.h"
#include "textbook.h"
#include "world.h"

// The textbook's network of a closed mesh, with the material, masses and areas of the body `like`,
// under `force` [N] shared by all nodes.
void twin_textbook(Textbook *textbook, const TriMesh *mesh, const Body *like, const Vec3 *velocity,
                   Vec3 force);
#ifdef PLIANT_BENCH_BULLET
// Bullet's body of the same nodes, masses and links.
BulletBody *twin_bullet(const Textbook *textbook, int iterations);
#endif

#endif
