// SPDX-License-Identifier: MIT
// Which blocks may be leaves of a body that adapts, by the rule for one block alone.
#include "cut_reference.h"
#include "test.h"

static bool cells_hang_together(const CutSample *sample, const CutElement *of)
{
    const int edge = 1 << of->level, cells = edge * edge * edge;
    FREED int *queue = malloc((size_t)cells * sizeof *queue);
    FREED bool *seen = calloc((size_t)cells, sizeof *seen);
    int solid = 0, first = -1, end = 0;
    for (int n = cells - 1; n >= 0; n--)
        if (cut_reference_is_solid(sample,
                                   (int[3]){of->cell[0] + n % edge, of->cell[1] + n / edge % edge,
                                            of->cell[2] + n / edge / edge})) {
            solid++;
            first = n;
        }
    queue[end++] = first;
    seen[first] = true;
    for (int begin = 0; begin < end; begin++)
        for (int d = 0; d < 6; d++) {
            int at[3] = {queue[begin] % edge, queue[begin] / edge % edge,
                         queue[begin] / edge / edge};
            at[d / 2] += d & 1 ? 1 : -1;
            if (at[d / 2] < 0 || at[d / 2] >= edge)
                continue;
            const int n = (at[2] * edge + at[1]) * edge + at[0];
            for (int k = 0; k < 3; k++)
                at[k] += of->cell[k];
            if (seen[n] || !cut_reference_is_solid(sample, at))
                continue;
            seen[n] = true;
            queue[end++] = n;
        }
    return end == solid;
}

// How many parts the cells around a point are in, none of them gone or merged.
static int parts_of_cells(const CutSample *sample, const int point[3], int *solid)
{
    int part[8], parts = 0;
    *solid = 0;
    for (int s = 0; s < 8; s++) {
        const bool is = cut_reference_is_solid(
            sample,
            (int[3]){point[0] - 1 + (s & 1), point[1] - 1 + (s >> 1 & 1), point[2] - 1 + (s >> 2)});
        part[s] = is ? s : -1;
        *solid += is;
    }
    for (int round = 0; round < 8; round++)
        for (int s = 0; s < 8; s++)
            for (int axis = 0; axis < 3; axis++) {
                const int t = s ^ 1 << axis;
                if (part[s] >= 0 && part[t] >= 0)
                    part[s] = part[t] = part[s] < part[t] ? part[s] : part[t];
            }
    for (int s = 0; s < 8; s++)
        parts += part[s] == s;
    return parts;
}

// Whether a point of a closed block is where its motion keeps it: all corners that move it are
// held.
static bool is_kept_by_corners(const CutElement *of, const int point[3], const FixedRegion *held)
{
    const int edge = 1 << of->level;
    for (int c = 0; c < 8; c++) {
        bool moves = true; // it: the weight is not 0
        int corner[3];
        for (int d = 0; d < 3; d++) {
            corner[d] = of->cell[d] + (c >> d & 1) * edge;
            moves &= abs(point[d] - corner[d]) < edge;
        }
        if (moves && !fixed_contains(held, vec3(corner[0], corner[1], corner[2])))
            return false;
    }
    return true;
}

// Whether some cell has held points that lie as far apart along each axis as its element's.
static bool is_held_by_a_cell(const CutSample *sample, const CutElement *of,
                              const FixedRegion *held)
{
    const int edge = 1 << of->level;
    unsigned axes = 0;
    for (int whole = 1; whole >= 0; whole--) // the element itself first
        for (int n = 0; n < (whole ? 1 : edge * edge * edge); n++) {
            const int wide = whole ? edge : 1;
            const int at[3] = {of->cell[0] + n % edge, of->cell[1] + n / edge % edge,
                               of->cell[2] + n / edge / edge};
            unsigned side[3] = {0};
            for (int c = 0; c < 8; c++)
                for (int d = 0; d < 3; d++)
                    if (fixed_contains(held,
                                       vec3(at[0] + (c & 1) * wide, at[1] + (c >> 1 & 1) * wide,
                                            at[2] + (c >> 2) * wide)))
                        side[d] |= 1u << (c >> d & 1);
            unsigned own = 0;
            for (int d = 0; d < 3; d++)
                own |= (unsigned)(side[d] == 3) << d;
            if (whole && side[0] == 0)
                return true; // nothing is held
            if (whole)
                axes = own;
            else if (side[0] != 0 && own == axes && cut_reference_is_solid(sample, at))
                return true;
        }
    return false;
}

