// SPDX-License-Identifier: MIT
// Tissue of a wall is removed from under all that holds it, pulls it and touches it.
#include "effort.h"
#include "random.h"
#include "test.h"
#include "tied_bodies.h"

AROUND_ALL(scratch_begin, scratch_end)

// A ball that is held by the world and by a bar, pinned, pulled by a load and by jaws, touches the
// bar and itself; with levels, or at one, with explicit steps or implicit.
static const char HELD[] =
    "max_ties = 4; gravity = [0.0, 0.0, -0.1];\n"
    "bodies = (\n"
    "  { name = \"ball\"; mesh = { generator = \"sphere\"; nodes = 162; radius = 0.05; };\n"
    "    cuttable = true; tear = { stretch = 2.0; }; %s },\n"
    "  { name = \"bar\"; model = \"voxel\";\n"
    "    voxels = { generator = \"box\"; count = [8, 4, 4]; size = 0.01;\n"
    "               place = { translation = [0.092, 0, 0]; }; };\n"
    "    integrator = \"leapfrog\"; material = { youngs_modulus = 2000.0; };\n"
    "    fixed = ( { box = ([0.12, -1.0, -1.0], [1.0, 1.0, 1.0]); } ); } );\n"
    "tools = (\n"
    "  { id = 1; kind = \"remover\"; removes_by = \"drill\"; mouth = { radius = 0.008; }; },\n"
    "  { id = 2; kind = \"remover\"; removes_by = \"suction\"; rate_mm3_s = 1e5;\n"
    "    mouth = { radius = 0.02; }; },\n"
    "  { id = 3; kind = \"grasper\"; capsules = ( { radius = 0.02; } ); max_force = 3.0; } );\n"
    "touch = ( { bodies = [\"ball\"]; }%s );\n"
    "attachments = (\n"
    "  { body = \"ball\"; to = \"world\"; box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.04]); }%s );\n";
static const char TOUCH[] = ", { bodies = [\"ball\", \"bar\"]; }";
static const char BED[] =
    ",\n  { body = \"ball\"; to_body = \"bar\"; box = ([0.04, -1.0, -1.0], [1.0, 1.0, 1.0]); }";

enum { DRILL, SUCTION, GRASPER };

static void press(Run *run, int tool, Vec3 at, double grip)
{
    const ToolPose pose = {
        .position = at, .orientation = {1.0, 0.0, 0.0, 0.0}, .active = true, .grip = grip};
    sim_apply_pose(run->world.sim, tool, &pose, true);
}

static double removed_area(Run *run)
{
    const Body *body = sim_body(run->world.sim, 0);
    TissueAccount account;
    body->ops->account(body->model, &account, 1);
    return account.removed;
}

// Sucks at one place until nothing is left there.
static void suck_away(Run *run, Vec3 at)
{
    const double before = removed_area(run);
    press(run, SUCTION, at, 1.0);
    sim_ticks(run->world.sim, 100);
    press(run, SUCTION, at, 0.0);
    sim_ticks(run->world.sim, 2);
    assert_true(removed_area(run) > before);
    assert_true(sim_check(run->world.sim));
}

static void hold_all(Run *run, bool tied)
{
    Sim *sim = run->world.sim;
    const TieOptions pin = {.action = TIE_MAKE,
                            .kind = TIE_PIN,
                            .to_body = -1,
                            .tool = -1,
                            .center = {0.0, 0.05, 0.0},
                            .radius = 0.012,
                            .stiffness = 0.3,
                            .damping_ratio = 0.5};
    TieOptions carry = pin;
    carry.kind = TIE_CARRY;
    carry.tool = GRASPER;
    carry.center = (Vec3){0.0, -0.05, 0.0};
    const LoadOptions load = {.body = 0,
                              .center = {-0.05, 0.0, 0.0},
                              .radius = 0.012,
                              .force = {-0.01, 0.0, 0.0},
                              .duration = 100.0};
    press(run, GRASPER, (Vec3){0.0, 0.0, 0.055}, 1.0);
    sim_ticks(sim, 3);
    apply_well(sim_apply_tie, sim, &pin);
    apply_well(sim_apply_tie, sim, &carry);
    apply_well(sim_apply_load, sim, &load);
    sim_ticks(sim, 20);
    assert_true(sim_attachment_nodes(sim, 0) > 3);
    assert_true(!tied || sim_attachment_nodes(sim, 1) > 3);
    assert_true(sim_wrench(sim, GRASPER)->contact);
}

static bool is_tied(Run *run, int number)
{
    TieFigures figures;
    return sim_find_tie(run->world.sim, number, &figures);
}

TEST(what_holds_tissue_lets_go_of_what_is_removed)
{
    static const char *const KINDS[] = {
        "levels = 1; adapt = { }; integrator = \"leapfrog\";", "integrator = \"rk4\";",
        "levels = 2; integrator = \"leapfrog\"; shape = { frame = \"body\"; };",
        "integrator = \"implicit\";"};
    for (size_t kind = 0; kind < sizeof KINDS / sizeof *KINDS; kind++) {
        const bool tied = kind != 1 && kind != 3; // with one integrator
        char text[4096];
        snprintf(text, sizeof text, HELD, KINDS[kind], tied ? TOUCH : "", tied ? BED : "");
        START_RUN(run, text);
        Sim *sim = run.world.sim;
        hold_all(&run, tied);
        // Each in turn loses all that it holds.
        suck_away(&run, (Vec3){0.0, 0.055, 0.0});
        assert_true(!is_tied(&run, 1) && is_tied(&run, 2));
        suck_away(&run, (Vec3){0.0, -0.055, 0.0});
        assert_true(!is_tied(&run, 2));
        suck_away(&run, (Vec3){-0.055, 0.0, 0.0});
        suck_away(&run, (Vec3){0.0, 0.0, 0.055});
        suck_away(&run, (Vec3){0.055, 0.0, 0.0});
        suck_away(&run, (Vec3){0.0, 0.0, -0.055});
        sim_ticks(sim, 100);
        // Neither a force nor a bad number is left of them.
        assert_int_equal(sim_resets(sim), 0);
        assert_true(sim_check(sim));
        assert_true(!sim_wrench(sim, GRASPER)->contact);
    }
}
