// SPDX-License-Identifier: MIT
// One cell of the matrix: a scene as text is read, built and run like any other; what came of it is
// judged by statements that do not depend on how the body computes.
#include "trial.h"
#include "scoped.h"

#include "base/check.h"
#include "body/integrator.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { SCENE_TEXT = 8192, CUTS_ALONG = 8 };

#define LOAD_S 0.1 // how long loads and tools act [s]
// A body is at rest when no node is farther from its place than this share of the body's size, at
// REST_LOOKS ticks in a row, spread over as many hundredths of a second: a tenth of what an eye
// sees, a thousand times what single precision rounds.
#define REST_SHARE 1e-3
enum { REST_LOOKS = 5, RESETS_MOST = 200 };
// More than that times its energy at first is energy out of nothing; less, and more than is
// allowed, needs a remark.
#define SWELL 1e3
// It stands still elsewhere when so slow [sizes/s] for a second: what is on its way is faster.
#define STILL 1e-6
enum { STILL_LOOKS = 100 };
// A press goes in, and is held; its last second is looked at.
#define PRESS_IN_S   0.3
#define PRESS_HELD_S 2.0
#define TOOL_RADIUS  0.01 // [m]
// A hand feels changes of force of a tenth. A body that is pressed follows its tool: a node that
// moves three times as far as that is on its own way.
#define FORCE_SWING   0.1
#define FARTHEST_MOVE 3.0
// How long a body has to come to rest: whichever ends later. Surface bodies lose a factor of e in
// 1/15 s (shape springs); elements lose energy by the step.
#define REST_S        1.5
#define REST_SUBSTEPS 25000.0

typedef struct Trial {
    Cell *cell;
    const Model *model;
    const Case *at;
    const char *integrator, *folder, *prefix;
    char text[SCENE_TEXT];
    Scene scene;
    World world;
    Body *body;
    float *snapshot;
    double size;    // [m]
    double impulse; // bound of the energy that the load can have brought [J]; infinite: unknown
    double brought; // the same with what the body had before
} Trial;

const char *verdict_word(Verdict verdict)
{
    static const char *const words[VERDICT_COUNT] = {"FAILED", "refused", "reset",   "trembles",
                                                     "sinks",  "swelled", "bounded", "rest"};
    return words[verdict];
}

// ---------------------------------------------------------------------------------------------
// The scene

static const char *value_of(const Trial *trial, const char *key)
{
    const Key *given = case_keys(trial->at, trial->model);
    for (int i = 0; i < CASE_KEYS && given[i].key != NULL; i++)
        if (strcmp(given[i].key, key) == 0)
            return given[i].value;
    for (int i = 0; i < MODEL_KEYS && trial->model->key[i].key != NULL; i++)
        if (strcmp(trial->model->key[i].key, key) == 0)
            return trial->model->key[i].value;
    return NULL;
}

// The top, where loads act and tools lie in the outside.
static Vec3 top_of(const Trial *trial)
{
    const double half = trial->model->kind == KIND_VOXEL ? 0.025 : 0.05;
    return trial->model->kind == KIND_PLANE ? (Vec3){0.0, half, 0.0} : (Vec3){0.0, 0.0, half};
}

static const char *tools_of(const Trial *trial, char text[400])
{
    const Drive drive = trial->at->drive;
    const bool is_static = drive == DRIVE_TOOL_STAY || drive == DRIVE_TOOL_WALL;
    text[0] = '\0';
    if (!is_static && drive != DRIVE_TOOL_FAST && drive != DRIVE_TOOL_IN && drive != DRIVE_PRESS &&
        drive != DRIVE_GRASP && drive != DRIVE_STROKE)
        return text;
    if (drive == DRIVE_STROKE)
        return "tools = ( { id = 1;  kind = \"blade\";\n"
               "  edge = ([0.0, 0.0, -0.2], [0.0, 0.0, 0.2]); } );\n";
    char force[64] = "";
    if (!is_static && drive != DRIVE_PRESS) // there its preset
        snprintf(force, sizeof force, "max_force = %.1f;", trial->at->value);
    const Vec3 at = drive == DRIVE_TOOL_WALL ? top_of(trial) : (Vec3){0.0, 0.0, 0.0};
    // In the plane a tool acts by its section with it: an upright stick.
    const double reach = trial->model->kind == KIND_PLANE ? 0.1 : 0.0;
    snprintf(text, 400,
             "tools = ( { id = 1;  kind = \"%s\";  %s\n  capsules = ( { from = [%.4f, %.4f, "
             "%.4f];  to = [%.4f, %.4f, %.4f];  radius = 0.01; } ); } );\n",
             is_static              ? "static"
             : drive == DRIVE_GRASP ? "grasper"
                                    : "probe",
             force, at.x, at.y, at.z - reach, at.x, at.y, at.z + reach);
    return text;
}

