// SPDX-License-Identifier: MIT
// Reads the keys of a body that only the voxel model has: voxels, materials and skin.
#include "scene/scene_parts.h"

#include "base/check.h"
#include "io/volume_import.h"

#include <stdlib.h>

// --- `voxels`: a label volume, a mesh to be filled or a generator, and its placement in the world

typedef struct VoxelsGroup {
    VoxelSource voxels;
    const char *file, *mesh;
    int generator, dimensions;
    const config_setting_t *label, *count, *place;
} VoxelsGroup;

static const OptionWord GENERATOR_WORDS[] = {
    {"box", VOXELS_BOX}, {"ball", VOXELS_BALL}, {"disc", VOXELS_DISC}, {NULL, 0}};

static const OptionWord INNER_WORDS[] = {
    {"cavity", INNER_CAVITY}, {"filled", INNER_FILLED}, {NULL, 0}};

enum { CELLS_ALONG = 4096, CELLS_USUAL = 16, LABEL_MAX = 1000000000 };
#define GENERATED_SIZE 0.003125 // [m]

// Sources that use a key.
#define FROM(kind) (1u << (kind))

#define AT(member) offsetof(VoxelsGroup, member)
static const Option VOXELS_OPTIONS[] = {
    {"file", OPTION_STRING, AT(file), "", .low = 1, .high = SCENE_FILE_MAX, .preset_text = "none",
     .about =
         "Label volume, NRRD or NIfTI, relative to the scene's folder. One of this, `mesh` and "
         "`generator`."},
    {"label", OPTION_INTS, AT(label), "", 1.0, LABEL_MAX, .preset_text = "1", .names = true,
     .only = FROM(VOXELS_FILE),
     .about = "With `file`: the labels that belong to the body, one or a list of up to 255, by "
              "number or by the name that a .seg.nrrd gives them."},
    {"layer", OPTION_INT, AT(voxels.layer), "", 1.0, VOLUME_MOST_VOXELS,
     .preset_text = "that of the names, or the one with most of the labels",
     .only = FROM(VOXELS_FILE),
     .about = "With `file`: which of several label images is read, a layer of a .seg.nrrd or a "
              "frame of a NIfTI file, from 1."},
    {"mesh", OPTION_STRING, AT(mesh), "", .low = 1, .high = SCENE_FILE_MAX, .preset_text = "none",
     .about = "Closed OBJ, STL, PLY, OFF, VTK, MSH or TetGen mesh, relative to the scene's folder, "
              "whose inside is "
              "filled with cells of `size`."},
    {"inner", OPTION_WORD, AT(voxels.inner), "", .words = INNER_WORDS, .preset = INNER_CAVITY,
     .only = FROM(VOXELS_MESH),
     .about = "`mesh`: a closed part that lies wholly within another is a cavity, or filled. Parts "
              "that overlap are united."},
    {"generator", OPTION_WORD, AT(generator), "", .words = GENERATOR_WORDS, .preset = -1,
     .preset_text = "none",
     .about = "Shape that is generated, around the origin; `disc` is a plane body."},
    {"count", OPTION_INTS, AT(count), "", 1.0, CELLS_ALONG, .preset_text = "16",
     .only = FROM(VOXELS_BOX),
     .about = "`box`: cells along x, y and z; one number: the same along all. A plane box has "
              "two."},
    {"radius", OPTION_REAL, AT(voxels.radius), "m", 0.0, SIZE_LIMIT, .open = true, .preset = 0.05,
     .only = FROM(VOXELS_BALL) | FROM(VOXELS_DISC),
     .about = "`ball`, `disc`: cells whose centres lie within it belong to the body."},
    {"size", OPTION_REAL, AT(voxels.size), "m", 0.0, SIZE_LIMIT, .open = true,
     .preset_text = "generators 0.003125, `file` the volume's spacing, `mesh` none",
     .about = "Edge length of a cell; for generators before `scale`, otherwise in the world."},
    {"scale", OPTION_REAL, AT(voxels.scale), "", 0.0, 1e6, .open = true, .preset = 1.0,
     .about = "Metres per unit of the mesh file; 0.001 for millimetres. A volume states its own "
              "units and is enlarged by this factor, as a generator's cells are."},
    {"place", OPTION_GROUP, AT(place), "", .preset_text = "as it is",
     .about = "Position and rotation of the scaled cells."},
    {"dimensions", OPTION_INT, AT(dimensions), "", 2.0, 3.0, .preset_text = "the body's",
     .about = "The body's `dimensions`, which may be written here instead."},
};
#undef AT
const OptionTable VOXELS_TABLE =
    OPTION_TABLE("bodies.voxels", "The cells of a voxel body.", VOXELS_OPTIONS);

