// Records what a body did from what the daemon really published: its largest displacement over
// time, and its triangles in one frame for gnuplot. One thread.
#ifndef PLIANT_CLIENTS_CURVE_H
#define PLIANT_CLIENTS_CURVE_H

#include "client.h"
#include "frames.h"

typedef enum CurveFrame { CURVE_LAST, CURVE_PEAK, CURVE_FRAMES } CurveFrame;

// One whole frame, kept.
typedef struct CurveShape {
    float *position;     // [3 node_count of the curve]
    double time;         // simulated [s]
    double displacement; // largest of all nodes [m]
} CurveShape;

typedef struct Curve {
    MeshFrame mesh;
    NodesFrame nodes;
    // of the present topology
    int32_t topology;
    int node_count;
    float *first;                   // its first whole frame: displacements count from it
    CurveShape shape[CURVE_FRAMES]; // the last frame, and that of the largest displacement
    int64_t frames;                 // since the start
    FILE *out;                      // or NULL; not owned
} Curve;

// Starts zeroed. Takes one raw message of the body; a whole frame adds a row to `out`: simulated
// time [s], largest displacement [m], and the node that has it.
void curve_take_nodes(Curve *curve, const void *data, size_t size);
void curve_take_mesh(Curve *curve, const void *data, size_t size);
// Writes the triangles of a frame as gnuplot's pm3d reads them: per triangle two lines of two
// corners "x y z displacement" [m]. False when no frame or no mesh of its topology came.
bool curve_write_shape(const Curve *curve, CurveFrame which, const char *path, ClientError *error);
void curve_destroy(Curve *curve);

#endif
