// SPDX-License-Identifier: MIT
#include "scene/build.h"

#include "base/log.h"
#include "body/body.h"
#include "io/mesh_import.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// The subject of a check: the scene, one of its bodies, or one of its tools.
typedef struct Subject {
    const Scene *scene;
    int line; // in the scene file; 0: unknown
    char name[BODY_NAME_MAX + 16];
    const SceneBody *body;   // or NULL
    const Body *made;        // of `body`
    double extent;           // longest side of the body's box [m]
    bool held;               // the body is fixed, attached, or on springs to the world
    const ToolOptions *tool; // or NULL
    double widest;           // largest extent of all bodies [m]
    const char *widest_name;
} Subject;

// A warning for a number outside [low, high]; NaN: does not apply to the subject.
typedef struct Row {
    double (*value)(const Subject *);
    double low, high;
    // Formats the number, then the likely causes of one that is too small or too large; NULL: none.
    void (*say)(const Subject *, double value, char *text, size_t size);
    const char *small, *large;
    bool instead; // alternative to the row before: only one of the two is reported
} Row;

// --- the scene -----------------------------------------------------------------------------------

static double gravity(const Subject *s)
{
    return vec3_length(s->scene->sim.gravity);
}

static void say_gravity(const Subject *s, double value, char *text, size_t size)
{
    (void)s;
    snprintf(text, size, "gravity is %g m/s2", value);
}

static double rate(const Subject *s)
{
    return s->scene->sim.rate_hz;
}

static void say_rate(const Subject *s, double value, char *text, size_t size)
{
    (void)s;
    snprintf(text, size, "a tick is %g s long (rate_hz = %g)", 1.0 / value, value);
}

static const Row SCENE_ROWS[] = {
    // Ten times the Earth's: more than any human centrifuge.
    {gravity, 0.0, 98.1, say_gravity, NULL, "is it in mm/s2? gravity = [0.0, 0.0, -9.81];", false},
    // The eye sees fewer than 20 pictures per second one by one; no display or hand can use that.
    {rate, 20.0, HUGE_VAL, say_rate,
     "rate_hz is in ticks per second: 1000 for a hand, 60 for a display", NULL, false},
};

// --- bodies --------------------------------------------------------------------------------------

static double extent(const Subject *s)
{
    return s->extent;
}

// Formats a mass: "130 t", "0.33 kg", "12 mg".
static void print_mass(double mass, char *text, size_t size)
{
    if (mass >= 1e3)
        snprintf(text, size, "%.3g t", 1e-3 * mass);
    else if (mass >= 1e-3)
        snprintf(text, size, "%.3g kg", mass);
    else
        snprintf(text, size, "%.3g mg", 1e6 * mass);
}

static void say_extent(const Subject *s, double value, char *text, size_t size)
{
    char mass[32];
    print_mass(s->made->mass, mass, sizeof mass);
    if (value >= 1.0)
        snprintf(text, size, "measures %.3g m and weighs %s", value, mass);
    else
        snprintf(text, size, "measures %.3g mm and weighs %s", 1e3 * value, mass);
}

static double mass_of(const Subject *s)
{
    return s->made->mass;
}

static void say_mass(const Subject *s, double value, char *text, size_t size)
{
    char mass[32];
    print_mass(value, mass, sizeof mass);
    snprintf(text, size, "weighs %s and measures %.3g m", mass, s->extent);
}

// Returns the most suspicious density of a voxel body's materials.
static double density(const Subject *s)
{
    double least = (double)NAN, most = (double)NAN;
    for (int i = 0; i < s->body->voxel.material_count && scene_has_cells(s->body); i++) {
        least = fmin(least, s->body->material[i].density);
        most = fmax(most, s->body->material[i].density);
    }
    return most > 2.5e4 ? most : least;
}

static void say_density(const Subject *s, double value, char *text, size_t size)
{
    (void)s;
    snprintf(text, size, "has a density of %g kg/m3", value);
}

