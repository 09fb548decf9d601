// SPDX-License-Identifier: MIT
// Contact on the smooth surface of solids: tools feel what is shown, the forces on the vertices
// that carry it are the slope of one energy, momentum is exchanged exactly, friction is that of the
// push, and a cut beside a tool is not felt as a jump.
#include "test.h"
#include "sim_steps.h"
#include "effort.h"
#include "momentum_exchange.h"

#include "cut_world.h"

#include "sim/contact/contact_data.h"
#include "body/fit.h"

static const double RADIUS = 0.05, CELL = 0.00625, PROBE = 0.006; // [m]

// A free ball of cells with the surface of a ball, and one tool: a ball, or a capsule along x.
typedef struct Options {
    VoxelWorldOptions world;
    SurfaceField field;
} Options;

static void options_destroy(Options *options)
{
    surface_field_destroy(&options->field);
}

static void make_options(Options *options, double length)
{
    options->world = voxel_world_cube(8);
    lattice_destroy(&options->world.lattice);
    Lattice *lattice = &options->world.lattice;
    assert_true(lattice_ball(lattice, RADIUS, CELL, &(Status){0}));
    SolidBlocks blocks = {.low = {-2.0, -2.0, -2.0}};
    enum { PARTS = 4 }; // to a cell
    size_t voxels = 1;
    for (int a = 0; a < 3; a++) {
        blocks.count[a] = PARTS * (lattice->count[a] + 4);
        blocks.spacing[a] = 1.0 / PARTS;
        voxels *= (size_t)blocks.count[a];
    }
    unsigned char *inside = zeroed(voxels, 1), *to = inside;
    const Vec3 low = vec3_madd(lattice->origin, -2.0 * CELL, vec3(1.0, 1.0, 1.0));
    for (int k = 0; k < blocks.count[2]; k++)
        for (int j = 0; j < blocks.count[1]; j++)
            for (int i = 0; i < blocks.count[0]; i++)
                *to++ = vec3_length(vec3_madd(low, CELL / PARTS, vec3(i + 0.5, j + 0.5, k + 0.5))) <
                        RADIUS;
    blocks.inside = inside;
    surface_field_of_blocks(&options->field, lattice, &blocks);
    free(inside);
    VoxelOptions *body = &options->world.body;
    body->field = &options->field;
    body->tick = 1e-3;
    body->body.levels = 0;
    body->body.integrator = INTEGRATOR_LEAPFROG;
    options->world.tool[options->world.tool_count++] = (ToolOptions){CAPSULE(length, PROBE, 3.0)};
}

static void hold_below(Options *options)
{
    static const FixedRegion below = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.03}};
    fix_within(&options->world.body.body, &below);
}

static void make_cuttable(Options *options)
{
    options->world.body.body.cuttable = true;
    options->world.body.split_budget = 16;
}

static double step_at(Sim *sim, Vec3 position)
{
    put_tool(sim, 0, position);
    sim_step(sim);
    return vec3_length(sim_wrench(sim, 0)->force);
}

// Returns the farthest node of the contact from where it is shown [m].
static double off_from_shown(const Body *body, Contact *contact)
{
    const BodyMesh *mesh = &body->mesh;
    const BodyFit *fit = &mesh->fit;
    FREED float *row = zeroed(3 * (size_t)fit->row_count, sizeof *row),
                *shown = zeroed(3 * (size_t)mesh->node_count, sizeof *shown);
    double *scratch = zeroed(FIT_SCRATCH * (size_t)fit->row_count, sizeof *scratch), most = 0.0;
    body->ops->snapshot_rows(body->model, row, NULL);
    fit_nodes(fit, mesh->node_count, row, scratch, shown);
    fit_fade(fit, contact->fit->step, row, shown);
    contact_fit_read(contact);
    assert_true(contact->local_count > 0);
    for (int i = 0; i < contact->local_count; i++) {
        const float *at = shown + 3L * contact->node[i];
        const Vec3 place = vec3((double)at[0], (double)at[1], (double)at[2]);
        most = fmax(most, vec3_length(vec3_sub(contact->x[i], place)));
    }
    free(scratch);
    return most;
}