// `more`: keys of the body besides those of model and case.
static void write_scene(Trial *trial, double rate_hz, const char *more)
{
    char tools[400];
    char *text = trial->text;
    size_t size = SCENE_TEXT;
    int length = snprintf(text, size,
                          "name = \"stability\";\nrate_hz = %.17g;\nprecision = \"%s\";\n"
                          "publish = { nodes_hz = 0.0;  mesh_hz = 0.0;  contact_hz = 0.0;  "
                          "status_hz = 0.0; };\n%s%sbodies = ( {\n  name = \"body\";\n  "
                          "integrator = \"%s\";\n%s",
                          rate_hz, trial->cell->is_double ? "double" : "single",
                          trial->at->scene != NULL ? trial->at->scene : "", tools_of(trial, tools),
                          trial->integrator, more);
    const Key *given = case_keys(trial->at, trial->model);
    for (int i = 0; i < MODEL_KEYS && trial->model->key[i].key != NULL; i++) {
        const char *key = trial->model->key[i].key, *value = value_of(trial, key);
        if (value != NULL)
            length += snprintf(text + length, size - (size_t)length, "  %s = %s;\n", key, value);
    }
    for (int i = 0; i < CASE_KEYS && given[i].key != NULL; i++) {
        bool known = false;
        for (int k = 0; k < MODEL_KEYS && trial->model->key[k].key != NULL; k++)
            known |= strcmp(trial->model->key[k].key, given[i].key) == 0;
        if (!known)
            length += snprintf(text + length, size - (size_t)length, "  %s = %s;\n", given[i].key,
                               given[i].value);
    }
    length += snprintf(text + length, size - (size_t)length, "}%s );\n",
                       trial->at->beside != NULL ? trial->at->beside : "");
    ASSERT((size_t)length < size);
}

// False with the reason, without names of files.
static bool build(Trial *trial, char reason[REASON_TEXT])
{
    char path[512];
    Status status = {0};
    const BuildOptions options = {.isa = "auto", .may_load = true};
    snprintf(path, sizeof path, "%s/%s.cfg", trial->folder, trial->prefix);
    FILE *file = fopen(path, "wb");
    ASSERT(file != NULL);
    fputs(trial->text, file);
    fclose(file);
    bool ok = scene_read(path, &trial->scene, &status);
    if (ok && !world_build(&trial->world, &trial->scene, &options, &status)) {
        scene_destroy(&trial->scene);
        ok = false;
    }
    unlink(path);
    if (ok) {
        trial->body = sim_body(trial->world.sim, 0);
        return true;
    }
    // The folder's name and the line of the generated scene say nothing to a reader.
    const size_t folder = strlen(trial->folder);
    const char *from = status.text;
    size_t to = 0;
    while (*from != '\0' && to + 1 < REASON_TEXT) {
        if (strncmp(from, trial->folder, folder) == 0) {
            from += folder + 1;
            if (strncmp(from, trial->prefix, strlen(trial->prefix)) == 0) {
                const char *end = strstr(from, ": ");
                from = end != NULL ? end + 2 : from;
            }
        } else {
            reason[to++] = *from++;
        }
    }
    reason[to] = '\0';
    return false;
}

