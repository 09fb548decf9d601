// Private to the surface module: a body whose faces are refined and coarsened while it runs (Choi
// et al. 2005; README.md derives the rules). Everything here follows from one set of bits, which
// faces are refined: tables, masses, sums and their order are a pure function of it, and every
// local update gives the same bits as rebuilding everything (detail_rebuild).
//
// A node has a slot for its rows, in an order of the hierarchy that keeps neighbours together,
// level by level, and, while it is on, a lane in the kernel's tables.
#ifndef PLIANT_SURFACE_DETAIL_DETAIL_H
#define PLIANT_SURFACE_DETAIL_DETAIL_H

#include "geometry/levels.h"
#include "surface/detail/detail_cut.h"
#include "surface/detail/detail_faces.h"
#include "surface/detail/detail_frames.h"
#include "surface/detail/detail_set.h"
#include "surface/level_rules.h"
#include "surface/model.h"

// Slots that are packed together: larger windows leave fewer lanes empty, smaller ones are packed
// faster.
enum { WINDOW_MOST = 1024, WINDOW_LEAST = 256 };

enum { CREASE_SHARP = 2 }; // largest value in Detail.crease: divide the leaf

// The springs of a node: slots of the other ends, ascending.
typedef struct NodeSprings {
    int count;
    int *neighbour;
    double *stiffness; // [N/m]
} NodeSprings;

// Results of packing one window; sums and maxima over its free nodes.
typedef struct Window {
    int free_count, hanging_count;
    int free_chunks; // the hanging nodes' chunks follow
    double mass;     // [kg]
    double lambda, damping;
    int spring_ends;
} Window;

// Progress of the sweep over the criteria; plain data, part of the state.
typedef struct Sweep {
    int64_t root;                        // next face of level 0
    int64_t urgent;                      // roots to sweep at once, after a new load
    double credit;                       // number of roots that may be swept by now
    double thresholds[3];                // force, speed, curvature
    double scale;                        // multiplies all three
    int64_t level;                       // finest level that may be used
    int64_t topology;                    // number of changes since the start
    int64_t refined, coarsened, refused; // faces, since the start
} Sweep;

// A force of a tool on a node in the last evaluation of a tick; part of the state.
typedef struct Felt {
    int64_t node;
    Vec3 force; // [N]
} Felt;

// What a sweep has computed for a node.
typedef struct NodeLook {
    int64_t pass;    // number of the pass; 0: never
    Vec3 position;   // [m]
    Vec3 moved;      // displacement from the rest position [m]
    double slip2;    // square of the speed relative to the body's rigid motion [m2/s2]
    double traction; // external force over its area [N/m2]
} NodeLook;

typedef struct Detail {
    // --- constant ---
    SurfaceOptions options;
    StateList *state; // load time only
    LevelRules rules;
    LeafSet set;
    DetailFaces faces;
    DetailReport report;
    int edge_base[LEVELS_MAX + 2];       // number of the first edge of each level
    double least_height[LEVELS_MAX + 1]; // smallest height of the faces of a level at rest [m]
    float (*rest_fold)[2]; // [edges of all levels] cosine and sine of the angle between the faces
    bool *fixed;           // [node_count]
    double modulus;        // E2D [N/m]
    double shape_rate, shape_drag, node_drag; // by mass [1/s2], [1/s], [1/s]
    double edge_length;                       // mean of level 0 [m]
    double wave_speed;                        // sqrt(E2D / rho_A) [m/s]
    double least_lambda, least_damping;       // of level 0: bounds of a body that is entirely fixed
    int *of_slot; // [window_count * width] node of a slot, on or off; -1: padding
    int window_count;
    int width;            // slots of a window
    int window_chunks;    // chunks per window: both the last chunk of free nodes and the last of
                          // hanging ones may be partly filled
    int spare_slot;       // + window: the rows of lanes without a node
    DetailFrames *frames; // NULL: not cuttable, or virtual nodes follow no frame

    // --- part of the state ---
    int64_t *calm_since; // the same: tick since which its children are calm, plus 1; 0: not calm
    Sweep *sweep;
    unsigned char *crease; // [faces of all levels] what the sweep has found for a face from the
                           // other side of its edges
    Felt *felt;            // [felt_capacity]
    int64_t *felt_count;
    int felt_capacity;
    bool is_sound; // detail_check succeeded, or was not called

    // --- derived from the bits ---
    Window *window;     // [window_count]
    double *bound;      // [node_count] Carried.stiffness
    bool *is_dirty;     // [node_count] its springs or mass have changed: pack again
    bool *stale_window; // [window_count] has such a node, or one that was switched on or off
    int hanging_count;
    int *hanging;     // [node_count] slots of hanging nodes, finest level first
    int (*master)[2]; // [node_count] slots of their masters
    int *carrier;     // [carrier_count] slots of free masters, once per hanging node
    int carrier_count;
    unsigned char *carries; // [window_count * window_chunks] true if a chunk contains a master
    int *free_chunk, *hanging_chunk; // [window_count * window_chunks] in use, ascending
    int free_chunk_count, hanging_chunk_count;
    int (*run)[2]; // [window_count] first slot and end of adjacent windows in use
    int run_count;
    double mass, lambda, damping;
    int spring_ends, on_count;

    Leaf *calm; // [calm_capacity] refined faces whose four children have been calm for long
    int calm_count, calm_capacity;
    bool again; // of TopologyChange
    int again_count;

    // --- scratch ---
    void *handed;   // Real [slot_count][ROW], half of it used: forces of hanging nodes, and their
                    // masters' shares of them [N]; zero for other nodes that are on
    NodeLook *look; // [node_count]
    int64_t look_passes;
    double *felt_force;               // [node_count] zero except during a sweep [N]
    NodeSprings springs[WINDOW_MOST]; // by slot
} Detail;

