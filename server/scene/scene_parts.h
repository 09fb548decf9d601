// SPDX-License-Identifier: MIT
// The readers of the parts of a scene file and their tables. Private to scene/, its
// tests, and the reader of the score sheet's rules (clients/play).
#ifndef PLIANT_SCENE_SCENE_PARTS_H
#define PLIANT_SCENE_SCENE_PARTS_H

#include "scene/option_table.h"
#include "scene/scene.h"

enum {
    SCENE_BODIES = 64,
    SCENE_TOOLS = 32,
    SCENE_ATTACHMENTS = 64,
    SCENE_TOUCHES = 64,
    SCENE_WORD_MAX = 31,   // characters of a name of scene, body or prefix
    SCENE_FILE_MAX = 4000, // characters of a file name
};

// Value of `integrator` beyond the integrators: the body chooses.
enum { INTEGRATOR_AUTO = INTEGRATOR_COUNT };

#define POSITION_LIMIT 1e6 // [m] from the origin
#define SIZE_LIMIT     1e3 // [m] of generated meshes
#define FORCE_LIMIT    1e6 // [N]
#define TIME_LIMIT     1e9 // [s] of simulated time

#define TABLE_MEMBERS(heading, where, sentences, options)                                          \
    .title = (heading), .path = (where), .about = (sentences), .option = (options),                \
    .count = (int)(sizeof(options) / sizeof(options)[0])
#define TITLED_TABLE(heading, where, sentences, options)                                           \
    {                                                                                              \
        TABLE_MEMBERS(heading, where, sentences, options)                                          \
    }
#define OPTION_TABLE(where, sentences, options) TITLED_TABLE(NULL, where, sentences, options)
// That notes in a member which keys were given.
#define GIVEN_TABLE(where, sentences, options, offset)                                             \
    {                                                                                              \
        TABLE_MEMBERS(NULL, where, sentences, options), .given = (offset)                          \
    }
// Of keys of a SceneBody, some of which only one model uses.
#define BODY_OPTION_TABLE(where, sentences, options)                                               \
    {                                                                                              \
        TABLE_MEMBERS(NULL, where, sentences, options), .variant = offsetof(SceneBody, model)      \
    }

extern const OptionTable SCENE_TABLE, PUBLISH_TABLE, CAPACITY_TABLE;
extern const OptionTable BODY_TABLE, TEAR_TABLE, CONTACT_TABLE, FIXED_TABLE, WEIGHT_TABLE,
    PLACEMENT_TABLE;
extern const OptionTable MESH_TABLE, MATERIAL_TABLE, STIFFENING_TABLE, SHAPE_TABLE, CAVITY_TABLE,
    ADAPT_TABLE;
extern const OptionTable VOXELS_TABLE, LEVELS_TABLE, FINE_TABLE, VOXEL_ADAPT_TABLE,
    VOXEL_MATERIAL_TABLE, BRANCH_TABLE, LABEL_MATERIAL_TABLE, SKIN_TABLE, LOOK_TABLE;
extern const OptionTable TOOL_TABLE, CAPSULE_TABLE, PLANE_TABLE;
extern const OptionTable LOAD_TABLE, ATTACHMENT_TABLE, TOUCH_TABLE;
extern const OptionTable SCORE_TABLE, SCORE_REGION_TABLE;

// A group of a body's keys as its options hold it: the rows of the table are offsets in `keys`.
typedef struct KeyGroup {
    const OptionTable *table;
    const void *keys;
    size_t size; // of `keys`: rows beyond it are of what only the reader holds
    bool absent; // the scene has no such group, which disables what it describes
} KeyGroup;

// The groups of a body, without its sources and lists; returns their number.
enum { KEY_GROUPS = 9 };
int scene_list_groups(const SceneBody *body, KeyGroup group[KEY_GROUPS]);

// The tables in the order of the reference.
enum { SCENE_TABLE_COUNT = 32 };
const OptionTable *scene_table(int index);

