// Reads the group `mesh` of a body: a file or a generator, and its placement in the world.
#include "scene/scene_parts.h"
#include "scene/scene_source.h"

#include <string.h>

typedef struct MeshGroup {
    MeshSource mesh;
    const char *file;
    int generator, nodes, subdivisions;
    const config_setting_t *place;
} MeshGroup;

static const OptionWord GENERATOR_WORDS[] = {
    {"sphere", MESH_SPHERE}, {"uv_sphere", MESH_UV_SPHERE}, {"ico_sphere", MESH_ICO_SPHERE},
    {"sheet", MESH_SHEET},   {"stomach", MESH_STOMACH},     {NULL, 0}};

enum { ICO_DEEPEST = 8, ICO_USUAL = 3, ICO_MOST = 655362 };

// Sources that use a key.
#define FROM(kind) (1u << (kind))

#define AT(member) offsetof(MeshGroup, member)
static const Option MESH_OPTIONS[] = {
    {"file", OPTION_STRING, AT(file), "", .low = 1, .high = SCENE_FILE_MAX, .preset_text = "none",
     .about =
         "OBJ, STL, PLY or OFF file, relative to the scene's folder. Either this or `generator`."},
    {"generator", OPTION_WORD, AT(generator), "", .words = GENERATOR_WORDS, .preset = -1,
     .preset_text = "none", .about = "Shape that is generated."},
    {"nodes", OPTION_INT, AT(nodes), "", 4.0, ICO_MOST,
     .preset_text = "`sphere` 114, `stomach` 188",
     .only = FROM(MESH_SPHERE) | FROM(MESH_ICO_SPHERE) | FROM(MESH_STOMACH),
     .about =
         "Number of nodes: `sphere` 4 to 20000, `stomach` 60 to 20000, `ico_sphere` 10 * 4^s + "
         "2."},
    {"subdivisions", OPTION_INT, AT(subdivisions), "", 0.0, ICO_DEEPEST, .preset = ICO_USUAL,
     .only = FROM(MESH_ICO_SPHERE),
     .about = "`ico_sphere`: how often every triangle of the icosahedron is split in four."},
    {"rings", OPTION_INT, AT(mesh.rings), "", 1.0, 2000.0, .preset = 8.0,
     .only = FROM(MESH_UV_SPHERE), .about = "`uv_sphere`: rings of nodes between the poles."},
    {"segments", OPTION_INT, AT(mesh.segments), "", 3.0, 4000.0, .preset = 14.0,
     .only = FROM(MESH_UV_SPHERE), .about = "`uv_sphere`: nodes per ring."},
    {"columns", OPTION_INT, AT(mesh.columns), "", 2.0, 4000.0, .preset = 21.0,
     .only = FROM(MESH_SHEET), .about = "`sheet`: nodes along x."},
    {"rows", OPTION_INT, AT(mesh.rows), "", 2.0, 4000.0, .preset = 21.0, .only = FROM(MESH_SHEET),
     .about = "`sheet`: nodes along y."},
    {"radius", OPTION_REAL, AT(mesh.radius), "m", 0.0, SIZE_LIMIT, .open = true, .preset = 0.05,
     .only = FROM(MESH_SPHERE) | FROM(MESH_UV_SPHERE) | FROM(MESH_ICO_SPHERE),
     .about = "Radius of the spheres."},
    {"width", OPTION_REAL, AT(mesh.width), "m", 0.0, SIZE_LIMIT, .open = true, .preset = 0.1,
     .only = FROM(MESH_SHEET), .about = "`sheet`: extent along x."},
    {"height", OPTION_REAL, AT(mesh.height), "m", 0.0, SIZE_LIMIT, .open = true, .preset = 0.1,
     .only = FROM(MESH_SHEET), .about = "`sheet`: extent along y."},
    {"length", OPTION_REAL, AT(mesh.length), "m", 0.0, SIZE_LIMIT, .open = true, .preset = 0.25,
     .only = FROM(MESH_STOMACH), .about = "`stomach`: its largest extent."},
    {"scale", OPTION_REAL, AT(mesh.scale), "", 0.0, 1e6, .open = true, .preset = 1.0,
     .about = "Metres per unit of the file or generator; 0.001 for millimetres."},
    {"place", OPTION_GROUP, AT(place), "", .preset_text = "as it is",
     .about = "Position and rotation of the scaled mesh."},
};
#undef AT
const OptionTable MESH_TABLE = OPTION_TABLE(
    "bodies.mesh", "A closed or open triangle mesh, from a file or a generator.", MESH_OPTIONS);

