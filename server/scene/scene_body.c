// SPDX-License-Identifier: MIT
// Reads one entry of `bodies`: the keys of both models, and checks which of them apply to its own.
#include "scene/scene_parts.h"

#include <math.h>

static const OptionWord MODEL_WORDS[] = {
    {"surface", MODEL_SURFACE}, {"voxel", MODEL_VOXEL}, {NULL, 0}};
static const OptionWord INTEGRATOR_WORDS[] = {{"leapfrog", INTEGRATOR_LEAPFROG},
                                              {"rk4", INTEGRATOR_RK4},
                                              {"symplectic_euler", INTEGRATOR_SYMPLECTIC_EULER},
                                              {"implicit", INTEGRATOR_IMPLICIT},
                                              {"auto", INTEGRATOR_AUTO},
                                              {NULL, 0}};
_Static_assert(sizeof INTEGRATOR_WORDS / sizeof *INTEGRATOR_WORDS == INTEGRATOR_COUNT + 2,
               "every integrator has a word");
static const OptionWord ADJUST_WORDS[] = {
    {"continuum", ADJUST_CONTINUUM}, {"choi2005", ADJUST_CHOI2005}, {NULL, 0}};
static const OptionWord LAW_WORDS[] = {
    {"affine", VOXEL_AFFINE}, {"miyazaki2004", VOXEL_MIYAZAKI2004}, {NULL, 0}};
static const OptionWord SHOWN_WORDS[] = {
    {"auto", SHOWN_AUTO}, {"fitted", SHOWN_FITTED}, {"blocks", SHOWN_BLOCKS}, {NULL, 0}};

// As it was built: "auto" may be.
static bool is_implicit(const OptionPlace *place)
{
    return place->made->integrator == INTEGRATOR_IMPLICIT;
}