typedef struct SceneReader {
    OptionSource source;
    const char *folder; // of the scene file
    Scene *scene;       // being filled
} SceneReader;

// An entry of `bodies` as BODY_TABLE reads it: what it becomes, and what is read further.
typedef struct BodyGroup {
    SceneBody body; // first: offsets of rows are the same in a SceneBody
    const config_setting_t *at;
    const char *name, *initial;
    const config_setting_t *material, *contact, *fixed, *tear, *look, *adapt;
    const config_setting_t *mesh, *shape, *cavity;               // of a surface body
    const config_setting_t *voxels, *materials, *skin, *weights; // of a voxel body
} BodyGroup;

// Sets of models, for keys that only one of them uses.
#define SURFACE_ONLY (1u << MODEL_SURFACE)
#define VOXEL_ONLY   (1u << MODEL_VOXEL | 1u << MODEL_PLANE)

// Location of a group: the scene itself, a body, or a tool.
struct OptionPlace {
    const Scene *scene;
    const SceneBody *body;         // or NULL
    const ToolOptions *tool;       // or NULL
    const config_setting_t *group; // of the body or the tool, while the scene is read
    const World *world;            // once it is built
    const Body *made;              // of the body
};

// scene_idle.c: conditions in which keys have no effect.
extern const OptionIdle IDLE_MOVES_NO_TOOL, IDLE_HAS_NO_INSIDE, IDLE_PUBLISHES_NO_NODES,
    IDLE_PUBLISHES_ALL_NODES, IDLE_HAS_NO_TOOL, IDLE_HAS_ONLY_PLANES, IDLE_PUBLISHES_NO_CONTACTS,
    IDLE_PUBLISHES_NO_ERRORS, IDLE_HAS_NO_VOXELS, IDLE_HAS_ONE_LEVEL, IDLE_IS_EXPLICIT,
    IDLE_HAS_NO_TIME_STEP, IDLE_IS_WHOLE, IDLE_HAS_ONLY_CELLS, IDLE_MEETS_NO_TOOL,
    IDLE_TOOLS_HAVE_FRICTION, IDLE_LABELS_HAVE_MODULUS, IDLE_LABELS_HAVE_RATIO,
    IDLE_LABELS_HAVE_DENSITY, IDLE_LABELS_HAVE_PRESTRESS, IDLE_LABELS_HAVE_AXIS,
    IDLE_HAS_NO_PRESTRESS, IDLE_HOLDS_NO_GAS, IDLE_HOLDS_NO_FLUID, IDLE_TOUCHES_NOTHING,
    IDLE_IS_NOT_SHOWN, IDLE_IS_NOT_HEATED, IDLE_CAN_TAKE_NOTHING;

// The keys that select nodes.
typedef struct RegionGroup {
    const config_setting_t *box, *nodes;
    Vec3 sphere;
    double radius;
} RegionGroup;

// Each reads one group into zeroed memory; returns false with a status. The scene owns what they
// allocate, also after a failure.
bool scene_read_body(const SceneReader *reader, const config_setting_t *group, SceneBody *body);
// Read the keys of one model.
bool scene_read_surface(const SceneReader *reader, const BodyGroup *raw, SceneBody *body);
bool scene_read_voxel(const SceneReader *reader, const BodyGroup *raw, SceneBody *body);
bool scene_read_fixed(const SceneReader *reader, const config_setting_t *list, SceneBody *body);
// Reads `levels` of a body of cells, a number or a group, and `adapt`; after everything else of the
// body.
bool scene_read_levels(const SceneReader *reader, const BodyGroup *raw, SceneBody *body);
bool scene_read_weights(const SceneReader *reader, const config_setting_t *list, SceneBody *body);
bool scene_read_mesh(const SceneReader *reader, const config_setting_t *group, MeshSource *mesh);
// Reads `place` of the group `owner`, "bodies.mesh.place".
bool scene_read_placement(const SceneReader *reader, const config_setting_t *group,
                          const char *owner, Vec3 *rotation, Vec3 *translation);