static double youngs_modulus(const Subject *s)
{
    double least = (double)NAN;
    for (int i = 0; i < s->body->voxel.material_count && scene_has_cells(s->body); i++)
        least = fmin(least, s->body->material[i].youngs_modulus);
    return least;
}

static void say_youngs_modulus(const Subject *s, double value, char *text, size_t size)
{
    (void)s;
    snprintf(text, size, "has a youngs_modulus of %g Pa", value);
}

static bool has_wall(const Subject *s)
{
    return s->body->model == MODEL_SURFACE && !s->body->surface.material.uniform;
}

static double areal_density(const Subject *s)
{
    return has_wall(s) ? s->body->surface.material.areal_density : (double)NAN;
}

static void say_areal_density(const Subject *s, double value, char *text, size_t size)
{
    (void)s;
    snprintf(text, size, "has an areal_density of %g kg/m2", value);
}

static double wall_modulus(const Subject *s)
{
    return has_wall(s) ? s->body->surface.material.youngs_modulus_2d : (double)NAN;
}

static void say_wall_modulus(const Subject *s, double value, char *text, size_t size)
{
    (void)s;
    snprintf(text, size, "has a youngs_modulus_2d of %g N/m", value);
}

// Returns the speed after a second in free fall [m/s]. A static tool may be the table on which the
// body is meant to fall; loads and graspers are there to move it.
static double free_fall(const Subject *s)
{
    for (int i = 0; i < s->scene->tool_count; i++)
        if (s->scene->tool[i].kind == TOOL_STATIC)
            return (double)NAN;
    return s->held ? (double)NAN : gravity(s);
}

static void say_free_fall(const Subject *s, double value, char *text, size_t size)
{
    (void)s;
    snprintf(text, size, "has no support and falls %.3g m in its first second", 0.5 * value);
}

// Reports what moves the body where gravity does not.
static double pushed_away(const Subject *s)
{
    int probes = 0;
    for (int i = 0; i < s->scene->tool_count; i++)
        probes += s->scene->tool[i].kind == TOOL_PROBE;
    return s->held || gravity(s) > 0.0 || probes == 0 ? (double)NAN : probes;
}

static void say_pushed_away(const Subject *s, double value, char *text, size_t size)
{
    (void)s;
    snprintf(text, size, "has no support: %g probe%s will push it away", value,
             value > 1.0 ? "s" : "");
}

// Returns the damping rate of nodes relative to each other and in space, for a scheme without
// numerical damping [1/s].
static double damping(const Subject *s, bool solid)
{
    return scene_has_cells(s->body) == solid && integrator_is_symplectic(s->made->integrator)
               ? s->made->damping
               : (double)NAN;
}

static double wall_damping(const Subject *s)
{
    return damping(s, false);
}

static double solid_damping(const Subject *s)
{
    return damping(s, true);
}

static void say_damping(const Subject *s, double value, char *text, size_t size)
{
    // For its implicit step: a crumpled wall comes to rest at once, however fast (README.md,
    // Limits).
    const double time = 0.02 * s->made->h;
    const SurfaceMaterial *wall = &s->body->surface.material;
    char key[64];
    (void)value;
    if (scene_has_cells(s->body))
        snprintf(key, sizeof key, "damping = 0.2;");
    else if (wall->uniform)
        snprintf(key, sizeof key, "spring_damping = %.2g;", time * wall->spring_stiffness);
    else
        snprintf(key, sizeof key, "damping_time = %.2g;", time);
    snprintf(text, size,
             "has no damping: once crumpled it gains energy without end by %s, which material = { "
             "%s } prevents",
             integrator_name(s->made->integrator), key);
}

// Returns the time of a step in ticks, shared by the threads.
static double cost(const Subject *s)
{
    return cost_tick(s->made, s->made->substeps) * s->scene->sim.rate_hz / s->scene->threads;
}

static void say_cost(const Subject *s, double value, char *text, size_t size)
{
    snprintf(text, size,
             "takes %d substeps a tick, by estimate %.2g times the time that a tick has",
             s->made->substeps, value);
}

