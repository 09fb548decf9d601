// Reads the keys of a body that only the voxel model has: voxels, materials and skin.
#include "scene/scene_parts.h"
#include "scene/scene_source.h"

#include "base/check.h"
#include "voxel/layout.h"

#include <stdlib.h>

#define POISSON_MAX 0.49
enum { LEVELS_USUAL = 2 };

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
    {"damping", OPTION_REAL, AT(voxel.damping), "", 0.0, 10.0, .preset = 0.2, .physics = true,
     .feature = "damping of elements",
     .about = "Damping of the elements' deformation over their stiffness, in units of the critical "
              "time step: below 0.1 crushed elements may not recover."},
};
const OptionTable VOXEL_MATERIAL_TABLE =
    TITLED_TABLE("`bodies.material` of a voxel body", "bodies.material",
                 "Material of all cells without an entry in `materials`.", MATERIAL_OPTIONS);

#undef AT

typedef struct LabelGroup {
    SolidMaterial material; // first: offsets of rows are the same in a SolidMaterial
    int label;
} LabelGroup;

#define AT(member) offsetof(LabelGroup, member)
static const Option LABEL_OPTIONS[] = {
    {"label", OPTION_INT, AT(label), "", 1.0, 1e9, .required = true,
     .about = "Label in the volume, one of `voxels.label`."},
    {"youngs_modulus", OPTION_REAL, AT(material.youngs_modulus), "Pa", 0.0, 1e12, .open = true,
     .preset_text = "as in `material`", .physics = true, .about = "Young's modulus."},
    {"poisson_ratio", OPTION_REAL, AT(material.poisson_ratio), "", 0.0, POISSON_MAX,
     .preset_text = "as in `material`", .physics = true, .about = "Poisson's ratio."},
    {"density", OPTION_REAL, AT(material.density), "kg/m3", 0.0, 1e6, .open = true,
     .preset_text = "as in `material`", .physics = true, .about = "Mass per unit volume."},
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
     .required = true, .about = "OBJ, STL, PLY or OFF file, relative to the scene's folder."},
    {"scale", OPTION_REAL, offsetof(SkinGroup, scale), "", 0.0, 1e6, .open = true, .preset = 1.0,
     .about = "Metres per unit of the file; 0.001 for millimetres."},
    {"place", OPTION_GROUP, offsetof(SkinGroup, place), "", .preset_text = "as it is",
     .about = "Position and rotation of the scaled mesh, as of the voxels."},
};
const OptionTable SKIN_TABLE = OPTION_TABLE(
    "bodies.skin",
    "A mesh that is published instead of the cells' faces; tools still collide with the cells.",
    SKIN_OPTIONS);

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

// Reads one entry of `materials`; `given`: by index of the label, whether it has an entry already.
static bool read_label(const SceneReader *reader, const BodyGroup *raw,
                       const config_setting_t *group, bool *given, SceneBody *body)
{
    const OptionSource *source = &reader->source;
    LabelGroup entry = {0};
    if (!option_read(&LABEL_MATERIAL_TABLE, group, source, &entry) ||
        !check_poisson(reader, raw, group, entry.material.poisson_ratio))
        return false;
    int index = 0;
    while (index < body->voxels.label_count && body->voxels.label[index] != entry.label)
        index++;
    const config_setting_t *at = option_find(group, "label");
    if (index == body->voxels.label_count)
        return option_fail(source, at, "label %d is not among those of voxels", entry.label);
    if (given[index])
        return option_fail(source, at, "label %d has a material already", entry.label);
    given[index] = true;
    SolidMaterial *material = &body->material[index];
    if (option_given(group, "youngs_modulus"))
        material->youngs_modulus = entry.material.youngs_modulus;
    if (option_given(group, "poisson_ratio"))
        material->poisson_ratio = entry.material.poisson_ratio;
    if (option_given(group, "density"))
        material->density = entry.material.density;
    return true;
}

static bool read_materials(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    if (!option_read(&VOXEL_MATERIAL_TABLE, raw->material, &reader->source, body) ||
        !check_poisson(reader, raw, raw->material, body->usual.poisson_ratio))
        return false;
    int count = body->voxels.label_count;
    body->material = calloc((size_t)count, sizeof *body->material);
    ASSERT(body->material != NULL);
    body->voxel.material = body->material;
    body->voxel.material_count = count;
    for (int i = 0; i < count; i++)
        body->material[i] = body->usual;
    bool given[LATTICE_MATERIALS] = {false};
    for (int i = 0; i < option_length(raw->materials); i++) {
        const config_setting_t *group = option_group_at(raw->materials, i, &reader->source);
        if (group == NULL || !read_label(reader, raw, group, given, body))
            return false;
    }
    return true;
}

static bool read_skin(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    SkinGroup skin = {0};
    if (raw->skin == NULL)
        return true;
    if (body->dimensions == 2)
        return option_fail(&reader->source, raw->skin, "skin means nothing for a plane body");
    if (!option_read(&SKIN_TABLE, raw->skin, &reader->source, &skin))
        return false;
    body->skin.kind = MESH_FILE;
    body->skin.file = scene_source_resolve(reader->folder, skin.mesh);
    body->skin.scale = skin.scale;
    return scene_read_placement(reader, skin.place, "bodies.skin.place", &body->skin.rotation,
                                &body->skin.translation);
}

static bool choose_levels(const SceneReader *reader, const BodyGroup *raw, VoxelOptions *voxel)
{
    const config_setting_t *at = option_find(raw->at, "levels");
    if (at == NULL)
        voxel->body.levels = LEVELS_USUAL;
    return voxel->body.levels <= VOXEL_LEVELS_MAX ||
           option_fail(&reader->source, at, "levels %d outside [0, %d] of a voxel body",
                       voxel->body.levels, VOXEL_LEVELS_MAX);
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

bool scene_read_voxel(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    VoxelOptions *voxel = &body->voxel;
    if (!option_require(&BODY_TABLE, raw->at, "voxels", &reader->source))
        return false;
    return choose_levels(reader, raw, voxel) && choose_integrator(reader, raw, voxel) &&
           scene_read_voxels(reader, raw->voxels, &body->voxels, &body->dimensions) &&
           read_materials(reader, raw, body) && read_skin(reader, raw, body);
}
