// SPDX-License-Identifier: MIT
// The account of a body's tissue: against closed forms, and against counting its cells again from
// the bits alone.
#include "test.h"
#include "sim_steps.h"
#include "cut_bench.h"
#include "cut_world.h"
#include "effort.h"

enum { OUTER = 1, BALL = 2, TISSUES = 2 };

static const SolidMaterial MATERIALS[TISSUES] = {{.youngs_modulus = 1e4, .density = 1000.0},
                                                 {.youngs_modulus = 2e4, .density = 1100.0}};
static const char *const NAMES[TISSUES] = {"liver", "tumour"};

// A cube of 0.1 m at the origin with a ball of the second material in it.
static VoxelWorldOptions cube_with_ball(int n, Vec3 center, double radius)
{
    VoxelWorldOptions options = voxel_world_cube(n);
    for (int k = 0; k < n; k++)
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++) {
                const Vec3 x = lattice_point(&options.lattice, i + 0.5, j + 0.5, k + 0.5);
                if (vec3_length(vec3_sub(x, center)) < radius)
                    options.lattice.label[lattice_index(&options.lattice, i, j, k)] = BALL;
            }
    options.body.material = MATERIALS;
    options.body.material_count = TISSUES;
    options.body.tissue = NAMES;
    return options;
}

static const BodySections *sections_of(const CutWorld *world)
{
    return world->body->ops->sections(world->model);
}

// A plane through a point, all across the body.
static CutOptions plane(Vec3 point, Vec3 normal)
{
    Vec3 edge = vec3_cross(normal, vec3(0.3, -0.5, 0.8));
    edge = vec3_unit(edge);
    return cut_world_sweep(point, edge, vec3_cross(normal, edge), 0.4, -0.4, 0.4);
}

// --- closed forms ---

// A plane at a distance from a ball has that margin: from the ball itself, as it is known where the
// blade met each link, within what links leave between them, a twentieth of a cell at least two
// cells away; from the label's cells within half a cell.
TEST(plane_at_a_distance_from_a_ball_has_that_margin)
{
    static const int CELLS[] = {12, 24};
    uint64_t seed = 71;
    for (int k = 0; k < 2; k++) {
        const Vec3 center = {0.003, -0.004, 0.002};
        const double radius = 0.02;
        VoxelWorldOptions options = cube_with_ball(CELLS[k], center, radius);
        options.body.body.levels = k; // also through elements that are yet to be divided
        const WatchedRegion watch[] = {
            {.material = BALL},
            {.region = {.kind = FIXED_SPHERE, .center = center, .radius = radius}}};
        options.body.body.watch = watch;
        options.body.body.watch_count = 2;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        const double size = world.lattice.size;
        FREED void *start = malloc(state_bytes(&world.state));
        state_copy_out(&world.state, start);
        double label_off = 0.0, sphere_off = 0.0;
        for (int trial = 0; trial < EFFORT(60); trial++) {
            const Vec3 normal = vec3_unit(random_vec3(&seed));
            const double d = random_between(&seed, 2.0 * size, 0.02);
            const CutOptions cut = plane(vec3_madd(center, radius + d, normal), normal);
            CutOutcome outcome;
            assert_true(cut_world_cut(&world, &cut, &outcome));
            const RegionAccount *region = sections_of(&world)->region;
            assert_int_equal(region[0].cause, ACCOUNT_CUT);
            assert_false(region[0].touched || region[1].touched);
            label_off = fmax(label_off, fabs(region[0].distance - d) / size);
            sphere_off = fmax(sphere_off, fabs(region[1].distance - d) / size);
            state_copy_in(&world.state, start);
            sim_restored(world.sim);
            assert_true(isinf(sections_of(&world)->region[0].distance));
        }
        print_message("%d cells: label %.3f, sphere %.3f cells off at most\n", CELLS[k], label_off,
                      sphere_off);
        expect_at_most(label_off, 0.5);
        expect_at_most(sphere_off, 0.15);
    }
}

