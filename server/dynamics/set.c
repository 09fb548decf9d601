// Parameters of bodies that change while a scene runs (sim_apply_set, sim_apply_gravity). Step
// thread, between two ticks.
#include "dynamics/sim_data.h"

#include "geometry/levels.h"

#include <stdio.h>
#include <string.h>

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

// Sets stiffness_scale or damping_scale of one body, within the stability bound of its step.
static bool set_scale(Sim *sim, Body *body, BodyParameter parameter, double value, char *why,
                      size_t why_size)
{
    double *scale = parameter == BODY_STIFFNESS_SCALE ? &body->tuning.stiffness_scale
                                                      : &body->tuning.damping_scale;
    double before = *scale, limit, step;
    *scale = value;
    if (!time_step_allows(sim, body, body->tuning.stiffness_scale, body->tuning.damping_scale,
                          &limit, &step)) {
        double most = largest_scale(sim, body, scale, before, value);
        *scale = before;
        snprintf(why, why_size,
                 "%g needs a time step of at most %.4g s, and body %s runs at %.4g s; take at most "
                 "%.4g",
                 value, limit, body->name, step, most);
        return false;
    }
    if (!body->ops->set(body->model, parameter, value)) {
        *scale = before;
        snprintf(why, why_size, "body %s has no such parameter", body->name);
        return false;
    }
    if (body_changes(body))
        time_step_follow(sim, body);
    return true;
}

// Parameters of bodies with levels of detail.
typedef struct AdaptKey {
    const char *key;
    BodyParameter parameter;
    double most; // from 0
    bool whole;  // an integer
} AdaptKey;

static const AdaptKey *find_adapt_key(const char *key)
{
    static const AdaptKey keys[] = {
        {"adapt_force", BODY_ADAPT_FORCE, 1e6, false},
        {"adapt_speed", BODY_ADAPT_SPEED, 1e6, false},
        {"adapt_curvature", BODY_ADAPT_CURVATURE, 1e6, false},
        {"adapt_scale", BODY_ADAPT_SCALE, 1e6, false},
        {"adapt_level", BODY_ADAPT_LEVEL, LEVELS_MAX, true},
    };
    for (size_t k = 0; k < sizeof keys / sizeof *keys; k++)
        if (strcmp(key, keys[k].key) == 0)
            return &keys[k];
    return NULL;
}

// Sets it for one body, or (NULL) for all with levels.
static bool set_adapt(Sim *sim, Body *body, const AdaptKey *key, double value, char *why,
                      size_t why_size)
{
    if (!(value >= 0.0 && value <= key->most && (!key->whole || value == floor(value)))) {
        snprintf(why, why_size, "%s %g %s [0, %g]", key->key, value,
                 key->whole ? "is not a whole number in" : "outside", key->most);
        return false;
    }
    int count = 0;
    for (int b = 0; b < sim->body_count; b++) {
        Body *at = &sim->body[b];
        if ((body == NULL || at == body) && at->ops->adapt != NULL)
            count += at->ops->set(at->model, key->parameter, value);
    }
    if (count == 0)
        snprintf(why, why_size, "%s%s does not adapt its level of detail (levels, adapt)",
                 body == NULL ? "the scene" : "body ", body == NULL ? "" : body->name);
    return count > 0;
}

static bool set_body(Sim *sim, Body *body, const char *key, double value, char *why,
                     size_t why_size)
{
    bool stiffness = strcmp(key, "stiffness_scale") == 0;
    if (stiffness || strcmp(key, "damping_scale") == 0) {
        if (!(value >= 0.0 && value <= 1e6)) {
            snprintf(why, why_size, "%s %g outside [0, 1e6]", key, value);
            return false;
        }
        return set_scale(sim, body, stiffness ? BODY_STIFFNESS_SCALE : BODY_DAMPING_SCALE, value,
                         why, why_size);
    }
    if (strcmp(key, "friction") == 0) {
        if (!(value >= 0.0 && value <= 10.0)) {
            snprintf(why, why_size, "friction %g outside [0, 10]", value);
            return false;
        }
        body->tuning.friction = value;
        return true;
    }
    const AdaptKey *adapt = find_adapt_key(key);
    if (adapt != NULL)
        return set_adapt(sim, body, adapt, value, why, why_size);
    snprintf(why, why_size,
             "unknown key %s; of a body: stiffness_scale, damping_scale, friction, "
             "adapt_force|speed|curvature|scale|level",
             key);
    return false;
}

