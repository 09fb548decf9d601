// SPDX-License-Identifier: MIT
// Plane bodies that are cut: blades, the paper's threshold, quarters by its Fig. 7.
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "plane_world.h"
#include "base/sets.h"
#include "random.h"
#include "plane/cut.h"

static PlaneWorldOptions cuttable_disc(int cells)
{
    PlaneWorldOptions options = plane_world_disc(cells);
    options.body.body.cuttable = true;
    return options;
}

static PlaneCut *cut_of(const PlaneWorld *world)
{
    return world->model->cut;
}

// An upright edge from one place of the plane to another, or turned by the way if `reach` > 0: it
// reaches beyond both ends.
static bool slice(PlaneWorld *world, Vec3 from, Vec3 to, CutOutcome *sum)
{
    char why[192];
    const CutOptions cut = {
        .body = -1,
        .before = {{vec3(from.x, from.y, -0.01), vec3(from.x, from.y, 0.01)}},
        .after = {{vec3(to.x, to.y, -0.01), vec3(to.x, to.y, 0.01)}},
    };
    return sim_apply_cut(world->sim, &cut, sum, why, sizeof why);
}

static double mass_of(const PlaneWorld *world)
{
    double mass = 0.0;
    for (int v = 0; v < world->model->vertices.count; v++)
        mass += world->model->vertices.mass[v];
    return mass;
}

// Everything about a body as it is, against the same made from its bits alone, by brute force:
// cells covered once, levels, vertices by flooding the cells around each point.
static void expect_sound(const PlaneWorld *world)
{
    const PlaneCut *cut = cut_of(world);
    const PlaneLayout *layout = &cut->layout;
    const Vertices *vertices = &world->model->vertices;
    int components = 0;
    for (int j = 0; j <= layout->lattice_count[1]; j++)
        for (int i = 0; i <= layout->lattice_count[0]; i++) {
            int element[4], part[4];
            for (int s = 0; s < 4; s++) {
                element[s] = plane_layout_at(layout, i - 1 + (s & 1), j - 1 + (s >> 1));
                part[s] = element[s] < 0 ? -1 : s;
            }
            for (int pass = 0; pass < 4; pass++)
                for (int a = 0; a < 4; a++)
                    for (int b = 0; b < 4; b++) {
                        if (part[a] < 0 || part[b] < 0)
                            continue;
                        bool beside = (a ^ b) == 1 || (a ^ b) == 2;
                        int low = a < b ? a : b;
                        int x = i - 1 + (low & 1), y = j - 1 + (low >> 1);
                        int bit = (a ^ b) == 1 ? PLANE_BROKEN_RIGHT : PLANE_BROKEN_UP;
                        bool broken = beside && cut->broken[y * layout->count[0] + x] & bit;
                        if ((beside && !broken) || element[a] == element[b])
                            part[a] = part[b] = part[a] < part[b] ? part[a] : part[b];
                    }
            for (int c = 0; c < 4; c++) {
                bool owns = false;
                for (int s = 0; s < 4; s++) {
                    if (part[s] != c)
                        continue;
                    int cells = 0;
                    for (int k = 0; k < 4; k++)
                        cells += element[k] == element[s];
                    owns |= cells % 2 == 1;
                }
                components += owns;
            }
            if (element[3] >= 0 && element[2] >= 0)
                assert_true(abs(layout->element[element[3]].level -
                                layout->element[element[2]].level) <= 1);
            if (element[3] >= 0 && element[1] >= 0)
                assert_true(abs(layout->element[element[3]].level -
                                layout->element[element[1]].level) <= 1);
        }
    assert_int_equal(vertices->count, components);
    for (int v = 0; v < vertices->count; v++)
        assert_true(vertices->mass[v] > 0.0);
}

// All that follows from the state, made again from it, has the same bits.
static void expect_same_from_scratch(PlaneWorld *world)
{
    const PlaneCut *cut = cut_of(world);
    const Vertices *vertices = &world->model->vertices;
    const size_t elements = (size_t)cut->layout.element_count, count = (size_t)vertices->count;
    FREED int(*vertex)[PLANE_PLACES] = malloc(elements * sizeof *vertex);
    FREED double *mass = malloc(count * sizeof *mass);
    int faces = world->body->surface.face_used;
    FREED int(*face)[3] = malloc((size_t)faces * sizeof *face);
    memcpy(vertex, cut->vertex, elements * sizeof *vertex);
    memcpy(mass, vertices->mass, count * sizeof *mass);
    memcpy(face, world->body->surface.face, (size_t)faces * sizeof *face);
    uint64_t hash = state_hash(&world->state);
    assert_true(plane_cut_restore(world->body));
    assert_int_equal(vertices->count, (int)count);
    assert_memory_equal(vertex, cut->vertex, elements * sizeof *vertex);
    assert_memory_equal(mass, vertices->mass, count * sizeof *mass);
    assert_memory_equal(face, world->body->surface.face, (size_t)faces * sizeof *face);
    assert_true(hash == state_hash(&world->state));
}

