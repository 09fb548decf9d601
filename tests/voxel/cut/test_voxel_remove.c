// SPDX-License-Identifier: MIT
// Taking cells away from a real body: what is taken, what it takes along, and what is left.
#include "test.h"
#include "sim_steps.h"
#include "cut_bench.h"
#include "cut_world.h"
#include "effort.h"

#include "base/fnv.h"
#include "sim/follow.h"

static const ToolOptions DRILL = {.id = 1,
                                  .kind = TOOL_REMOVER,
                                  .removes = REMOVER_DRILL,
                                  .mouth = {.radius = 0.02},
                                  .max_force = 10.0};

static VoxelWorldOptions with_remover(VoxelWorldOptions options, const ToolOptions *tool)
{
    options.body.body.removable = true;
    options.tool[options.tool_count++] = *tool;
    return options;
}

// --- what must hold, from the bits alone ---

// Vertices without elements have no mass, do not move and are published by no one.
static void check_vertices(const CutWorld *world)
{
    const CutLattice *lattice = &world->cuts->lattice;
    const Vertices *vertices = &world->model->vertices;
    const int count = cut_lattice_used(lattice);
    FREED int *id = calloc((size_t)count + 1, sizeof *id);
    FREED bool *has = calloc((size_t)count + 1, sizeof *has);
    FREED Vec3 *x = calloc((size_t)count + 1, sizeof *x), *v = calloc((size_t)count + 1, sizeof *v);
    for (int e = 0; e < lattice->element_count; e++)
        for (int n = 0; n < (e < lattice->level_first[1] ? NODE_CORNERS : NODE_COUNT); n++)
            if (cut_lattice_nodes(lattice, e)[n] >= 0)
                has[cut_lattice_nodes(lattice, e)[n]] = true;
    assert_int_equal(world->body->ops->read_state(world->model, id, x, v), count);
    for (int i = 0; i < count; i++) {
        assert_int_equal(has[i], id[i] >= 0);
        assert_int_equal(has[i], vertices->mass[i] > 0.0);
        if (!has[i])
            assert_true(vec3_length(x[i]) == 0.0 && vertices_is_fixed(vertices, i));
    }
    const BodyMesh *mesh = &world->body->mesh;
    for (int s = 0; s < mesh->node_count; s++) {
        const int vertex = (int)world->model->node[s];
        const bool shown = has[vertex] || cut_lattice_is_carried(lattice, vertex);
        assert_int_equal(mesh->id[s] >= 0, shown);
        assert_int_equal(mesh->piece[s] >= 0, shown);
    }
    for (int f = 0; f < mesh->triangle_count; f++)
        for (int k = 0; k < 3 && mesh->triangle[f][0] != mesh->triangle[f][1]; k++)
            assert_true(mesh->id[mesh->triangle[f][k]] >= 0);
}

static int count_present(const CutWorld *world)
{
    int present = 0;
    for (int c = 0; c < world->cuts->lattice.level_first[1]; c++)
        present += !cut_lattice_is_gone(&world->cuts->lattice, c);
    return present;
}

// Masses from the elements that are left, and their sum from the cells that are.
static void check_masses(const CutWorld *world)
{
    CutWorld left = *world;
    const CutLattice *lattice = &world->cuts->lattice;
    left.rest_mass = 0.0;
    for (int c = 0; c < lattice->level_first[1]; c++)
        left.rest_mass += cut_lattice_is_gone(lattice, c)
                              ? 0.0
                              : world->cuts->masses.mass[lattice->element[c].material - 1];
    cut_world_check_masses(&left);
}

static void flood(const CutLattice *lattice, int *label, int *stack, int first)
{
    int top = 0;
    stack[top++] = first;
    label[first] = first;
    while (top > 0) {
        const int cell = stack[--top];
        for (int d = 0; d < 6; d++) {
            const int next = cut_lattice_across(lattice, cell, d);
            const int low = d & 1 ? cell : next;
            if (next < 0 || (lattice->broken[low] >> d / 2 & 1) || label[next] >= 0)
                continue;
            label[next] = first;
            stack[top++] = next;
        }
    }
}

