// A base frame that gravity accelerates in place of its rows. Step thread, but for rows_let_fall.
//
// In single precision g h, added to a velocity in every substep, is rounded in every substep, in
// the same direction as long as the velocity is between the same powers of two, and not alike for
// all nodes: a body falls too fast and begins to spin. Gravity is the same for all nodes, and no
// force inside of the body changes with a velocity that all have: so the frame takes it, with the
// integrator's own stages in double precision, and rows_follow hands over what the rows gather of a
// common velocity by other forces.
#include "dynamics/rows.h"

void rows_let_fall(Rows *rows, const char *name, Arena *arena, StateList *state)
{
    rows->fall =
        arena_allocate(arena, ARENA_STEP, 1, sizeof *rows->fall, "%s/frame velocity", name);
    // Rare: files of builds without it hold velocities in the world, a frame's of 0.
    state_add_rare(state, &rows->fall->velocity, sizeof rows->fall->velocity, "%s/frame_velocity",
                   name);
}

void frame_drift(Rows *rows, double dt)
{
    FrameMotion *ahead = &rows->fall->ahead;
    ahead->shift = vec3_madd(ahead->shift, dt, rows_velocity(rows));
}

static FrameMotion motion_after(FrameMotion from, double dt, Vec3 velocity, Vec3 acceleration)
{
    return (FrameMotion){vec3_madd(from.shift, dt, velocity),
                         vec3_madd(from.velocity, dt, acceleration)};
}

// As the kernels do with a row (StageRule in integrator.h).
void frame_advance(Rows *rows, const Stage *stage, double h, Vec3 gravity)
{
    FrameFall *fall = rows->fall;
    if (stage->rule == STAGE_KICK) {
        fall->ahead.velocity = vec3_madd(fall->ahead.velocity, h, gravity);
        frame_drift(rows, stage->advance * h);
        return;
    }
    const Vec3 velocity = rows_velocity(rows);
    if (stage->rule == STAGE_RK4_FIRST)
        fall->begin = fall->sum = fall->ahead;
    fall->sum = motion_after(fall->sum, stage->weight * h, velocity, gravity);
    fall->ahead = stage->rule == STAGE_RK4_LAST
                      ? fall->sum
                      : motion_after(fall->begin, stage->advance * h, velocity, gravity);
}

void frame_end_tick(Rows *rows, bool stays)
{
    FrameFall *fall = rows->fall;
    if (stays) {
        rows->frame->origin = rows_origin(rows);
        fall->velocity = rows_velocity(rows);
    }
    *fall = (FrameFall){.velocity = fall->velocity};
}
