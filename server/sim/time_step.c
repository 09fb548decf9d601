// SPDX-License-Identifier: MIT
// The time step of each body: from its own bounds, those of every tool that may touch it, and the
// scales of its stiffness and damping. No allocation: safe for the step thread.
#include "sim/time_step.h"

#include "sim/hold/tie.h"

#include "body/integrator.h"

#include <stdio.h>
#include <string.h>

enum { MOST_SUBSTEPS = 100000 };
static const double ROUNDING = 1.0 + 1e-9; // tolerance, as in stability_substeps

// Implicit bodies: external forces are explicit, at x + theta h v. An oscillator lambda with
// damping c advances by a matrix of determinant 1 - h c + (1 - 2 theta) h^2 lambda and trace 2 - h
// c - 2 theta h^2 lambda: stable for (4 theta - 1) h^2 lambda + 2 h c <= 4, which is leapfrog's
// bound for (4 theta - 1) lambda. The body's own springs add to neither: with the mass m + (theta
// h)^2 k they only reduce h^2 lambda.

// Returns the largest stable step of a body with bounds `lambda` and `damping` of its own and every
// tool. `now`: with the ties by message of now, which shorten steps but no bound of the scene, and
// without contact of the body with itself while nothing is near.
static double bound(const Sim *sim, const Body *body, double lambda, double damping,
                    double stiffness_scale, double damping_scale, bool now)
{
    // The body's own springs: implicit ones do not count, softer ones are not relied on.
    const bool implicit = body->integrator == INTEGRATOR_IMPLICIT;
    lambda *= implicit ? 0.0 : fmax(1.0, stiffness_scale);
    damping *= implicit ? 0.0 : fmax(1.0, stiffness_scale * damping_scale);
    damping += body->drag * fmax(1.0, damping_scale);
    // Whatever may touch or hold the body, each at its worst.
    for (int t = 0; t < sim->tool_count; t++) {
        const ToolOptions *tool = &sim->tool[t];
        double more_lambda, more_damping, held_lambda = 0.0, held_damping = 0.0;
        contact_bounds(body, tool, &more_lambda, &more_damping);
        // It pushes the body or grasps it, never both; bodies of kicks it grasps implicitly.
        if (tool->kind == TOOL_GRASPER && !integrator_is_symplectic(body->integrator))
            attachment_bounds(body, tool->grip_stiffness, tool->grip_damping, &held_lambda,
                              &held_damping);
        lambda += fmax(more_lambda, held_lambda);
        damping += fmax(more_damping, held_damping);
    }
    // Attachments and ties of the scene, at either end.
    for (int k = 0; k < sim->scene_attachment_count; k++) {
        const AttachmentOptions *options = attachment_options(sim->scene_attachment[k]);
        double more_lambda, more_damping;
        if (&sim->body[options->body] != body &&
            (options->to != ATTACH_BODY || &sim->body[options->to_body] != body))
            continue;
        attachment_bounds(body, options->stiffness, options->damping_ratio, &more_lambda,
                          &more_damping);
        lambda += more_lambda;
        damping += more_damping;
    }
    if (now && sim->ties != NULL) {
        lambda += sim->ties->lambda[body - sim->body];
        damping += sim->ties->damping[body - sim->body];
    }
    // Contact with other bodies.
    for (int k = 0; k < sim->touch_count; k++) {
        const TouchOptions *options = touch_options(sim->touch[k]);
        double more_lambda, more_damping;
        if ((&sim->body[options->body[0]] != body && &sim->body[options->body[1]] != body) ||
            (now && !touch_shortens(sim->touch[k])))
            continue;
        touch_bounds(options, body, &more_lambda, &more_damping);
        lambda += more_lambda;
        damping += more_damping;
    }
    // See above: what leapfrog allows for so many times lambda.
    if (implicit)
        lambda *= 4.0 * body->theta - 1.0;
    return stability_time_step(body->integrator, lambda, damping);
}