// Links that a plane crosses give its area with the blade's normal, whatever its direction. A link
// needs a cell on both sides, so the section ends where cells do: within half a cell of the disc's
// rim, and falling with the cells.
TEST(area_of_a_section_is_that_of_the_disc)
{
    static const double SIZE[] = {0.005, 0.0025};
    double mean[2] = {0.0};
    const double radius = 0.05;
    const WatchedRegion watch = {.material = -1}; // of no use, but links are measured where met
    for (int k = 0; k < 2; k++) {
        uint64_t seed = 5;
        VoxelWorldOptions options = voxel_world_ball();
        options.body.body.watch = &watch;
        options.body.body.watch_count = 1;
        lattice_destroy(&options.lattice);
        assert_true(lattice_ball(&options.lattice, radius, SIZE[k], &(Status){0}));
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        FREED void *start = malloc(state_bytes(&world.state));
        state_copy_out(&world.state, start);
        const int trials = EFFORT(40);
        double off = 0.0;
        for (int trial = 0; trial < trials; trial++) {
            const Vec3 normal = vec3_unit(random_vec3(&seed));
            const double d = random_between(&seed, 0.0, 0.03);
            const CutOptions cut = plane(vec3_scale(d, normal), normal);
            CutOutcome outcome;
            assert_true(cut_world_cut(&world, &cut, &outcome));
            const double rho = sqrt(radius * radius - d * d);
            const double rim = (sections_of(&world)->cut - M_PI * rho * rho) / (2.0 * M_PI * rho);
            off = fmax(off, fabs(rim) / SIZE[k]);
            mean[k] += rim / trials;
            state_copy_in(&world.state, start);
            sim_restored(world.sim);
        }
        print_message("cells of %g mm: the rim is %.3f cells off at most, %.3f mm in the mean\n",
                      1e3 * SIZE[k], off, 1e3 * mean[k]);
        expect_at_most(off, 0.5);
    }
    expect_at_most(fabs(mean[1]), 0.65 * fabs(mean[0])); // of first order
}

// --- bookkeeping ---

static int find_label(const CutLattice *lattice, int *label, int *stack, int first)
{
    int top = 0, count = 0;
    stack[top++] = first;
    label[first] = first;
    while (top > 0) {
        const int cell = stack[--top];
        count++;
        for (int d = 0; d < 6; d++) {
            const int next = cut_lattice_across(lattice, cell, d), low = d & 1 ? cell : next;
            if (next < 0 || (lattice->broken[low] >> d / 2 & 1) || label[next] >= 0 ||
                cut_lattice_is_gone(lattice, next))
                continue;
            label[next] = first;
            stack[top++] = next;
        }
    }
    return count;
}

// True if a corner of a cell is below the floor that holds the body.
static int held_corners(const CutWorld *world, int cell, double floor)
{
    const short *at = world->cuts->lattice.element[cell].cell;
    int held = 0;
    for (int c = 0; c < 8; c++)
        held +=
            lattice_point(&world->lattice, at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2))
                .z <= floor;
    return held;
}

// Counts everything again: pieces by a flood through the bits, the main one by its fixed corners.
static void expect_account(const CutWorld *world, double floor)
{
    const CutLattice *lattice = &world->cuts->lattice;
    const int cells = lattice->level_first[1];
    const double cell = pow(world->lattice.size, 3.0);
    FREED int *label = malloc((size_t)cells * sizeof *label),
              *stack = malloc((size_t)cells * sizeof *stack);
    FREED int *held = calloc((size_t)cells, sizeof *held),
              *size = calloc((size_t)cells, sizeof *size);
    double present[TISSUES] = {0}, attached[TISSUES] = {0}, all[TISSUES] = {0};
    int best = -1;
    memset(label, -1, (size_t)cells * sizeof *label);
    for (int c = 0; c < cells; c++) {
        if (label[c] < 0 && !cut_lattice_is_gone(lattice, c))
            size[c] = find_label(lattice, label, stack, c);
        if (!cut_lattice_is_gone(lattice, c))
            held[label[c]] += held_corners(world, c, floor);
    }
    for (int c = 0; c < cells; c++)
        if (size[c] > 0 &&
            (best < 0 || held[c] > held[best] || (held[c] == held[best] && size[c] > size[best])))
            best = c;
    for (int c = 0; c < cells; c++) {
        const int m = lattice->element[c].material - 1;
        all[m] += cell;
        present[m] += cut_lattice_is_gone(lattice, c) ? 0.0 : cell;
        attached[m] += !cut_lattice_is_gone(lattice, c) && label[c] == best ? cell : 0.0;
    }
    TissueAccount account[TISSUES + 1];
    assert_int_equal(world->body->ops->account(world->model, account, TISSUES + 1), TISSUES);
    for (int m = 0; m < TISSUES; m++) {
        const TissueAccount *of = &account[m];
        const double eps = 1e-12 * of->at_load; // sums of as many cells round by less
        assert_string_equal(of->name, NAMES[m]);
        expect_near(of->at_load, all[m], eps);
        expect_near(of->attached + of->cut_off + of->removed, of->at_load, eps);
        expect_near(of->removed, all[m] - present[m], eps);
        expect_near(of->attached, attached[m], eps);
        expect_near(of->cut_off, present[m] - attached[m], eps);
    }
}