// Returns the pressure inside over the most that a ball of that wall bears.
static double burst(const Subject *s)
{
    const SurfaceCavity *cavity = &s->body->surface.cavity;
    return has_wall(s) && cavity->wanted ? cavity->pressure / s->made->bears : (double)NAN;
}

static void say_burst(const Subject *s, double value, char *text, size_t size)
{
    snprintf(text, size, "has %g Pa inside, %.2g times what a ball of its wall and size bears",
             s->body->surface.cavity.pressure, value);
}

// Returns the elements of a solid that adapts over those with all of its surface fine.
static double unmerged(const Subject *s)
{
    return s->made->fine_elements > 0
               ? (double)s->made->element_count / (double)s->made->fine_elements
               : (double)NAN;
}

static void say_unmerged(const Subject *s, double value, char *text, size_t size)
{
    (void)value;
    snprintf(text, size,
             "hardly gains by levels.surface: it has %d elements untouched, %d with all of its "
             "surface fine",
             s->made->element_count, s->made->fine_elements);
}

#define HOLD "fixed = (...), attachments, or shape springs to the world would support it"

static const Row BODY_ROWS[] = {
    // A torso measures 0.7 m; the smallest organs that anybody operates on, lens and eardrum, 9 mm.
    {extent, 5e-3, 1.0, say_extent, NULL, NULL, false}, // causes: scale_hint
    // As much as two heavy people, within 1 m.
    {mass_of, 0.0, 300.0, say_mass, NULL, "is a density or a length in other units than SI?", true},
    // The estimate is accurate within a factor of two: beyond three times no machine keeps up.
    {cost, 0.0, 3.0, say_cost, NULL,
     "its shortest edges or cells are too short for its stiffness (pliant-prepare --check MESH; "
     "integrator = \"auto\"; a coarser mesh or larger cells)",
     true},
    // Inflated lungs have 100 kg/m3 or more; osmium has 22,600.
    {density, 50.0, 2.5e4, say_density, "is it in g/cm3? Tissue has 1050 kg/m3",
     "density is kg/m3, and tissue has 1050", false},
    // Brain, the softest organ, has 500 Pa.
    {youngs_modulus, 100.0, HUGE_VAL, say_youngs_modulus, "is it in kPa? youngs_modulus is in Pa",
     NULL, false},
    // Membranes with the density of water, from 10 um to half a metre.
    {areal_density, 0.01, 500.0, say_areal_density,
     "areal_density is kg/m3 times the wall's thickness in m: 4.2 for 4 mm",
     "is it a density? areal_density is that times the wall's thickness in m: 4.2 for 4 mm", false},
    // From a membrane of 1 mm of brain up to a stiff artery, of 2 MPa and 2 mm.
    {wall_modulus, 0.5, 4e3, say_wall_modulus,
     "is it in kPa? youngs_modulus_2d is Pa times the wall's thickness in m: 400 for 100 kPa, 4 mm",
     "is it in Pa? youngs_modulus_2d is that times the wall's thickness in m: 400 for 100 kPa, 4 "
     "mm",
     false},
    // Beyond, linear springs have no equilibrium.
    {burst, -HUGE_VAL, 1.0, say_burst, NULL,
     "it will grow without end; is it in mmHg? cavity.pressure is in Pa, 133 of them", false},
    // A tenth of a percent of an oscillation per year.
    {wall_damping, 1e-10, HUGE_VAL, say_damping, "integrator = \"rk4\" prevents it too", NULL,
     false},
    {solid_damping, 1e-10, HUGE_VAL, say_damping, "that is its default", NULL, false},
    // Adapting costs a tenth.
    {unmerged, 0.0, 0.9, say_unmerged, NULL,
     "larger ones need four of them across the solid, of one label, away from the borders of fixed "
     "regions",
     false},
    // A body in free fall is out of reach within a second.
    {free_fall, 0.0, 0.0, say_free_fall, NULL, HOLD, false},
    {pushed_away, 0.0, 0.0, say_pushed_away, NULL, HOLD, true},
};

