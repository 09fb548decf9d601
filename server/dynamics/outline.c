#include "dynamics/outline.h"

#include <math.h>

// Rounding of rows that hold displacements is nothing to show.
static double without_rounding(double x, double size)
{
    return fabs(x) < 1e-12 * size ? 0.0 : x;
}

BodyOutline body_outline(const Body *body)
{
    const BodySurface *places = &body->surface; // more than there are nodes, where a body adapts
    BodyOutline outline = {.box = box_empty()};
    Box *box = &outline.box;
    for (int i = 0; i < places->node_count; i++) {
        if (places->node_face_end[i] <= places->node_face_start[i])
            continue;
        Vec3 x;
        body->ops->read_nodes(body->model, &i, 1, &x, NULL);
        box_add(box, x);
        outline.nodes++;
        outline.fixed += body->ops->is_fixed != NULL && body->ops->is_fixed(body->model, i);
    }
    const double size = vec3_length(box_low(box)) + vec3_length(box_high(box));
    for (int c = 0; c < 3; c++) {
        box->low[c] = without_rounding(box->low[c], size);
        box->high[c] = without_rounding(box->high[c], size);
    }
    return outline;
}