static const char *source_name(VoxelSourceKind kind)
{
    for (const OptionWord *word = GENERATOR_WORDS; word->word != NULL; word++)
        if (word->value == (int)kind)
            return word->word;
    return kind == VOXELS_MESH ? "a mesh" : "a file";
}

// Refuses a key that the chosen source would ignore.
static bool check_meant(const SceneReader *reader, const config_setting_t *group,
                        VoxelSourceKind kind)
{
    char owner[64];
    snprintf(owner, sizeof owner, "voxels from %s", source_name(kind));
    return option_refuse_unused(&VOXELS_TABLE, group, &reader->source, kind, owner);
}

static bool choose_kind(const SceneReader *reader, const config_setting_t *group,
                        const VoxelsGroup *raw, VoxelSource *voxels)
{
    bool file = option_given(group, "file"), mesh = option_given(group, "mesh");
    int sources = file + mesh + option_given(group, "generator");
    // One source, and only keys that it uses.
    if (sources != 1)
        return option_fail(&reader->source, group, "voxels needs %s file, mesh or generator",
                           sources == 0 ? "a" : "only one of");
    voxels->kind = file ? VOXELS_FILE : mesh ? VOXELS_MESH : (VoxelSourceKind)raw->generator;
    if (file || mesh)
        voxels->file = scene_source_resolve(reader->folder, file ? raw->file : raw->mesh);
    return check_meant(reader, group, voxels->kind);
}

static bool choose_size(const SceneReader *reader, const config_setting_t *group,
                        VoxelSource *voxels)
{
    if (option_given(group, "size") || voxels->kind == VOXELS_FILE)
        return true;
    voxels->size = GENERATED_SIZE;
    return voxels->kind != VOXELS_MESH ||
           option_require(&VOXELS_TABLE, group, "size", &reader->source);
}

// Finds the label of a name in the file, and its layer.
static bool find_named(const SceneReader *reader, const config_setting_t *at, VoxelSource *voxels,
                       int *label)
{
#ifdef PLIANT_WITH_LATTICES
    LabelVolume volume;
    Status said = {0};
    const char *name = config_setting_get_string(at);
    if (!volume_import_header(voxels->file, &volume, &said))
        return option_fail(&reader->source, at, "%s", said.text);
    int layer = voxels->layer;
    *label = volume_find_name(&volume, name, &layer, &said);
    volume_destroy(&volume);
    if (*label == 0)
        return option_fail(&reader->source, at, "%s: %s", voxels->file, said.text);
    voxels->layer = layer;
    return true;
#else
    (void)voxels;
    (void)label;
    return option_fail(&reader->source, at, "label: built without label volumes (PLIANT_VOXEL)");
#endif
}

// Reads one label, a number or a name.
static bool choose_label(const SceneReader *reader, const config_setting_t *at, VoxelSource *voxels,
                         int *label)
{
    if (config_setting_type(at) == CONFIG_TYPE_STRING)
        return find_named(reader, at, voxels, label);
    return option_read_ints(at, label, 1) == 1;
}

