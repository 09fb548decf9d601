// SPDX-License-Identifier: MIT
// The faces of the smallest elements that border on void, as triangles with neighbours. Load time
// only.
#include "voxel/lattice_faces.h"

#include "base/check.h"

#include <stdlib.h>

enum { DIRECTIONS = SQUARE_DIRECTIONS };

const int SQUARE_CORNER[DIRECTIONS][4] = {
    {0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6},
};

const int SQUARE_SIDE[DIRECTIONS][4] = {
    {2, 5, 3, 4}, {4, 3, 5, 2}, {4, 1, 5, 0}, {0, 5, 1, 4}, {0, 3, 1, 2}, {2, 1, 3, 0},
};

static int beyond(const void *cells, int element, int direction)
{
    const Layout *layout = cells;
    const Leaf *leaf = &layout->leaf[element];
    int cell[3] = {leaf->cell[0], leaf->cell[1], leaf->cell[2]};
    cell[direction / 2] += direction & 1 ? 1 << leaf->level : -1;
    return layout_leaf_at(layout, cell[0], cell[1], cell[2]);
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
                const SquareEdge to = square_across(beyond, layout, (SquareEdge){e, d, k});
                mesh->face_neighbor[square_triangle(square[e][d], k)][square_edge(k)] =
                    square_triangle(square[to.cell][to.direction], to.k);
            }
    free(square);
}
