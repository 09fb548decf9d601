// What comes from outside while a scene runs: poses, loads, states that replace the present one,
// and parameters (SET). Step thread, between two ticks.
#include "dynamics/body.h"
#include "dynamics/sim_data.h"
#include "geometry/levels.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// Poses and loads

void sim_apply_pose(Sim *sim, int tool, const ToolPose *pose, bool hold)
{
    if (!guard_admits(sim, tool, pose))
        return;
    if (!pose->active)
        cutting_lift(sim, tool);
    if (pose->active && !sim->motion[tool].active)
        guard_renew(sim, -1); // it may start inside tissue
    tool_motion_apply(&sim->motion[tool], pose, sim->clock->step, sim->tick, hold);
}

bool sim_apply_load(Sim *sim, const LoadOptions *options, char *why, size_t why_size)
{
    // At least one tick, and an end that the counter of ticks can reach.
    double ticks = fmax(1.0, floor(options->duration / sim->tick + 0.5));
    int64_t end = sim->clock->step + (int64_t)fmin(ticks, 1e15);
    if (!loads_start(&sim->loads, sim->body, sim->body_count, options->body, options->center,
                     options->radius, options->force, end, why, why_size))
        return false;
    // Remember who sent it, so that the sender can be blamed.
    LoadRecord *record = &sim->loads.record[*sim->loads.count - 1];
    guard_renew(sim, -1);
    record->sender = options->sender;
    record->id = options->id;
    return true;
}

// ---------------------------------------------------------------------------------------------
// States

bool sim_check(const Sim *sim)
{
    for (int k = 0; k < sim->attachment_count; k++)
        if (!attachment_check(sim->attachment[k]))
            return false;
    for (int k = 0; k < sim->scene_attachment_count; k++)
        if (sim->scene_attachment[k].joint != NULL && !joint_check(sim->scene_attachment[k].joint))
            return false;
    for (int k = 0; k < sim->touch_count; k++)
        if (!touch_check(sim->touch[k]))
            return false;
    for (int t = 0; t < sim->tool_count; t++)
        if (!tool_motion_check(&sim->motion[t], sim->clock->step))
            return false;
    // The time, and the rest, each by its owner.
    return sim->clock->step >= 0 && sim->clock->step <= INT64_MAX / 4 &&
           sim->clock->next_load >= 0 && sim->clock->next_load <= sim->scene_load_count &&
           loads_check(&sim->loads, sim->body, sim->body_count) && cutting_check(sim) &&
           guard_check(sim) && (sim->ties == NULL || ties_check(sim));
}

// A mesh changes about once per tick at most: clients of another run have no number this high.
static int number_by_step(const Sim *sim, int before)
{
    const int64_t step = sim->clock->step;
    return step > before ? (int)(step % (INT_MAX / 2)) : before;
}

// Recomputes what depends on the state. Meshes get new numbers, unless a body's state has the
// number that it had in `another_run`, whose numbers count instead of this run's.
static void follow_state(Sim *sim, bool another_run)
{
    // Estimates belong to the motion before.
    if (sim->stiffness != NULL)
        stiffness_forget(sim->stiffness);
    for (int b = 0; b < sim->body_count; b++) {
        Body *body = &sim->body[b];
        // The state of another run brings that run's number of the mesh.
        const int before = body->mesh.topology;
        if (another_run && body_changes(body))
            body->mesh.topology = 0;
        const int known = body->mesh.topology;
        // The body derives its own tables from the state.
        if (body->ops->restored != NULL)
            body->ops->restored(body);
        if (!body_changes(body))
            continue;
        // Clients must see a newer number, or they keep the mesh that they have.
        if (!topology_is_newer(body->mesh.topology, known))
            body->mesh.topology =
                topology_after(another_run ? number_by_step(sim, before) : before);
        time_step_follow(sim, body);
    }
    if (sim->ties != NULL)
        ties_follow(sim);
    for (int k = 0; k < sim->touch_count; k++)
        touch_restored(sim->touch[k], sim->clock->step);
}

void sim_restored(Sim *sim)
{
    follow_state(sim, true);
}

void sim_reset(Sim *sim)
{
    SimClock clock = *sim->clock;
    state_copy_in(sim->state, sim->start_state);
    *sim->clock = clock;
    follow_state(sim, false);
}

