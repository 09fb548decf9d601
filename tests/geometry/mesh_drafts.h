// SPDX-License-Identifier: MIT
// Drafts of meshes as a reader makes them, and what holds for every repaired one.
#ifndef PLIANT_TESTS_MESH_DRAFTS_H
#define PLIANT_TESTS_MESH_DRAFTS_H

#include "test.h"

#include "geometry/mesh.h"
#include "geometry/mesh_repair.h"

// --- making drafts ---

static inline void add_nodes(MeshDraft *draft, const Vec3 *x, int count)
{
    for (int i = 0; i < count; i++)
        mesh_draft_add_node(draft, x[i]);
}

// A face of nodes that end with -1.
static inline void add_face(MeshDraft *draft, const int *node)
{
    for (; *node >= 0; node++)
        mesh_draft_add_corner(draft, *node, -1);
    mesh_draft_end_polygon(draft, 0);
}

#define FACE(draft, ...) add_face(draft, (const int[]){__VA_ARGS__, -1})

// A cube of side 1 whose lowest corner is `at`, as quads; its nodes go behind those that are there.
static const Vec3 CUBE[8] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                             {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
static const int CUBE_FACES[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                     {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

static inline void add_cube(MeshDraft *draft, Vec3 at)
{
    int first = draft->node_count;
    for (int i = 0; i < 8; i++)
        mesh_draft_add_node(draft, vec3_add(at, CUBE[i]));
    for (int f = 0; f < 6; f++)
        FACE(draft, first + CUBE_FACES[f][0], first + CUBE_FACES[f][1], first + CUBE_FACES[f][2],
             first + CUBE_FACES[f][3]);
}

static inline MeshDraft cube_draft(void)
{
    MeshDraft draft = {0};
    add_cube(&draft, vec3(0, 0, 0));
    return draft;
}

// A tetrahedron of volume 1/6 on nodes a b c d that stand right-handed.
static inline void add_tetrahedron(MeshDraft *draft, int a, int b, int c, int d)
{
    FACE(draft, a, c, b);
    FACE(draft, a, b, d);
    FACE(draft, b, c, d);
    FACE(draft, c, a, d);
}

// --- looking at results ---

typedef struct Result {
    TriMesh mesh;
    MeshRepairs repairs;
    MeshQuality quality;
} Result;

// Repairs and checks what holds for every result. Takes the draft.
static inline Result repair(MeshDraft *draft)
{
    Result result;
    MeshFault fault;
    if (!mesh_repair(draft, &result.mesh, &result.repairs, &fault))
        fail_msg("refused: %s", fault.text);
    const TriMesh *mesh = &result.mesh;
    assert_true(mesh_check(mesh, &fault));
    assert_int_equal(mesh->file_node_count, draft->node_count);
    for (int i = 0; i < mesh->node_count; i++) {
        assert_true(i == 0 || mesh->file_index[i] > mesh->file_index[i - 1]);
        // Nodes keep the bits of the source, and their numbers there lead to them.
        int row = mesh_file_row(mesh, i);
        assert_memory_equal(&mesh->position[i], &draft->position[row], sizeof(Vec3));
        if (mesh->file_index[i] < draft->node_count)
            assert_int_equal(mesh_node_of_file(mesh, mesh->file_index[i]), i);
    }
    // Every node of the source went one way.
    const MeshRepairs *repairs = &result.repairs;
    assert_int_equal(mesh->node_count - mesh->copy_count + repairs->welded_nodes +
                         repairs->merged_nodes + repairs->unused_nodes,
                     draft->node_count);
    mesh_quality_measure(mesh, &result.quality);
    mesh_draft_destroy(draft);
    return result;
}

static inline void result_destroy(Result *result)
{
    mesh_quality_destroy(&result->quality);
    mesh_destroy(&result->mesh);
}

// One closed cube of eight nodes, outward.
static inline void expect_cube(const Result *result)
{
    assert_int_equal(result->mesh.node_count, 8);
    assert_int_equal(result->mesh.triangle_count, 12);
    assert_int_equal(result->quality.component_count, 1);
    assert_int_equal(result->quality.border_loops, 0);
    assert_int_equal(result->quality.component[0].genus, 0);
    expect_near(result->quality.volume, 1.0, 1e-15); // exact but for rounding
    expect_near(result->quality.area, 6.0, 1e-15);
}

// What the repairs say of themselves.
static inline void expect_repairs(const Result *result, const char *expected)
{
    char text[512];
    mesh_repairs_text(&result->repairs, text, sizeof text);
    assert_string_equal(text, expected);
}

// Takes the draft.
static inline void expect_refusal(MeshDraft *draft, int face, const char *expected)
{
    TriMesh mesh;
    MeshRepairs repairs;
    MeshFault fault;
    assert_false(mesh_repair(draft, &mesh, &repairs, &fault));
    assert_string_equal(fault.text, expected);
    assert_int_equal(fault.triangle, face);
    mesh_draft_destroy(draft);
}

#endif