static RemovalOutcome take(CutWorld *world, Vec3 at, double radius)
{
    const Removal removal = {.kind = REMOVER_DRILL,
                             .mouth = {REGION_CAPSULE, at, at, radius},
                             .volume = (double)INFINITY,
                             .tick = 1e-3};
    RemovalOutcome sum = {.removed = 0}, outcome;
    TopologyChange change = {.again = true};
    while (change.again) {
        change = (TopologyChange){.face_count = 0};
        world->body->ops->remove(world->body, &removal, &outcome, &change);
        sum.removed += outcome.removed;
        sum.volume += outcome.volume;
        sum.mass += outcome.mass;
    }
    return sum;
}

// Random cuts, removals and divisions (1000 in the long form) of bodies that a floor holds and of
// free ones, larger elements inside; also after the state was brought back, which has to derive all
// of it.
TEST(account_adds_up_over_random_cuts_and_removals)
{
    uint64_t seed = 12;
    int cuts = 0, removals = 0, changed_main = 0;
    for (int body = 0; body < TRIALS(6, 20); body++) {
        const double floor = body % 2 ? -0.045 : -1.0;
        VoxelWorldOptions options = cube_with_ball(10, vec3(0.01, 0.0, 0.01), 0.025);
        const FixedRegion ground = {
            .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.045}};
        const WatchedRegion watch[] = {{.material = BALL},
                                       {.region = {.kind = FIXED_BOX,
                                                   .low = {-0.05, -0.05, -0.05},
                                                   .high = {-0.03, -0.03, -0.03}}}};
        options.body.body.levels = body % 3;
        options.body.body.removable = true;
        options.body.body.watch = watch;
        options.body.body.watch_count = 2;
        options.body.body.fixed = &ground;
        options.body.body.fixed_count = body % 2;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        FREED void *state = malloc(state_bytes(&world.state));
        expect_account(&world, floor);
        double removed = 0.0, mass = 0.0, distance[2] = {(double)INFINITY, (double)INFINITY},
               area = 0.0;
        for (int k = 0; k < 50; k++) {
            const int main_piece = world.cuts->account.main_piece;
            if (random_below(&seed, 3) > 0) {
                const CutOptions cut = cut_world_random(&world, &seed);
                CutOutcome outcome;
                cuts += cut_world_cut(&world, &cut, &outcome);
            } else {
                const Vec3 at = vec3_scale(0.05, random_vec3(&seed));
                const RemovalOutcome went = take(&world, at, random_between(&seed, 0.004, 0.015));
                removals += went.removed > 0;
                removed += went.volume;
                mass += went.mass;
            }
            changed_main += main_piece != world.cuts->account.main_piece;
            expect_account(&world, floor);
            // What opened only grows, and distances only fall.
            const BodySections *now = sections_of(&world);
            assert_true(now->cut >= area);
            area = now->cut;
            for (int r = 0; r < 2; r++) {
                assert_true(now->region[r].distance <= distance[r]);
                distance[r] = now->region[r].distance;
            }
            if (k == 30) {
                state_copy_out(&world.state, state);
                const BodySections before = *sections_of(&world);
                const RegionAccount was = before.region[0];
                sim_reset(world.sim);
                expect_account(&world, floor);
                assert_true(sections_of(&world)->cut == 0.0);
                state_copy_in(&world.state, state);
                sim_restored(world.sim);
                expect_account(&world, floor);
                assert_true(sections_of(&world)->cut == before.cut);
                assert_true(sections_of(&world)->region[0].distance == was.distance);
                assert_int_equal(sections_of(&world)->region[0].cause, was.cause);
            }
        }
        TissueAccount account[TISSUES];
        world.body->ops->account(world.model, account, TISSUES);
        expect_near(account[0].removed + account[1].removed, removed, 1e-12 * 1e-3);
        expect_near(account[0].removed * account[0].density +
                        account[1].removed * account[1].density,
                    mass, 1e-12);
    }
    print_message("%d cuts, %d removals, the main piece changed %d times\n", cuts, removals,
                  changed_main);
    assert_true(cuts > 20 && removals > 20 && changed_main > 1);
}

// --- regions ---