static bool choose_labels(const SceneReader *reader, const VoxelsGroup *raw, VoxelSource *voxels)
{
    int count = option_read_ints(raw->label, NULL, 0);
    if (count > LATTICE_MATERIALS)
        return option_fail(&reader->source, raw->label, "label has %d entries, at most %d", count,
                           LATTICE_MATERIALS);
    // Without labels of its own the body is what has label 1.
    voxels->label_count = count > 0 ? count : 1;
    voxels->label[0] = 1;
    voxels->any_label = count == 0;
    for (int i = 0; i < count; i++) {
        const config_setting_t *one = config_setting_is_scalar(raw->label)
                                          ? raw->label
                                          : config_setting_get_elem(raw->label, (unsigned)i);
        if (!choose_label(reader, one, voxels, &voxels->label[i]))
            return false;
    }
    // Each label is one material.
    for (int i = 0; i < count; i++)
        for (int k = 0; k < i; k++)
            if (voxels->label[k] == voxels->label[i])
                return option_fail(&reader->source, raw->label, "label %d is chosen twice",
                                   voxels->label[i]);
    return true;
}

static bool choose_count(const SceneReader *reader, const VoxelsGroup *raw, bool plane,
                         VoxelSource *voxels)
{
    int *count = voxels->count;
    // One number stands for all directions, two for those of the plane.
    int given = option_read_ints(raw->count, count, 3);
    if (raw->count == NULL)
        count[0] = CELLS_USUAL;
    if (given <= 1)
        count[1] = count[2] = count[0];
    if (plane && (given <= 2))
        count[2] = 1;
    // What is left contradicts the dimensions.
    if (given > 3 || (given == 2 && !plane))
        return option_fail(&reader->source, raw->count,
                           "count has %d entries and must be one or three numbers%s", given,
                           plane ? "" : ", two only with dimensions 2");
    return !plane || count[2] == 1 ||
           option_fail(&reader->source, raw->count,
                       "count %d along z: a plane body has one layer of cells", count[2]);
}

// Here alone dimensions are asked for: from then on a plane body is of a model of its own.
static bool choose_dimensions(const SceneReader *reader, const config_setting_t *group,
                              const VoxelsGroup *raw, SceneBody *body)
{
    const OptionSource *source = &reader->source;
    const VoxelSource *voxels = &body->voxels;
    int *dimensions = &body->dimensions;
    const config_setting_t *at = option_find(group, "dimensions");
    // What the body says, what its voxels say, or what their source implies.
    if (at != NULL && *dimensions != 0 && raw->dimensions != *dimensions)
        return option_fail(source, at, "dimensions %d contradicts dimensions %d of the body",
                           raw->dimensions, *dimensions);
    if (at != NULL)
        *dimensions = raw->dimensions;
    if (*dimensions == 0)
        *dimensions = voxels->kind == VOXELS_DISC ? 2 : 3;
    // Some sources make bodies of one kind only.
    if (voxels->kind == VOXELS_DISC && *dimensions == 3)
        return option_fail(source, at != NULL ? at : group,
                           "dimensions 3 means nothing for voxels from disc, a plane body");
    if (voxels->kind != VOXELS_DISC && voxels->kind != VOXELS_BOX && *dimensions == 2)
        return option_fail(source, at != NULL ? at : group,
                           "dimensions 2 means nothing for voxels from %s, only for box and disc",
                           source_name(voxels->kind));
    body->model = *dimensions == 2 ? MODEL_PLANE : MODEL_VOXEL;
    return true;
}

// Checks that a plane body stays in z = 0.
static bool check_place(const SceneReader *reader, const config_setting_t *place,
                        const VoxelSource *voxels)
{
    const Vec3 *turn = &voxels->rotation;
    if (voxels->translation.z == 0.0 && turn->x == 0.0 && turn->y == 0.0)
        return true;
    return option_fail(&reader->source, place,
                       "place takes a plane body out of z = 0: it can move along x and y, and turn "
                       "about z");
}

bool scene_read_voxels(const SceneReader *reader, const config_setting_t *group, SceneBody *body)
{
    VoxelsGroup raw = {0};
    VoxelSource *voxels = &body->voxels;
    if (!option_read(&VOXELS_TABLE, group, &reader->source, &raw))
        return false;
    *voxels = raw.voxels;
    // Choices that depend on each other, in this order.
    if (!choose_kind(reader, group, &raw, voxels) || !choose_size(reader, group, voxels) ||
        !choose_labels(reader, &raw, voxels) || !choose_dimensions(reader, group, &raw, body))
        return false;
    const bool plane = body->model == MODEL_PLANE;
    if (voxels->kind == VOXELS_BOX && !choose_count(reader, &raw, plane, voxels))
        return false;
    return scene_read_placement(reader, raw.place, "bodies.voxels.place", &voxels->rotation,
                                &voxels->translation) &&
           (!plane || check_place(reader, raw.place, voxels));
}

