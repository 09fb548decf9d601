// Modified butterfly subdivision: moves the midpoints of edges to the smooth surface that
// interpolates a mesh (Zorin, Schroeder, Sweldens 1996; Choi et al. 2005, eqs 4 and 5, with two
// corrections: weight 3/4 for an extraordinary node itself, and the sign in the boundary rule).
#ifndef PLIANT_GEOMETRY_BUTTERFLY_H
#define PLIANT_GEOMETRY_BUTTERFLY_H

#include "geometry/edges.h"

// A border has a corner where it turns by more than 60 degrees: the cosine of the turn is below
// 1/2, less the rounding error of a regular hexagon, so that all its corners are treated alike.
#define BUTTERFLY_CORNER (0.5 - 1e-9)

// Returns s_j of an extraordinary node v with `valence` edges: the new point of its edge 0 is v +
// sum s_j (p_j - v).
double butterfly_weight(int valence, int j);

// Fills middle[edge_count] with the new point of every edge [m]. `position` [node_count] are the
// nodes [m]; `face` [face_count] the triangles from which the table was made. A node is regular
// when it has 6 edges or lies on the boundary. Then, for the edge (a, b):
//  - on the boundary: 9/16 (a + b) - 1/16 (the next nodes along the boundary on either side). Where
//   the boundary turns by more than 60 degrees, the node beyond is the reflection 2 a - b, so that
//   corners stay sharp and straight sides straight;
//  - both ends regular: 1/2 (a + b) + 1/8 (the two nodes opposite) - 1/16 (the four wings). A wing
//   missing across a boundary edge (u, v), seen from w, is u + v - w;
//  - one end v extraordinary, K edges: 3/4 v + sum s_j p_j over its neighbours in order, p_0 the
//   other end: s = (5, -1, -1)/12 for K = 3, (3, 0, -1, 0)/8 for K = 4, else s_j = (1/4 + cos(2 pi
//   j/K) + 1/2 cos(4 pi j/K))/K. K = 2: the middle;
//  - both extraordinary: the mean of the two.
// Takes O(nodes + edges) for any valences. Each coordinate is computed independently of the others,
// so that a plane z = 0 stays one.
void butterfly_midpoints(const WingedMesh *winged, const int (*face)[3], const Vec3 *position,
                         Vec3 *middle);

#endif
