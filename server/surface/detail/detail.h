// Private to the surface room: a body whose faces are refined and simplified while it runs (Choi et
// al. 2005, with the rules of surface.md). Everything here follows from one set of bits, which
// faces are refined: tables, masses, sums and their order are a pure function of it, and every
// local update gives the same bits as building all of it anew (detail_rebuild).
//
// Words: a face exists when its parent is refined, and is a leaf when it is not refined itself.
// Leaves across an edge differ by at most one level. A node is on when a leaf has it as a corner.
// It is a midpoint of an edge of the level above; when only one of the faces at that edge is
// refined it hangs: with adjust = "continuum" it is held in the middle of the edge's ends, its
// masters, and its forces and mass are theirs; with "choi2005" it moves freely.
//
// A node has a slot for its rows, in an order of the hierarchy that keeps neighbours together,
// level by level, and, while it is on, a lane in the kernel's tables.
#ifndef PLIANT_SURFACE_DETAIL_DETAIL_H
#define PLIANT_SURFACE_DETAIL_DETAIL_H

#include "geometry/levels.h"
#include "surface/detail/detail_cut.h"
#include "surface/detail/detail_frames.h"
#include "surface/detail/detail_slots.h"
#include "surface/level_rules.h"
#include "surface/model.h"

// Slots that are packed together: more of them leave fewer lanes empty, fewer are packed sooner.
enum { WINDOW_MOST = 1024, WINDOW_LEAST = 256 };

enum { CREASE_SHARP = 2 }; // largest note in Detail.crease: that a leaf is to be divided

typedef enum NodeStatus { NODE_OFF, NODE_FREE, NODE_HANGING } NodeStatus;

// The springs of a node: slots of the other ends, ascending.
typedef struct NodeSprings {
    int count;
    int *neighbour;
    double *stiffness; // [N/m]
} NodeSprings;

// What is packed of one window; sums and largest values over its free nodes.
typedef struct Window {
    int free_count, hanging_count;
    int free_chunks; // the hanging nodes' chunks follow
    double mass;     // [kg]
    double lambda, damping;
    int spring_ends;
} Window;

// Where the sweep of the criteria stands; plain data, part of the state.
typedef struct Sweep {
    int64_t root;                        // next face of level 0
    int64_t urgent;                      // roots to sweep at once: a load is new
    double credit;                       // roots that may be swept by now
    double thresholds[3];                // force, speed, curvature
    double scale;                        // of all three
    int64_t level;                       // finest that may be used
    int64_t topology;                    // changes since the start
    int64_t refined, coarsened, refused; // faces, since the start
} Sweep;

// A force that a tool put on a node in the last evaluation of a tick; part of the state.
typedef struct Felt {
    int64_t node;
    Vec3 force; // [N]
} Felt;

// What a sweep has found out about a node.
typedef struct NodeLook {
    int64_t pass;    // in which; 0: never
    Vec3 position;   // [m]
    Vec3 moved;      // from its rest place [m]
    double slip2;    // square of its speed against the body's motion [m2/s2]
    double traction; // force from outside over its area [N/m2]
} NodeLook;

