// SPDX-License-Identifier: MIT
// Blades through bodies that move and are divided while they are cut: the whole pipeline, tick by
// tick. What must hold is looked at in every tick, from scratch.
#include "test.h"
#include "cut_world.h"
#include "effort.h"

// --- what must hold ---

// A blade that goes right through crosses every loop of four links an even number of times.
static int odd_loops(const CutLattice *lattice)
{
    int odd = 0;
    for (int cell = 0; cell < lattice->level_first[1]; cell++)
        for (int axis = 0; axis < 3; axis++) {
            const int a = (axis + 1) % 3, b = (axis + 2) % 3;
            const int right = cut_lattice_beyond(lattice, cell, a);
            const int up = cut_lattice_beyond(lattice, cell, b);
            if (right < 0 || up < 0 || cut_lattice_beyond(lattice, right, b) < 0)
                continue;
            odd += ((lattice->broken[cell] >> a & 1) + (lattice->broken[cell] >> b & 1) +
                    (lattice->broken[right] >> b & 1) + (lattice->broken[up] >> a & 1)) %
                   2;
        }
    return odd;
}

// Cells joined by faces that are not broken.
static int count_pieces(const CutLattice *lattice)
{
    const int cells = lattice->level_first[1];
    int *stack = malloc(((size_t)cells + 1) * sizeof *stack), pieces = 0;
    FREED bool *seen = calloc((size_t)cells, sizeof *seen);
    for (int first = 0; first < cells; first++) {
        if (seen[first])
            continue;
        pieces++;
        int top = 0;
        seen[stack[top++] = first] = true;
        while (top > 0) {
            const int cell = stack[--top];
            const short *at = lattice->element[cell].cell;
            for (int d = 0; d < 6; d++) {
                const int axis = d / 2, step = d % 2 == 0 ? 1 : -1;
                const int next =
                    cut_lattice_cell(lattice, at[0] + step * (axis == 0),
                                     at[1] + step * (axis == 1), at[2] + step * (axis == 2));
                if (next < 0 || seen[next] || (lattice->broken[step > 0 ? cell : next] >> axis & 1))
                    continue;
                seen[stack[top++] = next] = true;
            }
        }
    }
    free(stack);
    return pieces;
}

// Vertices, windows, pieces and faces are what the state says.
static void expect_same_from_scratch(CutWorld *world)
{
    const VoxelModel *model = world->model;
    const VoxelCuts *cuts = world->cuts;
    const CutLattice *lattice = &cuts->lattice;
    const size_t cells = (size_t)lattice->level_first[1];
    const size_t others = (size_t)lattice->element_count - cells;
    const size_t corners = cells * sizeof *lattice->corner, nodes = others * sizeof *lattice->node;
    const size_t masses = (size_t)model->vertices.count * sizeof(double);
    const size_t places = (size_t)lattice->element_count * sizeof(int);
    FREED unsigned char *kept = malloc(corners + nodes + masses + places);
    memcpy(kept, lattice->corner, corners);
    memcpy(kept + corners, lattice->node, nodes);
    memcpy(kept + corners + nodes, model->vertices.mass, masses);
    memcpy(kept + corners + nodes + masses, cuts->windows.lane, places);
    world->body->ops->restored(world->body);
    assert_true(cuts->sound);
    assert_memory_equal(kept, lattice->corner, corners);
    assert_memory_equal(kept + corners, lattice->node, nodes);
    assert_memory_equal(kept + corners + nodes, model->vertices.mass, masses);
    assert_memory_equal(kept + corners + nodes + masses, cuts->windows.lane, places);
}

// --- strokes ---

typedef struct LiveStroke {
    Vec3 middle, edge, along; // where the edge passes, and which way
    double half_edge, from, to, speed;
} LiveStroke;

static void place_blade(CutWorld *world, const LiveStroke *stroke, double way, bool active)
{
    // A frame with its x axis along the edge.
    const Vec3 x = vec3_unit(stroke->edge);
    const double angle = acos(fmax(-1.0, fmin(1.0, x.x)));
    Vec3 axis = vec3_cross(vec3(1.0, 0.0, 0.0), x);
    axis = vec3_length(axis) > 0.0 ? vec3_unit(axis) : vec3(0.0, 0.0, 1.0);
    const ToolPose pose = {
        .position = vec3_madd(stroke->middle, way, stroke->along),
        .orientation = quat_from_rotation(vec3_scale(angle, axis)),
        .active = active,
    };
    sim_apply_pose(world->sim, 0, &pose, true);
}

// Returns how many links broke. The body may be looked at after each tick.
static int run_stroke(CutWorld *world, const LiveStroke *stroke, int look_every)
{
    const double step = stroke->speed * sim_tick(world->sim);
    int broken = 0, ticks = 0;
    const CutLattice *lattice = &world->cuts->lattice;
    for (int cell = 0; cell < lattice->level_first[1]; cell++)
        broken -= __builtin_popcount(lattice->broken[cell]);
    for (double way = stroke->from; way < stroke->to; way += step, ticks++) {
        place_blade(world, stroke, way, true);
        sim_step(world->sim);
        if (ticks % look_every == 0) {
            cut_world_check_masses(world);
            expect_same_from_scratch(world);
        }
    }
    place_blade(world, stroke, stroke->to, false);
    sim_step(world->sim);
    for (int cell = 0; cell < lattice->level_first[1]; cell++)
        broken += __builtin_popcount(lattice->broken[cell]);
    return broken;
}