static double finest_bound(const Sim *sim, const Body *body, double stiffness_scale,
                           double damping_scale)
{
    return bound(sim, body, fmax(body->lambda, body->finest_lambda),
                 fmax(body->damping, body->finest_damping), stiffness_scale, damping_scale, false);
}

// Returns the substeps that the body needs by itself.
static int count_substeps(const Sim *sim, Body *body)
{
    body->time_step_limit = bound(sim, body, body->lambda, body->damping,
                                  body->tuning.stiffness_scale, body->tuning.damping_scale, true);
    double wanted = body->time_step_limit;
    if (body->time_step_wanted > 0.0)
        wanted =
            body->unsafe_time_step ? body->time_step_wanted : fmin(wanted, body->time_step_wanted);
    int substeps = stability_substeps(sim->tick, wanted);
    return substeps < MOST_SUBSTEPS ? substeps : MOST_SUBSTEPS;
}

// Contact has the stiffness of the coarsest level, as a wall should feel the same at every level.
// But that lets a tool deep into the small faces of a finer one, which it would only push aside:
// near the axis contact is as much stiffer as that level, as far as the step has room for it. A
// power of two, since the bounds change with every face.
static void set_barrier(const Sim *sim, Body *body)
{
    double contacts = 0.0;
    for (int t = 0; t < sim->tool_count; t++) {
        double lambda, damping;
        contact_bounds(body, &sim->tool[t], &lambda, &damping);
        contacts += lambda;
    }
    const double spare = body->time_step_limit / body->h;
    const double most = fmin(body->lambda / body->contact_lambda - 1.0,
                             (spare * spare - 1.0) * body->lambda / contacts);
    body->contact_barrier = 0.0;
    if (!(contacts > 0.0) || body->integrator == INTEGRATOR_IMPLICIT || !(most >= 1.0))
        return;
    for (body->contact_barrier = 1.0; 2.0 * body->contact_barrier <= most;)
        body->contact_barrier *= 2.0;
}

void time_step_follow(Sim *sim, Body *body)
{
    const int first = sim->group[body - sim->body].first;
    int substeps = 1;
    for (int b = first; b >= 0; b = sim->group[b].next) {
        const int needed = count_substeps(sim, &sim->body[b]);
        substeps = needed > substeps ? needed : substeps;
    }
    for (int b = first; b >= 0; b = sim->group[b].next) {
        sim->body[b].substeps = substeps;
        sim->body[b].h = sim->tick / substeps;
        set_barrier(sim, &sim->body[b]);
    }
}

void time_step_join(Sim *sim)
{
    if (sim->joint_count == 0 && sim->touch_count == 0)
        return;
    for (int b = 0; b < sim->body_count; b++) {
        Body *first = &sim->body[sim->group[b].first], *body = &sim->body[b];
        if (body->finest_substeps > first->finest_substeps)
            first->finest_substeps = body->finest_substeps;
    }
    for (int b = 0; b < sim->body_count; b++) {
        sim->body[b].finest_substeps = sim->body[sim->group[b].first].finest_substeps;
        time_step_follow(sim, &sim->body[b]);
    }
}

int sim_undamped_substeps(Sim *sim, int index)
{
    Body *body = &sim->body[index];
    const Body own = *body;
    body->damping = body->drag = 0.0;
    const int substeps = count_substeps(sim, body);
    *body = own;
    return substeps;
}

double time_step_bound(const Sim *sim, const Body *body)
{
    return finest_bound(sim, body, 1.0, 1.0);
}

