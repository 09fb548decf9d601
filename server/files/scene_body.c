// Reads one entry of `bodies`.
#include "files/scene_parts.h"
#include "files/scene_source.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

typedef struct BodyGroup {
    const char *name, *initial;
    int model, integrator;
    int levels, start_level, adjust;
    const config_setting_t *mesh, *adapt, *material, *shape, *contact, *fixed;
    double prestress, time_step;
    bool unsafe_time_step;
    // Read, checked against their only value, and of no further use.
    int split_budget;
    bool cuttable;
} BodyGroup;

enum { MODEL_SURFACE, MODEL_VOXEL };

static const OptionWord MODEL_WORDS[] = {
    {"surface", MODEL_SURFACE, NULL}, {"voxel", MODEL_VOXEL, LATER_VOXEL}, {NULL, 0, NULL}};
static const OptionWord INTEGRATOR_WORDS[] = {
    {"leapfrog", INTEGRATOR_LEAPFROG, NULL},
    {"rk4", INTEGRATOR_RK4, NULL},
    {"symplectic_euler", INTEGRATOR_SYMPLECTIC_EULER, NULL},
    {"implicit", INTEGRATOR_COUNT, LATER_IMPLICIT},
    {NULL, 0, NULL}};
static const OptionWord ADJUST_WORDS[] = {
    {"continuum", ADJUST_CONTINUUM, NULL}, {"choi2005", ADJUST_CHOI2005, NULL}, {NULL, 0, NULL}};

#define AT(member) offsetof(BodyGroup, member)
static const Option BODY_OPTIONS[] = {
    {"name", OPTION_NAME, AT(name), "", .low = 1, .high = SCENE_WORD_MAX, .required = true,
     .about = "Name of the body in channels, commands and files; unique."},
    {"model", OPTION_WORD, AT(model), "", .words = MODEL_WORDS, .preset = MODEL_SURFACE,
     .about = "Surface: a hollow organ as a mesh of springs (Choi et al. 2005)."},
    {"mesh", OPTION_GROUP, AT(mesh), "", .required = true,
     .about = "Where its triangles come from."},
    {"levels", OPTION_INT, AT(levels), "", 0.0, LEVELS_MAX,
     .about = "Finest level of detail: each divides every face into four. 0: the mesh as it is."},
    {"start_level", OPTION_INT, AT(start_level), "", 0.0, LEVELS_MAX,
     .about = "Level at which the body starts, and stays without `adapt`; at most `levels`."},
    {"adjust", OPTION_WORD, AT(adjust), "", .words = ADJUST_WORDS, .preset = ADJUST_CONTINUUM,
     .about = "How properties follow the level: `continuum` as an elastic wall asks, `choi2005` by "
              "the paper's eqs 6 to 8. Of no effect with `levels = 0`."},
    {"adapt", OPTION_GROUP, AT(adapt), "", .preset_text = "stays at start_level",
     .about = "When faces are refined and coarsened."},
    {"material", OPTION_GROUP, AT(material), "", .preset_text = "its defaults",
     .about = "Stiffness, mass and damping."},
    {"shape", OPTION_GROUP, AT(shape), "", .preset_text = "no shape springs",
     .about = "Springs that pull every node to where it was."},
    {"contact", OPTION_GROUP, AT(contact), "", .preset_text = "its defaults",
     .about = "How the body meets tools."},
    {"prestress", OPTION_REAL, AT(prestress), "", 0.0, 0.9,
     .about = "Rest lengths are shortened by this fraction; 0.1 lets cuts open."},
    {"integrator", OPTION_WORD, AT(integrator), "", .words = INTEGRATOR_WORDS,
     .preset = INTEGRATOR_LEAPFROG,
     .about = "Scheme of time integration: `leapfrog` and `symplectic_euler` evaluate the forces "
              "once a step, `rk4` four times."},
    {"time_step", OPTION_REAL, AT(time_step), "s", 0.0, 1.0, .open = true,
     .preset_text = "from the stability bound",
     .about = "Longest step; a tick is divided into equal steps that are not longer."},
    {"unsafe_time_step", OPTION_BOOL, AT(unsafe_time_step), "",
     .about = "Accepts a time step beyond the stability bound."},
    {"fixed", OPTION_LIST, AT(fixed), "", .about = "Regions whose nodes never move."},
    {"initial", OPTION_STRING, AT(initial), "", .low = 1, .high = SCENE_FILE_MAX,
     .preset_text = "at rest",
     .about = "HDF5 file with `/position` and, if not zero, `/velocity`, [n][3], in the order of "
              "the mesh."},
    {"cuttable", OPTION_BOOL, AT(cuttable), "", .later = LATER_CUTTING,
     .about = "Whether blades cut it."},
    {"split_budget", OPTION_INT, AT(split_budget), "", 0.0, 1e6, .later = LATER_CUTTING,
     .about = "Vertices that one tick may split."},
    {"voxels", OPTION_LATER, 0, "", .later = LATER_VOXEL, .about = "Elements of a voxel body."},
    {"law", OPTION_LATER, 0, "", .later = LATER_VOXEL, .about = "Element law of a voxel body."},
    {"materials", OPTION_LATER, 0, "", .later = LATER_VOXEL,
     .about = "Materials by label of a voxel body."},
    {"tear", OPTION_LATER, 0, "", .later = LATER_VOXEL, .about = "When a voxel body tears."},
    {"skin", OPTION_LATER, 0, "", .later = LATER_VOXEL,
     .about = "Display surface carried by a voxel body."},
};
#undef AT
const OptionTable BODY_TABLE = OPTION_TABLE("bodies", "One soft body.", BODY_OPTIONS);

