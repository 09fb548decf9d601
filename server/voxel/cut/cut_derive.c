// Derives everything from the bits of a cut lattice: at load, and after the state was replaced.
// Step thread.
#include "voxel/cut/cut_parts.h"

#include <string.h>

static int point_count(const CutScratch *scratch)
{
    return scratch->points[0] * scratch->points[1] * scratch->points[2];
}

// True if elements are divided only where they can be, and none borders on a leaf two levels
// larger.
static bool divisions_are_valid(const CutLattice *lattice)
{
    for (int e = 0; e < lattice->element_count; e++) {
        const CutElement *element = &lattice->element[e];
        if (lattice->divided[e] > 1 || (lattice->divided[e] && element->child < 0))
            return false;
        if (lattice->divided[e] && element->parent >= 0 && !lattice->divided[element->parent])
            return false;
    }
    for (int e = 0; e < lattice->element_count; e++) {
        if (!cut_lattice_is_leaf(lattice, e))
            continue;
        const CutElement *element = &lattice->element[e];
        const int level = element->level;
        for (int n = 0; n < 27; n++) {
            const int around =
                cut_parts_block(lattice, level, (element->cell[0] >> level) - 1 + n % 3,
                                (element->cell[1] >> level) - 1 + n / 3 % 3,
                                (element->cell[2] >> level) - 1 + n / 9);
            if (around < 0 || lattice->divided[around])
                continue;
            if (lattice->element[cut_parts_leaf(lattice, around)].level > level + 1)
                return false;
        }
    }
    return true;
}

static bool bits_are_valid(const CutLattice *lattice)
{
    for (int cell = 0; cell < lattice->level_first[1]; cell++) {
        if (lattice->broken[cell] > 7)
            return false;
        for (int axis = 0; axis < 3; axis++)
            if ((lattice->broken[cell] >> axis & 1) && cut_lattice_beyond(lattice, cell, axis) < 0)
                return false;
    }
    return true;
}

static bool ids_are_valid(const CutLattice *lattice)
{
    if (*lattice->vertex_count < 0 || *lattice->vertex_count > lattice->vertex_capacity)
        return false;
    const int most = 8 * point_count(lattice->scratch);
    for (int v = 0; v < lattice->vertex_capacity; v++) {
        const int id = lattice->vertex_id[v];
        if (v < *lattice->vertex_count ? id < 0 || id >= most : id != -1)
            return false;
    }
    return true;
}

static void enter_leaves(CutLattice *lattice)
{
    const long margin =
        cut_parts_grid(lattice, lattice->count[0], lattice->count[1], lattice->count[2]) + 1;
    memset(lattice->scratch->grid, -1, (size_t)margin * sizeof *lattice->scratch->grid);
    lattice->leaf_count = 0;
    memset(lattice->leaf_at_level, 0, sizeof lattice->leaf_at_level);
    for (int e = 0; e < lattice->element_count; e++)
        if (cut_lattice_is_leaf(lattice, e)) {
            lattice->leaf_count++;
            lattice->leaf_at_level[lattice->element[e].level]++;
            cut_parts_enter_leaf(lattice, e);
        }
}

static void find_wanted(CutLattice *lattice)
{
    CutScratch *scratch = lattice->scratch;
    memset(scratch->bitten, 0, (size_t)lattice->element_count * sizeof *scratch->bitten);
    lattice->wanted_count = 0;
    for (int cell = 0; cell < lattice->level_first[1]; cell++)
        for (int axis = 0; axis < 3; axis++)
            if (lattice->broken[cell] >> axis & 1) {
                cut_split_bite(lattice, cell);
                cut_split_bite(lattice, cut_lattice_beyond(lattice, cell, axis));
            }
    cut_split_sort(lattice, 0);
}

static bool find_vertices(CutLattice *lattice)
{
    CutScratch *scratch = lattice->scratch;
    memset(scratch->head, -1, (size_t)point_count(scratch) * sizeof *scratch->head);
    for (int v = 0; v < cut_lattice_used(lattice); v++)
        cut_points_add(lattice, v);
    int expected = 0, leaf[8];
    for (int z = 0; z < scratch->points[2]; z++)
        for (int y = 0; y < scratch->points[1]; y++)
            for (int x = 0; x < scratch->points[0]; x++) {
                const int point[3] = {x, y, z};
                cut_lattice_around(lattice, point, leaf);
                bool one = true; // a point inside a leaf is not on its border
                for (int s = 1; s < 8; s++)
                    one &= leaf[s] == leaf[0];
                if (one)
                    continue;
                expected += cut_points_wanted(lattice, point, leaf);
                if (!cut_points_visit(lattice, point, leaf, CUT_NO_BIRTHS))
                    return false;
            }
    // Each expected vertex was found by its id: equal counts mean all of them, and none twice.
    return expected == cut_lattice_used(lattice);
}

bool cut_lattice_derive(CutLattice *lattice)
{
    cut_lattice_forget_changes(lattice);
    const size_t cells = (size_t)lattice->level_first[1];
    memset(lattice->corner, -1, cells * sizeof *lattice->corner);
    memset(lattice->node, -1, ((size_t)lattice->element_count - cells) * sizeof *lattice->node);
    lattice->wanted_count = 0;
    if (!divisions_are_valid(lattice) || !bits_are_valid(lattice) || !ids_are_valid(lattice))
        return false;
    enter_leaves(lattice);
    find_wanted(lattice);
    const bool sound = find_vertices(lattice);
    cut_lattice_forget_changes(lattice);
    return sound;
}
