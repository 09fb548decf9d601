// The readers of the parts of a scene file, one source file each, and their tables. Private to
// files/ and its tests.
#ifndef PLIANT_FILES_SCENE_PARTS_H
#define PLIANT_FILES_SCENE_PARTS_H

#include "files/option_table.h"
#include "files/scene.h"

enum {
    SCENE_BODIES = 64,
    SCENE_TOOLS = 32,
    SCENE_WORD_MAX = 31,   // characters of a name of scene, body or prefix
    SCENE_FILE_MAX = 4000, // characters of a file name
};

// Why known keys of features that are not built in are refused.
#define LATER_CUTTING  "cutting is not built into this version"
#define LATER_VOXEL    "voxel bodies are not built into this version"
#define LATER_IMPLICIT "implicit integration is not built into this version"
#define LATER_GRASPER  "graspers are not built into this version"

#define POSITION_LIMIT 1e6 // [m] from the origin
#define SIZE_LIMIT     1e3 // [m] of generated meshes
#define FORCE_LIMIT    1e6 // [N]
#define TIME_LIMIT     1e9 // [s] of simulated time

#define OPTION_TABLE(where, sentences, options)                                                    \
    {                                                                                              \
        .path = (where), .about = (sentences), .option = (options),                                \
        .count = (int)(sizeof(options) / sizeof(options)[0])                                       \
    }

extern const OptionTable SCENE_TABLE, PUBLISH_TABLE, CAPACITY_TABLE;
extern const OptionTable BODY_TABLE, ADAPT_TABLE, CONTACT_TABLE, FIXED_TABLE;
extern const OptionTable MESH_TABLE, PLACE_TABLE;
extern const OptionTable MATERIAL_TABLE, SHAPE_TABLE;
extern const OptionTable TOOL_TABLE, CAPSULE_TABLE, PLANE_TABLE;
extern const OptionTable LOAD_TABLE;

// All of them, in the order of the reference.
enum { SCENE_TABLE_COUNT = 15 };
const OptionTable *scene_table(int index);

typedef struct SceneReader {
    OptionSource source;
    const char *folder; // of the scene file
    Scene *scene;       // being filled
} SceneReader;

// Each reads one group into zeroed memory; false with a status. What they allocate belongs to the
// scene also when they fail.
bool scene_read_body(const SceneReader *reader, const config_setting_t *group, SceneBody *body);
bool scene_read_fixed(const SceneReader *reader, const config_setting_t *list, SceneBody *body);
bool scene_read_mesh(const SceneReader *reader, const config_setting_t *group, MeshSource *mesh);
bool scene_read_material(const SceneReader *reader, const config_setting_t *group,
                         SurfaceMaterial *material);
bool scene_read_shape(const SceneReader *reader, const config_setting_t *group,
                      SurfaceShape *shape);
bool scene_read_tool(const SceneReader *reader, const config_setting_t *group, ToolOptions *tool);
bool scene_read_load(const SceneReader *reader, const config_setting_t *group, LoadOptions *load);

#endif