// --- materials, skin and other keys of the model -------------------------------------------------

#define POISSON_MAX 0.49

#define AT(member) offsetof(SceneBody, member)
static const Option MATERIAL_OPTIONS[] = {
    {"youngs_modulus", OPTION_REAL, AT(usual.youngs_modulus), "Pa", 0.0, 1e12, .open = true,
     .preset = 1e4, .physics = true, .idle = {&IDLE_LABELS_HAVE_MODULUS},
     .about = "Young's modulus."},
    {"poisson_ratio", OPTION_REAL, AT(usual.poisson_ratio), "", 0.0, POISSON_MAX, .physics = true,
     .idle = {&IDLE_LABELS_HAVE_RATIO},
     .about = "Poisson's ratio; the time step is proportional to sqrt(1 - 2 nu). 0 with law "
              "`miyazaki2004`."},
    {"density", OPTION_REAL, AT(usual.density), "kg/m3", 0.0, 1e6, .open = true, .preset = 1000.0,
     .physics = true, .idle = {&IDLE_LABELS_HAVE_DENSITY}, .about = "Mass per unit volume."},
    {"prestress", OPTION_REAL, AT(usual.prestress), "Pa", 0.0, 1e12, .physics = true,
     .idle = {&IDLE_IS_WHOLE, &IDLE_LABELS_HAVE_PRESTRESS}, .feature = {.name = "tension at rest"},
     .about = "Tension of the tissue at rest, at most a fifth of `youngs_modulus`. It moves no "
              "body that is whole, and opens cuts. Solids only."},
    {"prestress_axis", OPTION_VECTOR, AT(usual.prestress_axis), "", 0.0, SIZE_LIMIT, .open = true,
     .preset_text = "none: all directions", .physics = true,
     .idle = {&IDLE_IS_WHOLE, &IDLE_HAS_NO_PRESTRESS, &IDLE_LABELS_HAVE_AXIS},
     .about = "Direction of the fibres that are under tension, in the world, of any length: cuts "
              "along them do not open."},
    {"damping", OPTION_REAL, AT(voxel.damping), "", 0.0, 10.0, .preset = 0.2,
     .preset_text = "0.2 without `damping_time`, else 0", .physics = true,
     .feature = {.name = "damping of elements"},
     .about = "Damping of the elements' deformation over their stiffness, in units of the critical "
              "time step, so that it depends on cells and stiffness: below 0.1 crushed elements "
              "may not recover."},
    {"damping_time", OPTION_REAL, AT(voxel.damping_time), "s", 0.0, 10.0, .apart = "damping",
     .physics = true, .feature = {.name = "damping by a time"},
     .about = "Damping over stiffness in seconds, whatever the cells; instead of `damping`. A loss "
              "of 2 pi f times it at a frequency f. Shortens the time step, see `--check`. Solids "
              "only."},
    {"drag", OPTION_REAL, AT(voxel.drag), "1/s", 0.0, 1e4,
     .preset_text = "4 for solids without any other key of damping or relaxation, else 0",
     .physics = true, .feature = {.name = "drag on solids"},
     .about = "Damping over mass: slow swings die out as exp(-drag t/2). A loss of drag/(2 pi f). "
              "Slows all motion of a body that something fixes, only the deformation of one that "
              "nothing fixes."},
    {"relaxation", OPTION_LIST, AT(relaxation), "", .preset_text = "none",
     .about = "Up to three Maxwell branches beside the elastic law, by which stress relaxes: "
              "`youngs_modulus` is what is left after a long time. Solids only."},
    {"loss_factor", OPTION_REAL, AT(loss_factor), "", 0.0, LOSS_MAX, .apart = "relaxation",
     .physics = true, .feature = {.name = "loss factor"},
     .about = "Tangent of the phase between strain and stress, nearly the same from 1 to 100 Hz, "
              "by three branches of `relaxation`, instead of it. A swing's damping ratio is half "
              "of it. Solids only."},
    {"stiffening", OPTION_GROUP, AT(stiffening), "", .preset_text = "linear",
     .about = "Stiffening with strain, of all labels alike. Solids only."},
};
const OptionTable VOXEL_MATERIAL_TABLE =
    TITLED_TABLE("`bodies.material` of a voxel body", "bodies.material",
                 "Material of all cells without an entry in `materials`.", MATERIAL_OPTIONS);