static void destroy(Trial *trial)
{
    world_destroy(&trial->world);
    scene_destroy(&trial->scene);
    trial->body = NULL;
}

// The largest stable time step, as the refusal of one of a whole second tells it [s]; 0: none is
// refused, or all, with the reason.
static double find_bound(Trial *trial, char reason[REASON_TEXT])
{
    static const char words[] = "stability bound ";
    write_scene(trial, 1.0, "  time_step = 1.0;\n");
    reason[0] = '\0';
    if (build(trial, reason)) {
        destroy(trial);
        return 0.0;
    }
    const char *at = strstr(reason, words);
    double bound = at != NULL ? strtod(at + sizeof words - 1, NULL) : 0.0;
    if (bound > 0.0)
        reason[0] = '\0';
    return bound;
}

// A scene whose tick is one step of `value` bounds; a scheme without a bound takes 10 ms for it.
static bool build_step(Trial *trial, char reason[REASON_TEXT])
{
    char more[128];
    double bound = find_bound(trial, reason);
    if (reason[0] != '\0')
        return false;
    const double step = trial->at->value * (bound > 0.0 ? bound : 0.01);
    snprintf(more, sizeof more, "  time_step = %.9g;\n%s", step,
             trial->at->drive == DRIVE_BIG_STEP ? "  unsafe_time_step = true;\n" : "");
    write_scene(trial, 1.0 / step, more);
    return build(trial, reason);
}

static bool build_started(Trial *trial, char reason[REASON_TEXT])
{
    char path[512], more[600];
    const double rate_hz = trial->at->rate_hz > 0.0 ? trial->at->rate_hz : 1000.0;
    write_scene(trial, rate_hz, "");
    if (!build(trial, reason))
        return false;
    trial->size = trial_size(trial->body);
    if (trial->at->start == START_REST)
        return true;
    snprintf(path, sizeof path, "%s/%s.h5", trial->folder, trial->prefix);
    trial_write_start(path, trial->body, trial->model, trial->at->start);
    destroy(trial);
    snprintf(more, sizeof more, "  initial = \"%s.h5\";\n", trial->prefix);
    write_scene(trial, rate_hz, more);
    bool ok = build(trial, reason);
    unlink(path);
    return ok;
}

// ---------------------------------------------------------------------------------------------
// What leaves the body

static double square(double x)
{
    return x * x;
}

static double energy_of(const Trial *trial, BodyMeasure *measure)
{
    trial->body->ops->measure(trial->body->model, measure);
    return measure->kinetic + measure->elastic;
}

// Everything that clients could see is a number.
static bool is_finite(const Trial *trial, BodyMeasure *measure)
{
    const BodyMesh *mesh = &trial->body->mesh;
    const int nodes = mesh->node_count;
    trial->body->ops->snapshot(trial->body->model, trial->snapshot, trial->snapshot + 3 * nodes);
    for (int i = 0; i < 6 * nodes; i++)
        if (!isfinite(trial->snapshot[i]) && mesh->id[i % (3 * nodes) / 3] >= 0)
            return false;
    for (int t = 0; t < sim_tool_count(trial->world.sim); t++) {
        const ToolWrench *wrench = sim_wrench(trial->world.sim, t);
        if (!isfinite(vec3_length(wrench->force)) || !isfinite(vec3_length(wrench->torque)) ||
            !isfinite(vec3_length(wrench->point)) || !isfinite(wrench->depth))
            return false;
    }
    const double energy = energy_of(trial, measure);
    return isfinite(energy) && isfinite(measure->max_displacement);
}

static bool fail(Trial *trial, const char *what)
{
    trial->cell->verdict = VERDICT_FAILED;
    snprintf(trial->cell->reason, REASON_TEXT, "%s at %.4g s", what, sim_time(trial->world.sim));
    return false;
}

static bool step(Trial *trial, BodyMeasure *measure)
{
    SimEvent event;
    sim_step(trial->world.sim);
    while (sim_take_event(trial->world.sim, &event))
        ;
    return is_finite(trial, measure) || fail(trial, "a number that is none");
}