TEST(tools_feel_what_is_shown)
{
    for (int k = 0; k < 2; k++) {
        SCOPED(options_destroy) Options options;
        make_options(&options, 0.0);
        if (k == 1)
            make_cuttable(&options);
        hold_below(&options);
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options.world);
        double force = 0.0;
        for (int i = 0; i < 300; i++)
            force = step_at(world.sim, vec3(0.007, 0.004, RADIUS + PROBE - 2e-5 * i));
        const double off = off_from_shown(world.body, world.sim->contact[0]);
        print_message("%s: %.3f N, off by %.2g m\n", k == 0 ? "plain" : "cuttable", force, off);
        assert_true(force > 0.01);
        expect_at_most(off, 3e-8); // floats of 0.06 m, a few of them added
    }
}

// Of a crumpled body, all vertices moved by up to a fifth of a cell: the forces on the carriers and
// on the tool are the slope of one energy along random ways of all vertices and of the tool.
TEST(forces_on_vertices_are_the_gradient)
{
    for (int k = 0; k < 2; k++) {
        SCOPED(options_destroy) Options options;
        make_options(&options, k == 0 ? 0.0 : 0.02);
        if (k == 1)
            make_cuttable(&options);
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options.world);
        Contact *contact = world.sim->contact[0];
        const size_t count = (size_t)world.count;
        FREED Vec3 *rest = calloc(count, sizeof *rest), *at = calloc(count, sizeof *at),
                   *way = calloc(count, sizeof *way), *moved = calloc(count, sizeof *moved);
        memcpy(rest, world.x, count * sizeof *rest);
        uint64_t random = 3;
        double worst = 0.0;
        int tried = 0;
        for (int trial = 0; trial < EFFORT(200); trial++) {
            for (size_t i = 0; i < count; i++) {
                at[i] = vec3_madd(rest[i], 0.2 * CELL, random_vec3(&random));
                way[i] = random_vec3(&random);
            }
            voxel_world_write(&world, at, world.v);
            const Vec3 out = vec3_unit(random_vec3(&random)), move = random_vec3(&random);
            const double deep = random_between(&random, 0.1, 0.8);
            ToolPlacement place = {.position = vec3_scale(RADIUS + (1.0 - deep) * PROBE, out),
                                   .orientation = quat_from_rotation(random_vec3(&random))};
            contact_forget_candidates(contact);
            contact_find_candidates(contact, &place, PROBE);
            contact->yielded = 0.0;
            Vec3 leads;
            if (contact_look(contact, &place, false, &leads))
                continue;
            const Vec3 middle = place.position;
            double energy[2], slope = 0.0, scale = 0.0;
            const double step = 1e-7 * PROBE;
            for (int side = 0; side < 3; side++) {
                const double by = side == 2 ? 0.0 : side == 0 ? -step : step;
                for (size_t i = 0; i < count; i++)
                    moved[i] = vec3_madd(at[i], by, way[i]);
                voxel_world_write(&world, moved, world.v);
                contact_fit_read(contact);
                contact->yielded = 8.0 * step;
                place.position = vec3_madd(middle, by, move);
                contact_evaluate(contact, &place, 0.0);
                if (side < 2)
                    energy[side] = contact->forces.energy;
            }
            for (int i = 0; i < contact->carriers.count; i++) {
                const Vec3 f = contact->carriers.f[i];
                slope += vec3_dot(f, vec3_sub(way[contact->carriers.node[i]], move));
                scale += vec3_length(f);
            }
            if (scale == 0.0)
                continue;
            tried++;
            const double error = fabs((energy[1] - energy[0]) / (2.0 * step) + slope) / scale;
            worst = fmax(worst, error);
            // Differences of an energy of `scale` times the radius: rounding 1e-16 / 1e-7, and
            // that of places of 0.06 m, 1e-17, over steps of 6e-10 m.
            expect_at_most(error, 1e-6);
        }
        print_message("%s: off by %.2g at most in %d places\n", k == 0 ? "ball" : "capsule", worst,
                      tried);
        expect_at_least(tried, EFFORT(200) / 4); // capsules often start inside
    }
}

static Momentum read_momentum(void *world)
{
    Momentum sum;
    voxel_world_read(world);
    voxel_world_momentum(world, &sum.linear, &sum.angular);
    return sum;
}

static Momentum read_cut_momentum(void *world)
{
    const WorldMomentum sum = cut_world_momentum(world);
    return (Momentum){.linear = sum.linear, .angular = sum.angular};
}