TEST(an_uncut_cuttable_body_moves_as_another)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        PlaneWorldOptions one = plane_world_disc(12), two = cuttable_disc(12);
        one.body.body.precision = two.body.body.precision = (Precision)precision;
        one.body.body.time_step = two.body.body.time_step =
            1e-4; // the bounds differ: all shapes that can be
        SCOPED(plane_world_destroy) PlaneWorld a, b;
        plane_world_create(&a, &one);
        plane_world_create(&b, &two);
        assert_int_equal(a.model->vertices.count, b.model->vertices.count);
        for (int v = 0; v < a.model->vertices.count; v++) {
            assert_int_equal(a.model->vertices.id[v], b.model->vertices.id[v]);
            Vec3 x, u;
            plane_world_read(&a, v, &x, &u);
            u = vec3(3.0 * x.y, 2.0 * x.x, 0.0);
            plane_world_write(&a, v, x, u);
            plane_world_write(&b, v, x, u);
        }
        plane_world_run(&a, 0.05);
        plane_world_run(&b, 0.05);
        double most = 0.0, moved = 0.0;
        for (int v = 0; v < a.model->vertices.count; v++) {
            Vec3 x, y, u;
            plane_world_read(&a, v, &x, &u);
            plane_world_read(&b, v, &y, &u);
            most = fmax(most, vec3_length(vec3_sub(x, y)));
            moved = fmax(moved, vec3_length(x));
        }
        // Damping is in units of the bounds' step, which differ by the shapes that a cut may bring.
        expect_near(most / moved, 0.0, 2e-2);
    }
}

// The pieces that are told are those of the mesh: nodes that its triangles connect.
static void expect_pieces_of_mesh(const PlaneWorld *world)
{
    const BodyMesh *mesh = &world->body->mesh;
    FREED int *root = malloc((size_t)mesh->node_count * sizeof *root);
    union_find_reset(root, mesh->node_count);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int c = 1; c < 3; c++)
            union_find_join(root, mesh->triangle[t][0], mesh->triangle[t][c]);
    assert_int_equal(sim_pieces(world->sim, 0), union_find_number(root, mesh->node_count));
}

TEST(a_blade_through_the_disc_makes_two_pieces)
{
    for (int law = 0; law < 2; law++) {
        PlaneWorldOptions options = cuttable_disc(16);
        options.body.law = law == 0 ? PLANE_AFFINE : PLANE_MIYAZAKI2004;
        SCOPED(plane_world_destroy) PlaneWorld world;
        plane_world_create(&world, &options);
        const double mass = mass_of(&world);
        CutOutcome sum;
        // Exactly through a row of lattice points: 32 edges of the widest column.
        assert_true(slice(&world, vec3(0, -0.05, 0), vec3(0, 0.05, 0), &sum));
        assert_int_equal(sum.verdict, CUT_DONE);
        assert_int_equal(sum.separated, 32);
        assert_int_equal(sum.pieces, 2);
        for (int tick = 0; tick < 20; tick++) {
            sim_step(world.sim);
            expect_sound(&world);
            expect_near(mass_of(&world) / mass, 1.0, 1e-13); // sums of some hundred elements
        }
        expect_same_from_scratch(&world);
        // The outline along the cut is of single cells: 32 edges on either side.
        int along = 0;
        for (int k = 0; k < cut_of(&world)->mesh.edge_count; k++) {
            const int *edge = cut_of(&world)->mesh.edge[k];
            along += cut_of(&world)->mesh.point[edge[0]][0] == 16 &&
                     cut_of(&world)->mesh.point[edge[1]][0] == 16;
        }
        assert_int_equal(along, 64);
        assert_false(slice(&world, vec3(0, -0.05, 0), vec3(0, 0.05, 0), &sum));
        assert_int_equal(sum.verdict, CUT_WAS_CUT);
    }
}

