// Reads one entry of `bodies`: the keys of both models, and checks which of them apply to its own.
#include "files/scene_parts.h"
#include "files/scene_source.h"

static const OptionWord MODEL_WORDS[] = {
    {"surface", MODEL_SURFACE}, {"voxel", MODEL_VOXEL}, {NULL, 0}};
static const OptionWord INTEGRATOR_WORDS[] = {{"leapfrog", INTEGRATOR_LEAPFROG},
                                              {"rk4", INTEGRATOR_RK4},
                                              {"symplectic_euler", INTEGRATOR_SYMPLECTIC_EULER},
                                              {"implicit", INTEGRATOR_IMPLICIT},
                                              {"auto", INTEGRATOR_AUTO},
                                              {NULL, 0}};
static const OptionWord ADJUST_WORDS[] = {
    {"continuum", ADJUST_CONTINUUM}, {"choi2005", ADJUST_CHOI2005}, {NULL, 0}};
static const OptionWord LAW_WORDS[] = {
    {"affine", VOXEL_AFFINE}, {"miyazaki2004", VOXEL_MIYAZAKI2004}, {NULL, 0}};

#define AT(member) offsetof(BodyGroup, member)
static const Option BODY_OPTIONS[] = {
    {"name", OPTION_NAME, AT(name), "", .low = 1, .high = SCENE_WORD_MAX, .required = true,
     .about = "Name of the body in channels, commands and files; unique."},
    {"model", OPTION_WORD, AT(model), "", .words = MODEL_WORDS, .preset = MODEL_SURFACE,
     .about = "Surface: a hollow organ as a mesh of springs (Choi et al. 2005). Voxel: a solid "
              "organ of elements, small at its surface and large inside (Miyazaki et al. 2004)."},
    {"mesh", OPTION_GROUP, AT(mesh), "", .preset_text = "required of a surface body",
     .about = "Source of its triangles."},
    {"voxels", OPTION_GROUP, AT(voxels), "", .preset_text = "required of a voxel body",
     .about = "Source of its cells."},
    {"levels", OPTION_INT, AT(levels), "", 0.0, LEVELS_MAX, .preset_text = "surface 0, voxel 2",
     .about = "Surface: finest level of detail; each level divides every face into four. 0: the "
              "mesh as it is. Voxel, 0 to 5: coarsest level; elements inside are up to 2^levels "
              "cells wide. 0: one element per cell."},
    {"start_level", OPTION_INT, AT(start_level), "", 0.0, LEVELS_MAX,
     .about = "Surface: level at which the body starts, and at which it stays without `adapt`; at "
              "most `levels`."},
    {"adjust", OPTION_WORD, AT(adjust), "", .words = ADJUST_WORDS, .preset = ADJUST_CONTINUUM,
     .about = "Surface: how properties follow the level: `continuum` as those of an elastic "
              "membrane, `choi2005` by the paper's eqs 6 to 9, which a `cuttable` body with levels "
              "cannot use. No effect with `levels = 0`."},
    {"adapt", OPTION_GROUP, AT(adapt), "", .preset_text = "stays at start_level",
     .about = "Surface: when faces are refined and coarsened."},
    {"law", OPTION_WORD, AT(law), "", .words = LAW_WORDS, .preset = VOXEL_AFFINE,
     .about = "Voxel: law of the elements: `affine` is exact for uniform strain at every level, "
              "`miyazaki2004` is the paper's."},
    {"dimensions", OPTION_INT, AT(dimensions), "", 2.0, 3.0, .preset_text = "3, of a `disc` 2",
     .about = "Voxel: 2 is the plane case, in z = 0."},
    {"material", OPTION_GROUP, AT(material), "", .preset_text = "its defaults",
     .about = "Stiffness, mass and damping."},
    {"materials", OPTION_LIST, AT(materials), "",
     .about = "Voxel: materials for individual labels of a volume, instead of `material`."},
    {"shape", OPTION_GROUP, AT(shape), "", .preset_text = "no shape springs",
     .about = "Surface: springs that pull every node to its rest position."},
    {"contact", OPTION_GROUP, AT(contact), "", .preset_text = "its defaults",
     .about = "Contact of the body with tools."},
    {"prestress", OPTION_REAL, AT(prestress), "", 0.0, 0.9,
     .about = "Surface: rest lengths are shortened by this fraction; 0.1 lets cuts open."},
    {"skin", OPTION_GROUP, AT(skin), "", .preset_text = "the cells' own faces",
     .about = "Voxel: display surface carried by the elements."},
    {"integrator", OPTION_WORD, AT(integrator), "", .words = INTEGRATOR_WORDS,
     .preset = INTEGRATOR_LEAPFROG, .preset_text = "surface leapfrog, voxel symplectic_euler",
     .about =
         "Time integrator: `leapfrog` and `symplectic_euler` evaluate the forces once per step, "
         "`rk4` (surface only) four times. `implicit` (surface only) solves a linear system once "
         "per tick, or once per `time_step`, and is stable for any stiffness of the body; its "
         "contacts, graspers and attachments are at most as stiff as that step allows (`--explain` "
         "prints it), and its positions have double precision. `auto`: for a surface body "
         "`leapfrog`, but `implicit` where leapfrog would take more than 64 steps per tick at the "
         "finest level; for a voxel body its default. Bodies that are joined by `attachments` need "
         "the same integrator: those that name none take that of the others; if none names one and "
         "both models are joined, all take `leapfrog`."},
    {"theta", OPTION_REAL, AT(theta), "", 0.5, 1.0, .preset = 0.55,
     .about = "Surface, `implicit`: weight of the end of a step in its forces. 0.5 is the most "
              "accurate and damps nothing, 1 is backward Euler."},
    {"solver_tolerance", OPTION_REAL, AT(solver_tolerance), "", 1e-12, 1.0, .preset = 0.01,
     .about = "Surface, `implicit`: relative tolerance of the linear system's residual."},
    {"solver_iterations", OPTION_INT, AT(solver_iterations), "", 1.0, 10000.0, .preset = 50,
     .about = "Surface, `implicit`: largest number of iterations per step; the rest of the "
              "residual is left to the next step."},
    {"time_step", OPTION_REAL, AT(time_step), "s", 0.0, 1.0, .open = true,
     .preset_text = "from the stability bound",
     .about = "Longest step; a tick is divided into equal steps of at most this length."},
    {"unsafe_time_step", OPTION_BOOL, AT(unsafe_time_step), "",
     .about = "Accepts a time step beyond the stability bound."},
    {"fixed", OPTION_LIST, AT(fixed), "", .about = "Regions whose nodes never move."},
    {"initial", OPTION_STRING, AT(initial), "", .low = 1, .high = SCENE_FILE_MAX,
     .preset_text = "at rest",
     .about = "HDF5 file with `/position` and, if not zero, `/velocity`, [n][3], in the order of "
              "the mesh; of a voxel body, of all its vertices by ascending `id`."},
    {"cuttable", OPTION_BOOL, AT(cuttable), "",
     .about = "Whether blades and cut messages cut the body. Costs nothing if false."},
    {"split_budget", OPTION_INT, AT(split_budget), "", 1.0, 1e6, .preset = 12,
     .about = "Voxel: largest number of elements that one tick divides around a cut; the rest "
              "follows in the next ticks. Not for a plane body, whose elements are never divided."},
    {"tear", OPTION_GROUP, AT(tear), "", .preset_text = "never tears",
     .about = "Strain, stress or force at which the body tears; needs `cuttable = true`."},
};
#undef AT
const OptionTable BODY_TABLE = OPTION_TABLE(
    "bodies", "One soft body, of one of two models. Keys of the other are errors.", BODY_OPTIONS);