// --- tools ---------------------------------------------------------------------------------------

static double radius(const Subject *s)
{
    double most = (double)NAN;
    for (int i = 0; i < s->tool->capsule_count; i++)
        most = fmax(most, s->tool->capsule[i].radius);
    return s->tool->kind == TOOL_STATIC ? (double)NAN : most;
}

static void say_radius(const Subject *s, double value, char *text, size_t size)
{
    (void)s;
    snprintf(text, size, "has a radius of %g m", value);
}

static double length(const Subject *s)
{
    const ToolOptions *tool = s->tool;
    double most = tool->kind == TOOL_BLADE ? vec3_length(vec3_sub(tool->edge[1], tool->edge[0]))
                                           : (double)NAN;
    for (int i = 0; i < tool->capsule_count; i++)
        most = fmax(most, vec3_length(vec3_sub(tool->capsule[i].to, tool->capsule[i].from)));
    return tool->kind == TOOL_STATIC ? (double)NAN : most;
}

static void say_length(const Subject *s, double value, char *text, size_t size)
{
    (void)s;
    snprintf(text, size, "is %g m long", value);
}

// Returns the width of an instrument relative to the largest body; a ball without a shaft may be an
// object that collides with it, and counts half.
static double share(const Subject *s)
{
    const bool shaft = length(s) > 0.0;
    return s->tool->kind != TOOL_PROBE ? (double)NAN : (shaft ? 2.0 : 1.0) * radius(s) / s->widest;
}

static void say_share(const Subject *s, double value, char *text, size_t size)
{
    (void)value;
    snprintf(text, size, "is %.3g mm wide, %.2g times the size of body \"%s\" (%.3g mm)",
             2e3 * radius(s), 2.0 * radius(s) / s->widest, s->widest_name, 1e3 * s->widest);
}

static const Row TOOL_ROWS[] = {
    // The thinnest needles have 0.1 mm; a fist has a radius of 5 cm, a head of 10 cm.
    {radius, 5e-5, 0.25, say_radius, "were its lengths divided by 1000 twice? Lengths are in m",
     "is it in millimetres? radius = 0.005; is a tip of 5 mm", false},
    // Longer than a person is tall.
    {length, 0.0, 3.0, say_length, NULL, "is it in millimetres? Lengths are in m", true},
    // No instrument is half as wide as the organ that it presses, no ball as wide.
    {share, 0.0, 0.4999, say_share, NULL, "is one of the two in other units than m?", true},
};

// --- all of them ---------------------------------------------------------------------------------

// Names the source of the body's lengths and the correction.
static const char *scale_hint(const Subject *s)
{
    // Organs in centimetres are up to 30 units long. The texts of a file's key and of none follow.
    static const char *const hints[][3] = {
        {"is its file in metres already, or in centimetres? mesh = { scale = 0.01; }",
         "is its file in centimetres, or in no unit? mesh = { scale = 0.01; }",
         "is its file in millimetres? mesh = { scale = 0.001; }"},
        {"is its file in metres already, or in centimetres? voxels = { scale = 0.01; }",
         "is its file in centimetres, or in no unit? voxels = { scale = 0.01; }",
         "is its file in millimetres? voxels = { scale = 0.001; }"},
        {"were its lengths divided by 1000 twice? Lengths are in m",
         "is a length in other units than m, or a diameter given as radius?",
         "are its lengths in millimetres? Lengths are in m"},
    };
    const SceneBody *body = s->body;
    const bool cells = scene_has_cells(body);
    if (cells && body->voxels.kind == VOXELS_FILE)
        return "does its file state its units wrongly? voxels = { scale = 0.001; } (times those)";
    const int source = body->model == MODEL_SURFACE && body->mesh.kind == MESH_FILE ? 0
                       : cells && body->voxels.kind == VOXELS_MESH                  ? 1
                                                                                    : 2;
    return hints[source][s->extent > 30.0 ? 2 : s->extent > 1.0 ? 1 : 0];
}

