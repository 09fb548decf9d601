// SPDX-License-Identifier: MIT
// Private to the module sim: the data of a touch. touch_find.c finds what is near, at most
// once a tick, with the grid of touch_grid.c; touch.c is the law.
#ifndef PLIANT_SIM_TOUCH_DATA_H
#define PLIANT_SIM_TOUCH_DATA_H

#include "sim/carriers.h"
#include "sim/touch/touch.h"
#include "geometry/box.h"
#include "geometry/distance.h"

enum {
    TOUCH_PATCHES = 2,
    TOUCH_MOST_WAIT = 16, // ticks between two looks at bodies that are apart
};
// Cosine between two normals beyond which surfaces face the same way.
static const double TOUCH_ALIGNED = 0.25;
// How far the parts of a whole solid are told apart, in edges: it is bent out of shape before those
// beyond can meet, or those within that face away from each other at rest.
static const double TOUCH_MOST_GAP = 8.0;
// Speed of a body beyond which its contact is searched no farther [m/s].
static const double TOUCH_MOST_SPEED = 2.0;

// What a point remembers of the other surface; plain data, part of the state, whole words. All 0
// when nothing is near.
typedef struct TouchMemory {
    int face[TOUCH_PATCHES];    // 1 + the nearest face of a patch; 0: none
    int side[TOUCH_PATCHES];    // on which the point is: 1 outside, -1 inside
    double gap[TOUCH_PATCHES];  // TouchGap.distance [m]
    double rest[TOUCH_PATCHES]; // distance at which it rests on the patch now: grows to the
                                // thickness, from below 0 where bodies overlapped at the start [m]
    double stiffness;           // that it presses with [N/m]; 0: it does not press
    Vec3 bristle;               // of friction [m]
} TouchMemory;

// Of the last search, plain data, part of the state, whole words.
typedef struct TouchKept {
    int64_t holds;     // 1: what it found is still all that can meet
    int64_t wait;      // ticks until the boxes of bodies that are apart are looked at again
    int64_t searches;  // 0, 1 or, of more, 2
    double fastest[2]; // speed of any node of each body at that time [m/s]
    double moved;      // how much nearer bodies may have come since the search before [m]
} TouchKept;

// A face that a point can reach until the next search.
typedef struct TouchPair {
    int face;
    int corner[3]; // numbers in TouchEnd
    int patch;
    double least;    // distance from the point at the search [m]
    unsigned border; // bit k: nothing that counts continues the surface across edge (k, k + 1);
                     // bit 3 + k: around corner k
} TouchPair;

// How far a point is from a patch (touch_gap).
typedef struct TouchGap {
    double distance; // signed [m]
    Vec3 out;        // unit, the direction in which the distance grows
    const TouchPair *pair;
    double weight[3]; // of the nearest point, on the pair's corners
} TouchGap;

// A point that can reach the other surface until the next search.
typedef struct TouchPoint {
    int node;         // of its body
    int own;          // its number in TouchEnd
    int first, count; // of its pairs
    double stiffness; // [N/m]
    double thickness; // [m]
    double clear;     // distance beyond that at the search, negative inside [m]
    // The nodes under it at the search, by number, with the weights of the nearest points.
    int under_count, under[3 * TOUCH_PATCHES];
    double weight[3 * TOUCH_PATCHES];
    int side[TOUCH_PATCHES];
    Vec3 trial;                  // bristle of the current evaluation [m]
    TouchGap gap[TOUCH_PATCHES]; // of the last evaluation that looked,
    bool meets[TOUCH_PATCHES];   // and whether they count
} TouchPoint;

// The nodes of one body that a touch reads and pushes.
typedef struct TouchEnd {
    Body *body;
    Carriers carriers; // of the nodes by their numbers
    Carriers *fit;     // they, of a smooth surface; NULL: nodes are where their vertices are
    int count;
    int *node;   // [count]
    int *number; // [node slots] of a node; -1
    Vec3 *x, *v, *f;
    Vec3 *from;   // x at the search
    Vec3 *looked; // x that the gaps of points are of
    // Of the search: all nodes in use; their places at the last one and where their vertices were
    // (state; the same array without `fit`) and velocities, by node; both now in the order of
    // `used`.
    int used_count;
    int *used;
    Vec3 *start;
    int *piece; // [node slots] of a hollow body that touches itself, else NULL: a node of the piece
                // of surface that a node is on
    Vec3 *place, *speed, *packed_place, *packed_speed;
    double density; // mean mass of its free nodes per area of their faces [kg/m2]
    double fastest; // [m/s]
    Box box;
} TouchEnd;

// A face of the search.
typedef struct TouchFace {
    int face;
    Vec3 center, normal; // unit
    double radius;       // around the centre [m]
} TouchFace;