typedef struct ContactGroup {
    double ratio, damping, friction;
} ContactGroup;

static const Option CONTACT_OPTIONS[] = {
    {"stiffness", OPTION_REAL, offsetof(ContactGroup, ratio), "", 0.0, 100.0, .open = true,
     .preset = 0.5,
     .about = "Stiffness of the contact as a share of the body's own; a stiffer contact needs a "
              "smaller time step."},
    {"damping_time", OPTION_REAL, offsetof(ContactGroup, damping), "s", 0.0, 1.0, .preset = 2e-4,
     .about = "Damping of the contact over its stiffness. With 0, or little in stiff contacts, the "
              "steps of `leapfrog` and `symplectic_euler` are up to 1.28 times shorter, since "
              "bounces would gain energy."},
    {"friction", OPTION_REAL, offsetof(ContactGroup, friction), "", 0.0, 10.0, .preset = 0.2,
     .about = "Coulomb friction coefficient; 0: frictionless."},
};
const OptionTable CONTACT_TABLE = OPTION_TABLE(
    "bodies.contact", "The penalty force between the body's faces and tools.", CONTACT_OPTIONS);

typedef struct TearGroup {
    double stress, force, stretch;
} TearGroup;

static const Option TEAR_OPTIONS[] = {
    {"stress", OPTION_REAL, offsetof(TearGroup, stress), "Pa", 0.0, 1e12, .open = true,
     .preset_text = "none",
     .about = "Voxel: strength of the tissue; a crack grows where it is exceeded. Not for a plane "
              "body."},
    {"force", OPTION_REAL, offsetof(TearGroup, force), "N", 0.0, FORCE_LIMIT, .open = true,
     .preset_text = "none",
     .about =
         "Voxel, instead of `stress`: the paper's threshold on the external force on a vertex."},
    {"stretch", OPTION_REAL, offsetof(TearGroup, stretch), "", 0.0, 100.0, .open = true,
     .preset_text = "none",
     .about = "Surface: strain across an edge at which a crack grows; it starts at 1.5 times this "
              "strain."},
};
const OptionTable TEAR_TABLE =
    OPTION_TABLE("bodies.tear", "Threshold at which a body tears by its own strain: one of these.",
                 TEAR_OPTIONS);