static const Option CONTACT_OPTIONS[] = {
    {"stiffness", OPTION_REAL, offsetof(SurfaceOptions, contact_ratio), "", 0.0, 100.0,
     .open = true, .preset = 0.5,
     .about = "Stiffness of the contact as a share of the body's own; more is harder and needs a "
              "smaller time step."},
    {"damping_time", OPTION_REAL, offsetof(SurfaceOptions, contact_damping), "s", 0.0, 1.0,
     .preset = 2e-4, .about = "Damping of the contact over its stiffness."},
    {"friction", OPTION_REAL, offsetof(SurfaceOptions, friction), "", 0.0, 10.0, .preset = 0.2,
     .about = "Coulomb's coefficient; 0: frictionless."},
};
const OptionTable CONTACT_TABLE = OPTION_TABLE(
    "bodies.contact", "The penalty force between the body's faces and tools.", CONTACT_OPTIONS);

#define AT(member) offsetof(SurfaceAdapt, member)
static const Option ADAPT_OPTIONS[] = {
    {"force", OPTION_REAL, AT(force), "", 0.0, 1e9, .open = true, .preset = 0.005,
     .about = "Load an area times the edge length over `youngs_modulus_2d` beyond which a face is "
              "refined."},
    {"speed", OPTION_REAL, AT(speed), "", 0.0, 1e9, .open = true, .preset = 0.3,
     .about =
         "Speed against the body's rigid motion, over that of waves in the wall times 2^level, "
         "beyond which a face is refined."},
    {"curvature", OPTION_REAL, AT(curvature), "rad", 0.0, 1e9, .open = true, .preset = 0.4,
     .about = "Change of the angle between two faces beyond which they are refined."},
    {"check_hz", OPTION_REAL, AT(check_hz), "Hz", 0.0, 10000.0, .open = true, .preset = 100.0,
     .about = "How often all faces are looked at; at most, and by default lowered to, `rate_hz`."},
};
#undef AT
const OptionTable ADAPT_TABLE = OPTION_TABLE(
    "bodies.adapt",
    "The body refines where it is loaded, moves or bends, up to `levels`, and coarsens where it is "
    "at ease. A criterion is switched off by a large value.",
    ADAPT_OPTIONS);

// What of the levels can be said before the mesh is known.
static bool read_levels(const SceneReader *reader, const config_setting_t *group,
                        const BodyGroup *raw, SurfaceOptions *surface)
{
    const OptionSource *source = &reader->source;
    surface->levels = raw->levels;
    surface->start_level = raw->start_level;
    surface->adjust = (SurfaceAdjust)raw->adjust;
    surface->adaptive = raw->adapt != NULL;
    surface->node_capacity = reader->scene->node_capacity;
    surface->face_capacity = reader->scene->face_capacity;
    if (raw->start_level > raw->levels)
        return option_fail(source, option_find(group, "start_level"),
                           "start_level %d exceeds levels %d", raw->start_level, raw->levels);
    if (raw->adapt == NULL)
        return true;
    if (raw->levels == 0)
        return option_fail(source, raw->adapt,
                           "adapt needs levels, the finest level of detail: set it to 1 or more");
    if (!option_read(&ADAPT_TABLE, raw->adapt, source, &surface->adapt))
        return false;
    if (surface->adapt.check_hz <= reader->scene->rate_hz)
        return true;
    char rate[OPTION_NUMBER_TEXT], limit[OPTION_NUMBER_TEXT];
    if (option_given(raw->adapt, "check_hz"))
        return option_fail(source, option_find(raw->adapt, "check_hz"),
                           "check_hz %s exceeds rate_hz %s",
                           option_number_text(rate, surface->adapt.check_hz),
                           option_number_text(limit, reader->scene->rate_hz));
    surface->adapt.check_hz = reader->scene->rate_hz;
    return true;
}

static char *copy_resolved(const SceneReader *reader, const char *file)
{
    return file != NULL ? scene_source_resolve(reader->folder, file) : NULL;
}

bool scene_read_body(const SceneReader *reader, const config_setting_t *group, SceneBody *body)
{
    BodyGroup raw = {0};
    const OptionSource *source = &reader->source;
    body->line = (int)config_setting_source_line(group);
    if (!option_read(&BODY_TABLE, group, source, &raw))
        return false;
#ifndef PLIANT_WITH_SURFACE
    return option_fail(source, group,
                       "this pliantd was built without surface bodies (PLIANT_SURFACE)");
#endif
    snprintf(body->name, sizeof body->name, "%s", raw.name);
    snprintf(body->model, sizeof body->model, "surface");
    if (option_given(group, "initial"))
        body->initial = copy_resolved(reader, raw.initial);

    SurfaceOptions *surface = &body->surface;
    surface->name = body->name;
    surface->prestress = raw.prestress;
    surface->integrator = (IntegratorKind)raw.integrator;
    surface->time_step = option_given(group, "time_step") ? raw.time_step : 0.0;
    surface->unsafe_time_step = raw.unsafe_time_step;
    return scene_read_mesh(reader, raw.mesh, &body->mesh) &&
           read_levels(reader, group, &raw, surface) &&
           scene_read_material(reader, raw.material, &surface->material) &&
           scene_read_shape(reader, raw.shape, &surface->shape) &&
           option_read(&CONTACT_TABLE, raw.contact, source, surface) &&
           scene_read_fixed(reader, raw.fixed, body);
}
