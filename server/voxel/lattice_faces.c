// The faces of the smallest elements that border on void, as triangles with neighbours. Load time
// only.
#include "voxel/lattice_faces.h"

#include "base/check.h"

#include <stdlib.h>

enum { DIRECTIONS = SQUARE_DIRECTIONS };

const int SQUARE_CORNER[DIRECTIONS][4] = {
    {0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6},
};

// Returns the element behind a face, or -1 if the face connects it to none.
static int beyond(const Layout *layout, int element, int direction)
{
    int cell[3];
    for (int d = 0; d < 3; d++)
        cell[d] = layout->leaf[element].cell[d];
    cell[direction / 2] += direction & 1 ? 1 << layout->leaf[element].level : -1;
    return layout_leaf_at(layout, cell[0], cell[1], cell[2]);
}

int square_side(int direction, int k)
{
    int a = SQUARE_CORNER[direction][k], b = SQUARE_CORNER[direction][(k + 1) % 4];
    int axis = direction / 2;
    for (int d = 0; d < 3; d++)
        if (d != axis && (a >> d & 1) == (b >> d & 1))
            return 2 * d + (a >> d & 1);
    ASSERT(false);
    return -1;
}

// Walks around edge k of an outer square through the solid: from its element to the side, outwards,
// back and down again, until a face leads to no element: that is the next outer face. All cells
// around an edge of an outer face are elements of level 0.
static int square_across(const Layout *layout, int (*square)[DIRECTIONS], int element,
                         int direction, int k)
{
    int side = square_side(direction, k);
    const int turn[4] = {side, direction, side ^ 1, direction ^ 1};
    for (int t = 0; t < 4; t++) {
        int next = beyond(layout, element, turn[t]);
        if (next < 0)
            return square[element][turn[t]];
        ASSERT(layout->leaf[next].level == 0);
        element = next;
    }
    ASSERT(false); // the walk ends at the latest at the other side of the square itself
    return -1;
}

// Numbers the outer squares by element and direction; -1 elsewhere. Returns their number.
static int number_squares(const Layout *layout, int (*square)[DIRECTIONS], int fine_count)
{
    int count = 0;
    for (int e = 0; e < fine_count; e++)
        for (int d = 0; d < DIRECTIONS; d++)
            square[e][d] = beyond(layout, e, d) < 0 ? count++ : -1;
    return count;
}

static void set_square(LatticeMesh *mesh, int square, int element, int direction)
{
    int corner[4];
    for (int k = 0; k < 4; k++)
        corner[k] = mesh->vertex[element][SQUARE_CORNER[direction][k]];
    for (int half = 0; half < 2; half++) {
        int *face = mesh->face[2 * square + half];
        face[0] = corner[0];
        face[1] = corner[1 + half];
        face[2] = corner[2 + half];
        mesh->face_element[2 * square + half] = element;
    }
    mesh->face_neighbor[2 * square][NEAR_DIAGONAL] = 2 * square + 1;
    mesh->face_neighbor[2 * square + 1][FAR_DIAGONAL] = 2 * square;
}

// Returns the triangle of a square that has an edge from vertex a to vertex b.
static int half_with_edge(const LatticeMesh *mesh, int square, int a, int b)
{
    for (int k = 0; k < 4; k++) {
        const int *face = mesh->face[square_triangle(square, k)];
        if (face[square_edge(k)] == a && face[(square_edge(k) + 1) % 3] == b)
            return square_triangle(square, k);
    }
    ASSERT(false); // squares that meet around a solid corner share its vertices
    return -1;
}

void lattice_faces_create(LatticeMesh *mesh, const Layout *layout)
{
    int fine_count = 0; // elements of level 0: the first ones
    while (fine_count < layout->leaf_count && layout->leaf[fine_count].level == 0)
        fine_count++;
    int(*square)[DIRECTIONS] = malloc(((size_t)fine_count + 1) * sizeof *square);
    ASSERT(square != NULL);
    mesh->face_count = 2 * number_squares(layout, square, fine_count);
    size_t room = (size_t)mesh->face_count + 1;
    mesh->face = malloc(room * sizeof *mesh->face);
    mesh->face_neighbor = malloc(room * sizeof *mesh->face_neighbor);
    mesh->face_element = malloc(room * sizeof *mesh->face_element);
    ASSERT(mesh->face != NULL && mesh->face_neighbor != NULL && mesh->face_element != NULL);

    // All faces first: neighbours refer to each other's triangles.
    for (int e = 0; e < fine_count; e++)
        for (int d = 0; d < DIRECTIONS; d++)
            if (square[e][d] >= 0)
                set_square(mesh, square[e][d], e, d);
    for (int e = 0; e < fine_count; e++)
        for (int d = 0; d < DIRECTIONS; d++)
            for (int k = 0; k < 4 && square[e][d] >= 0; k++) {
                int a = mesh->vertex[e][SQUARE_CORNER[d][k]],
                    b = mesh->vertex[e][SQUARE_CORNER[d][(k + 1) % 4]];
                int across = square_across(layout, square, e, d, k);
                mesh->face_neighbor[square_triangle(square[e][d], k)][square_edge(k)] =
                    half_with_edge(mesh, across, b, a);
            }
    free(square);
}