#undef AT

#define AT(member) offsetof(MaxwellBranch, member)
static const Option BRANCH_OPTIONS[] = {
    {"time", OPTION_REAL, AT(time), "s", 1e-6, 1e6, .required = true, .physics = true,
     .about = "Time in which the stress of the branch falls to 1/e."},
    {"share", OPTION_REAL, AT(share), "", 0.0, 0.95, .required = true, .physics = true,
     .about =
         "Share of the branch in the stiffness to fast strains; that grows to that of the elastic "
         "law / (1 - the sum of all shares), which is at most 0.95."},
    {"volumetric", OPTION_BOOL, AT(volumetric), "", .preset = 0.0, .physics = true,
     .about = "Solids: whether the resistance to changes of volume relaxes as well; else only that "
              "to changes of shape."},
};
#undef AT
const OptionTable BRANCH_TABLE = OPTION_TABLE("bodies.material.relaxation",
                                              "One Maxwell branch: a spring and a dashpot in "
                                              "series.",
                                              BRANCH_OPTIONS);

typedef struct LabelGroup {
    SolidMaterial material; // first: offsets of rows are the same in a SolidMaterial
    const config_setting_t *label;
    Vec3 color, inside;
} LabelGroup;

#define AT(member) offsetof(LabelGroup, member)
static const Option LABEL_OPTIONS[] = {
    {"label", OPTION_INTS, AT(label), "", 1.0, LABEL_MAX, .required = true, .names = true,
     .about = "Label in the volume, one of `voxels.label`."},
    {"youngs_modulus", OPTION_REAL, AT(material.youngs_modulus), "Pa", 0.0, 1e12, .open = true,
     .preset_text = "as in `material`", .physics = true, .about = "Young's modulus."},
    {"poisson_ratio", OPTION_REAL, AT(material.poisson_ratio), "", 0.0, POISSON_MAX,
     .preset_text = "as in `material`", .physics = true, .about = "Poisson's ratio."},
    {"density", OPTION_REAL, AT(material.density), "kg/m3", 0.0, 1e6, .open = true,
     .preset_text = "as in `material`", .physics = true, .about = "Mass per unit volume."},
    {"prestress", OPTION_REAL, AT(material.prestress), "Pa", 0.0, 1e12,
     .preset_text = "as in `material`", .physics = true, .idle = {&IDLE_IS_WHOLE},
     .about = "Tension of the tissue at rest."},
    {"prestress_axis", OPTION_VECTOR, AT(material.prestress_axis), "", 0.0, SIZE_LIMIT,
     .open = true, .preset_text = "as in `material`", .physics = true, .idle = {&IDLE_IS_WHOLE},
     .about = "Direction of its fibres."},
    {"color", OPTION_VECTOR, AT(color), "", 0.0, LOOK_LENGTH, .preset_text = "as in `look`",
     .about = "Colour of the outside where it has this label, as in `look`."},
    {"inside", OPTION_VECTOR, AT(inside), "", 0.0, LOOK_LENGTH,
     .preset_text = "`color`, darker and redder; as in `look`",
     .about = "Colour of walls of cuts through this label."},
};
#undef AT
const OptionTable LABEL_MATERIAL_TABLE =
    OPTION_TABLE("bodies.materials", "The material of one label.", LABEL_OPTIONS);

typedef struct SkinGroup {
    const char *mesh;
    double scale;
    const config_setting_t *place;
} SkinGroup;