// A key without a body's name changes every body, or none if one refuses.
static bool set_every_body(Sim *sim, const char *key, double value, char *why, size_t why_size)
{
    BodyTuning before[SIM_BODIES];
    for (int b = 0; b < sim->body_count; b++) {
        before[b] = sim->body[b].tuning;
        if (set_body(sim, &sim->body[b], key, value, why, why_size))
            continue;
        for (int k = 0; k < b; k++) {
            Body *body = &sim->body[k];
            body->tuning = before[k];
            body->ops->set(body->model, BODY_STIFFNESS_SCALE, before[k].stiffness_scale);
            body->ops->set(body->model, BODY_DAMPING_SCALE, before[k].damping_scale);
            if (body_changes(body))
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
    const double part[3] = {gravity.x, gravity.y, gravity.z};
    for (int b = 0; b < sim->body_count; b++)
        for (int axis = 0; axis < 3; axis++)
            sim->body[b].ops->set(sim->body[b].model, (BodyParameter)(BODY_GRAVITY_X + axis),
                                  part[axis]);
    guard_note_set(sim, -1, "gravity");
    return true;
}

static bool set(Sim *sim, const char *key, double value, char *why, size_t why_size)
{
    static const char *const axes[3] = {"gravity_x", "gravity_y", "gravity_z"};
    // Gravity is that of all bodies.
    for (int axis = 0; axis < 3; axis++) {
        if (strcmp(key, axes[axis]) != 0)
            continue;
        if (!(fabs(value) <= 1e4)) {
            snprintf(why, why_size, "%s %g outside [-1e4, 1e4]", key, value);
            return false;
        }
        for (int b = 0; b < sim->body_count; b++)
            sim->body[b].ops->set(sim->body[b].model, (BodyParameter)(BODY_GRAVITY_X + axis),
                                  value);
        return true;
    }
    // "<body>.key", then keys of every body.
    for (int b = 0; b < sim->body_count; b++) {
        size_t length = strlen(sim->body[b].name);
        if (strncmp(key, sim->body[b].name, length) == 0 && key[length] == '.')
            return set_body(sim, &sim->body[b], key + length + 1, value, why, why_size);
    }
    static const char *const common[3] = {"stiffness_scale", "damping_scale", "friction"};
    for (int k = 0; k < 3; k++)
        if (strcmp(key, common[k]) == 0)
            return set_every_body(sim, key, value, why, why_size);
    const AdaptKey *adapt = find_adapt_key(key);
    if (adapt != NULL)
        return set_adapt(sim, NULL, adapt, value, why, why_size);
    snprintf(why, why_size,
             "unknown key %.40s; known: gravity, gravity_x|y|z, and for all bodies or as "
             "<body>.key: stiffness_scale, damping_scale, friction, "
             "adapt_force|speed|curvature|scale|level",
             key);
    return false;
}

bool sim_apply_set(Sim *sim, const char *key, double value, char *why, size_t why_size)
{
    if (!set(sim, key, value, why, why_size))
        return false;
    int body = -1; // all
    for (int b = sim->body_count - 1; b >= 0; b--) {
        size_t length = strlen(sim->body[b].name);
        if (strncmp(key, sim->body[b].name, length) == 0 && key[length] == '.')
            body = b;
    }
    guard_note_set(sim, body, body < 0 ? key : key + strlen(sim->body[body].name) + 1);
    return true;
}
