// The readers of the parts of a scene file, one source file each, and their tables. Private to
// files/ and its tests.
#ifndef PLIANT_FILES_SCENE_PARTS_H
#define PLIANT_FILES_SCENE_PARTS_H

#include "files/option_table.h"
#include "files/scene.h"

enum {
    SCENE_BODIES = 64,
    SCENE_TOOLS = 32,
    SCENE_ATTACHMENTS = 64,
    SCENE_WORD_MAX = 31,   // characters of a name of scene, body or prefix
    SCENE_FILE_MAX = 4000, // characters of a file name
};

// What `integrator` says besides the kinds there are: the body chooses.
enum { INTEGRATOR_AUTO = INTEGRATOR_COUNT };

#define POSITION_LIMIT 1e6 // [m] from the origin
#define SIZE_LIMIT     1e3 // [m] of generated meshes
#define FORCE_LIMIT    1e6 // [N]
#define TIME_LIMIT     1e9 // [s] of simulated time

#define TITLED_TABLE(heading, where, sentences, options)                                           \
    {                                                                                              \
        .title = (heading), .path = (where), .about = (sentences), .option = (options),            \
        .count = (int)(sizeof(options) / sizeof(options)[0])                                       \
    }
#define OPTION_TABLE(where, sentences, options) TITLED_TABLE(NULL, where, sentences, options)

extern const OptionTable SCENE_TABLE, PUBLISH_TABLE, CAPACITY_TABLE;
extern const OptionTable BODY_TABLE, TEAR_TABLE, CONTACT_TABLE, FIXED_TABLE, PLACE_TABLE;
extern const OptionTable MESH_TABLE, MATERIAL_TABLE, SHAPE_TABLE, ADAPT_TABLE;
extern const OptionTable VOXELS_TABLE, VOXEL_MATERIAL_TABLE, LABEL_MATERIAL_TABLE, SKIN_TABLE;
extern const OptionTable TOOL_TABLE, CAPSULE_TABLE, PLANE_TABLE;
extern const OptionTable LOAD_TABLE, ATTACHMENT_TABLE;

// All of them, in the order of the reference.
enum { SCENE_TABLE_COUNT = 21 };
const OptionTable *scene_table(int index);

typedef struct SceneReader {
    OptionSource source;
    const char *folder; // of the scene file
    Scene *scene;       // being filled
} SceneReader;

// An entry of `bodies` as BODY_TABLE reads it, for the readers of both models.
typedef struct BodyGroup {
    const config_setting_t *at;
    const char *name, *initial;
    int model, integrator;
    double time_step; // 0: not given
    bool unsafe_time_step;
    int levels;
    const config_setting_t *material, *contact, *fixed;
    bool cuttable;
    const config_setting_t *tear;
    // Surface.
    int start_level, adjust;
    double prestress;
    double theta, solver_tolerance;
    int solver_iterations;
    const config_setting_t *mesh, *adapt, *shape;
    // Voxel.
    int law, dimensions;
    const config_setting_t *voxels, *materials, *skin;
    int split_budget;
} BodyGroup;

// The keys that say where nodes are.
typedef struct RegionGroup {
    const config_setting_t *box, *nodes;
    Vec3 sphere;
    double radius;
} RegionGroup;

// Each reads one group into zeroed memory; false with a status. What they allocate belongs to the
// scene also when they fail.
bool scene_read_body(const SceneReader *reader, const config_setting_t *group, SceneBody *body);
// What is of one model only.
bool scene_read_surface(const SceneReader *reader, const BodyGroup *raw, SceneBody *body);
bool scene_read_voxel(const SceneReader *reader, const BodyGroup *raw, SceneBody *body);
bool scene_read_fixed(const SceneReader *reader, const config_setting_t *list, SceneBody *body);
bool scene_read_mesh(const SceneReader *reader, const config_setting_t *group, MeshSource *mesh);
// `place` of the group `owner`, "bodies.mesh.place".
bool scene_read_place(const SceneReader *reader, const config_setting_t *group, const char *owner,
                      Vec3 *rotation, Vec3 *translation);
bool scene_read_material(const SceneReader *reader, const config_setting_t *group,
                         SurfaceMaterial *material);
bool scene_read_shape(const SceneReader *reader, const config_setting_t *group,
                      SurfaceShape *shape);
// `dimensions` is that of the body, 0 when it says nothing; replaced by what the voxels make it.
bool scene_read_voxels(const SceneReader *reader, const config_setting_t *group,
                       VoxelSource *voxels, int *dimensions);
bool scene_read_tool(const SceneReader *reader, const config_setting_t *group, ToolOptions *tool);
// What the keys of an entry of `list` say; a list of nodes belongs to the caller.
bool scene_read_region(const SceneReader *reader, const config_setting_t *group,
                       const RegionGroup *raw, const char *list, FixedRegion *region);
bool scene_read_attachment(const SceneReader *reader, const config_setting_t *group,
                           SceneAttachment *attachment);
// The index of a body by its name, `at` being the setting that names it; -1 with a status.
int scene_find_body(const SceneReader *reader, const config_setting_t *at, const char *name);
bool scene_read_load(const SceneReader *reader, const config_setting_t *group, LoadOptions *load);

#endif