static void check_pieces(const CutWorld *world)
{
    const CutLattice *lattice = &world->cuts->lattice;
    const CutPieces *pieces = &world->cuts->pieces;
    const size_t cells = (size_t)lattice->level_first[1];
    FREED int *label = malloc(cells * sizeof *label), *stack = malloc(cells * sizeof *stack);
    memset(label, -1, cells * sizeof *label);
    int count = 0;
    for (int c = 0; c < (int)cells; c++) {
        if (cut_lattice_is_gone(lattice, c)) {
            assert_int_equal(cut_pieces_of(pieces, c), -1);
            continue;
        }
        if (label[c] < 0) {
            flood(lattice, label, stack, c);
            count++;
        }
        assert_int_equal(cut_pieces_first(pieces, c), label[c]);
        assert_true(cut_pieces_of(pieces, c) >= 0);
    }
    assert_int_equal(count, cut_pieces_count(pieces));
    assert_int_equal(count, body_count_pieces(&world->body->mesh));
}

// What follows from the state, as bytes.
static uint64_t hash_derived(const CutWorld *world)
{
    const CutFaces *faces = &world->cuts->faces;
    const CutPieces *pieces = &world->cuts->pieces;
    const Vertices *vertices = &world->model->vertices;
    const size_t cells = (size_t)faces->cell_count, count = (size_t)vertices->count;
    const size_t triangles = 2 * (size_t)*faces->shown, slots = (size_t)*faces->slot_count;
    uint64_t hash = FNV_START;
    for (size_t code = 0; code < 6 * cells; code++) {
        const int square = cut_faces_square(faces, (int)(code / 6), (int)(code % 6));
        hash = fnv_bytes(hash, &square, sizeof square);
    }
    hash = fnv_bytes(hash, faces->face, triangles * sizeof *faces->face);
    hash = fnv_bytes(hash, faces->neighbor, triangles * sizeof *faces->neighbor);
    hash = fnv_bytes(hash, faces->triangle, triangles * sizeof *faces->triangle);
    hash = fnv_bytes(hash, faces->node_area, count * sizeof *faces->node_area);
    hash = fnv_bytes(hash, faces->node_firmness, count * sizeof *faces->node_firmness);
    hash = fnv_bytes(hash, faces->cell_of, count * sizeof *faces->cell_of);
    hash = fnv_bytes(hash, faces->id, slots * sizeof *faces->id);
    hash = fnv_bytes(hash, faces->piece, slots * sizeof *faces->piece);
    hash = fnv_bytes(hash, &faces->wall_count, sizeof faces->wall_count);
    hash = fnv_bytes(hash, &faces->free_count, sizeof faces->free_count);
    hash = fnv_bytes(hash, pieces->label, cells * sizeof *pieces->label);
    hash = fnv_bytes(hash, &pieces->small_count, sizeof pieces->small_count);
    hash = fnv_bytes(hash, &pieces->gone_count, sizeof pieces->gone_count);
    hash = fnv_bytes(hash, vertices->mass, count * sizeof *vertices->mass);
    return fnv_bytes(hash, &world->body->mass, sizeof world->body->mass);
}

static void check_derived(CutWorld *world)
{
    const uint64_t hash = hash_derived(world), state = state_hash(&world->state);
    world->body->ops->restored(world->body);
    assert_true(world->body->ops->check(world->model));
    assert_true(hash_derived(world) == hash);
    assert_true(state_hash(&world->state) == state);
}

// Tension in all directions: a fibre from each side that lies open inside the whole body, and from
// nowhere else, between vertices that have elements.
static void check_tension(const CutWorld *world)
{
    const CutLattice *lattice = &world->cuts->lattice;
    const CutTension *tension = world->cuts->tension;
    int sides = 0, fibres = 0;
    for (int c = 0; c < lattice->level_first[1]; c++)
        for (int d = 0; d < 6 && !cut_lattice_is_gone(lattice, c); d++)
            sides += cut_lattice_across(lattice, c, d) >= 0 && cut_faces_is_shown(lattice, c, d);
    for (int p = 0; p < tension->count; p++) {
        fibres += tension->point[p].pull == 0.0;
        for (int k = 0; k < 4; k++)
            assert_true(lattice->anchor[tension->point[p].vertex[k]] >= 0);
    }
    assert_int_equal(fibres, sides);
}

static void check_all(CutWorld *world)
{
    if (world->cuts->tension != NULL)
        check_tension(world);
    cut_bench_expect_closed(&world->body->surface, world->cuts->faces.square);
    check_vertices(world);
    check_masses(world);
    check_pieces(world);
    check_derived(world);
}

// --- removals without a tool ---

typedef struct Taken {
    const Removal *removal;
    RemovalOutcome sum;
} Taken;

static bool take(Sim *sim, int b, void *context, TopologyChange *change)
{
    Taken *taken = context;
    RemovalOutcome one;
    Body *body = &sim->body[b];
    const bool changed = body->ops->remove(body, taken->removal, &one, change);
    taken->sum.verdict = one.verdict;
    taken->sum.removed += one.removed;
    taken->sum.volume += one.volume;
    taken->sum.mass += one.mass;
    taken->sum.momentum = vec3_add(taken->sum.momentum, one.momentum);
    return changed;
}