typedef struct Placement {
    Vec3 translation, rotation;
} Placement;

static const Option PLACE_OPTIONS[] = {
    {"translation", OPTION_VECTOR, offsetof(Placement, translation), "m", 0.0, POSITION_LIMIT,
     .about = "Applied last."},
    {"rotation", OPTION_VECTOR, offsetof(Placement, rotation), "rad", 0.0, 100.0,
     .about = "Rotation vector: axis times angle, about the mesh's origin; applied after `scale`."},
};
const OptionTable PLACEMENT_TABLE =
    TITLED_TABLE("`bodies.mesh.place`, `bodies.voxels.place`, `bodies.skin.place`",
                 "bodies.mesh.place", "A rigid motion of the mesh or voxels.", PLACE_OPTIONS);

bool scene_read_placement(const SceneReader *reader, const config_setting_t *group,
                          const char *owner, Vec3 *rotation, Vec3 *translation)
{
    Placement raw = {0};
    OptionTable table = PLACEMENT_TABLE;
    table.path = owner;
    if (!option_read(&table, group, &reader->source, &raw))
        return false;
    *rotation = raw.rotation;
    *translation = raw.translation;
    return true;
}

// Refuses a key that the chosen source would ignore.
static bool check_meant(const SceneReader *reader, const config_setting_t *group,
                        MeshSourceKind kind)
{
    const char *name = "a file";
    for (const OptionWord *word = GENERATOR_WORDS; word->word != NULL; word++)
        if (word->value == (int)kind)
            name = word->word;
    char owner[64];
    snprintf(owner, sizeof owner, "a mesh from %s", name);
    return option_refuse_unused(&MESH_TABLE, group, &reader->source, kind, owner);
}

// Chooses the number of nodes, limited by each generator in its own way; 0 for those without one.
static bool choose_nodes(const SceneReader *reader, const config_setting_t *group,
                         const MeshGroup *raw, MeshSource *mesh)
{
    const OptionSource *source = &reader->source;
    const config_setting_t *at = option_find(group, "nodes");
    if (mesh->kind == MESH_ICO_SPHERE) {
        if (at != NULL && option_given(group, "subdivisions"))
            return option_fail(source, at, "nodes and subdivisions are two ways to say the same");
        int nodes = 12, wanted = raw->nodes, subdivisions = 0;
        while (at != NULL ? nodes < wanted : subdivisions < raw->subdivisions) {
            nodes = 4 * nodes - 6;
            subdivisions++;
        }
        if (at != NULL && nodes != wanted)
            return option_fail(source, at,
                               "nodes %d is no ico_sphere: 10 * 4^s + 2, as 12, 42, 162, 642, 2562",
                               wanted);
        mesh->nodes = nodes;
        return true;
    }
    bool sphere = mesh->kind == MESH_SPHERE;
    if (!sphere && mesh->kind != MESH_STOMACH)
        return true;
    mesh->nodes = at != NULL ? raw->nodes : sphere ? 114 : 188;
    int low = sphere ? 4 : 60;
    if (mesh->nodes < low || mesh->nodes > 20000)
        return option_fail(source, at, "nodes %d outside [%d, 20000]", mesh->nodes, low);
    return true;
}

bool scene_read_mesh(const SceneReader *reader, const config_setting_t *group, MeshSource *mesh)
{
    MeshGroup raw = {0};
    const OptionSource *source = &reader->source;
    if (!option_read(&MESH_TABLE, group, source, &raw))
        return false;
    bool file = option_given(group, "file");
    if (file == option_given(group, "generator"))
        return option_fail(source, group, "mesh needs %s file or generator",
                           file ? "only one of" : "a");
    *mesh = raw.mesh;
    mesh->kind = file ? MESH_FILE : (MeshSourceKind)raw.generator;
    if (!check_meant(reader, group, mesh->kind) || !choose_nodes(reader, group, &raw, mesh))
        return false;
    if (file)
        mesh->file = scene_source_resolve(reader->folder, raw.file);
    return scene_read_placement(reader, raw.place, PLACEMENT_TABLE.path, &mesh->rotation,
                                &mesh->translation);
}
