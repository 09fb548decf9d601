// The operations of a plane body that is cut (dynamics/body.h). Step thread.
#include "plane/cut.h"

#include <string.h>

// With a threshold: records the external forces before those of the elements are added.
static void evaluate(void *self, const Stage *stage, double h)
{
    PlaneModel *model = self;
    vertices_begin(&model->vertices);
    plane_cut_feel(model);
    plane_evaluate_elements(model, stage, h);
}

// Forces recorded in a tick that is undone must not tear anything.
static void restore(void *self, RestoreMode mode)
{
    const PlaneCut *cut = ((PlaneModel *)self)->cut;
    plane_ops.restore(self, mode);
    if (cut->felt != NULL)
        memset(cut->felt, 0, (size_t)cut->vertex_capacity * sizeof *cut->felt);
}

static void restored(Body *body)
{
    PlaneModel *model = body->model;
    model->cut->is_sound = plane_cut_restore(body);
    plane_ops.restored(body);
}

static bool check(const void *self)
{
    const PlaneModel *model = self;
    return model->cut->is_sound && plane_ops.check(model);
}

static void explain(const void *self, FILE *out)
{
    const PlaneModel *model = self;
    plane_ops.explain(model, out);
    fprintf(out, "    cuts: at most %d vertices; all made anew after a change\n",
            model->cut->vertex_capacity);
}

const BodyOps *plane_cut_ops(const PlaneCut *cut)
{
    static BodyOps whole, tears;
    whole = plane_ops;
    whole.cut = plane_cut_along;
    whole.reconstruct = plane_cut_reconstruct;
    whole.reserve_blades = plane_cut_reserve_blades;
    whole.restored = restored;
    whole.restore = restore;
    whole.check = check;
    whole.explain = explain;
    tears = whole;
    tears.tear = plane_cut_tear;
    tears.evaluate = evaluate;
    return cut->tear_force > 0.0 ? &tears : &whole;
}
