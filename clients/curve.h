// Records the motion of a body from the published messages: its largest displacement over time, and
// its triangles in one frame for gnuplot. One thread.
#ifndef PLIANT_CLIENTS_CURVE_H
#define PLIANT_CLIENTS_CURVE_H

#include "program.h"
#include "frames.h"

typedef enum CurveFrame { CURVE_LAST, CURVE_PEAK, CURVE_FRAMES } CurveFrame;

// One complete frame with all data to draw it: its mesh may have been replaced by then.
typedef struct CurveShape {
    int32_t topology;
    int node_count;
    float *position, *first; // [3 node_count]
    int triangle_count;
    int32_t *triangle;   // [3 triangle_count]; NULL: its mesh has not arrived
    double time;         // simulated [s]
    double displacement; // largest of all nodes [m]
} CurveShape;

typedef struct Curve {
    MeshFrame mesh;
    NodesFrame nodes;
    // of the present topology
    int32_t topology;
    int node_count;
    int32_t *id;                    // [node_count] ids of the slots; NULL: the mesh has not arrived
    float *first;                   // [3 node_count] reference positions of the displacements
    CurveShape shape[CURVE_FRAMES]; // the last frame, and that of the largest displacement
    int64_t frames;                 // since the start
    FILE *out;                      // or NULL; not owned
} Curve;

// Takes one raw message of the body; the curve starts zeroed. A complete frame adds a row to `out`:
// simulated time [s], largest displacement [m], and the slot of the node that has it. Displacements
// are relative to the first complete frame. Across a change of topology nodes are identified by
// their ids. A node created between two others starts with the mean of their displacements, an
// unrelated one with none, and so do all nodes if the mesh before or after the change is missing.
void curve_take_nodes(Curve *curve, const void *data, size_t size);
void curve_take_mesh(Curve *curve, const void *data, size_t size);
void curve_take_delta(Curve *curve, const void *data, size_t size);
// First bytes of a file of a shape; only such files are replaced.
#define CURVE_SHAPE_MARK "# x_m y_m z_m displacement_m"
// Writes the triangles of a frame for gnuplot's pm3d: per triangle two lines of two corners "x y z
// displacement" [m]. Returns false if there is no frame or no mesh of its topology.
bool curve_write_shape(const Curve *curve, CurveFrame which, const char *path, PliantError *error);
void curve_destroy(Curve *curve);

#endif