static void make_world(CutWorld *world, int kind, bool single)
{
    VoxelWorldOptions options = kind % 3 == 0   ? voxel_world_cube(12)
                                : kind % 3 == 1 ? voxel_world_ball()
                                                : voxel_world_corner();
    options.body.body.levels = 1 + kind % 2;
    options.body.split_budget = 1 + kind % 5;
    options.body.body.precision = single ? PRECISION_SINGLE : PRECISION_DOUBLE;
    options.tool[options.tool_count++] = (ToolOptions){.id = 1,
                                                       .kind = TOOL_BLADE,
                                                       .edge = {{-1.0, 0.0, 0.0}, {1.0, 0.0, 0.0}},
                                                       .max_force = 10.0};
    cut_world_create(world, &options);
}

static LiveStroke random_stroke(const CutWorld *world, uint64_t *seed)
{
    const int *n = world->lattice.count;
    const double reach = world->lattice.size * (n[0] + n[1] + n[2]);
    // Through the middle of what the body is now.
    Vec3 middle = {0.0, 0.0, 0.0};
    const Vertices *vertices = &world->model->vertices;
    for (int i = 0; i < vertices->count; i++) {
        Vec3 x, v;
        rows_read(&vertices->rows, vertices_row(vertices), i, &x, &v);
        middle = vec3_madd(middle, 1.0 / vertices->count, x);
    }
    LiveStroke stroke = {.edge = vec3_unit(random_vec3(seed)), .half_edge = 1.0};
    stroke.along = vec3_unit(vec3_cross(stroke.edge, random_vec3(seed)));
    stroke.middle = vec3_madd(middle, 0.05 * reach, random_vec3(seed));
    stroke.from = -reach;
    stroke.to = 2.5 * reach; // it may be carried along
    stroke.speed = random_between(seed, 3.0, 12.0);
    return stroke;
}

TEST(strokes_part_bodies_that_move)
{
    uint64_t seed = 31;
    int parted = 0;
    for (int round = 0; round < EFFORT(24); round++) {
        SCOPED(cut_world_destroy) CutWorld world;
        make_world(&world, round, round % 4 == 3);
        cut_world_shake(&world, round % 2 == 0 ? 0.1 : 0.4, &seed);
        const WorldMomentum before = cut_world_momentum(&world);
        for (int k = 0; k < 2; k++) {
            const int pieces = count_pieces(&world.cuts->lattice);
            const LiveStroke stroke = random_stroke(&world, &seed);
            const int broken = run_stroke(&world, &stroke, 20);
            const int now = count_pieces(&world.cuts->lattice);
            assert_int_equal(now, *world.cuts->pieces.count);
            if (k == 0) // links that both strokes cross count once
                assert_int_equal(odd_loops(&world.cuts->lattice), 0);
            assert_true(broken == 0 ? now == pieces : now > pieces);
            parted += broken > 0;
        }
        assert_int_equal(sim_resets(world.sim), 0);
        // Nothing from outside acts: over hundreds of ticks with cuts and divisions momentum stays,
        // to rounding a tick of the sums of absolute values.
        const WorldMomentum after = cut_world_momentum(&world);
        const double share = round % 4 == 3 ? 1e-4 : 1e-10;
        expect_near(vec3_length(vec3_sub(after.linear, before.linear)), 0.0,
                    share * before.linear_sum);
        expect_near(vec3_length(vec3_sub(after.angular, before.angular)), 0.0,
                    share * (before.angular_sum + after.angular_sum));
        for (int tick = 0; world.cuts->lattice.wanted_count > 0; tick++) {
            sim_step(world.sim);
            assert_true(tick < 1000);
        }
        cut_world_check_masses(&world);
    }
    assert_true(parted > EFFORT(24));
}

TEST(strokes_that_stop_inside_leave_one_piece)
{
    uint64_t seed = 32;
    int met = 0;
    for (int round = 0; round < EFFORT(12); round++) {
        SCOPED(cut_world_destroy) CutWorld world;
        make_world(&world, 3 * round, false); // a cube
        cut_world_shake(&world, 0.05, &seed);
        LiveStroke stroke = random_stroke(&world, &seed);
        stroke.speed = 8.0; // fast: the body does not get away
        stroke.to = 0.0;
        stroke.middle = vec3_scale(1e-3, random_vec3(&seed));
        met += run_stroke(&world, &stroke, 50) > 0;
        assert_int_equal(count_pieces(&world.cuts->lattice), 1);
        assert_int_equal(*world.cuts->pieces.count, 1);
    }
    assert_true(met > EFFORT(12) / 2);
}
