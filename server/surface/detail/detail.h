// Private to the surface room: a body whose faces are refined and simplified while it runs (Choi et
// al. 2005, with the rules of surface.md). Everything here follows from one set of bits, which faces
// are refined: tables, masses, sums and their order are a pure function of it, and every local
// update gives the same bits as building all of it anew (detail_rebuild).
//
// Words: a face exists when its parent is refined, and is a leaf when it is not refined itself.
// Leaves across an edge differ by at most one level. A node is on when a leaf has it as a corner. It
// is a midpoint of an edge of the level above; when only one of the faces at that edge is refined it
// hangs: with adjust = "continuum" it is held in the middle of the edge's ends, its masters, and its
// forces and mass are theirs; with "choi2005" it moves freely.
#ifndef PLIANT_SURFACE_DETAIL_H
#define PLIANT_SURFACE_DETAIL_H

#include "geometry/levels.h"
#include "surface/model.h"

enum {
    WINDOW = 64,                             // slots that are packed together
    WINDOW_CHUNKS = WINDOW / LANES + 1,      // the last of the free nodes and the first of the
                                             // hanging ones may both be short
    WINDOW_LANES = WINDOW_CHUNKS * LANES,
};

typedef enum NodeStatus { NODE_OFF, NODE_FREE, NODE_HANGING } NodeStatus;

// A leaf and which of its corners a node is.
typedef struct Leaf {
    int level, face, corner;
} Leaf;

// The springs of a node, and what it stands for in the bounds.
typedef struct NodeSprings {
    int count;
    int *neighbour;    // [2 valence] slots, ascending
    double *stiffness; // [N/m]
} NodeSprings;

// What is constant for a window, and what of it is in use.
typedef struct Window {
    int first_slot;
    int free_count, hanging_count;
    int free_chunks;         // the hanging nodes' chunks follow
    double mass;             // [kg] of its free nodes
    double lambda, damping;  // largest of its free nodes
    int springs;             // ends of springs at its nodes
} Window;

typedef struct DetailCounts {
    int64_t refined, coarsened, refused; // faces, since the start
} DetailCounts;

// Where the sweep of the criteria stands; plain data, part of the state.
typedef struct Sweep {
    int64_t root;       // next face of level 0
    int64_t urgent;     // roots to sweep at once, whatever the rate: loads have changed
    int64_t topology;
    double thresholds[3]; // force, speed, curvature
    double scale;         // of all three
    int64_t level;        // finest that may be used
    double credit;        // roots that may be swept by now
    DetailCounts counts;
} Sweep;

// A force that a tool put on a node in the last evaluation of a tick; part of the state.
typedef struct Felt {
    int64_t node;
    Vec3 force; // [N]
} Felt;

typedef struct Detail {
    const SurfaceOptions *options; // a copy
    bool constrained;              // hanging nodes are (adjust = "continuum")
    int finest;
    Levels levels;
    int face_base[LEVELS_MAX + 2]; // number of the first face of each level in `refined`
    int *root_ring_start;          // [level[0].node_count + 1] faces of level 0 around a node
    int *root_ring;
    double *root_area;             // [level[0].face_count] at rest [m2]
    bool *fixed;                   // [node_count]
    int node_count;                // of the finest level
    int place_count;               // faces of the finest level: places of BodySurface

    // --- rules by level (level_rules.h) ---
    double areal_density; // [kg/m2]
    double modulus;       // E2D [N/m]
    double level_mass[LEVELS_MAX + 1];      // choi2005: of a node [kg]
    double level_stiffness[LEVELS_MAX + 1]; // choi2005: of a spring [N/m]
    double shape_rate, shape_drag, node_drag; // by mass: [1/s2], [1/s], [1/s]
    double edge_length;                       // mean of level 0 [m]
    double wave_speed;                        // sqrt(E2D / rho_A) [m/s]

    // --- part of the state ---
    unsigned char *refined; // [faces of all levels above the finest]
    int *calm_since;        // the same: tick since which its children are calm; 0: they are not
    Sweep *sweep;
    Felt *felt;             // [felt_capacity]
    int64_t *felt_count;
    int felt_capacity;
    bool felt_whole;        // the next add_forces begins a new list

    // --- follows from the bits ---
    unsigned char *status; // [node_count] NodeStatus
    int *of_slot;          // [slot_count] node of a slot whether on or off; -1: padding
    int window_count;
    Window *window;
    int *lane;             // [slot_count] of a slot in the tables; -1 when off
    int *hanging;          // [hanging_count] slots of constrained nodes, finest level first
    int (*master)[2];      // [node_count..] slots of a hanging slot's masters, by index in `hanging`
    int hanging_count, hanging_capacity;
    void *hanging_force;   // Real [chunk][3][LANES]
    int *free_chunk, *hanging_chunk; // [window_count * WINDOW_CHUNKS] chunks in use, ascending
    int free_chunk_count, hanging_chunk_count;
    int (*run)[2];         // [window_count] first slot and end of neighbouring windows in use
    int run_count;
    int leaf_count[LEVELS_MAX + 1];

    // --- the change under way ---
    int *dirty;           // [node_count] nodes to pack again
    bool *is_dirty;       // [node_count]
    int dirty_count;
    bool *stale_window;   // [window_count]
    int *touched;         // [place_count] leaves by their first place, whose triangles may change
    signed char *touched_level;
    bool *is_touched;     // [place_count]
    int touched_count;
    TopologyChange change;
    FaceChange *face_change; // [place_count]
    NodeBirth *born;         // [node_count]
    int *gone;               // [node_count]

    // --- faces that are touched and drawn; by place ---
    int (*face)[3];
    int (*face_neighbor)[3];
    double *face_area;
    double *finest_area;
    int *node_face_start, *node_face_end, *node_face;
    double *node_area;

    // --- slots of the mesh in messages (detail_slots.c) ---
    struct MeshSlots *slots;

    Leaf *ring[2];     // scratch [most leaves around a node], one for each depth of use
    NodeSprings springs; // scratch
    int most_leaves;
} Detail;