typedef struct Detail {
    // --- constant ---
    SurfaceOptions options;
    StateList *state; // load time only
    Levels levels;
    LevelRules rules;
    bool constrained; // hanging nodes are: adjust = "continuum"
    int finest;
    int face_base[LEVELS_MAX + 2];       // number of the first face of each level
    int edge_base[LEVELS_MAX + 2];       // likewise of its edges
    double least_height[LEVELS_MAX + 1]; // of the faces of a level at rest [m]
    float (*rest_fold)[2]; // [edges of all levels] cosine and sine of the angle between the faces
    int *root_ring_start, *root_ring;         // faces of level 0 around each of its nodes
    bool *fixed;                              // [node_count]
    int node_count, place_count;              // nodes and faces of the finest level; with copies
    double modulus;                           // E2D [N/m]
    double shape_rate, shape_drag, node_drag; // by mass [1/s2], [1/s], [1/s]
    double edge_length;                       // mean of level 0 [m]
    double wave_speed;                        // sqrt(E2D / rho_A) [m/s]
    double least_lambda, least_damping;       // of level 0: bounds of a body wholly held
    int *of_slot; // [window_count * width] node of a slot, on or off; -1: padding
    int window_count;
    int width;         // slots of a window
    int window_chunks; // chunks of a window: the last of the free nodes and the last of the hanging
                       // ones may both be short
    int spare_slot;    // + window: the rows of lanes without a node
    DetailCut *cut;    // NULL: nothing can cut it
    DetailFrames *frames; // NULL: that too, or its virtual nodes follow no frame

    // --- part of the state ---
    unsigned char *refined; // [faces above the finest level]
    int64_t *calm_since;    // the same: tick since which its four are calm, plus 1; 0: not calm
    Sweep *sweep;
    unsigned char *crease; // [faces of all levels] what the sweep has found out about a face from
                           // the other side of its edges
    Felt *felt;            // [felt_capacity]
    int64_t *felt_count;
    int felt_capacity;
    bool is_sound; // detail_check said so, or it was not asked

    // --- follows from the bits ---
    unsigned char *status; // [node_count] NodeStatus
    Window *window;        // [window_count]
    double *bound;         // [node_count] Carried.stiffness
    bool *is_dirty;        // [node_count] its springs or its mass have changed: to be packed again
    bool *stale_window;    // [window_count] has such a node, or one that came or went
    int hanging_count;
    int *hanging;     // [node_count] slots of hanging nodes, finest level first
    int (*master)[2]; // [node_count] slots of their masters
    int *carrier;     // [carrier_count] slots of free masters, once for each time
    int carrier_count;
    unsigned char *carries;          // [window_count * window_chunks] whether a chunk has one
    int *free_chunk, *hanging_chunk; // [window_count * window_chunks] in use, ascending
    int free_chunk_count, hanging_chunk_count;
    int (*run)[2]; // [window_count] first slot and end of neighbouring windows in use
    int run_count;
    int leaf_count[LEVELS_MAX + 1];
    double mass, lambda, damping;
    int spring_ends, on_count;

    // --- faces that are touched and drawn; by place (BodySurface) ---
    int (*face)[3];
    int (*face_neighbor)[3];
    double *face_area, *finest_area;
    int *node_face_start, *node_face_end, *node_face;
    double *node_area;
    MeshSlots *slots;

    // --- the change under way ---
    TopologyChange change;
    FaceChange *face_change; // [2 place_count]
    NodeBirth *born;         // [node_count]
    int *gone;               // [node_count]
    int (*gone_parent)[2];   // [node_count]
    Leaf *touched;           // [faces of all levels] to be drawn again
    bool *is_touched;
    int *cleared, *drawn; // [place_count] places
    bool *was_used;       // [place_count]
    int *redrawn;         // [node_count]
    bool *is_redrawn;
    int touched_count, cleared_count, drawn_count, redrawn_count;
    Leaf *calm; // [calm_capacity] refined faces whose four have been calm for long
    int calm_count, calm_capacity;
    bool again; // of TopologyChange
    int again_count;

    // --- scratch ---
    void *handed; // Real [slot_count][ROW], half of it used: forces of hanging nodes, and of these
                  // what their masters get [N]; zero for other nodes that are on
    NodeLook *look; // [node_count]
    int64_t look_passes;
    double *felt_force;               // [node_count] zero but during a sweep [N]
    Leaf *ring[LEVELS_MAX + 4];       // leaves around a node, by depth of use
    NodeSprings springs[WINDOW_MOST]; // by slot
} Detail;

// --- detail_set.c: what the bits say ---
bool detail_is_refined(const Detail *detail, int level, int face);
bool detail_exists(const Detail *detail, int level, int face);
bool detail_is_leaf(const Detail *detail, int level, int face);
// The node of the uncut mesh that a node is, or is a copy of.
int detail_original(const Detail *detail, int node);
// A face's corners in the uncut mesh.
const int *detail_uncut(const Detail *detail, int level, int face);
// Leaves that have the node as a corner, in an order that depends on the hierarchy alone.
int detail_leaves_around(const Detail *detail, int node, Leaf *leaf);
// The midpoint of an edge when it is on, else -1.
int detail_midpoint(const Detail *detail, int level, int edge);
// What the bits say of the midpoint of an edge of `level`.
NodeStatus detail_status_of_midpoint(const Detail *detail, int level, int edge);
// Whether the edge between corners k and k + 1 of a leaf is.
static inline bool detail_is_broken(const Detail *detail, int level, int face, int k)
{
    return detail->cut != NULL && level == detail->finest &&
           (detail->cut->broken[face] >> k & 1) != 0;
}
// First of the places of a face.
int detail_place(const Detail *detail, int level, int face);