// ---------------------------------------------------------------------------------------------
// What is done to it

// A load of force F works at F . v with v = sum s_i v_i over its nodes, and |v| is at most
// sqrt(2 E sum s_i^2 / m_i) (Cauchy and Schwarz): so sqrt(E) grows by at most
// F t sqrt(sum s_i^2 / m_i / 2).
static double impulse_bound(const Trial *trial, Vec3 center, double radius, double force)
{
    enum { MOST = 4096 };
    static int node[MOST];
    const Body *body = trial->body;
    const BodySurface *surface = &body->surface;
    double area = 0.0, sum = 0.0;
    int count = 0;
    for (int i = 0; i < surface->node_used && count < MOST; i++) {
        Vec3 x;
        if (surface->node_face_end[i] <= surface->node_face_start[i])
            continue;
        body->ops->read_nodes(body->model, &i, 1, &x, NULL);
        if (vec3_length(vec3_sub(x, center)) <= radius && !body->ops->is_fixed(body->model, i)) {
            node[count++] = i;
            area += surface->node_area[i];
        }
    }
    for (int k = 0; k < count; k++) {
        const double share = surface->node_area[node[k]] / area;
        sum += share * share / surface->node_mass[node[k]];
    }
    const double impulse = force * LOAD_S;
    return count > 0 ? 0.5 * impulse * impulse * sum : (double)INFINITY;
}

static void push(Trial *trial, double force, double duration)
{
    char why[160];
    // Half of the body: some node is inside whatever the mesh.
    LoadOptions load = {.body = -1,
                        .center = top_of(trial),
                        .radius = 0.6 * trial->size,
                        .force = vec3_scale(-force, vec3_unit(top_of(trial))),
                        .duration = duration};
    // Askew, so that no symmetry hides anything.
    load.force.x = 0.3 * force;
    trial->impulse = impulse_bound(trial, load.center, load.radius, 1.05 * force);
    sim_apply_load(trial->world.sim, &load, why, sizeof why);
}

static void move_jaws(Trial *trial, Vec3 position, bool active, double grip)
{
    const ToolPose pose = {
        .position = position, .orientation = {1.0, 0.0, 0.0, 0.0}, .active = active, .grip = grip};
    sim_apply_pose(trial->world.sim, 0, &pose, true);
}

static void move_tool(Trial *trial, Vec3 position, bool active)
{
    move_jaws(trial, position, active, 0.0);
}

// Pins the outside around the top, as stiff as a message may, or releases it.
static void pin(Trial *trial, TieAction action)
{
    char why[160];
    const TieOptions tie = {.action = action,
                            .number = 1,
                            .kind = TIE_PIN,
                            .center = top_of(trial),
                            .radius = 0.3 * trial->size,
                            .stiffness = TIE_STIFFNESS_MOST,
                            .damping_ratio = 0.5};
    const bool ok = sim_apply_tie(trial->world.sim, &tie, why, sizeof why);
    ASSERT(ok);
}

static void cut(Trial *trial, Vec3 corner, Vec3 along, Vec3 sweep)
{
    char why[256];
    CutOutcome outcome;
    const CutOptions options = {
        .body = -1,
        .before = {{corner, vec3_add(corner, along)}},
        .after = {{vec3_add(corner, sweep), vec3_add(vec3_add(corner, along), sweep)}}};
    sim_apply_cut(trial->world.sim, &options, &outcome, why, sizeof why);
}

// Cut `i` of all: planes at right angles to the axes, a little askew.
static void cut_slice(Trial *trial, int i)
{
    const double at = -0.05 + 0.1 * (i / 3 + 0.5) / CUTS_ALONG + 0.0003, far = 0.3;
    const Vec3 x = {far, 0.0, 0.0}, y = {0.0, far, 0.0}, z = {0.0, 0.0, far};
    const double half = 0.5 * far;
    if (i % 3 == 0)
        cut(trial, (Vec3){at, -half, -half}, z, y);
    else if (i % 3 == 1)
        cut(trial, (Vec3){-half, at, -half}, z, x);
    else if (trial->model->kind != KIND_PLANE)
        cut(trial, (Vec3){-half, -half, at}, y, x);
}

