// SPDX-License-Identifier: MIT
// Blades through real bodies that swing, sag and are divided while they are cut, tick by tick in
// the pipeline.
#include "test.h"
#include "sim_steps.h"
#include "cut_bench.h"
#include "cut_world.h"
#include "effort.h"

typedef struct Path {
    Quat orientation; // the edge lies along z of the tool, which moves along its x
    Vec3 middle;
    double from, to, speed; // [m], [m], [m/s]
} Path;

static Path random_stroke(uint64_t *seed, double speed)
{
    const Vec3 axis = random_vec3(seed);
    Path stroke = {.from = -0.25, .to = 0.25, .speed = speed};
    stroke.orientation = quat_unit((Quat){random_between(seed, -1.0, 1.0), axis.x, axis.y, axis.z});
    stroke.middle = vec3_scale(0.03, random_vec3(seed));
    return stroke;
}

static void make_world(CutWorld *world, int kind, bool single)
{
    VoxelWorldOptions options = kind % 3 == 0   ? voxel_world_cube(16)
                                : kind % 3 == 1 ? voxel_world_ball()
                                                : voxel_world_corner();
    if (kind % 3 == 2)
        options.body.material_count = 0;
    options.body.body.precision = single ? PRECISION_SINGLE : PRECISION_DOUBLE;
    options.body.split_budget = 4;
    options.tool[options.tool_count++] = (ToolOptions){.id = 1,
                                                       .kind = TOOL_BLADE,
                                                       .edge = {{0.0, 0.0, -0.4}, {0.0, 0.0, 0.4}},
                                                       .max_force = 10.0};
    cut_world_create(world, &options);
}

static void put_blade(CutWorld *world, const Path *stroke, double way, bool active)
{
    const Vec3 along = quat_rotate(stroke->orientation, vec3(1.0, 0.0, 0.0));
    const ToolPose pose = {.utime = (int64_t)(1e6 * (way + 1.0) / stroke->speed),
                           .position = vec3_madd(stroke->middle, way, along),
                           .orientation = stroke->orientation,
                           .active = active};
    sim_apply_pose(world->sim, 0, &pose, true);
}

// How far the body reaches along the blade's way.
static double farthest(const CutWorld *world, const Path *stroke)
{
    const Vec3 along = quat_rotate(stroke->orientation, vec3(1.0, 0.0, 0.0));
    const Vertices *vertices = &world->model->vertices;
    double most = -1e9;
    for (int i = 0; i < vertices->count; i++) {
        Vec3 x;
        rows_read(&vertices->rows, vertices_row(vertices), i, &x, NULL);
        most = fmax(most, vec3_dot(along, vec3_sub(x, stroke->middle)));
    }
    return most;
}

// Takes the stroke with the pipeline's ticks of 1 ms; `through`: goes on until the body, which may
// drift away in front of the blade, is behind it.
static void run(CutWorld *world, const Path *stroke, bool through)
{
    double way = stroke->from;
    for (; way <= stroke->to || (through && way < farthest(world, stroke) + 0.01);
         way += 1e-3 * stroke->speed) {
        put_blade(world, stroke, way, true);
        sim_step(world->sim);
    }
    put_blade(world, stroke, way, false);
    sim_step(world->sim);
    assert_int_equal(sim_resets(world->sim), 0);
}

static int broken(const CutWorld *world)
{
    return (int)world->cuts->faces.wall_count / 2;
}

// Everything that is kept is what follows from the bits.
static void expect_sound(CutWorld *world)
{
    const VoxelCuts *cuts = world->cuts;
    const BodySurface *surface = &world->body->surface;
    cut_bench_expect_closed(surface, NULL);
    cut_world_check_masses(world);
    const int pieces = (int)*cuts->pieces.count, faces = surface->face_used;
    const size_t nodes = (size_t)surface->node_used * sizeof(double),
                 triangles = (size_t)faces * sizeof(double), bytes = state_bytes(&world->state);
    FREED double *node_firmness = malloc(nodes), *face_firmness = malloc(triangles);
    memcpy(node_firmness, surface->node_firmness, nodes);
    memcpy(face_firmness, surface->face_firmness, triangles);
    FREED void *before = malloc(bytes), *after = malloc(bytes);
    state_copy_out(&world->state, before);
    sim_restored(world->sim);
    state_copy_out(&world->state, after);
    assert_memory_equal(before, after, bytes);
    assert_true(world->body->ops->check(world->model));
    assert_int_equal(pieces, (int)*cuts->pieces.count);
    assert_int_equal(faces, surface->face_used);
    assert_memory_equal(node_firmness, surface->node_firmness, nodes);
    assert_memory_equal(face_firmness, surface->face_firmness, triangles);
}

static int dead_ends(const CutWorld *world)
{
    const CutLattice *lattice = &world->cuts->lattice;
    const CutPieces *pieces = &world->cuts->pieces;
    int count = 0;
    for (int cell = 0; cell < lattice->level_first[1]; cell++)
        for (int axis = 0; axis < 3; axis++)
            count += (lattice->broken[cell] >> axis & 1) &&
                     cut_pieces_of(pieces, cell) ==
                         cut_pieces_of(pieces, cut_lattice_beyond(lattice, cell, axis));
    return count;
}