TEST(pieces_move_apart_and_keep_their_momentum)
{
    PlaneWorldOptions options = cuttable_disc(16);
    SCOPED(plane_world_destroy) PlaneWorld world;
    plane_world_create(&world, &options);
    for (int v = 0; v < world.model->vertices.count; v++) {
        Vec3 x, u;
        plane_world_read(&world, v, &x, &u);
        plane_world_write(&world, v, x, vec3(0.1 - 2.0 * x.y + 0.5 * x.x, 2.0 * x.x, 0.0));
    }
    Vec3 p, l, p_now, l_now;
    plane_world_momentum(&world, &p, &l);
    CutOutcome sum;
    assert_true(slice(&world, vec3(0.001, -0.05, 0), vec3(0.002, 0.05, 0), &sum));
    for (int tick = 0; tick < 100; tick++) {
        sim_step(world.sim);
        plane_world_momentum(&world, &p_now, &l_now);
        // Forces and exchanges of mass cancel to rounding, some 1e-16 of the sums a tick.
        expect_near(vec3_length(vec3_sub(p, p_now)) / vec3_length(p), 0.0, 1e-12);
        expect_near(vec3_length(vec3_sub(l, l_now)) / vec3_length(l), 0.0, 1e-10);
    }
    // Spinning halves fly apart.
    double left = -1.0, right = 1.0;
    for (int v = 0; v < world.model->vertices.count; v++) {
        int piece = cut_of(&world)->piece[v];
        Vec3 x, u;
        plane_world_read(&world, v, &x, &u);
        double along = x.x * cos(0.2) + x.y * sin(0.2); // they have turned by 0.2 rad
        if (piece == 0)
            left = fmax(left, along);
        else
            right = fmin(right, along);
    }
    assert_true(right > left - 0.002);
}

TEST(random_cuts_of_a_moving_disc_keep_everything_sound)
{
    uint64_t seed = 77;
    for (int run = 0; run < EFFORT(30); run++) {
        PlaneWorldOptions options = cuttable_disc(8 + 4 * (run % 3));
        options.body.body.levels = run % 4;
        options.body.law = run % 2 == 0 ? PLANE_AFFINE : PLANE_MIYAZAKI2004;
        SCOPED(plane_world_destroy) PlaneWorld world;
        plane_world_create(&world, &options);
        for (int v = 0; v < world.model->vertices.count; v++) {
            Vec3 x, u = vec3_scale(0.2, random_vec3(&seed));
            plane_world_read(&world, v, &x, &(Vec3){0});
            u.z = 0.0;
            plane_world_write(&world, v, x, u);
        }
        const double mass = mass_of(&world);
        Vec3 p, l, p_now, l_now;
        plane_world_momentum(&world, &p, &l);
        for (int k = 0; k < 12; k++) {
            Vec3 from = vec3_scale(0.04, random_vec3(&seed)),
                 to = vec3_scale(0.04, random_vec3(&seed));
            from.z = to.z = 0.0;
            CutOutcome sum;
            if (k % 3 == 0) // along lattice lines and through centres: degenerate
                from.x = to.x = 0.001 * floor(from.x * 1000.0);
            slice(&world, from, to, &sum);
            assert_true(sum.verdict <= CUT_WAS_CUT);
            for (int tick = 0; tick < 3; tick++) {
                sim_step(world.sim);
                expect_sound(&world);
                expect_pieces_of_mesh(&world);
            }
            expect_same_from_scratch(&world);
        }
        plane_world_momentum(&world, &p_now, &l_now);
        expect_near(mass_of(&world) / mass, 1.0, 1e-12);                 // 48 changes
        expect_near(vec3_length(vec3_sub(p, p_now)) / mass, 0.0, 1e-12); // [m/s], of 0.2
        expect_near(vec3_length(vec3_sub(l, l_now)) / (mass * 0.02), 0.0, 1e-11);
    }
}

static void blade_tick(PlaneWorld *world, int tool, double x, double y)
{
    plane_world_place(world, tool, vec3(x, y, 0.0));
    sim_step(world->sim);
    expect_sound(world);
}

