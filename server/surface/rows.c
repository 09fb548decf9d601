// Between a body's rows and the world: in double precision rows are positions; in single precision
// they are displacements in a base frame that follows floating bodies. Step thread.
#include "surface/model.h"

#include <math.h>

enum {
    FOLLOW_TICKS = 16, // ticks between moves of the base frame
    FOLLOW_LEAST = 4,  // at least so many, however fast the body
};

void model_read_row(const SurfaceModel *model, const void *rows, int slot, Vec3 *position,
                    Vec3 *velocity)
{
    if (model->precision == PRECISION_DOUBLE) {
        const double *row = (const double *)rows + (long)slot * ROW;
        *position = (Vec3){row[0], row[1], row[2]};
        if (velocity != NULL)
            *velocity = (Vec3){row[4], row[5], row[6]};
        return;
    }
    const float *row = (const float *)rows + (long)slot * ROW;
    const double *place = model->place[slot];
    Vec3 p = {place[0] + (double)row[0], place[1] + (double)row[1], place[2] + (double)row[2]};
    Vec3 v = {(double)row[4], (double)row[5], (double)row[6]};
    if (model->floating) {
        p = quat_rotate(model->frame->turn, p);
        v = quat_rotate(model->frame->turn, v);
    }
    *position = vec3_add(model->frame->origin, p);
    if (velocity != NULL)
        *velocity = v;
}

void model_write_row(const SurfaceModel *model, void *rows, int slot, Vec3 position, Vec3 velocity)
{
    Vec3 p = position, v = velocity;
    if (model->precision == PRECISION_SINGLE) {
        const double *place = model->place[slot];
        p = model_to_rows(model, vec3_sub(position, model->frame->origin));
        p = vec3_sub(p, (Vec3){place[0], place[1], place[2]});
        v = model_to_rows(model, velocity);
    }
    const double value[ROW] = {p.x, p.y, p.z, 0.0, v.x, v.y, v.z, 0.0};
    for (int c = 0; c < ROW; c++)
        model_put(model, rows, (long)slot * ROW + c, value[c]);
}

Vec3 model_to_rows(const SurfaceModel *model, Vec3 direction)
{
    return model->floating ? quat_rotate(quat_conjugate(model->frame->turn), direction) : direction;
}

bool model_is_sound(const SurfaceModel *model)
{
    const void *rows = model->rows[model->current];
    for (long i = 0; i < (long)model->slot_count * ROW; i++) {
        double limit = i % ROW < 4 ? model->position_limit : SPEED_LIMIT(model->precision);
        if (!(fabs(model_get(model, rows, i)) <= limit))
            return false;
    }
    return true;
}

void model_add_external(SurfaceModel *model, int slot, Vec3 force)
{
    Vec3 f = model_to_rows(model, force);
    const double part[3] = {f.x, f.y, f.z};
    for (int c = 0; c < 3; c++) {
        long at = model_lane(model_lane_of(model, slot)) + c * LANES;
        model_put(model, model->external, at, model_get(model, model->external, at) + part[c]);
    }
}

// Constant loads turn with the frame's coordinates: taken from the world's anew, so that no
// rounding builds up.
static void turn_loads(SurfaceModel *model)
{
    if (model->world_load == NULL || *model->loaded == 0)
        return;
    for (int s = 0; s < model->slot_count; s++) {
        if (model->node[s] < 0)
            continue;
        const double *load = model->world_load[s];
        Vec3 f = model_to_rows(model, (Vec3){load[0], load[1], load[2]});
        const double part[3] = {f.x, f.y, f.z};
        for (int c = 0; c < 3; c++)
            model_put(model, model->external, model_lane(model_lane_of(model, s)) + c * LANES,
                      part[c]);
    }
}

// With the fit p = center + R (place - rest_center) in the rows' coordinates: the new frame is the
// one in which the fitted body does not move, p' = R^T (p - center) + rest_center.
static void move_frame(SurfaceModel *model)
{
    BaseFrame *frame = model->frame;
    RigidFrame *rigid = model->rigid;
    void *rows = model->rows[model->current];
    rigid_frame_fit(rigid, rows);
    const FramePose *pose = &rigid->pose;
    Quat turn = {rigid->rotation[0], rigid->rotation[1], rigid->rotation[2], rigid->rotation[3]};
    Quat back = quat_conjugate(turn);
    Vec3 center = {pose->center[0], pose->center[1], pose->center[2]};
    Vec3 rest = {pose->rest_center[0], pose->rest_center[1], pose->rest_center[2]};

    float *row = rows;
    for (int s = 0; s < model->slot_count; s++, row += ROW) {
        if (model->node[s] < 0)
            continue;
        const double *place = model->place[s];
        Vec3 u = {(double)row[0], (double)row[1], (double)row[2]};
        Vec3 arm = vec3_sub((Vec3){place[0], place[1], place[2]}, rest);
        // R^T (arm + u - shift) - arm, the difference of rotations taken first: it is small.
        Vec3 away = vec3_sub(u, vec3_sub(center, rest));
        Vec3 moved = vec3_add(vec3_sub(quat_rotate(back, arm), arm), quat_rotate(back, away));
        Vec3 v = quat_rotate(back, (Vec3){(double)row[4], (double)row[5], (double)row[6]});
        row[0] = (float)moved.x, row[1] = (float)moved.y, row[2] = (float)moved.z;
        row[4] = (float)v.x, row[5] = (float)v.y, row[6] = (float)v.z;
    }
    Vec3 shift = vec3_sub(center, quat_rotate(turn, rest));
    frame->origin = vec3_add(frame->origin, quat_rotate(frame->turn, shift));
    frame->turn = quat_unit(quat_multiply(frame->turn, turn));
    frame->ticks = 0;
    rigid->rotation[0] = 1.0;
    rigid->rotation[1] = rigid->rotation[2] = rigid->rotation[3] = 0.0;
    turn_loads(model);
}

void model_follow(SurfaceModel *model)
{
    BaseFrame *frame = model->frame;
    frame->ticks++;
    const float *row = model->rows[model->current];
    double moved = fabs((double)row[0]) + fabs((double)row[1]) + fabs((double)row[2]);
    bool far = moved > 0.1 * model->longest_edge && frame->ticks >= FOLLOW_LEAST;
    if (frame->ticks >= FOLLOW_TICKS || far)
        move_frame(model);
}

void model_return_to_rest(SurfaceModel *model)
{
    if (model->precision == PRECISION_SINGLE) {
        *model->frame = (BaseFrame){.origin = model->rest_origin, .turn = {1.0, 0.0, 0.0, 0.0}};
        if (model->floating)
            turn_loads(model);
    }
    for (int s = 0; s < model->slot_count; s++)
        for (int c = 0; c < ROW; c++) {
            double value = model->precision == PRECISION_DOUBLE && c < 3 ? model->place[s][c] : 0.0;
            model_put(model, model->rows[model->current], (long)s * ROW + c, value);
        }
}
