// SPDX-License-Identifier: MIT
// Figs 2, 4 and 10: which elements a disc and a cube have, and their pictures.
#include "voxel_accuracy.h"

#include "base/check.h"
#include "picture.h"
#include "plane/mesh.h"
#include "remainder.h"
#include "scoped.h"
#include "voxel/layout.h"

#include <math.h>

const unsigned LEVEL_COLOUR[LEVEL_COLOURS] = {0xe8eef6, 0x9cc3e6, 0xf2c063, 0xd9705a, 0x8a4f9e};

// ---------------------------------------------------------------------------------------------
// Fig. 4

enum { SQUARE = 32, DISC_LEVELS = 3, DISC_CELLS = 852, DISC_ELEMENTS = 172 }; // the paper's

// Which cells belong to a disc, by where their parts lie.
typedef enum DiscRule { RULE_CENTRE, RULE_HALF, RULE_ANY, RULE_WHOLE, DISC_RULES } DiscRule;
static const char *const RULE_NAMES[DISC_RULES] = {"centre inside", "half of the area inside",
                                                   "any part inside", "all of it inside"};

static bool is_inside(DiscRule rule, double x, double y, double radius)
{
    double near[2], far[2]; // distances of the cell's parts along the axes; (x, y): its middle
    near[0] = fmax(0.0, fabs(x) - 0.5), near[1] = fmax(0.0, fabs(y) - 0.5);
    far[0] = fabs(x) + 0.5, far[1] = fabs(y) + 0.5;
    if (rule == RULE_CENTRE)
        return hypot(x, y) <= radius;
    if (rule == RULE_ANY)
        return hypot(near[0], near[1]) < radius;
    if (rule == RULE_WHOLE)
        return hypot(far[0], far[1]) <= radius;
    enum { PARTS = 32 };
    int inside = 0;
    for (int i = 0; i < PARTS; i++)
        for (int j = 0; j < PARTS; j++)
            inside += hypot(x - 0.5 + (i + 0.5) / PARTS, y - 0.5 + (j + 0.5) / PARTS) <= radius;
    return 2 * inside >= PARTS * PARTS;
}

// In a square of 32 x 32 cells, the disc's middle (x, y) from the square's; its cells.
static int make_disc(Lattice *lattice, DiscRule rule, double x, double y, double radius)
{
    ASSERT(lattice_create(lattice, (int[3]){SQUARE, SQUARE, 1}, 1.0, &(Status){0}));
    int cells = 0;
    for (int j = 0; j < SQUARE; j++)
        for (int i = 0; i < SQUARE; i++) {
            bool inside =
                is_inside(rule, i + 0.5 - SQUARE / 2 - x, j + 0.5 - SQUARE / 2 - y, radius);
            lattice->label[lattice_index(lattice, i, j, 0)] = inside;
            cells += inside;
        }
    return cells;
}

static int count_elements(const Lattice *lattice, int count[DISC_LEVELS + 1])
{
    SCOPED(plane_layout_destroy) PlaneLayout layout;
    plane_layout_create(&layout, lattice, DISC_LEVELS);
    for (int level = 0; level <= DISC_LEVELS; level++)
        count[level] = 0;
    for (int e = 0; e < layout.element_count; e++)
        count[layout.element[e].level]++;
    int total = layout.element_count;
    return total;
}

static void write_disc(FILE *out, const char *rule, double radius, int cells,
                       const Lattice *lattice)
{
    int count[DISC_LEVELS + 1], total = count_elements(lattice, count);
    fprintf(out, "%s\t%.2f\t%d\t%d\t%d + %d + %d + %d\t%.1f\n", rule, radius, cells, total,
            count[0], count[1], count[2], count[3], 100.0 * total / cells);
}

