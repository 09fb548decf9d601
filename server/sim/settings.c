// SPDX-License-Identifier: MIT
// Parameters that change while a scene runs (SET), and what a change would do before it is made.
// Step thread, between two ticks.
#include "body/body.h"
#include "sim/sim_data.h"
#include "sim/guard/guard.h"
#include "sim/time_step.h"
#include "geometry/levels.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
    bool stable;       // always: never the cause of bad numbers
    const char *lacks; // of whom no body has it
    // Whether a body that has it may have this value; NULL: all in its range.
    bool (*check)(Sim *sim, const Body *body, const SetKey *key, double value, char *why,
                  size_t why_size);
    // Sets it, which cannot fail any more.
    void (*apply)(Sim *sim, Body *body, const SetKey *key, double value);
    // Reads it as it is now; returns false if the body has no such parameter, or SET may not change
    // it.
    bool (*read)(const Body *body, const SetKey *key, double *value);
    // Narrows the range to that of a body; NULL: all have the same.
    void (*limit)(const Sim *sim, const Body *body, const SetKey *key, double *low, double *high);
};

// Of a parameter that the model has alone.
static bool read_parameter(const Body *body, const SetKey *key, double *value)
{
    return body->ops->get != NULL && body->ops->get(body->model, key->parameter, value);
}

// --- scales of stiffness and damping, within the stability bound of a body's step ---

static double *scale_of(BodyTuning *tuning, const SetKey *key)
{
    return key->parameter == BODY_STIFFNESS_SCALE ? &tuning->stiffness_scale
                                                  : &tuning->damping_scale;
}

static double present_scale(const Body *body, const SetKey *key)
{
    BodyTuning tuning = body->tuning;
    return *scale_of(&tuning, key);
}

static bool read_scale(const Body *body, const SetKey *key, double *value)
{
    const bool has = read_parameter(body, key, value);
    *value = present_scale(body, key);
    return has;
}

static bool scale_fits(const Sim *sim, const Body *body, const SetKey *key, double value,
                       double *limit, double *step)
{
    BodyTuning tuning = body->tuning;
    *scale_of(&tuning, key) = value;
    return time_step_allows(sim, body, tuning.stiffness_scale, tuning.damping_scale, limit, step);
}

// A limit less this much is still below it when it is printed in four digits, of which the first
// may be a 1.
static const double FOUR_DIGITS = 1.0 - 5e-4;

// Returns the largest scale between one that fits and one that may not, by bisection, rounded down
// for four digits.
static double largest_scale(const Sim *sim, const Body *body, const SetKey *key, double low,
                            double high)
{
    double limit, step;
    for (int i = 0; i < 40; i++) {
        const double scale = 0.5 * (low + high);
        *(scale_fits(sim, body, key, scale, &limit, &step) ? &low : &high) = scale;
    }
    return low * FOUR_DIGITS;
}

static bool check_scale(Sim *sim, const Body *body, const SetKey *key, double value, char *why,
                        size_t why_size)
{
    double limit, step;
    if (scale_fits(sim, body, key, value, &limit, &step))
        return true;
    // Say how much would be allowed.
    snprintf(why, why_size,
             "%g needs a time step of at most %.4g s (%d a tick), and body %s runs at %.4g s (%d); "
             "take at most %.4g",
             value, limit, stability_substeps(sim->tick, limit), body->name, step,
             (int)lround(sim->tick / step),
             largest_scale(sim, body, key, present_scale(body, key), value));
    return false;
}

static void limit_scale(const Sim *sim, const Body *body, const SetKey *key, double *low,
                        double *high)
{
    double limit, step;
    if (!scale_fits(sim, body, key, *high, &limit, &step))
        *high = fmax(largest_scale(sim, body, key, *low, *high), present_scale(body, key));
}

// Where steps follow the level of detail they change at once.
static bool step_follows(const Sim *sim, const Body *body)
{
    return body_changes(body) || sim->ties != NULL;
}

static void apply_scale(Sim *sim, Body *body, const SetKey *key, double value)
{
    *scale_of(&body->tuning, key) = value;
    body->ops->set(body->model, key->parameter, value);
    if (step_follows(sim, body))
        time_step_follow(sim, body);
}

// --- cavities, within what their body's time step leaves room for ---

static bool read_cavity(const Body *body, const SetKey *key, double *value)
{
    double low, high;
    return body->ops->range != NULL && body->ops->range(body->model, key->parameter, &low, &high) &&
           read_parameter(body, key, value);
}

static void limit_cavity(const Sim *sim, const Body *body, const SetKey *key, double *low,
                         double *high)
{
    (void)sim;
    body->ops->range(body->model, key->parameter, low, high);
    *high *= FOUR_DIGITS;
}

