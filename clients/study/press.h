// The built-in press: its location on a body, and the path of the tool.
#ifndef PLIANT_STUDY_PRESS_H
#define PLIANT_STUDY_PRESS_H

#include "study/context.h"

// The point of a body that is farthest from its fixed nodes.
typedef struct PressSite {
    Vec3 point;       // on the surface [m]
    Vec3 inward;      // unit, against the normal; in the plane towards the middle
    double edge;      // length of an edge of the surface [m]
    double thickness; // of the body, as press_extent measures it [m]
} PressSite;

// `plane`: the body is in z = 0. Returns false if every node is fixed.
bool press_find_site(const Body *body, bool plane, PressSite *site);
// Returns the longest side of the box around a body's surface; sets the shortest that is not flat
// [m].
double press_extent(const Body *body, double *thickness);

// Returns the depth of the press [m].
double press_depth(const PressSite *site);
// Plans the press: the tool starts clear of the surface and moves along `inward`, with its shaft
// outside; in the plane case it keeps its orientation.
void press_plan(StudyPress *press, int tool, const ToolOptions *options, const PressSite *site,
                bool plane);
// Returns the tool's position along its path at `time` [m]: a raised cosine down, a rest, and back,
// in straight lines between multiples of `knot_s`.
double press_way_at(const StudyPress *press, double time, double knot_s);

#endif