void sim_set_lockstep(Sim *sim, bool lockstep)
{
    sim->clock->lockstep = lockstep;
}

// ---------------------------------------------------------------------------------------------
// Parameters: sim_apply_set, sim_apply_gravity

// Returns the largest allowed scale, by bisection, rounded down a little.
static double largest_scale(const Sim *sim, const Body *body, double *scale, double low,
                            double high)
{
    double limit, step;
    for (int i = 0; i < 40; i++) {
        *scale = 0.5 * (low + high);
        bool fits = time_step_allows(sim, body, body->tuning.stiffness_scale,
                                     body->tuning.damping_scale, &limit, &step);
        *(fits ? &low : &high) = *scale;
    }
    return low * (1.0 - 1e-4); // rounded for four digits
}

// A parameter that SET knows.
typedef enum SetReach {
    OF_SCENE,  // the same for all bodies: no body can be named
    OF_BODIES, // of one body, or of all: of none if one refuses
    OF_THOSE,  // of one body, or of all that have it: levels, a cavity
} SetReach;

typedef struct SetKey SetKey;
struct SetKey {
    const char *key;
    BodyParameter parameter;
    SetReach reach;
    double low, high;
    const char *range; // both as text
    bool whole;        // an integer
    // `body`: NULL for all, where the reach is not OF_BODIES.
    bool (*apply)(Sim *sim, Body *body, const SetKey *key, double value, char *why,
                  size_t why_size);
};

// Sets stiffness_scale or damping_scale of one body, within the stability bound of its step.
static bool set_scale(Sim *sim, Body *body, const SetKey *key, double value, char *why,
                      size_t why_size)
{
    double *scale = key->parameter == BODY_STIFFNESS_SCALE ? &body->tuning.stiffness_scale
                                                           : &body->tuning.damping_scale;
    // Try it, and go back if the step does not allow it.
    double before = *scale, limit, step;
    *scale = value;
    if (!time_step_allows(sim, body, body->tuning.stiffness_scale, body->tuning.damping_scale,
                          &limit, &step)) {
        // Say how much would be allowed.
        double most = largest_scale(sim, body, scale, before, value);
        *scale = before;
        snprintf(why, why_size,
                 "%g needs a time step of at most %.4g s, and body %s runs at %.4g s; take at most "
                 "%.4g",
                 value, limit, body->name, step, most);
        return false;
    }
    // A model may lack the parameter.
    if (!body->ops->set(body->model, key->parameter, value)) {
        *scale = before;
        snprintf(why, why_size, "body %s has no such parameter", body->name);
        return false;
    }
    // Where steps follow the level of detail they change at once.
    if (body_changes(body) || sim->ties != NULL)
        time_step_follow(sim, body);
    return true;
}

static bool set_friction(Sim *sim, Body *body, const SetKey *key, double value, char *why,
                         size_t why_size)
{
    (void)sim, (void)key, (void)why, (void)why_size;
    body->tuning.friction = value;
    return true;
}

static bool set_gravity(Sim *sim, Body *body, const SetKey *key, double value, char *why,
                        size_t why_size)
{
    (void)body, (void)why, (void)why_size;
    for (int b = 0; b < sim->body_count; b++)
        sim->body[b].ops->set(sim->body[b].model, key->parameter, value);
    return true;
}

// Sets it for one body, or (NULL) for all with levels.
static bool set_adapt(Sim *sim, Body *body, const SetKey *key, double value, char *why,
                      size_t why_size)
{
    int count = 0;
    for (int b = 0; b < sim->body_count; b++) {
        Body *at = &sim->body[b];
        if ((body == NULL || at == body) && at->ops->adapt != NULL)
            count += at->ops->set(at->model, key->parameter, value);
    }
    // Nobody adapts, or the body that was named does not.
    if (count == 0)
        snprintf(why, why_size, "%s%s does not adapt its level of detail (levels, adapt)",
                 body == NULL ? "the scene" : "body ", body == NULL ? "" : body->name);
    return count > 0;
}