// Whether a point of the surface is held, and one beside it on the surface is not.
static bool is_at_edge(const CutSample *sample, const int point[3], const FixedRegion *held)
{
    int solid;
    parts_of_cells(sample, point, &solid);
    if (solid == 0 || solid == 8 || !fixed_contains(held, vec3(point[0], point[1], point[2])))
        return false;
    for (int d = 0; d < 3; d++)
        for (int side = -1; side <= 1; side += 2) {
            int q[3] = {point[0], point[1], point[2]};
            q[d] += side;
            parts_of_cells(sample, q, &solid);
            if (solid > 0 && solid < 8 && !fixed_contains(held, vec3(q[0], q[1], q[2])))
                return true;
        }
    return false;
}

// By the definition, for one element alone; the children are another's.
static bool may_be_leaf(const CutSample *sample, const CutElement *of, const FixedRegion *held,
                        const FineRegion *fine)
{
    const int edge = 1 << of->level;
    int material = 0, solid;
    bool inner = true;
    for (int n = 0; n < edge * edge * edge; n++) {
        const int at[3] = {of->cell[0] + n % edge, of->cell[1] + n / edge % edge,
                           of->cell[2] + n / edge / edge};
        const int label = lattice_label(&sample->lattice, at[0], at[1], at[2]);
        if (label != 0 && material != 0 && label != material)
            return false;
        material = label != 0 ? label : material;
    }
    double square = 0.0;
    for (int d = 0; d < 3; d++) { // the point of the block that is nearest to the ball
        const double at = d == 0 ? fine->centre.x : d == 1 ? fine->centre.y : fine->centre.z;
        const double near = fmax(of->cell[d], fmin(of->cell[d] + edge, at));
        square += (near - at) * (near - at);
    }
    if (square <= fine->radius * fine->radius)
        return false;
    for (int z = 0; z <= edge; z++)
        for (int y = 0; y <= edge; y++)
            for (int x = 0; x <= edge; x++) {
                const int p[3] = {of->cell[0] + x, of->cell[1] + y, of->cell[2] + z};
                if (parts_of_cells(sample, p, &solid) > 1)
                    return false;
                inner &= solid == 8;
                if (sample->adapt_error > 0.0 && is_at_edge(sample, p, held))
                    return false;
                if (fixed_contains(held, vec3(p[0], p[1], p[2])) != is_kept_by_corners(of, p, held))
                    return false;
            }
    return cells_hang_together(sample, of) && is_held_by_a_cell(sample, of, held) &&
           of->level <= (inner ? sample->levels : sample->surface_level);
}

TEST(elements_may_be_leaves_where_they_say_what_their_cells_do)
{
    uint64_t seed = 36;
    int may = 0, may_not = 0;
    for (int round = 0; round < EFFORT(3); round++)
        for (int kind = 0; kind < MERGE_KINDS + SAMPLE_KINDS; kind++) {
            SCOPED(cut_sample_drop) CutSample sample;
            Lattice lattice = kind < MERGE_KINDS
                                  ? cut_sample_body((MergeKind)kind)
                                  : sample_lattice((SampleKind)(kind - MERGE_KINDS), &seed);
            lattice.origin = vec3(0.0, 0.0, 0.0); // points are their own places
            FixedRegion held = {.kind = round % 2 == 0 ? FIXED_SPHERE : FIXED_BOX,
                                .low = vec3(-1.0, -1.0, -1.0),
                                .high = vec3(20.0, 8.0, 40.0),
                                .center = vec3(3.0, 4.0, 1.0),
                                .radius = random_between(&seed, 0.0, 8.0)};
            FineRegion fine = {.centre = vec3(10.0, 9.0, 2.0),
                               .radius = random_between(&seed, 0.0, 4.0)};
            cut_sample_options(&sample, lattice, round % 3, 1 + round % 3);
            sample.fixed = &held;
            sample.fine = &fine;
            sample.adapt_error = kind % 2 == 0 ? 0.0 : 0.05;
            cut_sample_build(&sample, 8 * (int)lattice_solid(&lattice) + 4096, 1);
            const CutLattice *cut = &sample.cut;
            for (int e = cut->level_first[1]; e < cut->element_count; e++) {
                const CutElement *of = &cut->element[e];
                bool expected = may_be_leaf(&sample, of, &held, &fine);
                for (int c = 0; c < 8 && of->level > 1; c++) {
                    const int child = cut_lattice_child(cut, e, c);
                    expected &= child < 0 || cut->element[child].mergeable;
                }
                assert_int_equal(of->mergeable, expected);
                may += expected;
                may_not += !expected;
            }
            cut_lattice_coarsen(&sample.cut);
            cut_reference_check(&sample);
        }
    assert_true(may > 1000 && may_not > 1000);
}