static const struct {
    const char *key;
    SceneModel model; // the only one that uses the key
} MEANT_FOR[] = {
    {"theta", MODEL_SURFACE},
    {"solver_tolerance", MODEL_SURFACE},
    {"solver_iterations", MODEL_SURFACE},
    {"mesh", MODEL_SURFACE},
    {"start_level", MODEL_SURFACE},
    {"adjust", MODEL_SURFACE},
    {"adapt", MODEL_SURFACE},
    {"shape", MODEL_SURFACE},
    {"prestress", MODEL_SURFACE},
    {"voxels", MODEL_VOXEL},
    {"law", MODEL_VOXEL},
    {"dimensions", MODEL_VOXEL},
    {"materials", MODEL_VOXEL},
    {"skin", MODEL_VOXEL},
    {"split_budget", MODEL_VOXEL},
};

const char *scene_model_name(SceneModel model)
{
    return MODEL_WORDS[model].word;
}

// Refuses a key that the body's model would ignore.
static bool check_meant(const SceneReader *reader, const BodyGroup *raw)
{
    for (size_t i = 0; i < sizeof MEANT_FOR / sizeof MEANT_FOR[0]; i++)
        if (option_given(raw->at, MEANT_FOR[i].key) && (int)MEANT_FOR[i].model != raw->model)
            return option_fail(&reader->source, option_find(raw->at, MEANT_FOR[i].key),
                               "%s means nothing for a %s body", MEANT_FOR[i].key,
                               scene_model_name((SceneModel)raw->model));
    return true;
}

// Refuses a threshold that the body's model does not have.
static bool check_threshold(const SceneReader *reader, const BodyGroup *raw, const char *key,
                            SceneModel model)
{
    return !option_given(raw->tear, key) || (int)model == raw->model ||
           option_fail(&reader->source, option_find(raw->tear, key),
                       "tear.%s means nothing for a %s body, only %s", key,
                       scene_model_name((SceneModel)raw->model),
                       raw->model == MODEL_VOXEL ? "stress or force" : "stretch");
}

// Checks a plane body, which keeps its elements and has no lattice faces to sum stresses over.
static bool check_plane(const SceneReader *reader, const BodyGroup *raw, const SceneBody *body)
{
    const OptionSource *source = &reader->source;
    if (body->model != MODEL_VOXEL || body->voxel.dimensions != 2)
        return true;
    if (option_given(raw->at, "split_budget"))
        return option_fail(source, option_find(raw->at, "split_budget"),
                           "split_budget means nothing for a plane body: a cut divides none of its "
                           "elements");
    return !option_given(raw->tear, "stress") ||
           option_fail(source, option_find(raw->tear, "stress"),
                       "tear.stress means nothing for a plane body, only force");
}

