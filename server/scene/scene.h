// SPDX-License-Identifier: MIT
// A scene as read: every value is checked for type, range and meaning; nothing is built yet.
#ifndef PLIANT_SCENE_SCENE_H
#define PLIANT_SCENE_SCENE_H

#include "base/check.h"
#include "body/look.h"
#include "geometry/lattice.h"
#include "geometry/mesh.h"
#include "sim/sim.h"
#include "sim/world.h"
#include "surface/surface.h"
#include "voxel/voxel.h"

enum { SCENE_NAME_MAX = 64 };

typedef enum MeshSourceKind {
    MESH_FILE,
    MESH_SPHERE,
    MESH_UV_SPHERE,
    MESH_ICO_SPHERE,
    MESH_SHEET,
    MESH_STOMACH,
} MeshSourceKind;

// The source of a body's mesh.
typedef struct MeshSource {
    MeshSourceKind kind;
    char *file;          // resolved against the scene file's folder; owned by the scene
    int nodes;           // sphere, stomach; ico_sphere: 10 * 4^s + 2
    int rings, segments; // uv_sphere
    int columns, rows;   // sheet
    double radius, width, height, length; // [m]
    double scale;                         // file coordinates to metres
    Vec3 rotation;                        // rotation vector [rad], applied after scale
    Vec3 translation;                     // [m], applied last
} MeshSource;

// The source of a voxel body's cells, as in a scene.
typedef enum VoxelSourceKind {
    VOXELS_FILE, // a label volume
    VOXELS_MESH, // the inside of a closed mesh
    VOXELS_BOX,
    VOXELS_BALL,
    VOXELS_DISC, // one layer of cells in z = 0: the plane case
} VoxelSourceKind;

typedef enum SceneInner { INNER_CAVITY, INNER_FILLED } SceneInner;

typedef struct VoxelSource {
    VoxelSourceKind kind;
    char *file;                   // of a volume or a mesh, resolved; owned by the scene
    int label_count;              // of a volume: at least one
    int label[LATTICE_MATERIALS]; // material m is the m-th
    int inner;                    // of a mesh: SceneInner, what a closed part within another is
    bool any_label;               // none was given: label 1
    int layer;     // of a volume file, from 1; 0: the one that has most of the labels
    double size;   // edge of a cell [m] after scale, except of a generator, which is scaled too; 0
                   // (volumes only): the smallest spacing
    int count[3];  // box: cells
    double radius; // ball, disc [m]
    double scale;  // file coordinates to metres; for a volume a factor on its units
    Vec3 rotation; // rotation vector [rad], applied after scale
    Vec3 translation; // [m], applied last
} VoxelSource;

// The models. `model = "voxel"` is the solid one, or with `dimensions = 2` the plane one.
typedef enum SceneModel { MODEL_SURFACE, MODEL_VOXEL, MODEL_PLANE } SceneModel;

// What of a voxel body is published (bodies.surface).
typedef enum SceneShown {
    SHOWN_AUTO,   // fitted if made from labels or a mesh
    SHOWN_FITTED, // a smooth surface
    SHOWN_BLOCKS, // the faces of its cells
} SceneShown;

// What a body looks like (bodies.look).
typedef struct SceneLook {
    int model;  // SceneModel, while it is read
    bool given; // the scene says something of its look
    LookColours usual;
    LookColours *label;  // [voxels.label_count] NULL: no label has a colour; owned
    char *image;         // resolved, or NULL; owned
    double black, white; // values of the image; equal: from the image
    char *texture;       // as the scene names it, or NULL; owned
} SceneLook;

// One body. Its options are complete except for values that depend on the mesh or lattice, the
// initial state, gravity, precision and isa, which world_build sets.
typedef struct SceneBody {
    char name[BODY_NAME_MAX];
    SceneModel model;
    uint64_t given;          // of its own keys, by their rows
    int line;                // of the group in the scene file, for later errors
    char *initial;           // file, resolved, or NULL; owned
    bool any_integrator;     // no integrator given: takes that of the bodies it is joined to
    union {                  // by the model; each begins with the options of bodies of all models
        BodyOptions options; // fixed: owned
        SurfaceOptions surface;
        VoxelOptions voxel;
    };
    MeshSource mesh; // of a surface body
    // Of a body of cells: a voxel body, or a plane one, created from PlaneOptions that follow from
    // `voxel`.
    int dimensions; // 3, of a plane body 2
    VoxelSource voxels;
    SolidMaterial usual;                       // of labels without a material of their own
    double loss_factor;                        // that voxel.branch follows from; 0: none given
    const struct config_setting_t *relaxation; // only while it is read
    const struct config_setting_t *stiffening; // likewise
    SolidMaterial *material; // [voxels.label_count]; owned; voxel.material points here
    HungMass *weight;        // [voxel.weight_count]; owned; voxel.weight points here
    FineRegion *fine;        // [voxel.fine_count]; owned; voxel.fine points here
    MeshSource skin;         // file NULL: none
    SceneShown shown;
    SceneLook look;
} SceneBody;

enum { POSITIONS_FLOATS, POSITIONS_PACKETS, POSITIONS_BOTH };
enum { NODES_SURFACE, NODES_ALL };
enum { START_RUNNING, START_PAUSED };

typedef struct ScenePublish {
    double nodes_hz, mesh_hz, contact_hz, status_hz; // 0: never
    double error_hz, elements_hz;                    // likewise
    int positions;                                   // POSITIONS_*
    int nodes;                                       // NODES_*
    bool velocity;
    bool rest;              // publishes rest positions and texture coordinates with meshes
    bool contact_stiffness; // of contacts
    bool error_map;         // of each node, with the errors of bodies
} ScenePublish;