#define AT(member) offsetof(BodyGroup, member)
static const Option BODY_OPTIONS[] = {
    {"name", OPTION_NAME, AT(name), "", .low = 1, .high = SCENE_WORD_MAX, .required = true,
     .about = "Name of the body in channels, commands and files; unique."},
    {"model", OPTION_WORD, AT(body.model), "", .words = MODEL_WORDS, .preset = MODEL_SURFACE,
     .about = "Surface: a hollow organ as a mesh of springs (Choi et al. 2005). Voxel: a solid "
              "organ of elements, small at its surface and large inside (Miyazaki et al. 2004)."},
    {"mesh", OPTION_GROUP, AT(mesh), "", .preset_text = "required of a surface body",
     .only = SURFACE_ONLY, .about = "Source of its triangles."},
    {"voxels", OPTION_GROUP, AT(voxels), "", .preset_text = "required of a voxel body",
     .only = VOXEL_ONLY, .about = "Source of its cells."},
    {"levels", OPTION_INT, AT(body.options.levels), "", 0.0, LEVELS_MAX, .grouped = true,
     .preset_text = "surface 0, voxel 2", .physics = true, .feature = {.name = "levels of detail"},
     .about = "Surface: finest level of detail; each level divides every face into four. 0: the "
              "mesh as it is. Voxel, 0 to 5: coarsest level; elements inside are up to 2^levels "
              "cells wide. 0: one element per cell. Or a group: elements at the surface are "
              "larger, too, "
              "where no tool is near."},
    {"start_level", OPTION_INT, AT(body.surface.start_level), "", 0.0, LEVELS_MAX,
     .only = SURFACE_ONLY, .physics = true,
     .about = "Surface: level at which the body starts, and at which it stays without `adapt`; at "
              "most `levels`."},
    {"adjust", OPTION_WORD, AT(body.surface.adjust), "", .words = ADJUST_WORDS,
     .preset = ADJUST_CONTINUUM, .only = SURFACE_ONLY, .physics = true,
     .idle = {&IDLE_HAS_ONE_LEVEL},
     .about = "Surface: how properties follow the level: `continuum` as those of an elastic "
              "membrane, `choi2005` by the paper's eqs 6 to 9, which a `cuttable` body with levels "
              "cannot use. No effect with `levels = 0`."},
    {"adapt", OPTION_GROUP, AT(adapt), "", .preset_text = "stays at start_level",
     .feature = {.name = "refinement at run time", .only = SURFACE_ONLY},
     .about =
         "Surface: when faces are refined and coarsened. Voxel, with `levels.surface`: how far "
         "around tools elements are fine."},
    {"law", OPTION_WORD, AT(body.voxel.law), "", .words = LAW_WORDS, .preset = VOXEL_AFFINE,
     .only = VOXEL_ONLY, .physics = true,
     .about = "Voxel: law of the elements: `affine` is exact for uniform strain at every level, "
              "`miyazaki2004` is the paper's."},
    {"dimensions", OPTION_INT, AT(body.dimensions), "", 2.0, 3.0, .preset_text = "3, of a `disc` 2",
     .only = VOXEL_ONLY, .physics = true, .about = "Voxel: 2 is the plane case, in z = 0."},
    {"material", OPTION_GROUP, AT(material), "", .preset_text = "its defaults",
     .about = "Stiffness, mass and damping."},
    {"materials", OPTION_LIST, AT(materials), "", .only = VOXEL_ONLY,
     .about = "Voxel: materials for individual labels of a volume, instead of `material`."},
    {"shape", OPTION_GROUP, AT(shape), "", .preset_text = "no shape springs", .only = SURFACE_ONLY,
     .feature = {.name = "shape springs"},
     .about = "Surface: springs that pull every node to its rest position."},
    {"cavity", OPTION_GROUP, AT(cavity), "", .preset_text = "nothing is inside",
     .only = SURFACE_ONLY, .about = "Surface: what a closed wall encloses, and its pressure."},
    {"contact", OPTION_GROUP, AT(contact), "", .preset_text = "its defaults",
     .about = "Contact of the body with tools."},
    {"prestress", OPTION_REAL, AT(body.surface.prestress), "", 0.0, 0.9, .only = SURFACE_ONLY,
     .physics = true, .feature = {.name = "prestress"},
     .about = "Surface: rest lengths are shortened by this fraction; 0.1 lets cuts open."},
    {"skin", OPTION_GROUP, AT(skin), "", .preset_text = "the cells' own faces", .only = VOXEL_ONLY,
     .feature = {.name = "display surface"},
     .about = "Voxel: display surface carried by the elements."},
    {"surface", OPTION_WORD, AT(body.shown), "", .words = SHOWN_WORDS, .preset = SHOWN_AUTO,
     .only = VOXEL_ONLY, .physics = true, .idle = {&IDLE_IS_NOT_SHOWN, &IDLE_PUBLISHES_ALL_NODES},
     .about = "Voxel: what is published of the outer faces and of cuts, and what tools and other "
              "bodies feel: "
              "`fitted`, a smooth surface "
              "through the labels or the mesh that the cells were made of; `blocks`, the faces of "
              "the cells, whose nodes are the vertices that move. `auto`: `fitted` for bodies from "
              "a volume or a mesh, `blocks` for generators, with a `skin`, and with "
              "`publish.nodes = \"all\"`, which publishes vertices."},
    {"integrator", OPTION_WORD, AT(body.options.integrator), "", .words = INTEGRATOR_WORDS,
     .preset = INTEGRATOR_LEAPFROG, .preset_text = "surface leapfrog, voxel symplectic_euler",
     .physics = true,
     .feature = {.name = "implicit integration",
                 is_implicit,
                 "integrator = \"implicit\" or \"auto\"",
                 SURFACE_ONLY},
     .about =
         "Time integrator: `leapfrog` and `symplectic_euler` evaluate the forces once per step, "
         "`rk4` (surface only) four times. `implicit` (surface only) solves a linear system once "
         "per tick, or once per `time_step`, and is stable for any stiffness of the body; its "
         "contacts, graspers and attachments are at most as stiff as that step allows (`--explain` "
         "prints it), and its positions have double precision. `auto`: for a surface body "
         "`leapfrog`, but `implicit` where that is cheaper, by counts of nodes, springs and steps "
         "per tick at the "
         "finest level; for a voxel body its default. Bodies that are joined by `attachments` need "
         "the same integrator: those that name none take that of the others; if none names one and "
         "both models are joined, all take `leapfrog`."},
    {"theta", OPTION_REAL, AT(body.surface.implicit.theta), "", 0.5, 1.0, .preset = 0.55,
     .only = SURFACE_ONLY, .physics = true, .idle = {&IDLE_IS_EXPLICIT},
     .about = "Surface, `implicit`: weight of the end of a step in its forces. 0.5 is the most "
              "accurate and damps nothing, 1 is backward Euler."},
    {"solver_tolerance", OPTION_REAL, AT(body.surface.implicit.tolerance), "", 1e-12, 1.0,
     .preset = 0.01, .only = SURFACE_ONLY, .physics = true, .idle = {&IDLE_IS_EXPLICIT},
     .about = "Surface, `implicit`: relative tolerance of the linear system's residual."},
    {"solver_iterations", OPTION_INT, AT(body.surface.implicit.iterations), "", 1.0, 10000.0,
     .preset = 50, .only = SURFACE_ONLY, .physics = true, .idle = {&IDLE_IS_EXPLICIT},
     .about = "Surface, `implicit`: largest number of iterations per step; the rest of the "
              "residual is left to the next step."},
    {"time_step", OPTION_REAL, AT(body.options.time_step), "s", 0.0, 1.0, .open = true,
     .preset_text = "from the stability bound", .physics = true,
     .about = "Longest step; a tick is divided into equal steps of at most this length."},
    {"unsafe_time_step", OPTION_BOOL, AT(body.options.unsafe_time_step), "",
     .idle = {&IDLE_HAS_NO_TIME_STEP}, .about = "Accepts a time step beyond the stability bound."},
    {"fixed", OPTION_LIST, AT(fixed), "", .feature = {.name = "held nodes"},
     .about = "Regions whose nodes never move."},
    {"weights", OPTION_LIST, AT(weights), "", .only = VOXEL_ONLY,
     .about = "Voxel: masses that hang on vertices. Not of a body that can be cut."},
    {"initial", OPTION_STRING, AT(initial), "", .low = 1, .high = SCENE_FILE_MAX,
     .preset_text = "at rest",
     .about = "HDF5 file with `/position` and, if not zero, `/velocity`, [n][3], in the order of "
              "the mesh; of a voxel body, of all its vertices by ascending `id`."},
    {"cuttable", OPTION_BOOL, AT(body.options.cuttable), "", .physics = true,
     .feature = {.name = "cuts"},
     .about = "Whether blades and cut messages cut the body. Costs nothing if false."},
    {"split_budget", OPTION_INT, AT(body.voxel.split_budget), "", 1.0, 1e6, .preset = 12,
     .only = VOXEL_ONLY, .physics = true, .idle = {&IDLE_IS_WHOLE, &IDLE_HAS_ONLY_CELLS},
     .about = "Voxel: largest number of elements that one tick divides around a cut; the rest "
              "follows in the next ticks. Solids that adapt divide what is in the way of a cut at "
              "once. Not for a plane body, whose elements are never divided."},
    {"coagulated_stiffness", OPTION_REAL, AT(body.voxel.coagulated_stiffness), "", 1.0, 100.0,
     .preset = HEAT_STIFFER, .only = VOXEL_ONLY, .physics = true,
     .idle = {&IDLE_IS_WHOLE, &IDLE_IS_NOT_HEATED},
     .about = "Voxel: stiffness of tissue that diathermy has coagulated, over that before. From "
              "the first coagulated cell on steps are shorter by its square root; 1: never."},
    {"look", OPTION_GROUP, AT(look), "", .preset_text = "a colour by its name",
     .about = "Colours and images for viewers."},
    {"tear", OPTION_GROUP, AT(tear), "", .preset_text = "never tears",
     .feature = {.name = "tearing"},
     .about = "Strain, stress or force at which the body tears; needs `cuttable = true`."},
};
#undef AT
const OptionTable BODY_TABLE = {
    TABLE_MEMBERS(NULL, "bodies",
                  "One soft body, of one of two models. Keys of the other are errors.",
                  BODY_OPTIONS),
    .variant = offsetof(SceneBody, model), .given = offsetof(SceneBody, given)};