// A tick's removal, as the pipeline asks for it.
static RemovalOutcome remove_near(CutWorld *world, RemoverKind kind, Vec3 at, double radius)
{
    const Removal removal = {
        .kind = kind,
        .mouth = {.kind = REGION_CAPSULE, .from = at, .to = at, .radius = radius},
        .volume = (double)INFINITY,
        .tick = 1e-3};
    Taken taken = {.removal = &removal};
    change_body(world->sim, 0, take, &taken);
    return taken.sum;
}

// A random cell's centre, in the world.
static Vec3 random_place(const CutWorld *world, uint64_t *seed)
{
    CellCentres centres;
    const CutLattice *lattice = &world->cuts->lattice;
    cut_centres_begin(&centres, lattice, &world->model->vertices.rows,
                      vertices_row(&world->model->vertices));
    int cell;
    do
        cell = random_below(seed, lattice->level_first[1]);
    while (cut_lattice_is_gone(lattice, cell));
    return cut_centre(&centres, cell);
}

TEST(random_removals_and_cuts_keep_all_that_follows)
{
    uint64_t seed = 3;
    for (int round = 0; round < 6; round++) {
        SCOPED(cut_world_destroy) CutWorld world;
        VoxelWorldOptions options =
            with_remover(round % 2 == 0 ? voxel_world_cube(12) : voxel_world_ball(), &DRILL);
        options.body.body.levels = round < 2 ? 0 : 2;
        options.body.surface_level = round < 4 ? 0 : 2;
        options.body.body.node_capacity = 30000;
        options.material.prestress = round % 2 == 0 ? 0.0 : 0.05 * options.material.youngs_modulus;
        cut_world_create(&world, &options);
        cut_world_shake(&world, 0.05, &seed);
        const double size = world.lattice.size;
        const int cells = count_present(&world);
        int removed = 0;
        double mass = 0.0;
        for (int step = 0; step < EFFORT(18); step++) {
            if (step % 3 == 0) {
                CutOutcome outcome;
                const CutOptions cut = cut_world_random(&world, &seed);
                cut_world_cut(&world, &cut, &outcome);
            }
            const WorldMomentum before = cut_world_momentum(&world);
            const RemovalOutcome one =
                remove_near(&world, REMOVER_SUCTION, random_place(&world, &seed),
                            random_between(&seed, 0.3, 2.5) * size);
            assert_true(!cut_refuses(one.verdict));
            const WorldMomentum after = cut_world_momentum(&world);
            // What left is what is missing; rounding of sums over all vertices.
            const Vec3 missing = vec3_sub(before.linear, after.linear);
            expect_at_most(vec3_length(vec3_sub(missing, one.momentum)), 1e-12 * before.linear_sum);
            removed += one.removed;
            mass += one.mass;
            assert_int_equal(count_present(&world) + removed, cells);
            expect_near(world.body->mass + mass, world.rest_mass, 1e-12 * world.rest_mass);
            check_all(&world);
            sim_ticks(world.sim, 2);
        }
        assert_true(removed > EFFORT(40));
        sim_ticks(world.sim, 50);
        assert_int_equal(sim_resets(world.sim), 0);
        check_all(&world);
    }
}

// Nearly all goes without copies of vertices: a cut that parts all cells would need seven times as
// many.
TEST(all_but_the_last_cell_go_and_hardly_any_vertex_comes)
{
    SCOPED(cut_world_destroy) CutWorld world;
    VoxelWorldOptions options = with_remover(voxel_world_cube(10), &DRILL);
    options.body.body.levels = 0;
    cut_world_create(&world, &options);
    const int before = cut_lattice_used(&world.cuts->lattice);
    for (int k = 0; k < 20; k++) {
        remove_near(&world, REMOVER_SUCTION, vec3(0, 0, 0), 1.0);
        check_all(&world);
        sim_ticks(world.sim, 20);
    }
    const int more = cut_lattice_used(&world.cuts->lattice) - before;
    print_message("%d vertices, %d more\n", before, more);
    expect_at_most(more, 0.1 * before);
    assert_int_equal(count_present(&world), 1);
    assert_int_equal(cut_pieces_count(&world.cuts->pieces), 1);
    assert_int_equal(sim_resets(world.sim), 0);
}