// The input of tick `i`; false: none is left, the body is on its own from now on.
static bool drive(Trial *trial, int i)
{
    const Case *at = trial->at;
    const double tick = sim_tick(trial->world.sim);
    const int load_ticks = (int)ceil(LOAD_S / tick - 1e-9);
    switch (at->drive) {
    case DRIVE_NOTHING:
    case DRIVE_TOOL_STAY:
    case DRIVE_TOOL_WALL:
        return false;
    case DRIVE_LOAD:
    case DRIVE_STEP:
    case DRIVE_BIG_STEP:
        if (i == 0)
            push(trial, at->drive == DRIVE_LOAD ? at->value : 1.0, LOAD_S);
        return i < load_ticks;
    case DRIVE_TOOL_FAST: {
        // To and fro over 0.3 m: three ticks each.
        const double x = fabs(fmod(100.0 * tick * i, 0.6) - 0.3) - 0.15;
        move_tool(trial, (Vec3){x, 0.002 * (i % 5), 0.0}, i < load_ticks);
        return i < load_ticks;
    }
    case DRIVE_STROKE: {
        const double path = at->value * tick * i, x = fabs(fmod(path, 0.6) - 0.3) - 0.15;
        move_tool(trial, (Vec3){x, 0.01 * floor(path / 0.3) - 0.012, 0.0}, i < load_ticks);
        return i < load_ticks;
    }
    case DRIVE_GRASP: {
        const double out = 1.0 + 0.3 / vec3_length(top_of(trial)) * i / load_ticks;
        const double grip = i > 1 ? 1.0 : 0.0;
        move_jaws(trial, vec3_scale(out, top_of(trial)), i < load_ticks, grip);
        return i < load_ticks;
    }
    case DRIVE_TIE:
        if (i == 0) {
            pin(trial, TIE_MAKE);
            push(trial, at->value, LOAD_S);
        }
        if (i == 2 * load_ticks)
            pin(trial, TIE_RELEASE);
        return i < 2 * load_ticks;
    case DRIVE_TOOL_IN:
        move_tool(trial, vec3_scale(0.9, top_of(trial)), i < load_ticks);
        return i < load_ticks;
    case DRIVE_PRESS: {
        // From 5 mm off.
        const double part = fmin(1.0, tick * i / PRESS_IN_S), clear = TOOL_RADIUS + 0.005;
        const double depth = part * (at->value * TOOL_RADIUS + 0.005);
        const Vec3 top = top_of(trial), out = vec3_unit(top);
        const bool held = tick * i < PRESS_IN_S + PRESS_HELD_S;
        move_tool(trial, vec3_madd(top, clear - depth, out), held);
        return held;
    }
    case DRIVE_CUT:
        if (i == 2)
            cut(trial, (Vec3){0.003, -0.5, -0.5}, (Vec3){0.0, 0.0, 1.0}, (Vec3){0.0, 1.0, 0.0});
        return i < 3;
    case DRIVE_CUT_ALL:
        if (i == 0)
            push(trial, at->value, 0.02);
        if (i >= 20 && i % 4 == 0 && (i - 20) / 4 < 3 * CUTS_ALONG)
            cut_slice(trial, (i - 20) / 4);
        return i < 20 + 4 * 3 * CUTS_ALONG;
    }
    return false;
}

// ---------------------------------------------------------------------------------------------
// Judging