static const Option CONTACT_OPTIONS[] = {
    {"stiffness", OPTION_REAL, offsetof(SceneBody, options.contact_ratio), "", 0.0, 100.0,
     .open = true, .preset = 0.5, .physics = true, .idle = {&IDLE_MEETS_NO_TOOL},
     .about =
         "Stiffness of the contact as a share of the body's own. For probes on solids 4 is "
         "added, and it costs nothing; elsewhere a stiffer contact needs a smaller time step."},
    {"damping_time", OPTION_REAL, offsetof(SceneBody, options.contact_damping), "s", 0.0, 1.0,
     .preset = 2e-4, .physics = true, .idle = {&IDLE_MEETS_NO_TOOL},
     .about = "Damping of the contact over its stiffness. With 0, or little in stiff contacts, the "
              "steps of `leapfrog` and `symplectic_euler` are up to 1.28 times shorter, since "
              "bounces would gain energy."},
    {"friction", OPTION_REAL, offsetof(SceneBody, options.friction), "", FRICTION_RANGE,
     .preset = 0.2, .physics = true, .live = "friction",
     .idle = {&IDLE_MEETS_NO_TOOL, &IDLE_TOOLS_HAVE_FRICTION},
     .feature = {.name = "friction at tools"},
     .about = "Coulomb friction coefficient; 0: frictionless."},
};
const OptionTable CONTACT_TABLE = BODY_OPTION_TABLE(
    "bodies.contact", "The penalty force between the body's faces and tools.", CONTACT_OPTIONS);