void time_step_cap_contacts(const Sim *sim, Body *body)
{
    // Steps of explicit bodies allow for their contacts, those of implicit ones may not.
    const double asked = body->contact_lambda;
    body->contact_share = 1.0;
    if (body->integrator != INTEGRATOR_IMPLICIT)
        return;
    // The substep that the tick is divided into.
    const double wanted = body->time_step_wanted > 0.0 ? body->time_step_wanted : sim->tick;
    const double h = sim->tick / stability_substeps(sim->tick, wanted);
    if (finest_bound(sim, body, 1.0, 1.0) >= h) // fits as it is
        return;
    // The share may be very small: search by its magnitude.
    double low = -300.0, high = 0.0; // of log10 of the share, by bisection
    for (int i = 0; i < 60; i++) {
        double middle = 0.5 * (low + high);
        body->contact_lambda = asked * pow(10.0, middle);
        if (finest_bound(sim, body, 1.0, 1.0) >= h)
            low = middle;
        else
            high = middle;
    }
    // What fits stays, and is told.
    body->contact_share = pow(10.0, low);
    body->contact_lambda = asked * body->contact_share;
}

// Returns advice for bodies whose explicit steps are too long.
static const char *way_out(const Body *body)
{
    return body->spring_count > 0 ? ", or integrator = \"implicit\" or \"auto\"" : "";
}

// Refuses a number of substeps beyond the limit.
static bool refuse_substeps(Sim *sim, Body *body, double wanted, double limit, Status *status)
{
    // The shortest step for the scene's rate, and the least rate for a stable step.
    enum { MOST_RATE = 10000 }; // [Hz] highest rate of a scene
    const double least = sim->tick / MOST_SUBSTEPS, rate = 1.0001 / (limit * MOST_SUBSTEPS);
    char bound[80] = "", nearest[256] = "", other[112] = "";
    // The bound, if there is one.
    if (isfinite(limit))
        snprintf(bound, sizeof bound, "; the stability bound of %s is %.3g s",
                 integrator_name(body->integrator), limit);
    // A longer step is stable: that alone would do.
    if (least <= limit) {
        snprintf(nearest, sizeof nearest, "; take a time_step of at least %.4g s",
                 least * (1.0 + 1e-4));
    } else {
        char faster[48] = ", or less stiffness or more mass"; // no rate is high enough
        if (rate <= MOST_RATE)
            snprintf(faster, sizeof faster, ", or a rate_hz of at least %.4g", rate);
        time_step_advise(sim, body, least, other, sizeof other);
        // Otherwise list the ways out.
        const char *ways[] = {faster, other, way_out(body)};
        for (int k = 0; k < 3; k++) { // ", or this, or that": the first opens the advice
            const size_t at = strlen(nearest);
            const bool first = at == 0 && ways[k][0] != '\0';
            snprintf(nearest + at, sizeof nearest - at, "%s%s", first ? "; take" : "",
                     first ? ways[k] + strlen(", or") : ways[k]);
        }
    }
    return status_fail(status, STATUS_INVALID,
                       "body %s: a time step of %.3g s needs more than %d substeps a tick of %g "
                       "s%s%s",
                       body->name, wanted, MOST_SUBSTEPS, sim->tick, bound, nearest);
}

static bool refuse_length(Sim *sim, Body *body, double h, double limit, Status *status)
{
    const int substeps = stability_substeps(sim->tick, limit);
    char other[112];
    time_step_advise(sim, body, h, other, sizeof other);
    return status_fail(status, STATUS_INVALID,
                       "body %s: time_step %.6g s is above the stability bound %.6g s of %s%s; "
                       "take at most that, %.10g s (%d a tick)%s, or set unsafe_time_step = true",
                       body->name, h, limit, integrator_name(body->integrator),
                       body->finest_lambda > 0.0 ? " at the finest level" : "",
                       sim->tick / substeps, substeps, other);
}

// Limit of an implicit step: ratio of a mesh's longest edge squared to its smallest face, that is
// lambda h^2 of the stiffest spring on the lightest node. Sheets of 0.1 m by a micrometre or less
// made 1e9 times the energy of a push, or were restored again and again; even meshes are correct at
// any stiffness beside which double precision does not lose their masses.
static const double UNEVEN = 1e5, UNEVEN_MOST = 1e10, LOST = 1e16;