TEST(a_stroke_of_a_blade_severs_what_it_passes_through_and_no_more)
{
    for (int half = 0; half < 2; half++) {
        PlaneWorldOptions options = cuttable_disc(16);
        options.tool[options.tool_count++] =
            (ToolOptions){.id = 1,
                          .kind = TOOL_BLADE,
                          .edge = {{0.0, 0.0, -0.02}, {0.0, 0.0, 0.02}},
                          .max_force = 3.3};
        SCOPED(plane_world_destroy) PlaneWorld world;
        plane_world_create(&world, &options);
        for (int v = 0; v < world.model->vertices.count; v++) { // moving tissue
            Vec3 x, u;
            plane_world_read(&world, v, &x, &u);
            plane_world_write(&world, v, x, vec3(-4.0 * x.y, 4.0 * x.x, 0.0));
        }
        const double end = half ? 0.0 : 0.05;
        for (double y = -0.05; y < end; y += 0.00137)
            blade_tick(&world, 0, 0.001, y);
        CutOutcome sum = {0};
        plane_cut_count_pieces(cut_of(&world), &sum);
        assert_int_equal(sum.pieces, half ? 1 : 2);
    }
}

TEST(what_does_not_fit_is_refused_and_changes_nothing)
{
    PlaneWorldOptions options = cuttable_disc(16);
    options.body.body.node_capacity = 400;
    SCOPED(plane_world_destroy) PlaneWorld world;
    plane_world_create(&world, &options);
    assert_true(world.model->vertices.count < 400);
    CutOutcome sum;
    int refused = 0;
    for (int k = 0; k < 40; k++) {
        uint64_t before = state_hash(&world.state);
        double x = -0.03 + 0.0015 * k;
        if (!slice(&world, vec3(x, -0.05, 0), vec3(x, 0.05, 0), &sum) &&
            sum.verdict == CUT_NO_NODES) {
            refused++;
            assert_true(sum.needed > sum.room);
            assert_true(before == state_hash(&world.state));
        }
        plane_world_run(&world, 0.01);
        expect_sound(&world);
        assert_true(world.model->vertices.count <= 400);
    }
    assert_true(refused > 0);
}

// The paper's Figs. 7 (a) and 8: a quarter of a square of two cells becomes an element when one of
// the three vertices that it shares with elements of one cell is released.
TEST(a_released_vertex_carves_the_quarter_beside_it)
{
    PlaneWorldOptions options = cuttable_disc(16);
    options.body.body.levels = 1;
    options.body.law = PLANE_MIYAZAKI2004;
    SCOPED(plane_world_destroy) PlaneWorld world;
    plane_world_create(&world, &options);
    PlaneCut *cut = cut_of(&world);
    const PlaneLayout *layout = &cut->layout;
    // A whole square of two cells, the others around it whole too, in the middle of the disc.
    int element = layout->lut[1][8 * (layout->count[0] / 2) + 8];
    assert_int_equal(cut->quarters[element], PLANE_WHOLE);
    const int i = layout->element[element].cell[0], j = layout->element[element].cell[1];
    // Both edges at the square's low corner that do not touch it: its vertex stays shared.
    const int away = (j - 1) * layout->count[0] + i - 1;
    const int apart[1] = {plane_cut_link(away, PLANE_BROKEN_UP)};
    CutOutcome outcome = {0};
    TopologyChange change;
    assert_true(plane_cut_break(world.body, apart, 1, &outcome, &change));
    plane_world_run(&world, 0.005);
    assert_int_equal(cut->quarters[element], PLANE_WHOLE);
    // All edges at the corner: the square has a vertex of its own there, it was released.
    const int rest[3] = {plane_cut_link(away, PLANE_BROKEN_RIGHT),
                         plane_cut_link(j * layout->count[0] + i - 1, PLANE_BROKEN_RIGHT),
                         plane_cut_link((j - 1) * layout->count[0] + i, PLANE_BROKEN_UP)};
    assert_true(plane_cut_break(world.body, rest, 3, &outcome, &change));
    plane_world_run(&world, 0.005);
    assert_int_equal(cut->quarters[element] & 1, 0); // the quarter at that corner
    assert_int_equal(cut->quarters[layout->lut[0][j * layout->count[0] + i]], PLANE_WHOLE);
    expect_sound(&world);
}