// The shaken body swings and drifts by more than a cell a tick's way of the slow blade.
TEST(whole_strokes_separate_swinging_bodies)
{
    uint64_t seed = 41;
    int met = 0, faces = 0, dead = 0;
    const int strokes = EFFORT(12);
    for (int s = 0; s < strokes; s++) {
        SCOPED(cut_world_destroy) CutWorld world;
        make_world(&world, s, s % 2);
        cut_world_shake(&world, 0.3, &seed);
        const Path stroke = random_stroke(&seed, s % 4 < 2 ? 1.0 : 4.0);
        run(&world, &stroke, true);
        expect_sound(&world);
        faces += broken(&world);
        dead += dead_ends(&world);
        met += broken(&world) > 0;
        if (broken(&world) > 0 && *world.cuts->pieces.count < 2)
            fail_msg("stroke %d: %d broken, one piece", s, broken(&world));
    }
    print_message("%d of %d met the body, %d faces, %d dead ends\n", met, strokes, faces, dead);
    assert_true(met > strokes / 2);
    expect_at_most(dead, 0.02 * faces); // links along the sweep
}

TEST(strokes_that_stop_inside_separate_nothing)
{
    uint64_t seed = 42;
    for (int s = 0; s < EFFORT(6); s++) {
        SCOPED(cut_world_destroy) CutWorld world;
        make_world(&world, 3 * s, s % 2); // convex: what stops in the middle leaves the rest whole
        cut_world_shake(&world, 0.1, &seed);
        Path stroke = random_stroke(&seed, 2.0);
        stroke.middle = vec3(0.0, 0.0, 0.0);
        stroke.from = -0.12, stroke.to = -0.01;
        run(&world, &stroke, false);
        assert_int_equal(*world.cuts->pieces.count, 1);
        expect_sound(&world);
    }
}

// Path after stroke on one body, single precision, with what is left to be divided piling up.
TEST(many_strokes_keep_a_body_sound)
{
    uint64_t seed = 43;
    SCOPED(cut_world_destroy) CutWorld world;
    make_world(&world, 0, true);
    cut_world_shake(&world, 0.1, &seed);
    int pieces = 1;
    for (int s = 0; s < EFFORT(5); s++) {
        const Path stroke = random_stroke(&seed, 4.0);
        run(&world, &stroke, true);
        expect_sound(&world);
        assert_true(*world.cuts->pieces.count >= pieces);
        pieces = (int)*world.cuts->pieces.count;
    }
    assert_true(pieces > 1);
}

// In the middle of a stroke the state is copied out; brought back, the stroke goes on in the same
// bits.
TEST(stroke_goes_on_in_the_same_bits_after_a_restore)
{
    uint64_t seed = 44;
    SCOPED(cut_world_destroy) CutWorld world;
    make_world(&world, 0, true);
    cut_world_shake(&world, 0.2, &seed);
    Path stroke = random_stroke(&seed, 1.0);
    stroke.middle = vec3(0.0, 0.0, 0.0);
    FREED void *middle = malloc(state_bytes(&world.state));
    double way = stroke.from;
    for (; way < 0.0; way += 1e-3 * stroke.speed) {
        put_blade(&world, &stroke, way, true);
        sim_step(world.sim);
    }
    assert_true(broken(&world) > 0);
    state_copy_out(&world.state, middle);
    uint64_t hash[2];
    for (int again = 0; again < 2; again++) {
        if (again == 1) {
            resume(&world.state, world.sim, middle);
        }
        for (double w = way; w < 0.1; w += 1e-3 * stroke.speed) {
            put_blade(&world, &stroke, w, true);
            sim_step(world.sim);
        }
        hash[again] = state_hash(&world.state);
    }
    assert_true(hash[0] == hash[1]);
}

// What follows from scratch is what sim_create asked contact for.
TEST(uncut_body_is_as_firm_as_contact_says)
{
    for (int kind = 0; kind < 3; kind++) {
        SCOPED(cut_world_destroy) CutWorld world;
        make_world(&world, kind, false);
        expect_sound(&world);
    }
}

TEST(cut_without_room_changes_nothing)
{
    for (int which = 0; which < 2; which++) {
        VoxelWorldOptions options = voxel_world_cube(8);
        if (which == 0)
            options.body.body.face_capacity = 2 * 6 * 64 + 40; // ten faces
        else
            options.body.body.node_capacity = 9 * 9 * 9 + 10;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        const CutOptions cut = cut_world_sweep(vec3(0.001, 0.0, 0.0), vec3(0.0, 0.0, 1.0),
                                               vec3(0.0, 1.0, 0.0), 1.0, -1.0, 1.0);
        CutOutcome outcome;
        const uint64_t before = state_hash(&world.state);
        TopologyChange change;
        const CutSweep sweep = {
            .phase = CUT_WHOLE, .before = cut.before, .after = cut.after, .blade = -1};
        assert_false(world.body->ops->cut(world.body, &sweep, &outcome, &change));
        assert_int_equal(outcome.verdict, which == 0 ? CUT_NO_FACES : CUT_NO_NODES);
        assert_true(outcome.needed > outcome.room);
        assert_true(state_hash(&world.state) == before);
        expect_sound(&world);
    }
}
