// SPDX-License-Identifier: MIT
// Whether a published mesh is one that a front end can draw: every test of a body whose topology
// changes asks this after each change.
#ifndef PLIANT_TESTS_MESH_CHECK_H
#define PLIANT_TESTS_MESH_CHECK_H

#include "body/body.h"
#include "geometry/mesh.h"

enum { MESH_CHECK_TEXT = 200 };

// True for a mesh without cracks: every edge of its triangles lies in two of them, in opposite
// directions, or once in a piece of a border edge of level 0, whose pieces join end to end, all in
// one direction. So there is no T-junction, and orientation is consistent. Also: counts within
// capacity, ids unique, free slots free (id -1, triangle 0 0 0), no triangle with a repeated or
// free node, every live node used, parents alive and of a coarser birth, one piece a triangle.
// `base`: the mesh of level 0, whose borders must be the very borders found; NULL: any will do.
// `position` [node_count] by slot: finite, and no triangle without area; NULL: not looked at.
// False with the first fault in `why`. Bodies that have been cut are not meant.
bool mesh_agrees(const BodyMesh *mesh, const TriMesh *base, const Vec3 *position,
                 char why[MESH_CHECK_TEXT]);
// Fails the cmocka test with the fault.
#define expect_crack_free(mesh, base, position)                                                    \
    do {                                                                                           \
        char why_[MESH_CHECK_TEXT];                                                                \
        if (!mesh_agrees((mesh), (base), (position), why_))                                        \
            fail_msg("topology %d: %s", (mesh)->topology, why_);                                   \
    } while (0)

#endif