// From x = `from` [m] inwards.
static void cut_beside(CutWorld *world, double from)
{
    CutOutcome outcome;
    const CutOptions cut = cut_world_sweep(vec3(from, 0.0, 0.03), vec3(0.0, 0.0, 1.0),
                                           vec3(0.0, 1.0, 0.0), 0.04, -0.1, 0.1);
    assert_true(cut_world_cut(world, &cut, &outcome));
}

static void expect_exact(const char *name, const MomentumExchange *sum)
{
    print_message("%s: of %.2g N s a tick %.2g is lost, angular %.2g\n", name, sum->impulse,
                  sum->impulse_lost / sum->impulse, sum->turn_lost / sum->moment);
    expect_at_least(sum->impulse, 1e-6);
    // Rounding of the body's own momentum, 0.5 kg at 0.1 m/s and more, to 1e-16 of it.
    expect_at_most(sum->impulse_lost, 1e-12 * sum->impulse);
    expect_at_most(sum->turn_lost, 1e-12 * sum->moment);
}

// A free body struck by a turning capsule, with friction; whole, and just cut, while the nodes of
// the cut move to their places.
TEST(body_and_tool_exchange_momentum_exactly)
{
    Options options;
    make_options(&options, 0.06);
    VoxelWorld world;
    voxel_world_create(&world, &options.world);
    MomentumExchange sum = exchange_momentum(world.sim, 400, 0.02, 8.0, read_momentum, &world);
    expect_exact("whole", &sum);
    voxel_world_destroy(&world);
    surface_field_destroy(&options.field);

    make_options(&options, 0.06);
    SCOPED(cut_world_destroy) CutWorld cut;
    cut_world_create(&cut, &options.world);
    cut_beside(&cut, 0.004);
    assert_true(cut.body->mesh.fit.fade_count > 0);
    sum = exchange_momentum(cut.sim, 400, 0.02, 8.0, read_cut_momentum, &cut);
    expect_exact("cut", &sum);
    surface_field_destroy(&options.field);
}

// Dragged over the top of a ball that is held below: with friction more is pulled along the way,
// by so much of the push; what the tissue's own slope gives is the same without.
TEST(friction_is_a_share_of_the_push)
{
    const double friction = 0.2, half = 0.012, deep = 0.003;
    double along[2] = {0.0}, push[2] = {0.0};
    for (int k = 0; k < 2; k++) {
        SCOPED(options_destroy) Options options;
        make_options(&options, 0.0);
        hold_below(&options);
        options.world.body.body.friction = k * friction;
        options.world.body.damping = 2.0;
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options.world);
        const double reach = RADIUS + PROBE - deep;
        for (int i = -500; i <= 2400; i++) { // a way of 24 mm at 10 mm/s
            const double x = -half + 1e-5 * fmax(0.0, i), lift = i < 0 ? deep * (-i / 500.0) : 0.0;
            step_at(world.sim, vec3(x, 0.0, sqrt(reach * reach - x * x) + lift));
            const Vec3 force = sim_wrench(world.sim, 0)->force;
            // The first 6 mm, in which the tissue is dragged along, and as much at the end do not
            // count.
            if (i < 600 || i > 1800)
                continue;
            along[k] -= force.x;
            push[k] += force.z;
        }
    }
    const double more = along[1] / push[1] - along[0] / push[0];
    print_message("friction %.4f of the push\n", more);
    expect_near(more, friction, 0.05 * friction);
}

// A cut beside a probe at rest changes nothing at its own tick, as nothing moves yet: nodes stay
// where they are shown. Contact on the faces of cells changed by 14 % there.
TEST(a_cut_beside_a_tool_is_no_jump)
{
    SCOPED(options_destroy) Options options;
    make_options(&options, 0.0);
    hold_below(&options);
    options.world.body.damping = 2.0;
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options.world);
    const double deep = 0.004;
    double before = 0.0;
    for (int i = 0; i < 2000; i++)
        before = step_at(world.sim, vec3(0.0, 0.0, RADIUS + PROBE - fmin(deep, 1e-5 * i)));
    cut_beside(&world, 0.008);
    assert_true(world.body->mesh.fit.fade_count > 0);
    const double after = step_at(world.sim, vec3(0.0, 0.0, RADIUS + PROBE - deep));
    print_message("%.4f N before, %.4f at the tick of the cut\n", before, after);
    assert_true(before > 0.02);
    // What changes at once is how stiff the faces beside the cut are, by their areas at rest.
    expect_near(after, before, 0.02 * before);
}

