// Statistics of a mesh: its components, borders, angles and lengths, with the worst elements. Load
// time only.
#ifndef PLIANT_GEOMETRY_MESH_QUALITY_H
#define PLIANT_GEOMETRY_MESH_QUALITY_H

#include "geometry/mesh.h"

// One component: triangles that are connected across edges.
typedef struct MeshComponent {
    int node_count, edge_count, triangle_count;
    int border_loops; // 0: closed
    int genus;        // handles: (2 - border loops - (V - E + F)) / 2
    double area;      // [m2]
    double volume;    // enclosed, for a closed component; else 0 [m3]
} MeshComponent;

typedef struct MeshQuality {
    int edge_count, border_edges, border_loops;
    int component_count;
    MeshComponent *component;    // [component_count], in the order of their first triangles
    double area, volume;         // sums; volume of the closed components only
    Box box;                     // of all nodes [m]
    double angle_min, angle_max; // of triangles [rad]
    double angle_mean;           // mean over the triangles of their smallest angle [rad]
    int sharpest;                // triangle with the smallest angle
    int sharp_triangles;         // with an angle below MESH_SHARP_ANGLE
    double edge_min, edge_mean, edge_max; // lengths [m]
    int shortest[2], longest[2];          // their nodes
} MeshQuality;

// Triangles with smaller angles are slivers: stiff, and of little use to the simulation.
#define MESH_SHARP_ANGLE (20.0 / 180.0 * 3.14159265358979323846)

// Measures a mesh that passes mesh_check. `quality` owns its arrays.
void mesh_quality_measure(const TriMesh *mesh, MeshQuality *quality);
void mesh_quality_destroy(MeshQuality *quality);

#endif