static const Option TEAR_OPTIONS[] = {
    {"stress", OPTION_REAL, offsetof(SceneBody, voxel.tear_stress), "Pa", 0.0, 1e12, .open = true,
     .preset_text = "none", .only = VOXEL_ONLY, .physics = true,
     .about = "Voxel: strength of the tissue; a crack grows where it is exceeded. Not for a plane "
              "body."},
    {"force", OPTION_REAL, offsetof(SceneBody, voxel.tear_force), "N", 0.0, FORCE_LIMIT,
     .open = true, .preset_text = "none", .only = VOXEL_ONLY, .physics = true,
     .about =
         "Voxel, instead of `stress`: the paper's threshold on the external force on a vertex."},
    {"stretch", OPTION_REAL, offsetof(SceneBody, surface.tear_stretch), "", 0.0, 100.0,
     .open = true, .preset_text = "none", .only = SURFACE_ONLY, .physics = true,
     .about = "Surface: strain across an edge at which a crack grows; it starts at 1.5 times this "
              "strain."},
};
const OptionTable TEAR_TABLE = BODY_OPTION_TABLE(
    "bodies.tear", "Threshold at which a body tears by its own strain: one of these.",
    TEAR_OPTIONS);

static const Option STIFFENING_OPTIONS[] = {
    {"strain", OPTION_REAL, offsetof(Stiffening, strain), "", 0.0, 10.0, .open = true,
     .required = true, .physics = true, .feature = {.name = "stiffening"},
     .about = "Strain s in the law: along one axis the stress at a strain e is E e exp((e/s)^2), "
              "as far as `cap` permits: 1.3 times that of the linear law at e = s/2."},
    {"cap", OPTION_REAL, offsetof(Stiffening, cap), "", 1.0, 100.0, .required = true,
     .physics = true,
     .about = "Largest stiffness over that of the linear law; from there on stress grows in a "
              "straight line. The time step is that of a linear body so many times as stiff, "
              "shorter by sqrt(cap), see `--check`. 1: linear."},
};
const OptionTable STIFFENING_TABLE = OPTION_TABLE(
    "bodies.material.stiffening",
    "Stiffening by Fung's exponential law: the energy W of the linear law becomes c (exp(W/c) - "
    "1), with c that energy at the strain s along one axis.",
    STIFFENING_OPTIONS);

bool scene_read_stiffening(const SceneReader *reader, const config_setting_t *group,
                           Stiffening *stiffening)
{
    return group == NULL || option_read(&STIFFENING_TABLE, group, &reader->source, stiffening);
}

const char *scene_model_name(SceneModel model)
{
    // Of cells both models have one word.
    return MODEL_WORDS[model == MODEL_PLANE ? MODEL_VOXEL : model].word;
}

// Refuses a key that the body's model would ignore.
static bool check_meant(const SceneReader *reader, const BodyGroup *raw)
{
    char owner[32];
    const config_setting_t *levels = option_find(raw->at, "levels");
    snprintf(owner, sizeof owner, "a %s body", scene_model_name(raw->body.model));
    if (raw->body.model == MODEL_SURFACE && levels != NULL && config_setting_is_group(levels))
        return option_fail(&reader->source, levels, "levels of %s must be a whole number", owner);
    return option_refuse_unused(&BODY_TABLE, raw->at, &reader->source, (int)raw->body.model, owner);
}