// Cut where it is pressed: nodes begin to fade with an offset of zero, and those of walls have
// offsets along one axis, so that some weights vanish. Every vertex that a pushed node follows must
// have its own number among the touched ones; else it takes that of an earlier tick.
TEST(what_carries_a_pushed_node_is_touched)
{
    SCOPED(options_destroy) Options options;
    make_options(&options, 0.0);
    hold_below(&options);
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options.world);
    const Contact *contact = world.sim->contact[0];
    const double deep = 0.004;
    int64_t carried = 0, wrong = 0;
    for (int i = 0; i < 800; i++) {
        if (i == 500)
            cut_beside(&world, 0.001);
        step_at(world.sim, vec3(0.0, 0.0, RADIUS + PROBE - fmin(deep, 1e-5 * i)));
        for (int p = 0; p < contact->pressed_count; p++) {
            const Follower *follower = &contact->fit->follower[contact->pressed[p].local];
            for (int c = 0; c < follower->count; c++) {
                const int carrier = contact->fit->weight[follower->first + c].carrier,
                          number = contact->carriers.touched[carrier];
                carried++;
                wrong +=
                    number >= contact->touched_count || contact->touched[number].carrier != carrier;
            }
        }
    }
    print_message("%lld carriers of pushed nodes, %lld without a number\n", (long long)carried,
                  (long long)wrong);
    assert_true(carried > 10000);
    assert_int_equal(wrong, 0);
}

// A ball whose vertices are all fixed pushes a tool that leaves it, and never pulls; and one whose
// hand goes on by three radii stays where its largest force is, as on a rigid body.
TEST(what_is_fixed_only_pushes)
{
    static const FixedRegion all = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, 1.0}};
    SCOPED(options_destroy) Options options;
    make_options(&options, 0.0);
    fix_within(&options.world.body.body, &all);
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options.world);
    const double deep = 0.018, reach = RADIUS + PROBE;
    double least = 0.0, sunk = 0.0, most = 0.0;
    for (int i = 0; i < 1600; i++) { // at 20 mm/s, held, away at 60 mm/s
        const double depth = i < 900 ? 2e-5 * i : i < 1200 ? deep : deep - 6e-5 * (i - 1200);
        step_at(world.sim, vec3(0.0, 0.0, reach - depth));
        const ToolWrench *wrench = sim_wrench(world.sim, 0);
        least = fmin(least, wrench->force.z);
        most = fmax(most, wrench->force.z);
        if (i < 1200)
            sunk = fmax(sunk, reach - wrench->position.z);
    }
    print_message("at least %.4f N, at most %.4f, sunk by %.2f radii\n", least, most, sunk / PROBE);
    // It was pulled by 0.7 N.
    expect_at_most(most, 3.0 * (1.0 + 1e-12));
    expect_at_least(most, 2.99);
    expect_at_least(least, -1e-6 * most);
    expect_at_most(sunk, 0.5 * PROBE); // measured: 0.22
}

// Finds the velocities to which contact alone brings the touched carriers from `v` in a substep,
// and their masses times these, and what is left of the system.
static void respond(Contact *contact, double g, const Vec3 *v, Vec3 *to, Vec3 *left)
{
    const Carriers *carriers = &contact->carriers;
    Sym3 slope = {0};
    for (int t = 0; t < contact->touched_count; t++) {
        Touched *touched = &contact->touched[t];
        const Sym3 d = carriers->lumped[touched->carrier];
        const Sym3 k = sym3_scale(g / touched->mass, d);
        touched->force = (Vec3){0.0, 0.0, 0.0};
        contact->impulse[t] = sym3_solve(k, 1.0, vec3_scale(-g, sym3_times(d, v[t])));
    }
    for (int p = 0; p < contact->pressed_count; p++) {
        Pressed *pressed = &contact->pressed[p];
        const Follower *follower = &contact->fit->follower[pressed->local];
        *pressed = (Pressed){.local = pressed->local, .acts = true};
        for (int c = 0; c < follower->count; c++) {
            const CarrierWeight *weight = &contact->fit->weight[follower->first + c];
            pressed->speed =
                vec3_madd(pressed->speed, weight->weight, v[carriers->touched[weight->carrier]]);
        }
    }
    contact_fit_solve(contact, (Vec3){0.0, 0.0, 0.0}, 0.0, g, &slope);
    for (int t = 0; t < contact->touched_count; t++) {
        to[t] = vec3_madd(v[t], 1.0 / contact->touched[t].mass, contact->impulse[t]);
        left[t] = contact->left[t].left;
    }
}