// The polygons of a layout, by level in columns of x and y; then all vertices.
static void write_plane_layout(const Experiment *experiment, const char *name,
                               const Lattice *lattice, int levels)
{
    CLOSED FILE *out = experiment_open(experiment, name);
    SCOPED(plane_layout_destroy) PlaneLayout layout;
    SCOPED(plane_mesh_destroy) PlaneMesh mesh;
    plane_layout_create(&layout, lattice, levels);
    ASSERT(plane_mesh_create(&mesh, &layout, NULL, &(Status){0}));
    for (int level = 0; level <= DISC_LEVELS; level++) {
        for (int e = 0; e < layout.element_count; e++) {
            const PlaneElement *element = &layout.element[e];
            if (element->level != level)
                continue;
            int place[PLANE_PLACES], count = plane_outline(element->quarters, place);
            double half = 0.5 * (1 << level);
            for (int i = 0; i <= count; i++) // closed
                fprintf(out, "%g\t%g\n", element->cell[0] + half * (place[i % count] % 3),
                        element->cell[1] + half * (place[i % count] / 3));
            fprintf(out, "\n");
        }
        fprintf(out, "%s", "-1\t-1\n\n\n"); // no empty index, whatever levels there are
    }
    for (int v = 0; v < mesh.vertex_count; v++)
        fprintf(out, "%d\t%d\n", mesh.point[v][0], mesh.point[v][1]);
}

void disc_layout(const Experiment *experiment)
{
    FILE *out = experiment_open(experiment, "disc.tsv");
    fprintf(out, "rule\tradius, from [cells]\tcells\telements\tof levels 0 + 1 + 2 + 3\telements "
                 "of cells [%%]\n");
    fprintf(out, "the paper\t-\t%d\t%d\t-\t%.1f\n", DISC_CELLS, DISC_ELEMENTS,
            100.0 * DISC_ELEMENTS / DISC_CELLS);
    Lattice lattice;
    for (int rule = 0; rule < DISC_RULES; rule++) {
        int before = -1;
        // Up to where a disc no longer fits into the square.
        for (int r = 1600; r <= 1660; r++) {
            if (rule != RULE_CENTRE && r > 1600)
                break;
            int cells = make_disc(&lattice, (DiscRule)rule, 0.0, 0.0, 0.01 * r);
            if (cells != before)
                write_disc(out, RULE_NAMES[rule], 0.01 * r, cells, &lattice);
            if (rule == RULE_CENTRE && r == 1600) {
                write_plane_layout(experiment, "disc-graded.dat", &lattice, DISC_LEVELS);
                write_plane_layout(experiment, "disc-full.dat", &lattice, 0);
            }
            before = cells;
            lattice_destroy(&lattice);
        }
    }
    fclose(out);

    // Discs whose middle is no lattice point: anywhere in an eighth of a cell.
    out = experiment_open(experiment, "disc-elsewhere.tsv");
    fprintf(out, "discs tried\tof them with %d cells\tfewest elements of those\tmost\n",
            DISC_CELLS);
    int tried = 0, same = 0, least = DISC_CELLS, most = 0, count[DISC_LEVELS + 1];
    for (int x = 0; x <= 10; x++)
        for (int y = 0; y <= x; y++)
            for (int r = 1550; r <= 1660; r++) {
                tried++;
                if (make_disc(&lattice, RULE_CENTRE, 0.05 * x, 0.05 * y, 0.01 * r) == DISC_CELLS) {
                    int total = count_elements(&lattice, count);
                    same++;
                    least = total < least ? total : least;
                    most = total > most ? total : most;
                }
                lattice_destroy(&lattice);
            }
    fprintf(out, "%d\t%d\t%d\t%d\n", tried, same, least, most);
    fclose(out);
}

// ---------------------------------------------------------------------------------------------
// Figs 2 and 10

static Lattice cube_of(int n)
{
    Lattice lattice;
    ASSERT(lattice_box(&lattice, (int[3]){n, n, n}, 0.1 / n, &(Status){0}));
    return lattice;
}

static long remainder_of(const Lattice *lattice, int levels)
{
    long count[VOXEL_LEVELS_MAX + 1], total = 0;
    layout_count_remainder(lattice, 3, levels, count);
    for (int level = 0; level <= levels; level++)
        total += count[level];
    return total;
}

