// External forces in the tables of the kernel, in the coordinates of the rows. Step thread.
#include "surface/model.h"

void model_add_external(SurfaceModel *model, int slot, Vec3 force)
{
    Vec3 f = rows_turn_in(&model->basis, force);
    const double part[3] = {f.x, f.y, f.z};
    for (int c = 0; c < 3; c++) {
        long at = model_lane(model_lane_of(model, slot)) + c * LANES;
        model_put(model, model->external, at, model_get(model, model->external, at) + part[c]);
    }
}

void model_turn_loads(SurfaceModel *model)
{
    if (*model->loaded == 0)
        return;
    for (int s = 0; s < model->basis.count; s++) {
        if (model->node[s] < 0)
            continue;
        const double *load = model->world_load[s];
        Vec3 f = rows_turn_in(&model->basis, (Vec3){load[0], load[1], load[2]});
        const double part[3] = {f.x, f.y, f.z};
        for (int c = 0; c < 3; c++)
            model_put(model, model->external, model_lane(model_lane_of(model, s)) + c * LANES,
                      part[c]);
    }
}