// Section 3.2: strong collisions separate, weak ones do not.
TEST(a_strong_push_tears_and_a_weak_one_does_not)
{
    for (int strong = 0; strong < 2; strong++) {
        PlaneWorldOptions options = cuttable_disc(16);
        FixedRegion held = {.kind = FIXED_SPHERE, .center = {0.0, 0.032, 0.0}, .radius = 0.012};
        fix_within(&options.body.body, &held);
        options.body.law = PLANE_MIYAZAKI2004;
        options.body.tear_force = 2e-3;
        options.tool[options.tool_count++] =
            (ToolOptions){.id = 1,
                          .kind = TOOL_PROBE,
                          .capsule_count = 1,
                          .capsule = {{.from = {0, 0, -0.02}, .to = {0, 0, 0.02}, .radius = 0.004}},
                          .max_force = 3.3};
        SCOPED(plane_world_destroy) PlaneWorld world;
        plane_world_create(&world, &options);
        const int before = world.model->vertices.count;
        const double way = strong ? 0.02 : 0.0005;
        for (int tick = 0; tick < 400; tick++) {
            double deep = way * (tick < 200 ? tick / 200.0 : 1.0);
            plane_world_place(&world, 0, vec3(0.0, -0.0365 + deep, 0.0));
            sim_step(world.sim);
            if (tick % 10 == 0)
                expect_sound(&world);
        }
        if (strong)
            assert_true(world.model->vertices.count > before);
        else
            assert_int_equal(world.model->vertices.count, before);
        expect_same_from_scratch(&world);
    }
}

TEST(a_hostile_state_is_refused)
{
    PlaneWorldOptions options = cuttable_disc(12);
    SCOPED(plane_world_destroy) PlaneWorld world;
    plane_world_create(&world, &options);
    CutOutcome sum;
    slice(&world, vec3(0.0, -0.05, 0), vec3(0.001, 0.0, 0), &sum);
    plane_world_run(&world, 0.02);
    PlaneCut *cut = cut_of(&world);
    FREED void *good = copy_state(&world.state);
    uint64_t seed = 5;
    int refused = 0;
    for (int k = 0; k < EFFORT(2000); k++) {
        state_copy_in(&world.state, good);
        switch (random_below(&seed, 3)) {
        case 0:
            cut->quarters[random_below(&seed, cut->layout.element_count)] ^=
                (unsigned char)(1u << random_below(&seed, 8));
            break;
        case 1:
            cut->broken[random_below(&seed, cut->cell_count)] ^=
                (unsigned char)(1u << random_below(&seed, 8));
            break;
        default:
            cut->id[random_below(&seed, cut->vertex_capacity)] =
                random_below(&seed, 5 * cut->points) - 2;
        }
        sim_restored(world.sim);
        if (world.body->ops->check(world.model))
            sim_step(world.sim); // what is accepted can be lived with
        else
            refused++;
    }
    assert_true(refused > 100);
    resume(&world.state, world.sim, good);
    assert_true(world.body->ops->check(world.model));
    plane_world_run(&world, 0.01);
    expect_sound(&world);
}

// Nodes that a region around everything finds: exactly those that a face in use has.
static int expect_nodes_of_faces(const PlaneWorld *world)
{
    const BodySurface *surface = &world->body->surface;
    const Region all = {.kind = REGION_CAPSULE, .radius = 1.0};
    const int edges = cut_of(world)->mesh.edge_count, places = surface->node_count;
    FREED bool *has = calloc((size_t)places, sizeof *has);
    int *found = malloc((size_t)places * sizeof *found), wanted = 0;
    for (int f = 0; f < 2 * edges; f++)
        for (int k = 0; k < 3; k++) {
            wanted += !has[surface->face[f][k]];
            has[surface->face[f][k]] = true;
        }
    const int count = world->body->ops->find_nodes(world->model, &all, found, places);
    assert_int_equal(count, wanted);
    for (int i = 0; i < count; i++)
        assert_true(has[found[i]]);
    for (int n = 0; n < places; n++)
        assert_int_equal(surface->node_face_end[n] > surface->node_face_start[n], has[n]);
    free(found);
    return count;
}

TEST(only_nodes_of_the_outline_are_found_also_after_a_reset)
{
    PlaneWorldOptions options = cuttable_disc(12);
    SCOPED(plane_world_destroy) PlaneWorld world;
    plane_world_create(&world, &options);
    const int before = expect_nodes_of_faces(&world);
    assert_true(before < 2 * world.model->vertices.count); // there are vertices inside
    CutOutcome sum;
    assert_true(slice(&world, vec3(0.001, -0.05, 0), vec3(0.001, 0.05, 0), &sum));
    plane_world_run(&world, 0.01);
    assert_true(expect_nodes_of_faces(&world) > before);
    sim_reset(world.sim);
    assert_int_equal(expect_nodes_of_faces(&world), before);
}
