// A wall without physics whose edges are split and joined on command, for tests of whatever follows
// a body's topology: one level of midpoints, drawn without cracks; nodes stay where they are put,
// forces and loads are added up and kept for the test to look at.
#ifndef PLIANT_TESTS_SPLIT_TOY_H
#define PLIANT_TESTS_SPLIT_TOY_H

#include "dynamics/sim.h"
#include "geometry/mesh.h"

#define SPLIT_TOY_DENSITY 4.2  // [kg/m2]
#define SPLIT_TOY_LAMBDA  1e5  // of the coarse body [1/s2]; times 4 where anything is split
#define SPLIT_TOY_DAMPING 20.0 // likewise [1/s]

// Node i of the mesh is node i; the midpoint of edge e is node mesh.node_count + e. Face f of the
// mesh owns face places 4 f .. 4 f + 3 and uses as many as it is drawn with.
typedef struct SplitToy SplitToy;
struct SplitToy {
    // constant
    int base_nodes, base_faces, edges;
    int (*corner)[3];    // [base_faces]
    int (*face_edge)[3]; // [base_faces] edge k joins corners k and (k + 1) % 3
    int (*parent)[2];    // [edges]
    Vec3 *rest;          // [base_nodes + edges]

    // the state
    bool *split, *wanted; // [edges]
    Vec3 *position;       // [base_nodes + edges]
    double *parameter;    // [BODY_ADAPT_LEVEL + 1] as set last

    // what follows from `split`
    int (*face)[3], (*neighbor)[3];     // [4 base_faces]
    double *face_area, *finest_area;    // [4 base_faces]
    int *face_start, *face_end, *faces; // faces around a node
    double *node_area, *node_mass;

    // of the last change
    FaceChange *change; // [16 base_faces]
    NodeBirth *born;    // [edges]
    int *gone, (*gone_parent)[2];

    // for the test to look at and to clear
    Vec3 *load, *force; // [base_nodes + edges], as added; `force` since the last tick began
    int changes;        // of topology, since the creation
    // what the body does of itself, or NULL: before it adapts, and in each evaluation
    void (*decide)(SplitToy *toy), (*labour)(const SplitToy *toy);
};

// A body on a mesh, nothing split; what it has belongs to the arena.
Body split_toy_body(SplitToy **toy, const char *name, const TriMesh *mesh, Arena *arena,
                    StateList *state);
// Splits or joins an edge when the body adapts next.
void split_toy_want(SplitToy *toy, int edge, bool split);
void split_toy_want_all(SplitToy *toy, bool split);
// Each edge anew with a chance of one in `odds`.
void split_toy_want_some(SplitToy *toy, int odds, uint64_t *random);
int split_toy_node_of(const SplitToy *toy, int edge); // its midpoint
// Moves a node, or all.
void split_toy_move(SplitToy *toy, int node, Vec3 by);
void split_toy_move_all(SplitToy *toy, Vec3 by);

// A scene of one or two such bodies, "wall" and "twin".
typedef struct ToyScene {
    Arena arena;
    StateList state;
    TriMesh mesh;
    Sim *sim;
    int count;
    Body *body[2];
    SplitToy *toy[2];
} ToyScene;

typedef struct ToySceneOptions {
    TriMesh mesh; // taken over
    int count;    // of bodies; 0: one
    double rate_hz;
    double time_step; // [s]; 0: of the bound
    bool unsafe_time_step, may_load;
    double contact_damping; // [s]
    int tool_count;
    const ToolOptions *tool;
} ToySceneOptions;

// A flat sheet of cells x cells squares of side `cell` [m], two triangles each, normal +z.
TriMesh toy_sheet(int cells, double cell);
// False with `status` when the scene is refused; to be destroyed all the same.
bool toy_scene_try(ToyScene *scene, const ToySceneOptions *options, Status *status);
void toy_scene_create(ToyScene *scene, const ToySceneOptions *options); // aborts when refused
void toy_scene_destroy(ToyScene *scene);
// A tick; forces are those of this tick.
void toy_scene_step(ToyScene *scene);

#endif
