// Records what a body did from what the daemon really published: its largest displacement over
// time, and its triangles in one frame for gnuplot. One thread.
#ifndef PLIANT_CLIENTS_CURVE_H
#define PLIANT_CLIENTS_CURVE_H

#include "client.h"
#include "frames.h"

typedef enum CurveFrame { CURVE_LAST, CURVE_PEAK, CURVE_FRAMES } CurveFrame;

// One whole frame, kept with all that it takes to draw it: its mesh may be gone by then.
typedef struct CurveShape {
    int32_t topology;
    int node_count;
    float *position, *first; // [3 node_count]
    int triangle_count;
    int32_t *triangle;   // [3 triangle_count]; NULL: its mesh has not come yet
    double time;         // simulated [s]
    double displacement; // largest of all nodes [m]
} CurveShape;

typedef struct Curve {
    MeshFrame mesh;
    NodesFrame nodes;
    // of the present topology
    int32_t topology;
    int node_count;
    int32_t *id;                    // [node_count] whose slots; NULL: its mesh has not come yet
    float *first;                   // [3 node_count] displacements count from here
    CurveShape shape[CURVE_FRAMES]; // the last frame, and that of the largest displacement
    int64_t frames;                 // since the start
    FILE *out;                      // or NULL; not owned
} Curve;

// Starts zeroed. Takes one raw message of the body; a whole frame adds a row to `out`: simulated
// time [s], largest displacement [m], and the slot of the node that has it. Displacements count
// from the first whole frame. Across a change of topology nodes are told by their ids; one that
// comes between two others starts with the mean of their displacements, one that nothing is known
// of with none, and so do all when the mesh before or after the change never came.
void curve_take_nodes(Curve *curve, const void *data, size_t size);
void curve_take_mesh(Curve *curve, const void *data, size_t size);
void curve_take_delta(Curve *curve, const void *data, size_t size);
// Writes the triangles of a frame as gnuplot's pm3d reads them: per triangle two lines of two
// corners "x y z displacement" [m]. False when no frame or no mesh of its topology came.
bool curve_write_shape(const Curve *curve, CurveFrame which, const char *path, ClientError *error);
void curve_destroy(Curve *curve);

#endif