static bool check_cavity(Sim *sim, const Body *body, const SetKey *key, double value, char *why,
                         size_t why_size)
{
    (void)sim;
    double least, most;
    body->ops->range(body->model, key->parameter, &least, &most);
    if (value > least && value <= most)
        return true;
    snprintf(why, why_size,
             "%s %g is outside (%.4g, %.4g], for which the time step of body %s leaves room",
             key->key, value, least, most * FOUR_DIGITS, body->name);
    return false;
}

// --- the others ---

static bool read_friction(const Body *body, const SetKey *key, double *value)
{
    (void)key;
    *value = body->tuning.friction;
    return true;
}

static void apply_friction(Sim *sim, Body *body, const SetKey *key, double value)
{
    (void)sim, (void)key;
    body->tuning.friction = value;
}

static bool read_adapt(const Body *body, const SetKey *key, double *value)
{
    return body->ops->adapt != NULL && read_parameter(body, key, value);
}

static void apply_parameter(Sim *sim, Body *body, const SetKey *key, double value)
{
    (void)sim;
    body->ops->set(body->model, key->parameter, value);
}

_Static_assert(LEVELS_MAX == 8, "the range of adapt_level");
#define RANGE(...)          BOUNDS(__VA_ARGS__)
#define BOUNDS(least, most) .low = (least), .high = (most), .range = "[" #least ", " #most "]"
#define PLAIN               .apply = apply_parameter, .read = read_parameter
#define SCALE               .check = check_scale, .apply = apply_scale, .read = read_scale, .limit = limit_scale
#define FRICTION            .apply = apply_friction, .read = read_friction
#define CAVITY                                                                                     \
    .check = check_cavity, .apply = apply_parameter, .read = read_cavity, .limit = limit_cavity
// A live run's governor sets them, too.
#define ADAPT                                                                                      \
    .stable = true, .apply = apply_parameter, .read = read_adapt,                                  \
    .lacks = "does not adapt its level of detail (levels, adapt; of a solid levels.surface)"
#define THRESHOLD                                                                                  \
    .stable = true, .apply = apply_parameter, .read = read_adapt,                                  \
    .lacks = "has no wall that adapts (levels, adapt)"
#define DRIVEN                                                                                     \
    .stable = true, .apply = apply_parameter, .read = read_adapt,                                  \
    .lacks = "is not steered by its error (adapt.error)"
static const SetKey KEYS[] = {
    {"gravity_x", BODY_GRAVITY_X, OF_SCENE, RANGE(-1e4, 1e4), PLAIN},
    {"gravity_y", BODY_GRAVITY_Y, OF_SCENE, RANGE(-1e4, 1e4), PLAIN},
    {"gravity_z", BODY_GRAVITY_Z, OF_SCENE, RANGE(-1e4, 1e4), PLAIN},
    {"stiffness_scale", BODY_STIFFNESS_SCALE, OF_BODIES, RANGE(0, 1e6), SCALE},
    {"damping_scale", BODY_DAMPING_SCALE, OF_BODIES, RANGE(0, 1e6), SCALE},
    {"friction", .reach = OF_BODIES, RANGE(FRICTION_RANGE), FRICTION},
    {"pressure", BODY_PRESSURE, OF_THOSE, RANGE(PRESSURE_RANGE), CAVITY,
     .lacks = "has no closed cavity"},
    {"volume", BODY_VOLUME, OF_THOSE, RANGE(0, 1e9), CAVITY,
     .lacks = "has no closed cavity with a gas or fluid in it"},
    {"adapt_force", BODY_ADAPT_FORCE, OF_THOSE, RANGE(ADAPT_RANGE), THRESHOLD},
    {"adapt_speed", BODY_ADAPT_SPEED, OF_THOSE, RANGE(ADAPT_RANGE), THRESHOLD},
    {"adapt_curvature", BODY_ADAPT_CURVATURE, OF_THOSE, RANGE(ADAPT_RANGE), THRESHOLD},
    {"adapt_scale", BODY_ADAPT_SCALE, OF_THOSE, RANGE(0, 1e+06), ADAPT},
    {"adapt_level", BODY_ADAPT_LEVEL, OF_THOSE, RANGE(0, 8), .whole = true, ADAPT},
    {"adapt_error", BODY_ADAPT_ERROR, OF_THOSE, RANGE(ERROR_RANGE), DRIVEN},
};
enum { KEY_COUNT = sizeof KEYS / sizeof *KEYS };

// Numbers of keys for the guard, whose state has them: gravity as a vector, then the rows. States
// of versions that did not number all keys have 0.
enum { NUMBER_UNKNOWN, NUMBER_GRAVITY, NUMBER_ROWS };

const char *setting_name(int64_t number)
{
    return number >= NUMBER_ROWS      ? KEYS[number - NUMBER_ROWS].key
           : number == NUMBER_GRAVITY ? "gravity"
                                      : "another key";
}