// Twice the kinetic energy of two motions of the touched carriers together.
static double together(const Contact *contact, const Vec3 *a, const Vec3 *b)
{
    double sum = 0.0;
    for (int t = 0; t < contact->touched_count; t++)
        sum += contact->touched[t].mass * vec3_dot(a[t], b[t]);
    return sum;
}

// However few rounds find the step, it is that of one symmetric matrix between zero and the
// inverse of M + g W^T K W: it takes energy from every motion, and is the exact step of some
// contact. A step that is not leaves vertices trembling under a tool that is held deep.
TEST(the_step_is_that_of_a_contact)
{
    SCOPED(options_destroy) Options options;
    make_options(&options, 0.02);
    hold_below(&options);
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options.world);
    Contact *contact = world.sim->contact[0];
    for (int i = 0; i < 300; i++)
        step_at(world.sim, vec3(0.0, 0.0, RADIUS + PROBE - 2e-5 * i));
    enum { MOST = 2000 };
    static Vec3 a[MOST], b[MOST], sum[MOST], to_a[MOST], to_b[MOST], to_sum[MOST], left[MOST];
    const int count = contact->touched_count;
    assert_true(count > 50 && count < MOST);
    uint64_t random = 11;
    double off = 0.0, askew = 0.0;
    for (int trial = 0; trial < 60; trial++) {
        // The stiffest carriers resist 1.6 times as much as by their mass alone, to 16 000 times.
        const double g = 1e-7 * pow(10.0, trial % 5);
        for (int t = 0; t < count; t++) {
            a[t] = random_vec3(&random);
            b[t] = random_vec3(&random);
            sum[t] = vec3_add(a[t], b[t]);
        }
        respond(contact, g, b, to_b, left);
        respond(contact, g, sum, to_sum, left);
        respond(contact, g, a, to_a, left);
        const double scale = together(contact, a, a);
        double kept = 0.0, rest = 0.0;
        for (int t = 0; t < count; t++) {
            kept += vec3_dot(to_a[t], left[t]);
            const Vec3 parts = vec3_add(to_a[t], to_b[t]);
            rest = fmax(rest, vec3_length(vec3_sub(to_sum[t], parts)));
        }
        off = fmax(off, rest);
        askew = fmax(askew, fabs(together(contact, b, to_a) - together(contact, a, to_b)) / scale);
        assert_true(together(contact, to_a, a) > 0.0);
        assert_true(together(contact, to_a, to_a) < scale);
        assert_true(kept > -1e-12 * scale);
    }
    print_message("%d carriers: the sum's step is off by %.2g m/s, askew by %.2g\n", count, off,
                  askew);
    // Velocities of 1 m/s, rounded, times steps of up to 3.
    expect_at_most(off, 1e-12);
    expect_at_most(askew, 1e-12);
}

// Without memory for what nodes follow from, these are where their vertices are, and no more is
// written than there is memory for.
TEST(without_room_nodes_are_at_their_vertices)
{
    SCOPED(options_destroy) Options options;
    make_options(&options, 0.0);
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options.world);
    Contact *contact = world.sim->contact[0];
    contact->fit->weight_capacity = 100;
    const ToolPlacement place = {.position = {0.0, 0.0, RADIUS},
                                 .orientation = {1.0, 0.0, 0.0, 0.0}};
    contact_find_candidates(contact, &place, PROBE);
    assert_true(contact->local_count > 20 && contact->refused > 0);
    // All but one for each of the other nodes.
    expect_at_most(contact->fit->weight_count, 100 + contact->local_count);
    int alone = 0;
    for (int i = 0; i < contact->local_count; i++) {
        const Follower *follower = &contact->fit->follower[i];
        const CarrierWeight *own = &contact->fit->weight[follower->first];
        assert_int_equal(contact->carriers.node[own->carrier], contact->node[i]);
        if (follower->count == 1) {
            assert_true(own->weight == 1.0);
            alone++;
        }
    }
    assert_true(alone > contact->local_count / 2);
}