// Finds the branches of a material: those of `list`, or of its loss factor.
#define LOSS_MAX 0.3
bool scene_read_branches(const SceneReader *reader, const config_setting_t *group,
                         const config_setting_t *list, double loss_factor, int *count,
                         MaxwellBranch branch[MAXWELL_BRANCHES]);
// Reads `material.stiffening`; NULL: none.
bool scene_read_stiffening(const SceneReader *reader, const config_setting_t *group,
                           Stiffening *stiffening);
// Reads `look`, NULL: none. After the cells, before the materials of labels, which change it.
bool scene_read_look(const SceneReader *reader, const config_setting_t *group, SceneBody *body);
// Of three shares; each is at most 1, which the reader of colours says better.
#define LOOK_LENGTH 2.0
// Changes the colours that the group gives; the inside follows a `color` without `inside`.
bool scene_read_colours(const SceneReader *reader, const config_setting_t *group, Vec3 color,
                        Vec3 inside, LookColours *colours);
bool scene_read_material(const SceneReader *reader, const config_setting_t *group,
                         SurfaceMaterial *material);
bool scene_read_shape(const SceneReader *reader, const config_setting_t *group,
                      SurfaceShape *shape);
// Reads where the cells of a body come from, and decides its dimensions (0 if the body gives none)
// and with them its model.
bool scene_read_voxels(const SceneReader *reader, const config_setting_t *group, SceneBody *body);
bool scene_read_tool(const SceneReader *reader, const config_setting_t *group, ToolOptions *tool);
// Reads the node selection of an entry of `list`; the caller owns a list of nodes.
bool scene_read_region(const SceneReader *reader, const config_setting_t *group,
                       const RegionGroup *raw, const char *list, FixedRegion *region);
bool scene_read_attachment(const SceneReader *reader, const config_setting_t *group,
                           SceneAttachment *attachment);
bool scene_read_touch(const SceneReader *reader, const config_setting_t *group, SceneTouch *touch);
// Bodies that are joined or touch are stepped together: gives those without an integrator the one
// of the others. Call after all bodies, attachments and touches are read. Returns false with a
// status if two name different ones.
bool scene_join_bodies(const SceneReader *reader, const config_setting_t *attachments,
                       const config_setting_t *touch);
// Returns the index of a body by its name; `at` is the setting that names it. -1 with a status.
int scene_find_body(const SceneReader *reader, const config_setting_t *at, const char *name);
bool scene_read_load(const SceneReader *reader, const config_setting_t *group, LoadOptions *load);
bool scene_read_score_group(const SceneReader *reader, const config_setting_t *group,
                            SceneScore *score);
// Checks the labels that its regions name, of bodies that were read.
bool scene_check_score(const SceneReader *reader, const config_setting_t *group,
                       const SceneScore *score);
// Lists in scene->idle the keys that others make idle. Call last.
void scene_find_idle(Scene *scene, const config_setting_t *root);

// --- the text of a scene file, checked before libconfig reads it ---------------------------------

// Returns the folder of a file, "." for a bare name. The caller frees it.
char *scene_source_folder(const char *path);
// Returns `name` relative to `folder`; absolute names stay. The caller frees it.
char *scene_source_resolve(const char *folder, const char *name);

// Reads and parses a scene file with all its includes. The caller initialises and owns `config`.
// Returns the text of the scene file itself, which the caller frees, or NULL with a status that
// names file and line.
char *scene_source_read(const char *path, config_t *config, Status *status);
// Parses a text that is no file, and includes none; `name` is for errors.
bool scene_source_parse(const char *name, const char *text, config_t *config, Status *status);
// Writes what is wrong in a text that libconfig refuses at `line`, and what is right; "": unknown.
void scene_syntax_cure(const char *text, int line, char *cure, size_t size);

#endif