static bool refuse_uneven(const Body *body, Status *status)
{
    // The longest edge against the smallest face tells how uneven the mesh is.
    const double lambda = fmax(body->lambda, body->finest_lambda),
                 longest = body->surface.longest_edge;
    double least = longest * longest;
    for (int f = 0; f < body->surface.face_used; f++)
        if (body_face_area(&body->surface, f) > 0.0)
            least = fmin(least, body_face_area(&body->surface, f));
    const double ratio = lambda * body->h * body->h;
    const bool even = longest * longest <= UNEVEN * least;
    if (even && ratio > LOST)
        return status_fail(status, STATUS_INVALID,
                           "body %s: stiffness over mass times time_step^2 is %.3g, beyond %.3g: "
                           "double precision loses the masses; take more mass or less stiffness, "
                           "or set unsafe_time_step = true",
                           body->name, ratio, LOST);
    if (even)
        return true;
    return status_fail(
        status, STATUS_INVALID,
        "body %s: its mesh is too uneven (longest edge %.3g m, smallest face %.3g "
        "m2) for an implicit step of %.3g s: stiffness over mass times time_step^2 "
        "is %.3g, beyond %.3g; take a time_step of at most %.3g s, less stiffness or "
        "more mass, or an even mesh, or set unsafe_time_step = true",
        body->name, longest, least, body->h, ratio, UNEVEN_MOST,
        0.999 * sqrt(UNEVEN_MOST / lambda));
}

bool time_step_choose(Sim *sim, Body *body, Status *status)
{
    // The wanted step, or the longest stable one.
    double limit = finest_bound(sim, body, 1.0, 1.0);
    double wanted = body->time_step_wanted > 0.0 ? body->time_step_wanted : limit;
    if (!(sim->tick / wanted <= MOST_SUBSTEPS))
        return refuse_substeps(sim, body, wanted, limit, status);
    // As many equal substeps as it takes, checked against the bound.
    body->finest_substeps = stability_substeps(sim->tick, wanted);
    double h = sim->tick / body->finest_substeps;
    if (h > limit * ROUNDING && !body->unsafe_time_step)
        return refuse_length(sim, body, h, limit, status);
    // From the finest level to the present one.
    time_step_follow(sim, body);
    // An implicit step has no bound, but may be too much for an uneven mesh.
    const double lambda = fmax(body->lambda, body->finest_lambda);
    if (body->integrator == INTEGRATOR_IMPLICIT && lambda * h * h > UNEVEN_MOST &&
        !body->unsafe_time_step)
        return refuse_uneven(body, status);
    return true;
}

bool time_step_allows(const Sim *sim, const Body *body, double stiffness_scale,
                      double damping_scale, double *limit, double *step)
{
    *limit = finest_bound(sim, body, stiffness_scale, damping_scale);
    // Where the finest level is not known before the body is refined or cut, it may take as many
    // substeps as it needs there without scales.
    const int own = stability_substeps(sim->tick, finest_bound(sim, body, 1.0, 1.0));
    *step = sim->tick / (own > body->finest_substeps ? own : body->finest_substeps);
    return *step <= *limit * ROUNDING || body->unsafe_time_step;
}

// --- advice ---
// For a scene that is refused because its steps would be unstable: which of its keys would have to
// be how much smaller. Load time only.

// Keys that shorten the bound, each by itself. The first with a reasonable change is advised: the
// tissue's material comes last.
typedef enum Knob {
    KNOB_CONTACT_DAMPING,
    KNOB_GRIP_DAMPING,
    KNOB_CONTACT,
    KNOB_GRIP,
    KNOB_DAMPING,
    KNOB_STIFFNESS,
    KNOB_COUNT,
} Knob;

static const double LEAST = 1e-15; // practically zero
static const double WORTH = 1e-4;  // a smaller factor would leave nothing of it