static const Option SKIN_OPTIONS[] = {
    {"mesh", OPTION_STRING, offsetof(SkinGroup, mesh), "", .low = 1, .high = SCENE_FILE_MAX,
     .required = true,
     .about = "OBJ, STL, PLY, OFF, VTK, MSH or TetGen file, relative to the scene's folder."},
    {"scale", OPTION_REAL, offsetof(SkinGroup, scale), "", 0.0, 1e6, .open = true, .preset = 1.0,
     .about = "Metres per unit of the file; 0.001 for millimetres."},
    {"place", OPTION_GROUP, offsetof(SkinGroup, place), "", .preset_text = "as it is",
     .about = "Position and rotation of the scaled mesh, as of the voxels."},
};
const OptionTable SKIN_TABLE = OPTION_TABLE(
    "bodies.skin",
    "A mesh that is published instead of the cells' faces; tools still collide with the cells.",
    SKIN_OPTIONS);

// Without any key a swing falls to 5 % in 1.5 s, and deformation is damped as crushed elements need
// it.
#define DRAG_USUAL 4.0

static bool choose_damping(const SceneReader *reader, const config_setting_t *group,
                           SceneBody *body)
{
    VoxelOptions *voxel = &body->voxel;
    const config_setting_t *time = option_find(group, "damping_time");
    const bool given = option_given(group, "damping");
    if (time != NULL && body->model == MODEL_PLANE)
        return option_fail(&reader->source, time, "damping_time means nothing for a plane body");
    if (time != NULL)
        voxel->damping = 0.0;
    const bool relaxes = option_given(group, "relaxation") || option_given(group, "loss_factor");
    if (!option_given(group, "drag"))
        voxel->drag =
            time != NULL || given || relaxes || body->model == MODEL_PLANE ? 0.0 : DRAG_USUAL;
    return true;
}

static bool read_branches(const SceneReader *reader, const config_setting_t *list, int *branches,
                          MaxwellBranch branch[MAXWELL_BRANCHES])
{
    const int count = option_length(list);
    if (count < 1 || count > MAXWELL_BRANCHES)
        return option_fail(&reader->source, list, "relaxation has %d entries, it must have 1 to %d",
                           count, MAXWELL_BRANCHES);
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        const config_setting_t *entry = option_group_at(list, i, &reader->source);
        if (entry == NULL || !option_read(&BRANCH_TABLE, entry, &reader->source, &branch[i]))
            return false;
        sum += branch[i].share;
    }
    if (sum > 0.95)
        return option_fail(&reader->source, list,
                           "the shares of relaxation add up to %g, more "
                           "than 0.95",
                           sum);
    *branches = count;
    return true;
}

bool scene_read_branches(const SceneReader *reader, const config_setting_t *group,
                         const config_setting_t *list, double loss_factor, int *count,
                         MaxwellBranch branch[MAXWELL_BRANCHES])
{
    const config_setting_t *loss = option_find(group, "loss_factor");
    *count = 0;
    if (list != NULL)
        return read_branches(reader, list, count, branch);
    if (!maxwell_of_loss(loss_factor, branch))
        return option_fail(&reader->source, loss, "loss_factor %g is too large", loss_factor);
    *count = loss_factor > 0.0 ? MAXWELL_BRANCHES : 0;
    return true;
}

// Branches as given, or those of a loss factor.
static bool choose_branches(const SceneReader *reader, const BodyGroup *raw,
                            const config_setting_t *group, SceneBody *body)
{
    const config_setting_t *list = option_find(group, "relaxation"),
                           *loss = option_find(group, "loss_factor"),
                           *at = list != NULL ? list : loss;
    const char *key = list != NULL ? "relaxation" : "loss_factor";
    body->relaxation = NULL; // libconfig's, which is gone soon
    if (at == NULL)
        return true;
    if (body->model == MODEL_PLANE)
        return option_fail(&reader->source, at, "%s means nothing for a plane body", key);
    if (raw->body.voxel.law == VOXEL_MIYAZAKI2004)
        return option_fail(&reader->source, at, "%s needs law \"affine\"", key);
    return scene_read_branches(reader, group, list, body->loss_factor, &body->voxel.branch_count,
                               body->voxel.branch);
}