static int check_rows(const Subject *subject, const Row *row, int count)
{
    int said = 0;
    bool before = false;
    // A row that stands in for the one before is silent if that one spoke.
    for (int i = 0; i < count; i++) {
        const double value = row[i].value(subject);
        const bool wrong = value < row[i].low || value > row[i].high; // NaN is neither
        const bool say = wrong && !(row[i].instead && before);
        before = wrong || (row[i].instead && before);
        if (!say)
            continue;
        // One line: where, what, and what was perhaps meant.
        char what[256], place[32] = "";
        const char *cause = value < row[i].low ? row[i].small : row[i].large;
        row[i].say(subject, value, what, sizeof what);
        if (subject->line > 0)
            snprintf(place, sizeof place, ":%d", subject->line);
        log_line(LOG_WARNING, "%s%s: %s%s: %s", subject->scene->path, place, subject->name, what,
                 cause != NULL ? cause : scale_hint(subject));
        said++;
    }
    return said;
}

#define CHECK(subject, rows) check_rows(&(subject), (rows), (int)(sizeof(rows) / sizeof(rows)[0]))

static bool is_held(const Scene *scene, int index, const BodyOutline *outline)
{
    const SceneBody *body = &scene->body[index];
    const SurfaceShape *shape = &body->surface.shape;
    // Fixed, on springs to the world, attached at either end, or with a body to fall on.
    if (outline->fixed > 0 || body->options.fixed_count > 0 ||
        (body->model == MODEL_SURFACE && shape->wanted && shape->frame == SHAPE_WORLD))
        return true;
    for (int i = 0; i < scene->attachment_count; i++) {
        const AttachmentOptions *attachment = &scene->attachment[i].options;
        if (attachment->body == index ||
            (attachment->to == ATTACH_BODY && attachment->to_body == index))
            return true;
    }
    for (int i = 0; i < scene->touch_count; i++)
        if (touch_bodies(&scene->touch[i].options) == 2 &&
            (scene->touch[i].options.body[0] == index || scene->touch[i].options.body[1] == index))
            return true;
    return false;
}

// --- frames --------------------------------------------------------------------------------------

// Returns the mesh file of a body that stands where its file says; NULL: it has none.
static const char *mesh_in_place(const SceneBody *body)
{
    const bool cells = scene_has_cells(body), wall = !cells && body->mesh.kind == MESH_FILE;
    const Vec3 turn = cells ? body->voxels.rotation : body->mesh.rotation;
    const Vec3 move = cells ? body->voxels.translation : body->mesh.translation;
    if (vec3_length(turn) > 0.0 || vec3_length(move) > 0.0)
        return NULL;
    return wall                                        ? body->mesh.file
           : cells && body->voxels.kind == VOXELS_MESH ? body->voxels.file
                                                       : NULL;
}

// Warns of a mesh that misses the body of a label volume, but would meet it turned from RAS to LPS
// or back: bodies may well stand apart, but hardly like that.
static int check_frames(const Subject *mesh, const Subject *volume)
{
    const Box box = body_outline(mesh->made).box, other = body_outline(volume->made).box;
    const Box turned = {{-box.high[0], -box.high[1], box.low[2]},
                        {-box.low[0], -box.low[1], box.high[2]}};
    const char *file = mesh_in_place(mesh->body);
    if (file == NULL || !scene_has_cells(volume->body) ||
        volume->body->voxels.kind != VOXELS_FILE || box_gap(&box, &other) == 0.0 ||
        box_gap(&turned, &other) > 0.0)
        return 0;
    log_line(LOG_WARNING,
             "%s:%d: body \"%s\" misses body \"%s\", but would not if it were turned by 180 "
             "degrees about z: its mesh %s, labels are read in LPS: is it in RAS? place = { "
             "rotation = [0.0, 0.0, 3.14159265]; };",
             mesh->scene->path, mesh->line, mesh->made->name, volume->made->name, mesh_frame(file));
    return 1;
}

