// What a mesh is like: its components, borders, angles and lengths, with the worst elements named.
// Load time only.
#ifndef PLIANT_GEOMETRY_MESH_QUALITY_H
#define PLIANT_GEOMETRY_MESH_QUALITY_H

#include "geometry/mesh.h"

// One surface: triangles that can be reached from each other over edges.
typedef struct MeshComponent {
    int node_count, edge_count, triangle_count;
    int border_loops; // 0: closed
    int genus;        // handles: (2 - border loops - (V - E + F)) / 2
    double area;      // [m2]
    double volume;    // enclosed, of a closed component [m3]
} MeshComponent;

typedef struct MeshQuality {
    int edge_count, border_edges, border_loops;
    int component_count;
    MeshComponent *component;    // [component_count], in the order of their first triangles
    double area, volume;         // of all; volume that of the closed ones
    Vec3 low, high;              // box [m]
    double angle_min, angle_max; // of triangles [rad]
    double angle_mean;           // of the smallest angles of the triangles [rad]
    int sharpest;                // triangle of the smallest angle
    int sharp_triangles;         // with an angle below MESH_SHARP_ANGLE
    double edge_min, edge_mean, edge_max; // lengths [m]
    int shortest[2], longest[2];          // their nodes
} MeshQuality;

// Triangles with smaller angles are slivers: stiff, and of little use.
#define MESH_SHARP_ANGLE (20.0 / 180.0 * 3.14159265358979323846)

// The mesh must have passed mesh_validate. Arrays are owned by `quality`.
void mesh_quality_measure(const TriMesh *mesh, MeshQuality *quality);
void mesh_quality_destroy(MeshQuality *quality);

#endif