// Sets it for one body, or (NULL) for all with a cavity; of none if one of them cannot have it.
static bool set_cavity(Sim *sim, Body *body, const SetKey *key, double value, char *why,
                       size_t why_size)
{
    const bool pressure = key->parameter == BODY_PRESSURE;
    int count = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int b = 0; b < sim->body_count; b++) {
            Body *at = &sim->body[b];
            const double most = pressure ? at->pressure_limit : at->volume_limit,
                         least = pressure ? at->pressure_least : 0.0;
            if ((body != NULL && at != body) || !(most > 0.0))
                continue;
            count++;
            if (!(value > least && value <= most)) {
                snprintf(why, why_size,
                         "%s %g is outside (%.4g, %.4g], for which the time step of body %s leaves "
                         "room",
                         key->key, value, least, most * (1.0 - 1e-4), at->name);
                return false;
            }
            if (pass == 1)
                at->ops->set(at->model, key->parameter, value);
        }
    if (count == 0)
        snprintf(why, why_size, "%s%s has no closed cavity%s", body == NULL ? "the scene" : "body ",
                 body == NULL ? "" : body->name, pressure ? "" : " with a gas or fluid in it");
    return count > 0;
}

_Static_assert(LEVELS_MAX == 8, "the range of adapt_level");
#define RANGE(least, most) .low = (least), .high = (most), .range = "[" #least ", " #most "]"
static const SetKey KEYS[] = {
    {"gravity_x", BODY_GRAVITY_X, OF_SCENE, RANGE(-1e4, 1e4), .apply = set_gravity},
    {"gravity_y", BODY_GRAVITY_Y, OF_SCENE, RANGE(-1e4, 1e4), .apply = set_gravity},
    {"gravity_z", BODY_GRAVITY_Z, OF_SCENE, RANGE(-1e4, 1e4), .apply = set_gravity},
    {"stiffness_scale", BODY_STIFFNESS_SCALE, OF_BODIES, RANGE(0, 1e6), .apply = set_scale},
    {"damping_scale", BODY_DAMPING_SCALE, OF_BODIES, RANGE(0, 1e6), .apply = set_scale},
    {"friction", .reach = OF_BODIES, RANGE(0, 10), .apply = set_friction},
    {"pressure", BODY_PRESSURE, OF_THOSE, RANGE(-1e6, 1e6), .apply = set_cavity},
    {"volume", BODY_VOLUME, OF_THOSE, RANGE(0, 1e9), .apply = set_cavity},
    {"adapt_force", BODY_ADAPT_FORCE, OF_THOSE, RANGE(0, 1e+06), .apply = set_adapt},
    {"adapt_speed", BODY_ADAPT_SPEED, OF_THOSE, RANGE(0, 1e+06), .apply = set_adapt},
    {"adapt_curvature", BODY_ADAPT_CURVATURE, OF_THOSE, RANGE(0, 1e+06), .apply = set_adapt},
    {"adapt_scale", BODY_ADAPT_SCALE, OF_THOSE, RANGE(0, 1e+06), .apply = set_adapt},
    {"adapt_level", BODY_ADAPT_LEVEL, OF_THOSE, RANGE(0, 8), .whole = true, .apply = set_adapt},
};
enum { KEY_COUNT = sizeof KEYS / sizeof *KEYS };

static const SetKey *find_key(const char *key)
{
    for (int k = 0; k < KEY_COUNT; k++)
        if (strcmp(key, KEYS[k].key) == 0)
            return &KEYS[k];
    return NULL;
}

// True if two keys begin with the same word: "adapt_force" and "adapt_speed".
static bool are_alike(const SetKey *a, const SetKey *b)
{
    const size_t length = strcspn(a->key, "_");
    return a->key[length] == '_' && strncmp(a->key, b->key, length + 1) == 0;
}

// Lists the keys of the scene, or those of bodies: "friction, adapt_force|speed".
static void list_keys(bool of_scene, char *text, size_t size)
{
    size_t length = 0;
    const SetKey *last = NULL;
    text[0] = '\0';
    // Keys of one word are listed as one, with its endings.
    for (int k = 0; k < KEY_COUNT && length < size; k++) {
        if ((KEYS[k].reach == OF_SCENE) != of_scene)
            continue;
        const bool alike = last != NULL && are_alike(last, &KEYS[k]);
        length += (size_t)snprintf(text + length, size - length, "%s%s",
                                   alike          ? "|"
                                   : last != NULL ? ", "
                                                  : "",
                                   KEYS[k].key + (alike ? strcspn(KEYS[k].key, "_") + 1 : 0));
        last = &KEYS[k];
    }
}