// --- detail_set.c: what the bits say ---
bool detail_is_refined(const Detail *detail, int level, int face);
bool detail_exists(const Detail *detail, int level, int face);
bool detail_is_leaf(const Detail *detail, int level, int face);
// Leaves that have the node as a corner, in an order that depends on the hierarchy alone; at most
// detail->most_leaves.
int detail_leaves_around(const Detail *detail, int node, Leaf *leaf);
// The midpoint of an edge when it is on, else -1.
int detail_midpoint(const Detail *detail, int level, int edge);
// What the bits say of a midpoint of an edge of `level`.
NodeStatus detail_status_of_midpoint(const Detail *detail, int level, int edge);
// First of the places of a face.
int detail_place(const Detail *detail, int level, int face);

// --- detail_pack.c: from the bits to the kernel's tables ---
// Mass that moves with a node [kg]: its own third of the leaves around, and half of each hanging
// node's that it is master of.
double detail_mass(const Detail *detail, int node);
// Packs the stale windows, then everything that sums over windows.
void detail_pack(SurfaceModel *model);
// Everything that follows from the bits, from nothing.
void detail_rebuild(Body *body);
// Figures of the body that follow from the bits: mass, bounds, counts.
void detail_publish(Body *body);

// --- detail_change.c ---
// Begins and ends a change: between them faces are refined and coarsened.
void detail_begin_change(SurfaceModel *model);
void detail_refine(SurfaceModel *model, int level, int face);
bool detail_may_coarsen(const Detail *detail, int level, int face);
void detail_coarsen(SurfaceModel *model, int level, int face);
// True when something changed.
bool detail_end_change(Body *body);
// Faces that detail_refine would refine, with those that balance asks for.
int detail_refine_cost(const Detail *detail, int level, int face);
// Marks a node, and the masters that carry it, to be packed again.
void detail_mark(SurfaceModel *model, int node);

// --- detail_rows.c: rows of nodes that hang, come and go ---
// Velocity of a node that is on, through its masters when it hangs [m/s].
Vec3 detail_velocity(const SurfaceModel *model, int node);
// Changes the velocity of what carries a node by an impulse [N s].
void detail_push(SurfaceModel *model, int node, Vec3 impulse);
// Rest place of a node from its status; returns whether it moved.
bool detail_set_place(SurfaceModel *model, int node);
void detail_give_birth(SurfaceModel *model, int node);
void detail_switch_off(SurfaceModel *model, int node);
// Puts hanging rows in the middle of their masters.
void detail_hang(const SurfaceModel *model, void *rows);

// --- detail_faces.c ---
void detail_touch_leaf(Detail *detail, int level, int face);
// Draws the touched leaves anew and lists what changed.
void detail_draw(Body *body);

// --- detail_slots.c ---
typedef struct MeshSlots MeshSlots;

// --- detail_sweep.c ---
// Criteria of the next roots; refines and coarsens. True when the topology changed.
bool detail_sweep(Body *body, int64_t step, double tick);

extern const BodyOps detail_ops;

#endif
