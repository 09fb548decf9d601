// SPDX-License-Identifier: MIT
// The memory of contacts is bounded by what a tool can reach: ordinary use stays within it, and a
// body folded into the tool's reach is refused in part, counted, and still answers.
#include "contact_bench.h"
#include "test.h"

// All nodes of a body as near to each other as `share` of their places, held there.
static void create_shrunk(Bench *bench, double share)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(4), bench_ball(0.003));
    options.fixing = BENCH_FROZEN;
    options.tool[0].max_force = 1e6; // does not step back: what is refused shows in the force
    FREED Vec3 *shrunk = calloc((size_t)options.mesh.node_count, sizeof *shrunk);
    for (int i = 0; i < options.mesh.node_count; i++)
        shrunk[i] = vec3_scale(share, options.mesh.position[i]);
    options.initial_position = shrunk;
    bench_create(bench, &options);
}

TEST(faces_beyond_the_capacity_are_refused_and_counted)
{
    SCOPED(bench_destroy) Bench bench;
    create_shrunk(&bench, 0.02); // all 5120 faces within 1 mm
    Vec3 force = bench_touch(&bench, 0, vec3(0.0, 0.0, 0.0035));
    const Contact *contact = bench.sim->contact[0];
    assert_int_equal(contact->candidate_count, contact->face_capacity);
    // Twice: where it appears, across the wall, and where it is led out to.
    assert_int_equal(sim_refused_faces(bench.sim),
                     2 * (bench.body->surface.face_count - contact->face_capacity));
    for (int i = 0; i < 20; i++)
        force = bench_touch(&bench, 0, vec3(0.0, 0.0, 0.0035 - 1e-4 * i));
    assert_true(isfinite(vec3_length(force)));
    // Those that were taken act on both sides alike: the capsule has at most `face_capacity`
    // pushes.
    Vec3 sum = {0.0, 0.0, 0.0};
    double sizes = 0.0;
    for (int k = 0; k < contact->local_count; k++) {
        sum = vec3_add(sum, contact->f[k]);
        sizes += vec3_length(contact->f[k]);
    }
    // Rounding of some thousand additions.
    expect_near(vec3_length(vec3_add(sum, contact->forces.force)), 0.0, 1e-12 * (1.0 + sizes));
    assert_true(sizes > 0.0);
}

TEST(a_refused_face_forgets_its_side)
{
    SCOPED(bench_destroy) Bench bench;
    create_shrunk(&bench, 0.02);
    bench_touch(&bench, 0, vec3(0.0, 0.0, 0.0035));
    const Contact *contact = bench.sim->contact[0];
    int remembered = 0;
    for (int f = 0; f < bench.body->surface.face_count; f++)
        remembered += contact->side[0][f] != 0;
    assert_int_equal(remembered, contact->candidate_count);
}

TEST(a_deep_press_fits)
{
    for (int shape = 0; shape < 2; shape++) {
        SCOPED(bench_destroy) Bench bench;
        BenchOptions options = bench_with_tool(
            bench_ico_sphere(4), shape == 0 ? bench_ball(0.005) : bench_capsule(0.04, 0.004));
        options.fixing = BENCH_SEATED;
        bench_create(&bench, &options);
        assert_true(bench.sim->contact[0]->face_capacity < bench.body->surface.face_count);
        for (int i = 0; i < 300; i++) // 0.3 m/s through both walls
            bench_touch(&bench, 0, vec3(0.0, 0.0, 0.06 - 3e-4 * i));
        assert_int_equal(sim_refused_faces(bench.sim), 0);
    }
}

TEST(faces_are_found_by_their_rank)
{
    SCOPED(bench_destroy) Bench bench;
    BenchOptions options = bench_with_tool(bench_ico_sphere(3), bench_ball(0.01));
    bench_create(&bench, &options);
    bench_touch(&bench, 0, vec3(0.0, 0.0, 0.055));
    const Contact *contact = bench.sim->contact[0];
    assert_true(contact->candidate_count > 10);
    int found = 0;
    for (int f = 0; f < bench.body->surface.face_count; f++) {
        int at = contact_find_candidate(contact, f);
        if (at < 0)
            continue;
        assert_int_equal(contact->candidate[at].face, f);
        found++;
    }
    assert_int_equal(found, contact->candidate_count);
}