static bool fail_unknown(const Body *body, const char *key, char *why, size_t why_size)
{
    enum { LIST = 160 };
    char scene[LIST], bodies[LIST];
    // What could have been meant.
    list_keys(true, scene, sizeof scene);
    list_keys(false, bodies, sizeof bodies);
    if (body != NULL)
        snprintf(why, why_size, "unknown key %s; of a body: %s", key, bodies);
    else
        snprintf(why, why_size,
                 "unknown key %.40s; known: gravity, %s, and for all bodies or as <body>.key: %s",
                 key, scene, bodies);
    return false;
}

static bool check_value(const SetKey *key, double value, char *why, size_t why_size)
{
    // The form of the comparison makes NaN fail.
    if (value >= key->low && value <= key->high && (!key->whole || value == floor(value)))
        return true;
    snprintf(why, why_size, "%s %g %s %s", key->key, value,
             key->whole ? "is not a whole number in" : "outside", key->range);
    return false;
}

// Changes every body, or none if one refuses.
static bool set_every_body(Sim *sim, const SetKey *key, double value, char *why, size_t why_size)
{
    BodyTuning before[SIM_BODIES];
    for (int b = 0; b < sim->body_count; b++) {
        // One refusal: all bodies before it get their values back.
        before[b] = sim->body[b].tuning;
        if (key->apply(sim, &sim->body[b], key, value, why, why_size))
            continue;
        for (int k = 0; k < b; k++) {
            Body *body = &sim->body[k];
            body->tuning = before[k];
            body->ops->set(body->model, BODY_STIFFNESS_SCALE, before[k].stiffness_scale);
            body->ops->set(body->model, BODY_DAMPING_SCALE, before[k].damping_scale);
            if (body_changes(body) || sim->ties != NULL)
                time_step_follow(sim, body);
        }
        return false;
    }
    return true;
}

bool sim_apply_gravity(Sim *sim, Vec3 gravity, char *why, size_t why_size)
{
    if (!(vec3_length(gravity) <= 1e4)) {
        snprintf(why, why_size, "gravity (%g, %g, %g) is longer than 1e4", gravity.x, gravity.y,
                 gravity.z);
        return false;
    }
    // All bodies have one gravity, whatever their model.
    const double part[3] = {gravity.x, gravity.y, gravity.z};
    for (int b = 0; b < sim->body_count; b++)
        for (int axis = 0; axis < 3; axis++)
            sim->body[b].ops->set(sim->body[b].model, (BodyParameter)(BODY_GRAVITY_X + axis),
                                  part[axis]);
    guard_note_set(sim, -1, "gravity");
    return true;
}

// Returns the body of "<body>.key", and moves `key` behind the point; NULL: the key names none.
static Body *take_body(Sim *sim, const char **key)
{
    for (int b = 0; b < sim->body_count; b++) {
        const size_t length = strlen(sim->body[b].name);
        if (strncmp(*key, sim->body[b].name, length) == 0 && (*key)[length] == '.') {
            *key += length + 1;
            return &sim->body[b];
        }
    }
    return NULL;
}

bool sim_apply_set(Sim *sim, const char *key, double value, char *why, size_t why_size)
{
    // "<body>.key" names one body, a key alone all of them.
    Body *body = take_body(sim, &key);
    const SetKey *row = find_key(key);
    if (row == NULL || (body != NULL && row->reach == OF_SCENE))
        return fail_unknown(body, key, why, why_size);
    if (!check_value(row, value, why, why_size))
        return false;
    // Keys of bodies change all or none, keys of the scene are one call.
    const bool every = body == NULL && row->reach == OF_BODIES;
    if (every ? !set_every_body(sim, row, value, why, why_size)
              : !row->apply(sim, body, row, value, why, why_size))
        return false;
    guard_note_set(sim, body == NULL ? -1 : (int)(body - sim->body), key);
    return true;
}