static bool read_tear(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    const OptionSource *source = &reader->source;
    TearGroup tear = {0};
    if (raw->tear == NULL)
        return true;
    if (!option_read(&TEAR_TABLE, raw->tear, source, &tear) ||
        !check_threshold(reader, raw, "stress", MODEL_VOXEL) ||
        !check_threshold(reader, raw, "force", MODEL_VOXEL) ||
        !check_threshold(reader, raw, "stretch", MODEL_SURFACE))
        return false;
    if (option_given(raw->tear, "stress") && option_given(raw->tear, "force"))
        return option_fail(source, raw->tear, "tear has both stress and force: one of them");
    if (!(tear.stress > 0.0) && !(tear.force > 0.0) && !(tear.stretch > 0.0))
        return option_fail(source, raw->tear, "tear is empty: give it %s",
                           raw->model == MODEL_VOXEL ? "stress or force" : "stretch");
    if (!raw->cuttable)
        return option_fail(source, raw->tear, "tear needs cuttable = true");
    body->voxel.tear_stress = tear.stress;
    body->voxel.tear_force = tear.force;
    body->surface.tear_stretch = tear.stretch;
    return true;
}

// Reads the options of cuts and tears.
static bool read_cutting(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    if (body->model == MODEL_VOXEL) {
        body->voxel.body.cuttable = raw->cuttable;
        body->voxel.split_budget = raw->split_budget;
        body->voxel.body.node_capacity = reader->scene->node_capacity;
        body->voxel.body.face_capacity = reader->scene->face_capacity;
    } else {
        body->surface.body.cuttable = raw->cuttable;
    }
    return check_plane(reader, raw, body) && read_tear(reader, raw, body);
}

static bool check_built(const SceneReader *reader, const BodyGroup *raw)
{
    const char *lacks = NULL;
#ifndef PLIANT_WITH_SURFACE
    if (raw->model == MODEL_SURFACE)
        lacks = "surface bodies (PLIANT_SURFACE)";
#endif
#ifndef PLIANT_WITH_VOXEL
    if (raw->model == MODEL_VOXEL)
        lacks = "voxel bodies (PLIANT_VOXEL)";
#endif
    return lacks == NULL ||
           option_fail(&reader->source, raw->at, "this pliantd was built without %s", lacks);
}

static bool read_contact(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    ContactGroup contact;
    if (!option_read(&CONTACT_TABLE, raw->contact, &reader->source, &contact))
        return false;
    if (body->model == MODEL_VOXEL) {
        body->voxel.body.contact_ratio = contact.ratio;
        body->voxel.body.contact_damping = contact.damping;
        body->voxel.body.friction = contact.friction;
    } else {
        body->surface.body.contact_ratio = contact.ratio;
        body->surface.body.contact_damping = contact.damping;
        body->surface.body.friction = contact.friction;
    }
    return true;
}

static bool read_fixed(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    if (!scene_read_fixed(reader, raw->fixed, body))
        return false;
    if (body->model == MODEL_VOXEL) {
        body->voxel.body.fixed = body->fixed;
        body->voxel.body.fixed_count = body->fixed_count;
    } else {
        body->surface.body.fixed = body->fixed;
        body->surface.body.fixed_count = body->fixed_count;
    }
    return true;
}

bool scene_read_body(const SceneReader *reader, const config_setting_t *group, SceneBody *body)
{
    BodyGroup raw = {.at = group};
    body->line = (int)config_setting_source_line(group);
    if (!option_read(&BODY_TABLE, group, &reader->source, &raw) || !check_built(reader, &raw) ||
        !check_meant(reader, &raw))
        return false;
    body->model = (SceneModel)raw.model;
    body->any_integrator = !option_given(group, "integrator") ||
                           (body->model == MODEL_VOXEL && raw.integrator == INTEGRATOR_AUTO);
    snprintf(body->name, sizeof body->name, "%s", raw.name);
    if (option_given(group, "initial"))
        body->initial = scene_source_resolve(reader->folder, raw.initial);
    return (body->model == MODEL_VOXEL ? scene_read_voxel(reader, &raw, body)
                                       : scene_read_surface(reader, &raw, body)) &&
           read_cutting(reader, &raw, body) && read_contact(reader, &raw, body) &&
           read_fixed(reader, &raw, body);
}