bool setting_is_numbered(int64_t number)
{
    return number >= 0 && number < NUMBER_ROWS + KEY_COUNT;
}

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
    const size_t name = strcspn(key, ".");
    if (body == NULL && key[name] == '.')
        snprintf(why, why_size, "unknown key %.40s: the scene has no body %.*s", key,
                 (int)(name < 40 ? name : 40), key);
    else if (body != NULL)
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

bool settings_check(const Sim *sim)
{
    char why[64];
    for (int b = 0; b < sim->body_count; b++) {
        const Body *body = &sim->body[b];
        for (int k = 0; k < KEY_COUNT; k++) {
            const SetKey *key = &KEYS[k];
            double now, own;
            if (!key->read(body, key, &now))
                continue;
            // A sealed cavity has what pressure its shape gives it, within no range.
            if (key->read == read_cavity ? !isfinite(now) : !check_value(key, now, why, sizeof why))
                return false;
            // What the body computes with is what the scene has.
            if (key->read == read_scale && read_parameter(body, key, &own) && own != now)
                return false;
        }
        if (body->tuning.bad_in_a_row < 0 || body->tuning.bad_in_a_row > sim->clock->step)
            return false;
    }
    return true;
}

bool sim_try_gravity(Vec3 gravity, char *why, size_t why_size)
{
    const bool fits = vec3_length(gravity) <= 1e4;
    snprintf(why, why_size,
             fits ? "gravity = (%g, %g, %g)" : "gravity (%g, %g, %g) is longer than 1e4", gravity.x,
             gravity.y, gravity.z);
    return fits;
}

bool sim_apply_gravity(Sim *sim, Vec3 gravity, char *why, size_t why_size)
{
    if (!sim_try_gravity(gravity, why, why_size))
        return false;
    // All bodies have one gravity, whatever their model.
    const double part[3] = {gravity.x, gravity.y, gravity.z};
    for (int b = 0; b < sim->body_count; b++)
        for (int axis = 0; axis < 3; axis++)
            sim->body[b].ops->set(sim->body[b].model, (BodyParameter)(BODY_GRAVITY_X + axis),
                                  part[axis]);
    guard_note_set(sim, -1, NUMBER_GRAVITY);
    return true;
}

// Returns the body of "<body>.key", and moves `key` behind the point; NULL: the key names none.
static const Body *take_body(const Sim *sim, const char **key)
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

// What a request to SET means: a row of KEYS and the bodies that it would change.
typedef struct Setting {
    const SetKey *key;
    int first, end; // bodies: those of them that have it
    bool named;     // it names its body
} Setting;

static bool find_setting(Sim *sim, const char *text, Setting *found, char *why, size_t why_size)
{
    // "<body>.key" names one body, a key alone all of them.
    const char *name = text;
    const Body *body = take_body(sim, &name);
    const SetKey *key = find_key(name);
    if (key == NULL || (body != NULL && key->reach == OF_SCENE))
        return fail_unknown(body, name, why, why_size);
    const int first = body != NULL ? (int)(body - sim->body) : 0;
    *found = (Setting){key, first, body != NULL ? first + 1 : sim->body_count, body != NULL};
    return true;
}

// Whether SET may do it: all bodies are asked before any is changed.
static bool check_setting(Sim *sim, const Setting *set, double value, char *why, size_t why_size)
{
    const SetKey *key = set->key;
    if (!check_value(key, value, why, why_size))
        return false;
    int count = 0;
    for (int b = set->first; b < set->end; b++) {
        const Body *body = &sim->body[b];
        double now;
        const bool has = key->read(body, key, &now);
        if (!has && key->reach == OF_BODIES) {
            snprintf(why, why_size, "body %s has no such parameter", body->name);
            return false;
        }
        count += has;
        if (has && key->check != NULL && !key->check(sim, body, key, value, why, why_size))
            return false;
    }
    if (count > 0 || key->reach == OF_SCENE)
        return true;
    // Nobody has it, or the body that was named has not.
    snprintf(why, why_size, "%s%s %s", set->named ? "body " : "the scene",
             set->named ? sim->body[set->first].name : "", key->lacks);
    return false;
}

bool sim_apply_set(Sim *sim, const char *key, double value, char *why, size_t why_size)
{
    Setting set;
    if (!find_setting(sim, key, &set, why, why_size) ||
        !check_setting(sim, &set, value, why, why_size))
        return false;
    double now;
    for (int b = set.first; b < set.end; b++)
        if (set.key->read(&sim->body[b], set.key, &now))
            set.key->apply(sim, &sim->body[b], set.key, value);
    if (!set.key->stable)
        guard_note_set(sim, set.named ? set.first : -1, NUMBER_ROWS + (int)(set.key - KEYS));
    return true;
}

// --- what SET would do ---