// By how much the energy of a body on its own may rise above what it was. Of a linear oscillation
// with a = h omega / 2 < 0.9 (the safety of the bound) leapfrog keeps v^2 + (1 - a^2) (omega x)^2,
// so that the energy swings by 1 / (1 - a^2) = 5.3; symplectic Euler keeps
// v^2 + 2 a v omega x + (omega x)^2, so that it swings by (1 + a) / (1 - a) = 19. RK4 loses energy
// at every frequency within its bound; 5 % are for what is not linear. An implicit step is as
// stable as that for springs that only stretch; one that turns by an angle a within a step is
// stretched by a^2 / 2 of its length, however stiff it is: such energy comes and goes, and it is
// allowed what leapfrog is.
static double allowed_growth(const Trial *trial)
{
    double growth = 1.05;
    if (strcmp(trial->integrator, "rk4") != 0)
        growth = 5.3;
    if (strcmp(trial->integrator, "symplectic_euler") == 0)
        growth = 19.0;
    // New midpoints begin at the mean of their neighbours' displacements: a change of level keeps
    // momentum, not energy; it was measured to bring up to 8 % a change
    // (server/surface/detail/README.md, "Momentum and mass across changes").
    return trial->model->adapts ? 2.0 * growth : growth;
}

// The energy of rounding: positions known to `epsilon` sizes, on the stiffest springs.
static double noise(const Trial *trial)
{
    const double epsilon = trial->cell->is_double ? 1e-12 : 1e-6;
    const double blur = epsilon * trial->size;
    return trial->body->lambda * trial->body->mass * blur * blur + 1e-30;
}

// What a tool that is held still feels in its last second, and how far it moves the body.
static void watch_press(Trial *trial, int i, const BodyMeasure *measure, double force[3])
{
    Cell *cell = trial->cell;
    const double time = sim_tick(trial->world.sim) * (i + 1);
    const double depth = trial->at->value * TOOL_RADIUS;
    if (time < PRESS_IN_S + PRESS_HELD_S - 1.0)
        return;
    const double felt = vec3_length(sim_wrench(trial->world.sim, 0)->force);
    const bool first = force[2] == 0.0;
    force[0] = first ? felt : fmin(force[0], felt);
    force[1] = first ? felt : fmax(force[1], felt);
    force[2] += 1.0;
    cell->held_force += (felt - cell->held_force) / force[2];
    cell->held_swing = fmax(cell->held_force - force[0], force[1] - cell->held_force);
    cell->held_farthest = fmax(cell->held_farthest, measure->max_displacement / depth);
    cell->trembles = cell->held_swing > FORCE_SWING * cell->held_force + 1e-9 ||
                     cell->held_farthest > FARTHEST_MOVE;
    // Of the part of the depth that no node has gone.
    cell->sinks = (1.0 - cell->held_farthest) * depth > TOOL_RADIUS;
}

static bool run_driven(Trial *trial, BodyMeasure *measure)
{
    const double begin = measure->kinetic + measure->elastic;
    double force[3] = {0.0}; // least, most, how many
    for (int i = 0; drive(trial, i) && sim_resets(trial->world.sim) < RESETS_MOST; i++) {
        if (!step(trial, measure))
            return false;
        if (trial->at->drive == DRIVE_PRESS)
            watch_press(trial, i, measure, force);
    }
    const double energy = measure->kinetic + measure->elastic;
    trial->brought = square(sqrt(begin) + sqrt(trial->impulse));
    if (trial->at->drive == DRIVE_LOAD && sim_resets(trial->world.sim) == 0 &&
        energy > allowed_growth(trial) * trial->brought + noise(trial))
        return fail(trial, "more energy than the load can have brought");
    return true;
}