static int split_of(const Lattice *lattice, int levels)
{
    SCOPED(layout_destroy) Layout layout;
    layout_create(&layout, lattice, levels);
    int count = layout.leaf_count;
    return count;
}

static void write_counts(const Experiment *experiment)
{
    FILE *out = experiment_open(experiment, "cube-counts.tsv");
    fprintf(out, "n\tcells\tremainder kept: levels 1\t2\t3\tin n^2\tsplit in eight: levels "
                 "1\t2\t3\tin n^2\t8 n^2\n");
    for (int n = 16; n <= 64; n *= 2) {
        SCOPED(lattice_destroy) Lattice lattice = cube_of(n);
        fprintf(out, "%d\t%d", n, n * n * n);
        for (int kind = 0; kind < 2; kind++) {
            long count = 0;
            for (int levels = 1; levels <= 3; levels++) {
                count = kind == 0 ? remainder_of(&lattice, levels) : split_of(&lattice, levels);
                fprintf(out, "\t%ld", count);
            }
            fprintf(out, "\t%.2f", (double)count / (n * n));
        }
        fprintf(out, "\t%d\n", 8 * n * n);
    }
    fclose(out);

    // Of as many levels as help.
    out = experiment_open(experiment, "cube-counts.dat");
    fprintf(out, "n\tremainder\tsplit\n");
    for (int n = 8; n <= 160; n += n < 64 ? 8 : 32) {
        SCOPED(lattice_destroy) Lattice lattice = cube_of(n);
        double square = (double)n * n;
        fprintf(out, "%d\t%g\t%g\n", n, (double)remainder_of(&lattice, VOXEL_LEVELS_MAX) / square,
                split_of(&lattice, VOXEL_LEVELS_MAX) / square);
    }
    fclose(out);
}

// The square of a leaf's face across `axis`, on the high side if `side` is 1.
static void add_face(Picture *picture, const Lattice *lattice, const Leaf *leaf, int axis, int side)
{
    static const int AROUND[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    Vec3 corner[4];
    int size = 1 << leaf->level, b = (axis + 1) % 3, c = (axis + 2) % 3;
    for (int i = 0; i < 4; i++) {
        const int *turn = AROUND[side == 1 ? i : 3 - i];
        int at[3];
        at[axis] = leaf->cell[axis] + side * size;
        at[b] = leaf->cell[b] + turn[0] * size;
        at[c] = leaf->cell[c] + turn[1] * size;
        corner[i] = lattice_point(lattice, at[0], at[1], at[2]);
    }
    picture_add(picture, corner, 4, LEVEL_COLOUR[leaf->level]);
}

// All but the eighth towards the viewer: x high, y low, z high.
static void draw_cut_open(const Experiment *experiment, int n, int levels)
{
    SCOPED(lattice_destroy) Lattice lattice = cube_of(n);
    SCOPED(layout_destroy) Layout layout;
    SCOPED(picture_destroy) Picture picture;
    layout_create(&layout, &lattice, levels);
    picture_create(&picture, vec3(1.0, -0.8, 0.75));
    int half = n / 2;
    for (int l = 0; l < layout.leaf_count; l++) {
        const Leaf *leaf = &layout.leaf[l];
        const int *at = leaf->cell, size = 1 << leaf->level;
        if (at[0] >= half && at[1] < half && at[2] >= half)
            continue;
        // Seen are the sides x high, y low and z high, where there is nothing or the eighth beyond.
        if (at[0] + size == n || (at[0] + size == half && at[1] < half && at[2] >= half))
            add_face(&picture, &lattice, leaf, 0, 1);
        if (at[1] == 0 || (at[1] == half && at[0] >= half && at[2] >= half))
            add_face(&picture, &lattice, leaf, 1, 0);
        if (at[2] + size == n || (at[2] + size == half && at[0] >= half && at[1] < half))
            add_face(&picture, &lattice, leaf, 2, 1);
    }
    CLOSED FILE *out = experiment_open(experiment, "cube-open.gp");
    picture_write(&picture, true, out);
}

void cube_layout(const Experiment *experiment)
{
    write_counts(experiment);
    draw_cut_open(experiment, 32, 3);
}