static bool choose_stiffening(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    const config_setting_t *at = body->stiffening;
    body->stiffening = NULL; // libconfig's, as above
    if (at != NULL && body->model == MODEL_PLANE)
        return option_fail(&reader->source, at, "stiffening means nothing for a plane body");
    if (at != NULL && raw->body.voxel.law == VOXEL_MIYAZAKI2004)
        return option_fail(&reader->source, at, "stiffening needs law \"affine\"");
    return scene_read_stiffening(reader, at, &body->voxel.stiffening);
}

// The paper's element has one stiffness: its Poisson ratio is 0.
static bool check_poisson(const SceneReader *reader, const BodyGroup *raw,
                          const config_setting_t *group, double poisson_ratio)
{
    if (raw->body.voxel.law != VOXEL_MIYAZAKI2004 || !(poisson_ratio > 0.0))
        return true;
    char text[OPTION_NUMBER_TEXT];
    return option_fail(&reader->source, option_find(group, "poisson_ratio"),
                       "poisson_ratio %s needs law \"affine\": law \"miyazaki2004\" knows only 0",
                       option_number_text(text, poisson_ratio));
}

// A tension that the elements bear well: their strains stay near those of the linear law.
#define PRESTRESS_MOST 0.2

static bool check_prestress(const SceneReader *reader, const SceneBody *body,
                            const config_setting_t *group, const SolidMaterial *material)
{
    const config_setting_t *given = option_find(group, "prestress"),
                           *axis = option_find(group, "prestress_axis"),
                           *at = given != NULL ? given : group;
    char text[2][OPTION_NUMBER_TEXT];
    if (body->model == MODEL_PLANE && (given != NULL || axis != NULL))
        return option_fail(&reader->source, given != NULL ? given : axis,
                           "%s means nothing for a plane body",
                           given != NULL ? "prestress" : "prestress_axis");
    return material->prestress <= PRESTRESS_MOST * material->youngs_modulus ||
           option_fail(&reader->source, at,
                       "prestress %s is more than a fifth of youngs_modulus, %s",
                       option_number_text(text[0], material->prestress),
                       option_number_text(text[1], PRESTRESS_MOST * material->youngs_modulus));
}

// Reads the colours of a label.
static bool read_label_look(const SceneReader *reader, const config_setting_t *group,
                            const LabelGroup *entry, int index, SceneBody *body)
{
    SceneLook *look = &body->look;
    if (!option_given(group, "color") && !option_given(group, "inside"))
        return true;
    if (look->label == NULL) {
        look->label = calloc((size_t)body->voxels.label_count, sizeof *look->label);
        ASSERT(look->label != NULL);
        for (int i = 0; i < body->voxels.label_count; i++)
            look->label[i] = look->usual;
        look->given = true;
    }
    return scene_read_colours(reader, group, entry->color, entry->inside, &look->label[index]);
}

// Reads one entry of `materials`; `given`: by index of the label, whether it has an entry already.
static bool read_label(const SceneReader *reader, const BodyGroup *raw,
                       const config_setting_t *group, bool *given, SceneBody *body)
{
    const OptionSource *source = &reader->source;
    LabelGroup entry = {0};
    if (!option_read(&LABEL_MATERIAL_TABLE, group, source, &entry) ||
        !check_poisson(reader, raw, group, entry.material.poisson_ratio))
        return false;
    // Find the label among those of the voxels.
    const config_setting_t *at = entry.label;
    int index = 0, label;
    if (!config_setting_is_scalar(at))
        return option_fail(source, at, "label must be one number or name");
    if (!choose_label(reader, at, &body->voxels, &label))
        return false;
    while (index < body->voxels.label_count && body->voxels.label[index] != label)
        index++;
    if (index == body->voxels.label_count)
        return option_fail(source, at, "label %d is not among those of voxels", label);
    if (given[index])
        return option_fail(source, at, "label %d has a material already", label);
    given[index] = true;
    // Keys that are not given keep the usual value.
    SolidMaterial *material = &body->material[index];
    if (option_given(group, "youngs_modulus"))
        material->youngs_modulus = entry.material.youngs_modulus;
    if (option_given(group, "poisson_ratio"))
        material->poisson_ratio = entry.material.poisson_ratio;
    if (option_given(group, "density"))
        material->density = entry.material.density;
    if (option_given(group, "prestress"))
        material->prestress = entry.material.prestress;
    if (option_given(group, "prestress_axis"))
        material->prestress_axis = entry.material.prestress_axis;
    if (!check_prestress(reader, body, group, material))
        return false;
    return read_label_look(reader, group, &entry, index, body);
}

