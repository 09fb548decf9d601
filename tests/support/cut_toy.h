// A cuttable wall without physics, for tests of the pipeline: faces of a mesh are joined across its
// edges, blades break these links by the exact test, and the faces round a node that links still
// join share a copy of it. Nodes stay where they are put; loads and forces are added up.
#ifndef PLIANT_TESTS_CUT_TOY_H
#define PLIANT_TESTS_CUT_TOY_H

#include "dynamics/sim.h"
#include "geometry/mesh.h"

enum { CUT_TOY_CALLS = 4096 };

// One call of BodyOps.cut.
typedef struct CutCall {
    CutSweep sweep;
    int64_t under_way; // of its stroke
} CutCall;

typedef struct CutToy CutToy;
struct CutToy {
    // constant
    int faces, base_nodes, places; // places for nodes
    int links;
    int (*link)[2];       // [links] the two faces, the lower one first
    int (*neighbor)[3];   // [faces] link across edge k; -1: a border
    int (*base)[3];       // [faces] corners in the mesh
    int node_limit;       // most nodes; what needs more is refused
    double quantum, size; // [m]

    // the state
    bool *broken;     // [links]
    int (*corner)[3]; // [faces] nodes
    int *used;        // nodes
    Vec3 *position;   // [places]
    CutPoint *center; // [blades][faces] where links were when the last tick ended
    CutPoint *edge;   // [blades][2] likewise the blade
    int64_t *begun;   // [blades] 1: nothing was tested yet in this stroke

    // what follows
    int *face_start, *face_end, *around;
    double *face_area, *node_area, *node_mass;
    int (*face_neighbor)[3];

    // of the last change
    NodeBirth *born;

    // for the test to look at and to clear
    CutCall *call;                                  // [CUT_TOY_CALLS], the first ones
    int calls, changes, reconstructions, tear_next; // links [0, tear_next) are to be torn
    bool bad;                                       // the next commit says that numbers went bad
    Vec3 *load;                                     // [places]
};

// A sheet of cells x cells squares of side `cell`, round the origin in z = 0.
typedef struct CutScene {
    Arena arena;
    StateList state;
    TriMesh mesh;
    Sim *sim;
    Body *body;
    CutToy *toy;
} CutScene;

typedef struct CutSceneOptions {
    int cells;
    double cell, rate_hz;
    bool tears;
    int tool_count;
    const ToolOptions *tool;
} CutSceneOptions;

void cut_scene_create(CutScene *scene, const CutSceneOptions *options);
void cut_scene_destroy(CutScene *scene);
int cut_toy_broken(const CutToy *toy);
int cut_toy_pieces(const CutToy *toy);
void cut_toy_move(CutToy *toy, Vec3 by);

#endif