// Cells of the grid; empty if a low one is beyond the high one.
typedef struct TouchCells {
    int low[3], high[3];
} TouchCells;

// Points of one body against faces of a body, or of the same.
typedef struct TouchHalf {
    TouchEnd *points, *faces; // equal: contact with itself
    bool one_sided; // a point inside is pushed out; else it stays on the side that it came from
    TouchMemory *memory; // [node slots], state
    TouchMemory *before; // likewise, as it was before the last search
    int point_count, point_capacity;
    TouchPoint *point;
    int pair_count, pair_capacity;
    TouchPair *pair;
    double *demand;     // [vertices of faces] stiffness that pushes on a carrier of faces [N/m]
    double *own_demand; // [vertices of points] on one of points; NULL: they carry themselves
    // Of the search.
    int face_count;
    TouchFace *face;
    TouchCells *in; // that a face is in
    int64_t *stamp; // [face slots] the search in which a face was listed
    int64_t search;
    int *heir;   // [face slots] of a body whose topology changes, else NULL; 0 between changes
    Vec3 low;    // of the grid
    double cell; // its edge [m]
    int cells[3];
    int *cell_start;   // [cell_capacity + 2]
    bool *cell_smooth; // [cell_capacity] of a hollow body with itself: all faces are of one piece
                       // and face the same way, so that no point in it touches any; else NULL
    int *cell_face;    // [entry_capacity]
    int entries, cell_capacity, entry_capacity;
} TouchHalf;

struct Touch {
    TouchOptions options;
    Body *body[2];
    double tick; // [s]
    int count;   // of ends and halves: touch_bodies
    TouchEnd end[2];
    TouchHalf half[2];
    TouchKept *kept;
    double damping_time; // [s]
    double thickness;    // [m]
    double overlap;      // that a scene may start with, at its first search, else 0 [m]
    double edge;         // the longest edge of the body with the finer surface [m]
    double deepest;      // [m]
    double slack;        // how much nearer a point and a face may come until the next search [m]
    double margin;       // of the slack, for nodes that become faster within a tick [m]
    double reach;        // of the search [m]
    double least_slack;  // of it, whatever the speeds [m]
    bool whole;          // a body with itself is uncut
    bool acts;           // likewise: something is near in this tick
    bool shortened;      // touch_shortens of the last tick
    int whole_faces;     // of a solid with itself: face_used while it is uncut
    double rest_gap;     // likewise: between parts that face each other at rest, up to
                         // TOUCH_MOST_GAP edges [m]
    double drift;   // of a body with itself: bound on how much nearer its parts have come since
                    // the search; infinity: unknown [m]
    double speed;   // likewise: of any node at the start of the last tick [m/s]
    bool fast;      // a hollow body with itself is: the search holds for its tick only
    bool expires;   // likewise: points are at borders
    bool repeats;   // the search is one that was done before
    bool looked;    // gaps of points are known
    int64_t looks;  // evaluations that had to find them
    int64_t budget; // exact distances left to this search
    int64_t refused;
    double depth, energy; // of the last evaluation [m], [J]
};

// touch_find.c
// Load time, of a solid with itself: finds rest_gap.
void touch_find_gap(Touch *touch);
// Finds what can meet in this tick, unless the last search covers that too.
void touch_search(Touch *touch);
// Finds again what the last search found, after its state was restored.
void touch_search_again(Touch *touch);
// Lists the nodes in use again.
void touch_list_nodes(TouchEnd *end);
// Finds the box of the nodes where they were at the last search.
void touch_find_box(TouchEnd *end);
// Gives back all numbers of nodes.
void touch_forget_numbers(TouchEnd *end);

// touch_grid.c
// Builds the grid of a half over the faces in a box, which may be empty. `reach` [m]: of its
// points.
void touch_grid_build(TouchHalf *half, const Box *box, double reach);
// Finds the faces that a point in the box can reach, by index in `face` of the half. Returns their
// number, 0 without setting `near` if the grid is empty.
int touch_grid_at(const TouchHalf *half, Vec3 x, const int **near);

// touch.c
// Finds the signed distance of a point to one of its patches: negative across its side. Returns
// false if nothing of the patch is in front of or behind it; the distance is then that to its
// border, or infinite.
// `x`: positions by the numbers of TouchPair.corner. `moved`: how much nearer point and faces may
// have come since the search [m].
bool touch_gap(const Vec3 *x, Vec3 at, const TouchPair *pair, int count, int patch, int side,
               double moved, TouchGap *gap);
// Computes the forces f of both ends at their x and v.
void touch_evaluate(Touch *touch, double dt);

#endif
