// The built-in press: where a body is pressed, and the way of the tool.
#ifndef PLIANT_STUDY_PRESS_H
#define PLIANT_STUDY_PRESS_H

#include "study/context.h"

// The place of a body that lies farthest from what holds it.
typedef struct PressSite {
    Vec3 point;       // on the surface [m]
    Vec3 inward;      // unit, against the normal; in the plane towards the middle
    double edge;      // length of an edge of the surface [m]
    double thickness; // of the body, as press_extent tells it [m]
} PressSite;

// `plane`: it lies in z = 0. False: every node is held.
bool press_find_site(const Body *body, bool plane, PressSite *site);
// The longest side of the box around a body's surface, and the shortest that is not flat [m].
double press_extent(const Body *body, double *thickness);

// How far the tip goes in [m].
double press_depth(const PressSite *site);
// The tool starts clear of the surface and goes along `inward`, its shaft outside; in the plane
// case it keeps its own direction.
void press_plan(StudyPress *press, int tool, const ToolOptions *options, const PressSite *site,
                bool plane);
// How far the tool is along its way at `time` [m]: a raised cosine down, a rest, and back, in
// straight lines between multiples of `knot_s`.
double press_way_at(const StudyPress *press, double time, double knot_s);

#endif