// Warns of balls of fine elements that do not reach the body.
static int check_fine(const Subject *body)
{
    if (body->body->model != MODEL_VOXEL)
        return 0;
    const VoxelOptions *voxel = &body->body->voxel;
    const Box box = body_outline(body->made).box;
    int said = 0;
    for (int f = 0; f < voxel->fine_count; f++) {
        const Vec3 at = voxel->fine[f].centre;
        const Box centre = {{at.x, at.y, at.z}, {at.x, at.y, at.z}};
        if (box_gap(&centre, &box) <= voxel->fine[f].radius)
            continue;
        log_line(LOG_WARNING,
                 "%s:%d: levels.fine: the ball of %g m around (%g, %g, %g) misses body \"%s\": "
                 "nothing stays fine for it",
                 body->scene->path, body->line, voxel->fine[f].radius, at.x, at.y, at.z,
                 body->made->name);
        said++;
    }
    return said;
}

// Warns of a load that acts on nothing, unless a body gets there before it starts.
static int check_load(World *world, const Scene *scene, int index)
{
    const SceneLoad *at = &scene->load[index];
    const LoadOptions *load = &at->load;
    const Region region = {
        .kind = REGION_CAPSULE, .from = load->center, .to = load->center, .radius = load->radius};
    for (int b = 0; b < sim_body_count(world->sim); b++) {
        const Body *body = sim_body(world->sim, b);
        int node;
        if ((load->body < 0 || load->body == b) &&
            body->ops->find_nodes(body->model, &region, &node, 1) > 0)
            return 0;
    }
    log_line(LOG_WARNING,
             "%s:%d: the load has no node within %g m of (%g, %g, %g): nothing feels it there; a "
             "larger radius, or a center nearer to a surface",
             scene->path, at->line, load->radius, load->center.x, load->center.y, load->center.z);
    return 1;
}

int plausible_warn(World *world, const Scene *scene)
{
    // Keys without effect were found when the scene was read.
    int said = scene->idle_count;
    for (int i = 0; i < scene->idle_count; i++)
        log_line(LOG_WARNING, "%s", scene->idle[i]);
    // Rows of the scene differ in the line that they refer to.
    Subject all = {.scene = scene, .line = scene->gravity_line};
    said += check_rows(&all, &SCENE_ROWS[0], 1);
    all.line = scene->rate_line;
    said += check_rows(&all, &SCENE_ROWS[1], 1);
    for (int i = 0; i < scene->body_count; i++) {
        const Body *made = sim_body(world->sim, i);
        const BodyOutline outline = body_outline(made);
        // Each body in turn; the widest one is the measure for tools.
        Subject body = all;
        body.line = scene->body[i].line;
        body.body = &scene->body[i];
        body.made = made;
        body.extent = box_extent(&outline.box);
        body.held = is_held(scene, i, &outline);
        snprintf(body.name, sizeof body.name, "body \"%s\" ", made->name);
        if (body.extent > all.widest) {
            all.widest = body.extent;
            all.widest_name = made->name;
        }
        said += CHECK(body, BODY_ROWS);
        said += check_fine(&body);
        for (int k = 0; k < scene->body_count; k++) {
            Subject other = {.made = sim_body(world->sim, k), .body = &scene->body[k]};
            said += check_frames(&body, &other);
        }
    }
    // Tools are compared with the widest body.
    for (int i = 0; i < scene->tool_count; i++) {
        Subject tool = all;
        tool.tool = &scene->tool[i];
        tool.line = scene->tool_line[i];
        snprintf(tool.name, sizeof tool.name, "tool %d ", tool.tool->id);
        said += CHECK(tool, TOOL_ROWS);
    }
    for (int i = 0; i < scene->load_count; i++)
        said += check_load(world, scene, i);
    return said;
}