// Each cell that goes may leave six pieces: where fewer numbers are free, none goes, and no two
// pieces share a number.
TEST(no_cell_goes_for_whose_pieces_there_are_no_numbers)
{
    SCOPED(cut_world_destroy) CutWorld world;
    VoxelWorldOptions options = with_remover(voxel_world_cube(12), &DRILL);
    options.body.body.levels = options.body.surface_level = 2;
    options.body.body.node_capacity = 4000;
    cut_world_create(&world, &options);
    CutPieces *pieces = &world.cuts->pieces;
    const int most = pieces->most, cells = count_present(&world);
    static const struct {
        int numbers, cells;
    } room[] = {{5, 0}, {6, 1}, {11, 1}, {24, 4}};
    int removed = 0;
    for (size_t k = 0; k < sizeof room / sizeof *room; k++) {
        pieces->most = (int)*pieces->count + room[k].numbers;
        // What is in the way is divided first, in ticks of its own.
        RemovalOutcome one = {.verdict = CUT_DONE};
        for (int tick = 0; tick < 20 && one.verdict == CUT_DONE && one.removed == 0; tick++) {
            sim_ticks(world.sim, 1);
            one =
                remove_near(&world, REMOVER_SUCTION, vec3(0.0, 0.0, 0.0), 2.5 * world.lattice.size);
        }
        assert_int_equal(one.verdict, room[k].cells == 0 ? CUT_NO_NODES : CUT_DONE);
        assert_in_range(one.removed, room[k].cells > 0, room[k].cells);
        removed += one.removed;
        assert_int_equal(count_present(&world) + removed, cells);
        pieces->most = most;
        check_all(&world);
    }
}

// --- tools ---

static void hold_tool(CutWorld *world, Vec3 at, double grip)
{
    const ToolPose pose = {.utime = 1000 * (1 + sim_steps(world->sim)),
                           .position = at,
                           .orientation = QUAT_NONE,
                           .active = true,
                           .grip = grip};
    sim_apply_pose(world->sim, 0, &pose, true);
}

// A burr held in the middle of a block takes a ball, which is less than a layer of cells larger
// than itself: it takes what it touches, whose centres are within half a diagonal of a cell. The
// rest is what counting centres in a ball is off its volume.
TEST(a_drill_burrs_a_ball_out_of_a_block)
{
    double off[2];
    for (int k = 0; k < 2; k++) {
        const int n = k == 0 ? 12 : 24;
        SCOPED(cut_world_destroy) CutWorld world;
        ToolOptions drill = DRILL;
        drill.mouth.radius = 0.025;
        VoxelWorldOptions options = with_remover(voxel_world_cube(n), &drill);
        options.body.body.levels = 0;
        cut_world_create(&world, &options);
        const double size = world.lattice.size, radius = drill.mouth.radius;
        const Vec3 at = {0.0011, 0.0023, -0.0017}; // on no plane of the lattice
        for (int tick = 0; tick < 60; tick++) {
            hold_tool(&world, at, 1.0);
            sim_step(world.sim);
        }
        const double cell = size * size * size;
        const double volume = cell * (pow(n, 3.0) - count_present(&world));
        const double sphere = 4.0 / 3.0 * M_PI * pow(radius, 3.0);
        const double grown = 4.0 / 3.0 * M_PI * pow(radius + 0.87 * size, 3.0);
        const double layer = 4.0 / 3.0 * M_PI * pow(radius + size, 3.0) - sphere;
        print_message("n %d: %.4g of the sphere, %.3g of a layer off, %.3g of the grown one\n", n,
                      volume / sphere, (volume - sphere) / layer, volume / grown - 1.0);
        expect_at_least(volume, sphere);
        expect_at_most(volume, sphere + layer);
        off[k] = volume / sphere - 1.0;
        expect_at_most(fabs(volume / grown - 1.0), 0.03);
        check_all(&world);
        assert_int_equal(sim_resets(world.sim), 0);
    }
    expect_at_most(off[1], 0.65 * off[0]); // first order in the size of a cell
}