// Returns the distance of the cells that are gone from the label's, wall to wall, from their
// centres [m]; 0 if one of the label's is gone.
static double gap_to_gone(const CutWorld *world, int n)
{
    const CutLattice *lattice = &world->cuts->lattice;
    double least = (double)INFINITY;
    for (int a = 0; a < n * n * n; a++) {
        if (!cut_lattice_is_gone(lattice, a))
            continue;
        for (int b = 0; b < n * n * n; b++) {
            const short *p = lattice->element[a].cell, *q = lattice->element[b].cell;
            const Vec3 apart = vec3(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
            if (lattice->element[b].material == BALL)
                least = fmin(least, vec3_length(apart) - 1.0);
        }
    }
    return fmax(0.0, least) * world->lattice.size;
}

// A cell that goes is as near as its wall; what goes inside touches.
TEST(removal_has_the_distance_of_its_wall)
{
    const Vec3 center = {0.0, 0.0, 0.0};
    VoxelWorldOptions options = cube_with_ball(20, center, 0.015);
    const WatchedRegion watch[] = {{.material = BALL}};
    options.body.body.levels = 0;
    options.body.body.removable = true;
    options.body.body.watch = watch;
    options.body.body.watch_count = 1;
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options);
    const double size = world.lattice.size;
    // A burr in a corner, then nearer, then within.
    const double at[] = {0.04, 0.027, 0.006};
    for (int k = 0; k < 3; k++) {
        take(&world, vec3(at[k], 0.001, 0.001), 0.004);
        const RegionAccount *region = sections_of(&world)->region;
        assert_int_equal(region->cause, ACCOUNT_REMOVAL);
        assert_int_equal(region->touched, k == 2);
        // The burr takes cells whose centres are within half their diagonal of it, 0.87 cells;
        // their walls are half a cell nearer, and the label's surface is within half a cell.
        const double gap = fmax(0.0, at[k] - 0.004 - 0.015);
        expect_at_most(fabs(region->distance - gap), (0.87 + 0.5 + 0.5) * size);
        expect_near(region->distance, gap_to_gone(&world, 20), 1e-12); // sums of a few numbers
    }
}

// Ticks count that a tool is inside, where the tissue is now: the whole body has moved by two
// cells, and the label with it.
TEST(time_in_regions_follows_the_tissue)
{
    VoxelWorldOptions options = cube_with_ball(20, vec3(0.0, 0.0, 0.0), 0.02);
    const WatchedRegion watch[] = {
        {.material = BALL},
        {.region = {.kind = FIXED_BOX, .low = {0.03, -1.0, -1.0}, .high = {1.0, 1.0, 1.0}}}};
    options.body.body.watch = watch;
    options.body.body.watch_count = 2;
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options);
    Vertices *vertices = &world.model->vertices;
    void *row = vertices->row[vertices->current];
    for (int i = 0; i < vertices->count; i++) {
        Vec3 x, v;
        rows_read(&vertices->rows, row, i, &x, &v);
        rows_write(&vertices->rows, row, i, vec3_add(x, vec3(0.01, 0.0, 0.0)), v);
    }
    // At rest inside the ball, now outside; the other way round; in the box; in neither.
    const double place[] = {-0.013, 0.026, 0.043, 0.036};
    for (int k = 0; k < 4; k++)
        for (int tick = 0; tick <= k; tick++)
            world.body->ops->visit(world.model, vec3(place[k], 0.001, 0.001));
    const BodySections *sections = sections_of(&world);
    assert_int_equal(sections->region[0].visits, 2);
    assert_int_equal(sections->region[1].visits, 3);
    assert_int_equal(sections->visits, 5);
}

// The floor holds the smaller piece: it is the main one.
TEST(main_piece_is_the_one_that_is_held)
{
    VoxelWorldOptions options = cube_with_ball(10, vec3(0.0, 0.0, 0.02), 0.02);
    const FixedRegion ground = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.045}};
    options.body.body.fixed = &ground;
    options.body.body.fixed_count = 1;
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options);
    const CutOptions cut = plane(vec3(0.0, 0.0, -0.0301), vec3(0.0, 0.0, 1.0));
    CutOutcome outcome;
    TissueAccount account[TISSUES];
    assert_true(cut_world_cut(&world, &cut, &outcome));
    world.body->ops->account(world.model, account, TISSUES);
    // Two layers of ten are held; the ball is above.
    expect_near(account[0].attached, 2e-4, 1e-15);
    expect_near(account[1].cut_off, account[1].at_load, 0.0);
}