// --- detail_pack.c: from the bits to the kernel's tables ---
// Mass that moves with a node [kg]: its own third of the leaves around, and half of each hanging
// node's that it is master of; with choi2005 eq 7.
double detail_mass(const SurfaceModel *model, int node);
// Packs the stale windows, then what sums over windows.
void detail_pack(SurfaceModel *model);

// --- detail_rows.c: rows of nodes that hang, come and go ---
// Velocity of a node that is on, through its masters when it hangs [m/s].
Vec3 detail_velocity(const SurfaceModel *model, int node);
// Changes the velocity of what carries a node by an impulse [N s].
void detail_push(SurfaceModel *model, int node, Vec3 impulse);
// Puts a node where its status says that it rests.
void detail_set_place(SurfaceModel *model, int node);
// The same for a node that hangs no longer: its displacement stays.
void detail_release(SurfaceModel *model, int node);
void detail_give_birth(SurfaceModel *model, int node);
// A node that comes to be where another is, and moves as it does.
void detail_copy_row(SurfaceModel *model, int node, int from);
void detail_switch_off(SurfaceModel *model, int node);
// Puts hanging rows in the middle of their masters.
void detail_hang(const SurfaceModel *model, void *rows);

// --- detail_butterfly.c ---
// Displacement, in the rows' coordinates, that the modified butterfly gives the midpoint of an
// edge.
Vec3 detail_butterfly(const SurfaceModel *model, int level, int edge);

// --- detail_change.c: refining and coarsening ---
// Between the beginning and the end of a change faces are refined and coarsened.
void detail_begin_change(SurfaceModel *model);
// The springs or the mass of a node change: it is packed anew.
void detail_mark(SurfaceModel *model, int node);
// A leaf, after whatever balance asks for. False: it does not fit.
bool detail_refine(SurfaceModel *model, int level, int face);
// A refined face, whose four must be leaves: whether balance allows it; then do it.
bool detail_may_coarsen(const Detail *detail, int level, int face);
void detail_coarsen(SurfaceModel *model, int level, int face);
// True when something changed.
bool detail_end_change(Body *body);
// The same where edges were broken, which may have changed no node.
void detail_end_cut(Body *body);

// --- detail_faces.c: what is touched and drawn ---
void detail_touch(Detail *detail, int level, int face);
void detail_draw(Detail *detail);
void detail_draw_all(Detail *detail);

// --- detail_fold.c: angles between leaves ---
// Load time: fills rest_fold and least_height.
void detail_measure_folds(Detail *detail);
// Anew for one edge, after rest places have changed.
void detail_measure_fold(Detail *detail, int level, int edge);
// Cosine of the angle by which two leaves at an edge have turned against each other since rest; 1
// when one of them has no area, and so no direction. node: the edge's ends as one leaf has them in
// turn, its third corner, and that of the other leaf; x [m] where they are.
double detail_cos_of_turn(const SurfaceModel *model, int level, int edge, const int node[4],
                          const Vec3 x[4]);

// --- detail_sweep.c ---
// Looks at the next faces, refines and coarsens. True when the topology changed.
bool detail_sweep(Body *body, int64_t step, double tick);

// --- detail_check.c ---
// After the state list was overwritten: whether all else can follow from it.
bool detail_check(const Detail *detail);

// --- detail_create.c ---
// Everything that follows from the bits, from nothing.
void detail_rebuild(Body *body);
// The figures of the body that follow from them: mass, bounds, counts, mesh.
void detail_publish(Body *body);

// --- detail_body.c ---
const BodyOps *detail_ops(const SurfaceOptions *options);

#endif