// --- detail_pack.c: builds the kernel's tables from the bits ---
// Returns the mass that moves with a node [kg]: a third of the leaves around it, and half of the
// mass of each hanging node whose master it is; with choi2005 eq 7.
double detail_mass(const SurfaceModel *model, int node);
// Packs the stale windows, then updates the sums over windows.
void detail_pack(SurfaceModel *model);

// --- detail_rows.c: rows of nodes that hang, are created or removed ---
// Returns the velocity of a node that is on, from its masters if it hangs [m/s].
Vec3 detail_velocity(const SurfaceModel *model, int node);
// Changes the velocity of the nodes that carry a node by an impulse [N s].
void detail_push(SurfaceModel *model, int node, Vec3 impulse);
// Sets the rest position that a node's status requires.
void detail_set_place(SurfaceModel *model, int node);
// The same for a node that no longer hangs; its displacement stays.
void detail_release(SurfaceModel *model, int node);
void detail_give_birth(SurfaceModel *model, int node);
// Creates a node at the position of another, with the same motion.
void detail_copy_row(SurfaceModel *model, int node, int from);
void detail_switch_off(SurfaceModel *model, int node);
// Sets hanging rows to the means of their masters.
void detail_hang(const SurfaceModel *model, void *rows);

// --- detail_butterfly.c ---
// Returns the displacement, in the rows' coordinates, that the modified butterfly gives the
// midpoint of an edge [m].
Vec3 detail_butterfly(const SurfaceModel *model, int level, int edge);

// --- detail_change.c: refining and coarsening ---
// Begins a change; faces are refined and coarsened until detail_end_change.
void detail_begin_change(SurfaceModel *model);
// Marks a node whose springs or mass change, to be packed again.
void detail_mark(SurfaceModel *model, int node);
// Refines a leaf, after the refinements that balance requires. False: the capacity is too small.
bool detail_refine(SurfaceModel *model, int level, int face);
// Coarsen a refined face whose four children must be leaves; detail_may_coarsen: true if balance
// allows it.
bool detail_may_coarsen(const LeafSet *set, int level, int face);
void detail_coarsen(SurfaceModel *model, int level, int face);
// Ends a change. True if something changed.
bool detail_end_change(Body *body);
// The same after edges were broken, which may have changed no node.
void detail_end_cut(Body *body);

// --- detail_fold.c: angles between leaves ---
// Load time: fills rest_fold and least_height.
void detail_measure_folds(Detail *detail);
// Recomputes one edge, after rest positions have changed.
void detail_measure_fold(Detail *detail, int level, int edge);
// Returns the cosine of the angle by which two leaves at an edge have turned against each other
// since rest; 1 if one of them has no area and so no direction. node: the edge's ends in the order
// of one leaf, its third corner, and that of the other leaf; x: their positions [m].
double detail_cos_of_turn(const SurfaceModel *model, int level, int edge, const int node[4],
                          const Vec3 x[4]);

// --- detail_sweep.c ---
// Examines the next faces, refines and coarsens. True if the topology changed.
bool detail_sweep(Body *body, int64_t step, double tick);

// --- detail_check.c ---
// After the state was overwritten: true if everything else can be derived from it.
bool detail_check(const Detail *detail);

// --- detail_create.c ---
// Rebuilds everything that is derived from the bits.
void detail_rebuild(Body *body);
// Publishes the body's derived quantities: mass, bounds, counts, mesh.
void detail_publish(Body *body);
// Returns the topology number of its mesh.
int detail_topology(const Detail *detail);

// --- detail_body.c ---
// Returns the operations that the options require.
const BodyOps *detail_ops(const SurfaceOptions *options);
// Two of them, with explicit steps; implicit ones call them.
void detail_drift(void *self, double dt);
void detail_explain(const void *self, FILE *out);

#endif
