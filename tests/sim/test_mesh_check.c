// SPDX-License-Identifier: MIT
// The checker of published meshes knows a good mesh from a damaged one: otherwise whoever relies on
// it tests nothing.
#include "test.h"
#include "mesh_check.h"
#include "mesh_toy.h"

TEST(randomly_refined_meshes_are_crack_free)
{
    for (int open = 0; open < 2; open++) {
        SCOPED(mesh_toy_destroy) MeshToy toy;
        mesh_toy_create(&toy, open, 7);
        int changes = 0, most = 0;
        for (int i = 0; i < 500; i++) {
            Vec3 position[TOY_NODES];
            changes += mesh_toy_change(&toy);
            BodyMesh mesh = mesh_toy_mesh(&toy);
            mesh_toy_positions(&toy, position);
            expect_crack_free(&mesh, &toy.base, position);
            most = mesh.triangle_count > most ? mesh.triangle_count : most;
        }
        // The toy does what it is for: it changes, and goes beyond one level.
        assert_in_range(changes, 250, 500);
        assert_in_range(most, 4 * TOY_BASE_FACES, TOY_FACES);
        mesh_toy_refine_all(&toy);
        BodyMesh mesh = mesh_toy_mesh(&toy);
        expect_crack_free(&mesh, &toy.base, NULL);
    }
}

// A mesh with face 0 refined, to be damaged: its neighbours are drawn as two.
typedef struct Damaged {
    MeshToy toy;
    BodyMesh mesh;
    Vec3 position[TOY_NODES];
} Damaged;

static MeshToyState *start(Damaged *damaged, bool open)
{
    mesh_toy_create(&damaged->toy, open, 1);
    do { // until it is what we want: few refined faces, at level 0 only, some triangle slot free
        mesh_toy_change(&damaged->toy);
        damaged->mesh = mesh_toy_mesh(&damaged->toy);
    } while (damaged->mesh.triangle_count < 16 || damaged->mesh.triangle_count > 40);
    mesh_toy_positions(&damaged->toy, damaged->position);
    expect_crack_free(&damaged->mesh, &damaged->toy.base, damaged->position);
    return &damaged->toy.state;
}

static int live_triangle(const MeshToyState *state)
{
    int t = 0;
    while (state->triangle[t][0] == state->triangle[t][1])
        t++;
    return t;
}

static int midpoint_slot(const MeshToyState *state)
{
    int i = 0;
    while (state->id[i] < 0 || state->level[i] == 0)
        i++;
    return i;
}

TEST(every_damage_is_found)
{
    enum { DAMAGES = 14 };
    static const char *const said[DAMAGES] = {
        "ends in its middle|on no border|crack",
        "turn against|crack|on no border",
        "lies in 3|turn against|crack",
        "both have id",
        "which is no node",
        "which is no node",
        "twice",
        "is in no triangle",
        "not in the mesh",
        "has parents",
        "joins pieces",
        "finite",
        "no area",
        "of level",
    };
    for (int damage = 0; damage < DAMAGES; damage++) {
        Damaged d;
        char why[MESH_CHECK_TEXT];
        MeshToyState *s = start(&d, damage % 2);
        int t = live_triangle(s), m = midpoint_slot(s);
        int *corner = s->triangle[t];
        switch (damage) {
        case 0: // a hole
            memset(corner, 0, 3 * sizeof *corner);
            break;
        case 1: { // a triangle turned over
            int swapped = corner[1];
            corner[1] = corner[2];
            corner[2] = swapped;
            break;
        }
        case 2: // the same triangle twice
            memcpy(s->triangle[s->triangle_count], corner, 3 * sizeof *corner);
            d.mesh.triangle_count++;
            break;
        case 3:
            s->id[corner[0]] = s->id[corner[1]];
            break;
        case 4: // nodes whose triangles stay
            s->id[m] = -1;
            break;
        case 5:
            corner[1] = d.mesh.node_count;
            break;
        case 6:
            corner[0] = corner[1] == 0 ? corner[2] : corner[1];
            break;
        case 7: // a node that nobody needs
            s->id[d.mesh.node_count] = 5000;
            s->parent[d.mesh.node_count][0] = s->parent[d.mesh.node_count][1] = 5000;
            s->level[d.mesh.node_count] = 0;
            d.mesh.node_count++;
            break;
        case 8:
            s->parent[m][0] = 4999;
            break;
        case 9:
            s->level[m] = 0;
            break;
        case 10:
            s->piece[corner[0]] = 1;
            break;
        case 11:
            d.position[corner[2]].y = (double)NAN;
            break;
        case 12:
            d.position[corner[2]] = d.position[corner[1]];
            break;
        default: // a midpoint between itself and another: younger parents
            s->parent[m][1] = s->id[m];
            break;
        }
        assert_false(mesh_agrees(&d.mesh, &d.toy.base, d.position, why));
        char list[128], *rest = list, *one;
        bool found = false;
        snprintf(list, sizeof list, "%s", said[damage]);
        while ((one = strsep(&rest, "|")) != NULL)
            found |= strstr(why, one) != NULL;
        if (!found)
            fail_msg("damage %d: \"%s\"", damage, why);
        mesh_toy_destroy(&d.toy);
    }
}

// What a renderer shows as a gap: one side of an edge is divided, the other is not.
TEST(a_hanging_midpoint_is_a_crack)
{
    static const int id[5] = {3, 5, 8, 9, 20}, piece[5] = {0};
    static const int parent[5][2] = {{3, 3}, {5, 5}, {8, 8}, {9, 9}, {5, 8}};
    static const signed char level[5] = {0, 0, 0, 0, 1};
    // A square of two triangles about the diagonal 5-8, of which only one sees its midpoint.
    static const int cracked[4][3] = {{0, 1, 4}, {0, 4, 2}, {1, 3, 2}, {0, 0, 0}};
    static const int whole[4][3] = {{0, 1, 4}, {0, 4, 2}, {1, 3, 4}, {4, 3, 2}};
    BodyMesh mesh = {.topology = 1,
                     .node_count = 5,
                     .triangle_count = 4,
                     .node_capacity = 5,
                     .triangle_capacity = 4,
                     .triangle = whole,
                     .id = id,
                     .origin = id,
                     .parent = parent,
                     .piece = piece,
                     .level = level};
    char why[MESH_CHECK_TEXT];
    expect_crack_free(&mesh, NULL, NULL);
    mesh.triangle = cracked;
    assert_false(mesh_agrees(&mesh, NULL, NULL, why));
    assert_non_null(strstr(why, "crack along the edge of level 0 between 5 and 8"));
}

TEST(a_missing_face_of_level_0_needs_the_base_to_be_seen)
{
    SCOPED(mesh_toy_destroy) MeshToy toy;
    char why[MESH_CHECK_TEXT];
    mesh_toy_create(&toy, false, 1); // nowhere refined
    memset(toy.state.triangle[3], 0, sizeof toy.state.triangle[3]);
    BodyMesh mesh = mesh_toy_mesh(&toy);
    assert_true(mesh_agrees(&mesh, NULL, NULL, why));
    assert_false(mesh_agrees(&mesh, &toy.base, NULL, why));
    assert_non_null(strstr(why, "a whole face is missing"));
}