typedef struct SceneLoad {
    LoadOptions load; // body index resolved
    int line;         // of the group in the scene file
} SceneLoad;

typedef struct SceneAttachment {
    AttachmentOptions options; // indices resolved; a list of nodes is owned
    int line;                  // of the group in the scene file, for later errors
} SceneAttachment;

typedef struct SceneTouch {
    TouchOptions options; // indices resolved
    int line;             // of the group in the scene file, for later errors
} SceneTouch;

// What ledger and score sheet of a session judge by. `name` need not be unique.
enum { SCENE_SCORE_REGIONS = 16, SCENE_LABEL_MAX = 64 };
typedef struct SceneRegion {
    char name[SCENE_LABEL_MAX];
    FixedRegion region;          // a box or a sphere
    char label[SCENE_LABEL_MAX]; // or the tissue of a label, by name or number; "": none
    double margin;               // that must stay between it and any cut [m]
    bool keep;                   // it must not be touched
} SceneRegion;

// True if a region is tissue to be cut, not tissue to stay away from.
static inline bool scene_region_is_goal(const SceneRegion *region)
{
    return region->label[0] == '\0' && region->margin == 0.0 && !region->keep;
}

typedef struct SceneScore {
    double force_limit; // [N]; 0: none
    int region_count;
    SceneRegion region[SCENE_SCORE_REGIONS];
} SceneScore;

typedef struct Scene {
    char *path; // of the scene file
    char *text; // its text, includes not expanded; stored in files that we write
    char name[SCENE_NAME_MAX];
    uint64_t given; // keys of its own, by their rows
    SimOptions sim; // of the simulation, except for what follows from the lists and the run
    int rate_line, gravity_line; // in the scene file; 0: not given there
    int threads;
    Precision precision;
    char prefix[SCENE_NAME_MAX];       // of the channels that the daemon publishes on
    char input_prefix[SCENE_NAME_MAX]; // of the channels that it listens to
    char *lcm_url;                     // or NULL
    char *prepared;                    // file of prepared models, resolved, or NULL
    int start;                         // START_*
    bool remote;                       // accepts messages from other hosts
    bool stop_command;                 // executes STOP
    double settle_s;
    int node_capacity, face_capacity; // of each body; 0: from its mesh and levels
    ScenePublish publish;
    int body_count;
    SceneBody *body;
    int tool_count;
    ToolOptions *tool;
    int *tool_line; // [tool_count] of the groups in the scene file
    int attachment_count;
    SceneAttachment *attachment;
    int touch_count;
    SceneTouch *touch;
    int load_count;
    SceneLoad *load;
    SceneScore score;
    int idle_count;
    char **idle; // keys without effect: "file:line: key has no effect: why"; owned
} Scene;

// Reads and checks a scene. Every error is one sentence "file:line: key value why". Keys without
// effect are accepted and listed in `idle`.
bool scene_read(const char *path, Scene *scene, Status *status);
void scene_destroy(Scene *scene);

// Replaces the rate [Hz] (0: keep) and the prefix (NULL: keep) of a scene that was read, and
// updates what depends on them: rates of publishing and checking above the new rate are lowered to
// it; a prefix that makes a channel's name too long is refused. A scene with its own input prefix
// keeps it.
bool scene_override(Scene *scene, double rate_hz, const char *prefix, Status *status);

// Returns the word of scenes: "surface", or "voxel" for bodies of cells.
const char *scene_model_name(SceneModel model);
// Returns the word with which a scene names a kind of remover.
const char *scene_remover_name(RemoverKind kind);
// True if a tool heats tissue.
static inline bool scene_heats(const Scene *scene)
{
    for (int t = 0; t < scene->tool_count; t++)
        if (scene->tool[t].removes == REMOVER_DIATHERMY)
            return true;
    return false;
}

// True for bodies made of cells: voxel and plane ones.
static inline bool scene_has_cells(const SceneBody *body)
{
    return body->model != MODEL_SURFACE;
}

// Sets the material and the shape springs of a body whose scene says only `shape = {}`, and the
// thresholds of `adapt = {}`, which `adaptive` would enable; leaves the rest of `surface`
// unchanged.
void scene_preset_surface(SurfaceOptions *surface);

// Prints a line of a list of features: whether it is on, and the key or option that enables it.
void scene_print_feature(bool on, const char *name, const char *how, FILE *out);
// Prints the features that a scene can do without: those of the scene itself and its tools; those
// of what it publishes; those of a body.
void scene_print_features(const World *world, const Scene *scene, FILE *out);
void scene_print_published(const World *world, const Scene *scene, FILE *out);
void scene_print_body_features(const World *world, const Scene *scene, int body, FILE *out);

// Writes the value of a key of a body, or of a group of keys, as text of a scene file; "" for what
// the scene omits. Returns false if its model has no such key.
enum { SCENE_VALUE_TEXT = 192 };
bool scene_key_text(const SceneBody *body, const char *key, char text[SCENE_VALUE_TEXT]);

// Names the tissues of a body of cells by its materials: labels by their names in the file, or
// "label N"; "": that of the body. Reads the file's header.
void scene_name_tissues(const SceneBody *body, char name[][SCENE_LABEL_MAX]);
// Returns the material of a body that a region names by its label, from 1; 0: it has none such.
int scene_find_tissue(const SceneBody *body, const char *label);

// The line of a description (explain_describe) that has the group `score` begins so.
#define SCENE_SCORE_LINE "score = "
// Prints the group as one line of a scene file; nothing if there is none.
void scene_print_score(const SceneScore *score, FILE *out);

// Prints the reference of all keys, as Markdown (config/README.md is this text).
void scene_print_reference(FILE *out);

#endif