// What a try of a scale changes for a moment.
typedef struct Step {
    BodyTuning tuning;
    int substeps;
    double h, limit, barrier;
} Step;

static void keep_steps(const Sim *sim, Step *step)
{
    for (int b = 0; b < sim->body_count; b++) {
        const Body *body = &sim->body[b];
        step[b] = (Step){body->tuning, body->substeps, body->h, body->time_step_limit,
                         body->contact_barrier};
    }
}

static void restore_steps(Sim *sim, const Step *step)
{
    for (int b = 0; b < sim->body_count; b++) {
        Body *body = &sim->body[b];
        body->tuning = step[b].tuning;
        body->substeps = step[b].substeps;
        body->h = step[b].h;
        body->time_step_limit = step[b].limit;
        body->contact_barrier = step[b].barrier;
    }
}

// Writes what a scale does to the steps, and sets how much longer ticks are expected to take.
static void try_scale(Sim *sim, const Setting *set, double value, double *longer, char *text,
                      size_t size)
{
    Step before[SIM_BODIES] = {0};
    keep_steps(sim, before);
    for (int b = set->first; b < set->end; b++) {
        Body *body = &sim->body[b];
        *scale_of(&body->tuning, set->key) = value;
        if (step_follows(sim, body))
            time_step_follow(sim, body);
    }
    // The body whose steps change most stands for all.
    int most = set->first;
    double cost = 0.0, cost_before = 0.0;
    for (int b = 0; b < sim->body_count; b++) {
        const Body *body = &sim->body[b];
        cost += cost_tick(body, body->substeps);
        cost_before += cost_tick(body, before[b].substeps);
        if (abs(body->substeps - before[b].substeps) >
            abs(sim->body[most].substeps - before[most].substeps))
            most = b;
    }
    *longer = cost / cost_before;
    const Body *body = &sim->body[most];
    const bool changes = body->substeps != before[most].substeps;
    snprintf(text, size,
             changes ? ": %d substeps a tick instead of %d" : ": %d substeps a tick as now",
             body->substeps, before[most].substeps);
    restore_steps(sim, before);
}

bool sim_try_set(Sim *sim, const char *key, double value, double *longer, char *why,
                 size_t why_size)
{
    *longer = 0.0;
    Setting set;
    if (!find_setting(sim, key, &set, why, why_size) ||
        !check_setting(sim, &set, value, why, why_size))
        return false;
    // What it is now, where that is one number.
    double now = 0.0;
    size_t length = (size_t)snprintf(why, why_size, "%s = %g", key, value);
    if ((set.end == set.first + 1 || set.key->reach == OF_SCENE) && length < why_size &&
        set.key->read(&sim->body[set.first], set.key, &now))
        length += (size_t)snprintf(why + length, why_size - length, " instead of %.4g", now);
    if (set.key->apply == apply_scale && length < why_size)
        try_scale(sim, &set, value, longer, why + length, why_size - length);
    return true;
}

bool sim_tell_setting(Sim *sim, const char *key, char *text, size_t size)
{
    double x = 0.0, y = 0.0, z = 0.0;
    if (strcmp(key, "gravity") == 0) {
        const BodyOps *ops = sim->body[0].ops;
        const void *model = sim->body[0].model;
        const bool has = ops->get(model, BODY_GRAVITY_X, &x) &&
                         ops->get(model, BODY_GRAVITY_Y, &y) && ops->get(model, BODY_GRAVITY_Z, &z);
        snprintf(text, size, "gravity = (%.9g, %.9g, %.9g)", x, y, z);
        return has;
    }
    Setting set;
    if (!find_setting(sim, key, &set, text, size))
        return false;
    if (set.end != set.first + 1 && set.key->reach != OF_SCENE) {
        snprintf(text, size, "%s may differ between bodies: ask for <body>.%s", key, key);
        return false;
    }
    const Body *body = &sim->body[set.first];
    double low = set.key->low, high = set.key->high;
    if (!set.key->read(body, set.key, &x)) {
        snprintf(text, size, "body %s %s", body->name,
                 set.key->lacks != NULL ? set.key->lacks : "has no such parameter");
        return false;
    }
    if (set.key->limit != NULL)
        set.key->limit(sim, body, set.key, &low, &high);
    snprintf(text, size, "%s = %.9g, from %.4g to %.4g", key, x, low, high);
    return true;
}

void sim_list_settings(const Sim *sim, int body, char *text, size_t size)
{
    size_t length = 0;
    double now;
    text[0] = '\0';
    for (int k = 0; k < KEY_COUNT && length < size; k++)
        if (KEYS[k].reach != OF_SCENE && KEYS[k].read(&sim->body[body], &KEYS[k], &now))
            length += (size_t)snprintf(text + length, size - length, "%s%s", length > 0 ? ", " : "",
                                       KEYS[k].key);
}