static void turn(Sim *sim, Body *body, Knob knob, double factor)
{
    // What the key scales, in all that it enters.
    switch (knob) {
    case KNOB_STIFFNESS: // contacts take their share of it
        body->lambda *= factor;
        body->finest_lambda *= factor;
        body->contact_lambda *= factor;
        break;
    case KNOB_DAMPING:
        body->damping *= factor;
        body->finest_damping *= factor;
        body->drag *= factor;
        break;
    case KNOB_CONTACT:
        body->contact_ratio *= factor;
        break;
    case KNOB_CONTACT_DAMPING:
        body->contact_damping *= factor;
        break;
    default:
        for (int t = 0; t < sim->tool_count; t++)
            *(knob == KNOB_GRIP ? &sim->tool[t].grip_stiffness : &sim->tool[t].grip_damping) *=
                factor;
    }
}

// A value that is at most `x`, in three digits.
static double round_down(double x)
{
    double unit = pow(10.0, floor(log10(x)) - 2.0);
    return floor(x / unit) * unit;
}

static void describe(const Sim *sim, const Body *body, Knob knob, double factor, char *text,
                     size_t size)
{
    // The value that the scene has, of the worst grasper.
    double grip = 0.0, grip_damping = 0.0;
    for (int t = 0; t < sim->tool_count; t++) {
        if (sim->tool[t].kind != TOOL_GRASPER)
            continue;
        grip = fmax(grip, sim->tool[t].grip_stiffness);
        grip_damping = fmax(grip_damping, sim->tool[t].grip_damping);
    }
    static const char *const names[KNOB_COUNT] = {
        "contact.damping_time of at most",      "grip_damping_ratio of at most",
        "contact.stiffness of at most",         "grip_stiffness of at most",
        "damping (material, shape) of at most", "a stiffness (material, shape) of at most",
    };
    static const char *const units[KNOB_COUNT] = {" s", "", "", "", " times that", " times that"};
    // The key, and the value that it may have at most.
    const double value[KNOB_COUNT] = {
        body->contact_damping, grip_damping, body->contact_ratio, grip, 1.0, 1.0};
    snprintf(text, size, ", or %s %.3g%s", names[knob], round_down(factor * value[knob]),
             units[knob]);
}

// Returns the largest factor, up to 1, with which the body can take steps of h; 0: none.
static double find_factor(Sim *sim, Body *body, Knob knob, double h)
{
    // The knob is turned in place: keep what it turns.
    const Body own = *body;
    ToolOptions tools[SIM_TOOLS];
    const size_t bytes = (size_t)sim->tool_count * sizeof *tools;
    if (bytes > 0) // without tools there is no array
        memcpy(tools, sim->tool, bytes);
    // Even the least value may not be enough: try that first.
    double low = log10(LEAST), high = 0.0;
    for (int i = 0; i <= 50; i++) {
        const double middle = i == 0 ? low : 0.5 * (low + high);
        turn(sim, body, knob, pow(10.0, middle));
        // Does it fit? Then undo it.
        const bool fits = time_step_bound(sim, body) >= h;
        *body = own;
        if (bytes > 0)
            memcpy(sim->tool, tools, bytes);
        if (i == 0 && !fits)
            return 0.0;
        *(fits ? &low : &high) = middle;
    }
    return pow(10.0, low);
}

void time_step_advise(Sim *sim, Body *body, double h, char *text, size_t size)
{
    Knob best = KNOB_COUNT;
    double factor = 0.0;
    for (Knob knob = 0; knob < KNOB_COUNT && factor < WORTH; knob++) {
        double found = find_factor(sim, body, knob, h);
        if (found > factor) {
            factor = found;
            best = knob;
        }
    }
    text[0] = '\0';
    if (best < KNOB_COUNT)
        describe(sim, body, best, factor, text, size);
}

void time_step_group(Sim *sim, int a, int b)
{
    const int from = sim->group[a].first, to = sim->group[b].first, first = from < to ? from : to;
    int last = -1;
    // Members of both groups are linked anew, in ascending order.
    for (int i = 0; i < sim->body_count; i++) {
        GroupMember *member = &sim->group[i];
        if (member->first != from && member->first != to)
            continue;
        *member = (GroupMember){.first = first, .next = -1};
        if (last >= 0)
            sim->group[last].next = i;
        last = i;
    }
}