// Refuses a threshold that the body's model does not have.
static bool check_thresholds(const SceneReader *reader, const config_setting_t *group,
                             SceneModel model)
{
    for (int i = 0; i < TEAR_TABLE.count; i++) {
        const Option *option = &TEAR_TABLE.option[i];
        if (!option_is_used(option, (int)model) && option_given(group, option->key))
            return option_fail(&reader->source, option_find(group, option->key),
                               "tear.%s means nothing for a %s body, only %s", option->key,
                               scene_model_name(model),
                               model == MODEL_SURFACE ? "stretch" : "stress or force");
    }
    return true;
}

// Checks a plane body, which keeps its elements and has no lattice faces to sum stresses over.
static bool check_plane(const SceneReader *reader, const BodyGroup *raw, const SceneBody *body)
{
    const OptionSource *source = &reader->source;
    if (body->model != MODEL_PLANE)
        return true;
    if (option_given(raw->at, "coagulated_stiffness"))
        return option_fail(source, option_find(raw->at, "coagulated_stiffness"),
                           "coagulated_stiffness means nothing for a plane body: nothing heats it");
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
    if (raw->tear == NULL)
        return true;
    if (!option_read(&TEAR_TABLE, raw->tear, source, body) ||
        !check_thresholds(reader, raw->tear, body->model))
        return false;
    // One threshold, and a body that can be cut.
    if (option_given(raw->tear, "stress") && option_given(raw->tear, "force"))
        return option_fail(source, raw->tear, "tear has both stress and force: one of them");
    if (option_length(raw->tear) == 0)
        return option_fail(source, raw->tear, "tear is empty: give it %s",
                           scene_has_cells(body) ? "stress or force" : "stretch");
    if (!body->options.cuttable)
        return option_fail(source, raw->tear, "tear needs cuttable = true");
    // A body is whole until something pulls at it.
    double most = 0.0;
    for (int i = 0; scene_has_cells(body) && i < body->voxel.material_count; i++)
        most = fmax(most, body->material[i].prestress);
    char text[2][OPTION_NUMBER_TEXT];
    return !option_given(raw->tear, "stress") || body->voxel.tear_stress > most ||
           option_fail(source, option_find(raw->tear, "stress"),
                       "tear.stress %s must be more than prestress, %s",
                       option_number_text(text[0], body->voxel.tear_stress),
                       option_number_text(text[1], most));
}

// After the cells were read: only then a plane body is known to be one.
static bool check_built(const SceneReader *reader, const BodyGroup *raw, const SceneBody *body)
{
    // What this build lacks is refused where the scene says that it wants it.
    const char *lacks = NULL;
    (void)body; // where all are built in
#ifndef PLIANT_WITH_SURFACE
    if (body->model == MODEL_SURFACE)
        lacks = "surface bodies (PLIANT_SURFACE)";
#endif
#ifndef PLIANT_WITH_VOXEL
    if (body->model == MODEL_VOXEL)
        lacks = "voxel bodies (PLIANT_VOXEL)";
#endif
#ifndef PLIANT_WITH_PLANE
    if (body->model == MODEL_PLANE)
        lacks = "plane bodies (PLIANT_PLANE)";
#endif
    return lacks == NULL ||
           option_fail(&reader->source, raw->at, "this pliantd was built without %s", lacks);
}

bool scene_read_body(const SceneReader *reader, const config_setting_t *group, SceneBody *body)
{
    BodyGroup raw = {.at = group};
    const OptionSource *source = &reader->source;
    if (!option_read(&BODY_TABLE, group, source, &raw) || !check_meant(reader, &raw))
        return false;
    // What every body has, whatever its model.
    *body = raw.body;
    body->line = (int)config_setting_source_line(group);
    body->any_integrator =
        !option_given(group, "integrator") ||
        (scene_has_cells(body) && (int)body->options.integrator == INTEGRATOR_AUTO);
    body->options.node_capacity = reader->scene->node_capacity;
    body->options.face_capacity = reader->scene->face_capacity;
    snprintf(body->name, sizeof body->name, "%s", raw.name);
    if (option_given(group, "initial"))
        body->initial = scene_source_resolve(reader->folder, raw.initial);
    // Then what its model has, and what depends on both.
    return (scene_has_cells(body) ? scene_read_voxel(reader, &raw, body)
                                  : scene_read_surface(reader, &raw, body) &&
                                        scene_read_look(reader, raw.look, body)) &&
           check_built(reader, &raw, body) && check_plane(reader, &raw, body) &&
           read_tear(reader, &raw, body) &&
           option_read(&CONTACT_TABLE, raw.contact, source, body) &&
           scene_read_fixed(reader, raw.fixed, body);
}
