// Reads the group `voxels` of a body: a label volume, a mesh to be filled or a generator, and its
// placement in the world.
#include "scene/scene_parts.h"
#include "scene/scene_source.h"

typedef struct VoxelsGroup {
    VoxelSource voxels;
    const char *file, *mesh;
    int generator, dimensions;
    const config_setting_t *label, *count, *place;
} VoxelsGroup;

static const OptionWord GENERATOR_WORDS[] = {
    {"box", VOXELS_BOX}, {"ball", VOXELS_BALL}, {"disc", VOXELS_DISC}, {NULL, 0}};

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
    {"label", OPTION_INTS, AT(label), "", 1.0, LABEL_MAX, .preset_text = "1",
     .only = FROM(VOXELS_FILE),
     .about = "With `file`: the labels that belong to the body, one or a list of up to 255."},
    {"mesh", OPTION_STRING, AT(mesh), "", .low = 1, .high = SCENE_FILE_MAX, .preset_text = "none",
     .about = "Closed OBJ, STL, PLY or OFF mesh, relative to the scene's folder, whose inside is "
              "filled with cells of `size`."},
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

static bool choose_labels(const SceneReader *reader, const VoxelsGroup *raw, VoxelSource *voxels)
{
    int count = option_read_ints(raw->label, NULL, 0);
    if (count > LATTICE_MATERIALS)
        return option_fail(&reader->source, raw->label, "label has %d entries, at most %d", count,
                           LATTICE_MATERIALS);
    voxels->label_count = count > 0 ? count : 1;
    voxels->label[0] = 1;
    option_read_ints(raw->label, voxels->label, LATTICE_MATERIALS);
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
    int given = option_read_ints(raw->count, count, 3);
    if (raw->count == NULL)
        count[0] = CELLS_USUAL;
    if (given <= 1)
        count[1] = count[2] = count[0];
    if (plane && (given <= 2))
        count[2] = 1;
    if (given > 3 || (given == 2 && !plane))
        return option_fail(&reader->source, raw->count,
                           "count has %d entries and must be one or three numbers%s", given,
                           plane ? "" : ", two only with dimensions 2");
    return !plane || count[2] == 1 ||
           option_fail(&reader->source, raw->count,
                       "count %d along z: a plane body has one layer of cells", count[2]);
}

static bool choose_dimensions(const SceneReader *reader, const config_setting_t *group,
                              const VoxelsGroup *raw, VoxelSource *voxels, int *dimensions)
{
    const OptionSource *source = &reader->source;
    const config_setting_t *at = option_find(group, "dimensions");
    if (at != NULL && *dimensions != 0 && raw->dimensions != *dimensions)
        return option_fail(source, at, "dimensions %d contradicts dimensions %d of the body",
                           raw->dimensions, *dimensions);
    if (at != NULL)
        *dimensions = raw->dimensions;
    if (*dimensions == 0)
        *dimensions = voxels->kind == VOXELS_DISC ? 2 : 3;
    if (voxels->kind == VOXELS_DISC && *dimensions == 3)
        return option_fail(source, at != NULL ? at : group,
                           "dimensions 3 means nothing for voxels from disc, a plane body");
    if (voxels->kind != VOXELS_DISC && voxels->kind != VOXELS_BOX && *dimensions == 2)
        return option_fail(source, at != NULL ? at : group,
                           "dimensions 2 means nothing for voxels from %s, only for box and disc",
                           source_name(voxels->kind));
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

bool scene_read_voxels(const SceneReader *reader, const config_setting_t *group,
                       VoxelSource *voxels, int *dimensions)
{
    VoxelsGroup raw = {0};
    if (!option_read(&VOXELS_TABLE, group, &reader->source, &raw))
        return false;
    *voxels = raw.voxels;
    if (!choose_kind(reader, group, &raw, voxels) || !choose_size(reader, group, voxels) ||
        !choose_labels(reader, &raw, voxels) ||
        !choose_dimensions(reader, group, &raw, voxels, dimensions))
        return false;
    bool plane = *dimensions == 2;
    if (voxels->kind == VOXELS_BOX && !choose_count(reader, &raw, plane, voxels))
        return false;
    return scene_read_placement(reader, raw.place, "bodies.voxels.place", &voxels->rotation,
                                &voxels->translation) &&
           (!plane || check_place(reader, raw.place, voxels));
}