static bool run_alone(Trial *trial, BodyMeasure measure)
{
    // Springs of attachments give back what a load has brought; no body counts it.
    const bool attached = trial->scene.attachment_count > 0;
    const double left = measure.kinetic + measure.elastic, outer = measure.outer,
                 begin = attached ? fmax(left, trial->brought) : left;
    const double tick = sim_tick(trial->world.sim), allowed = allowed_growth(trial);
    const int look = (int)fmax(1.0, ceil(0.01 / tick - 1e-9));
    Cell *cell = trial->cell;
    double peak = begin, substeps = 0.0;
    int at_rest = 0, still = 0;
    const bool undamped = trial->at->undamped;
    for (int i = 1; i * tick < REST_S || substeps < REST_SUBSTEPS; i++) {
        if (!step(trial, &measure))
            return false;
        substeps += trial->body->substeps;
        if (sim_resets(trial->world.sim) >= RESETS_MOST)
            break; // it will not learn
        // Less what gravity and what a wall encloses have done; of a load this potential ends with
        // it.
        const double work = isinf(trial->impulse) ? fmax(0.0, outer - measure.outer) : 0.0;
        peak = fmax(peak, measure.kinetic + measure.elastic - allowed * work);
        // What a static tool or the guard does to the energy is none of the scheme's, and beyond
        // the bound it promises nothing: there the numbers alone are asked for.
        const bool alone = trial->at->drive != DRIVE_TOOL_STAY &&
                           trial->at->drive != DRIVE_TOOL_WALL &&
                           trial->at->drive != DRIVE_BIG_STEP && sim_resets(trial->world.sim) == 0;
        if (alone && peak > allowed * begin + noise(trial)) {
            snprintf(cell->reason, REASON_TEXT, "%.3g times the energy it was left with",
                     peak / begin);
            if (peak > SWELL * begin + noise(trial)) {
                cell->verdict = VERDICT_FAILED;
                return false;
            }
            cell->swelled = true;
        }
        if (i % look == 0) {
            at_rest = measure.max_displacement < REST_SHARE * trial->size ? at_rest + 1 : 0;
            if (at_rest == REST_LOOKS && !undamped)
                break;
            // Or stands still elsewhere.
            const double speed = sqrt(2.0 * measure.kinetic / trial->body->mass);
            still = speed < STILL * trial->size ? still + 1 : 0;
            if (still == STILL_LOOKS && at_rest == 0)
                break;
        }
        // An undamped body tells nothing more after a hundred of its slowest swings.
        if (undamped && i * tick > REST_S)
            break;
    }
    cell->came_to_rest = at_rest >= REST_LOOKS;
    cell->growth = begin > 0.0 ? peak / begin : 1.0;
    cell->left = begin > 0.0 ? (measure.kinetic + measure.elastic) / begin : 0.0;
    cell->pieces = sim_pieces(trial->world.sim, 0);
    cell->displacement = measure.max_displacement / trial->size;
    cell->speed = sqrt(2.0 * measure.kinetic / trial->body->mass) / trial->size;
    return true;
}

static void judge(Trial *trial)
{
    Cell *cell = trial->cell;
    const int nodes = trial->body->mesh.node_capacity + 1;
    trial->snapshot = zeroed(6 * (size_t)nodes, sizeof *trial->snapshot);
    BodyMeasure measure;
    bool sound = is_finite(trial, &measure) || fail(trial, "a number that is none");
    sound = sound && run_driven(trial, &measure);
    sound = sound && run_alone(trial, measure);
    cell->simulated = sim_time(trial->world.sim);
    cell->resets = (int)sim_resets(trial->world.sim);
    if (sound)
        cell->verdict = cell->resets > 0     ? VERDICT_RESET
                        : cell->trembles     ? VERDICT_TREMBLES
                        : cell->sinks        ? VERDICT_SINKS
                        : cell->swelled      ? VERDICT_SWELLED
                        : cell->came_to_rest ? VERDICT_REST
                                             : VERDICT_BOUNDED;
    free(trial->snapshot);
}

void trial_run(Cell *cell, const char *integrator, const char *folder, const char *prefix)
{
    static Trial trial;
    trial = (Trial){.cell = cell,
                    .model = &MODELS[cell->model],
                    .at = &CASES[cell->at_case],
                    .integrator = integrator,
                    .folder = folder,
                    .prefix = prefix,
                    .impulse = (double)INFINITY};
    const Drive drive = trial.at->drive;
    const bool by_step = drive == DRIVE_STEP || drive == DRIVE_BIG_STEP;
    if (by_step ? build_step(&trial, cell->reason) : build_started(&trial, cell->reason)) {
        trial.size = trial.size > 0.0 ? trial.size : trial_size(trial.body);
        judge(&trial);
        destroy(&trial);
    } else {
        cell->verdict = VERDICT_REFUSED;
    }
    cell->cpu_s = (double)clock() / CLOCKS_PER_SEC;
    cell->done = true;
}