// What goes in a second is what the rate says, but for a cell that is not full yet.
TEST(suction_takes_at_its_rate_the_nearest_first)
{
    SCOPED(cut_world_destroy) CutWorld world;
    ToolOptions tube = DRILL;
    tube.removes = REMOVER_SUCTION;
    tube.mouth.radius = 0.03;
    tube.rate_mm3_s = 20000.0;
    VoxelWorldOptions options = with_remover(voxel_world_cube(16), &tube);
    options.body.body.levels = 2;
    cut_world_create(&world, &options);
    const double cell = 1e9 * pow(world.lattice.size, 3.0); // [mm3], 244
    const Vec3 at = {0.05, 0.0011, 0.0017};
    for (int tick = 0; tick < 500; tick++) {
        hold_tool(&world, at, 1.0);
        sim_step(world.sim);
    }
    const int gone = 16 * 16 * 16 - count_present(&world);
    // Before anything can go, larger elements are divided: a few ticks.
    expect_at_least(gone * cell, 20000.0 * 0.48 - cell);
    expect_at_most(gone * cell, 20000.0 * 0.5);
    check_all(&world);
    // No cell that stays is nearer at rest than one that went by more than the body has deformed.
    double farthest = 0.0, nearest = 1.0;
    for (int c = 0; c < world.cuts->lattice.level_first[1]; c++) {
        const short *p = world.cuts->lattice.element[c].cell;
        const double size = world.lattice.size;
        const Vec3 x = vec3((p[0] - 7.5) * size, (p[1] - 7.5) * size, (p[2] - 7.5) * size);
        const double d = vec3_length(vec3_sub(x, at));
        if (cut_lattice_is_gone(&world.cuts->lattice, c))
            farthest = fmax(farthest, d);
        else
            nearest = fmin(nearest, d);
    }
    expect_at_most(farthest - nearest, 0.1 * world.lattice.size);
    // Off: nothing goes, and the event says what did.
    for (int tick = 0; tick < 100; tick++) {
        hold_tool(&world, at, tick < 50 ? 0.3 : 0.45);
        sim_step(world.sim);
    }
    assert_int_equal(gone, 16 * 16 * 16 - count_present(&world));
    SimEvent event;
    bool told = false;
    while (sim_take_event(world.sim, &event))
        if (strcmp(event.kind, "remove") == 0) {
            char text[96];
            snprintf(text, sizeof text, "tool 1: %d cells of body '%s' removed, %.4g mm3", gone,
                     world.body->name, gone * cell);
            assert_ptr_equal(strstr(event.text, text), event.text);
            assert_false(told);
            told = true;
        }
    assert_true(told);
}

static void drill_through(CutWorld *world, int from, int ticks, double *force)
{
    for (int tick = from; tick < from + ticks; tick++) {
        hold_tool(world, vec3(0.003, 0.0, 0.085 - 2e-4 * tick), 1.0);
        sim_step(world->sim);
        *force = fmax(*force, vec3_length(sim_wrench(world->sim, 0)->force));
    }
}

// A burr that is pushed through the body at 0.2 m/s makes a hole. It is felt where it takes less
// than that needs. A run that goes on from a state is the same bit for bit.
TEST(a_drill_goes_through_and_is_felt_where_it_is_pushed_faster_than_it_takes)
{
    for (int slow = 0; slow < 2; slow++) {
        SCOPED(cut_world_destroy) CutWorld world;
        ToolOptions drill = DRILL;
        drill.mouth.radius = 0.01;
        drill.rate_mm3_s = slow * 1e5; // a third of 0.2 m/s times the hole's section
        drill.capsule[drill.capsule_count++] = drill.mouth;
        VoxelWorldOptions options = with_remover(voxel_world_cube(16), &drill);
        options.body.body.levels = 2;
        static const FixedRegion bottom = {
            .kind = FIXED_BOX, .low = {-1, -1, -0.06}, .high = {1, 1, -0.045}};
        options.body.body.fixed = &bottom;
        options.body.body.fixed_count = 1;
        cut_world_create(&world, &options);
        double force = 0.0;
        drill_through(&world, 0, 300, &force);
        FREED void *state = malloc(state_bytes(&world.state));
        state_copy_out(&world.state, state);
        const int gone = 16 * 16 * 16 - count_present(&world);
        drill_through(&world, 300, 400, &force);
        const uint64_t expected = state_hash(&world.state);
        assert_true(16 * 16 * 16 - count_present(&world) > gone && gone > 0);
        print_message("%d cells, up to %.3g N\n", 16 * 16 * 16 - count_present(&world), force);
        if (slow)
            expect_at_least(force, 0.1); // 1 % of the tool's
        else
            expect_at_most(force, 0.1);
        check_all(&world);
        state_copy_in(&world.state, state);
        sim_restored(world.sim);
        assert_true(sim_check(world.sim));
        drill_through(&world, 300, 400, &force);
        assert_true(state_hash(&world.state) == expected);
        assert_int_equal(sim_resets(world.sim), 0);
        // A reset brings all of it back.
        sim_reset(world.sim);
        assert_int_equal(count_present(&world), 16 * 16 * 16);
        check_all(&world);
    }
}