static bool read_materials(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    if (!option_read(&VOXEL_MATERIAL_TABLE, raw->material, &reader->source, body) ||
        !check_poisson(reader, raw, raw->material, body->usual.poisson_ratio) ||
        !choose_damping(reader, raw->material, body) ||
        !choose_branches(reader, raw, raw->material, body) || !choose_stiffening(reader, raw, body))
        return false;
    // Each label begins with the usual material,
    int count = body->voxels.label_count;
    body->material = calloc((size_t)count, sizeof *body->material);
    ASSERT(body->material != NULL);
    body->voxel.material = body->material;
    body->voxel.material_count = count;
    for (int i = 0; i < count; i++)
        body->material[i] = body->usual;
    // and each entry changes one of them.
    bool given[LATTICE_MATERIALS] = {false};
    for (int i = 0; i < option_length(raw->materials); i++) {
        const config_setting_t *group = option_group_at(raw->materials, i, &reader->source);
        if (group == NULL || !read_label(reader, raw, group, given, body))
            return false;
    }
    // Labels without an entry.
    bool ok = true;
    for (int i = 0; i < count && ok; i++)
        ok = given[i] || check_prestress(reader, body, raw->material, &body->material[i]);
    return ok;
}

static bool read_skin(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    SkinGroup skin = {0};
    if (raw->skin == NULL)
        return true;
    // A plane body is its own picture.
    if (body->model == MODEL_PLANE)
        return option_fail(&reader->source, raw->skin, "skin means nothing for a plane body");
    if (!option_read(&SKIN_TABLE, raw->skin, &reader->source, &skin))
        return false;
    body->skin.kind = MESH_FILE;
    body->skin.file = scene_source_resolve(reader->folder, skin.mesh);
    body->skin.scale = skin.scale;
    return scene_read_placement(reader, skin.place, "bodies.skin.place", &body->skin.rotation,
                                &body->skin.translation);
}

static bool choose_integrator(const SceneReader *reader, const BodyGroup *raw, VoxelOptions *voxel)
{
    const config_setting_t *at = option_find(raw->at, "integrator");
    if (at == NULL || (int)voxel->body.integrator == INTEGRATOR_AUTO)
        voxel->body.integrator = INTEGRATOR_SYMPLECTIC_EULER;
    return integrator_is_symplectic(voxel->body.integrator) ||
           option_fail(&reader->source, at,
                       "integrator \"%s\" means nothing for a voxel body; only "
                       "\"symplectic_euler\", \"leapfrog\", \"auto\"",
                       integrator_name(voxel->body.integrator));
}

// Refuses a surface that something else replaces.
static bool check_shown(const SceneReader *reader, const BodyGroup *raw, const SceneBody *body)
{
    const config_setting_t *at = option_find(raw->at, "surface");
    if (at != NULL && body->model == MODEL_PLANE)
        return option_fail(&reader->source, at, "surface means nothing for a plane body");
    return body->shown != SHOWN_FITTED || raw->skin == NULL ||
           option_fail(&reader->source, at, "surface \"fitted\" and a skin: one of them");
}

bool scene_read_voxel(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    VoxelOptions *voxel = &body->voxel;
    if (!option_require(&BODY_TABLE, raw->at, "voxels", &reader->source))
        return false;
    return choose_integrator(reader, raw, voxel) && scene_read_voxels(reader, raw->voxels, body) &&
           scene_read_look(reader, raw->look, body) && read_materials(reader, raw, body) &&
           read_skin(reader, raw, body) && scene_read_weights(reader, raw->weights, body) &&
           check_shown(reader, raw, body) && scene_read_levels(reader, raw, body);
}
