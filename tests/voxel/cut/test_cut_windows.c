// SPDX-License-Identifier: MIT
// The batches of a cuttable body: a function of the leaves alone, whatever the way there, and the
// forces, bits and rotations of its elements.
#include "test.h"
#include "effort.h"
#include "random.h"

#include "base/team.h"
#include "geometry/lattice.h"
#include "voxel/batch.h"
#include "voxel/cut/cut_windows.h"
#include "voxel/layout.h"

static const double SIZE = 3e-3; // of a cell [m]
enum { LEVELS = 2, MATERIALS = 2 };

// --- a body's elements ---

typedef struct World {
    VoxelLaw law;
    Arena arena;
    StateList state;
    CutLattice lattice;
    TemplateCache templates;
    ElementClass classes[(LEVELS + 1) * MATERIALS];
    CutWindows windows;
    double (*row)[ROW]; // [vertex_capacity + 1]
} World;

static ElementClass class_of(int level, int material)
{
    const double size = SIZE * (1 << level), mu = material == 0 ? 5e3 : 1.3e4;
    return (ElementClass){.size = size,
                          .mu = mu,
                          .lambda = material == 0 ? 0.0 : 2.0 * mu,
                          .residual = mu * size / 2.2,
                          .damping = 3e-4 * mu * size,
                          .share = 1.0};
}

// A ball of two materials in a box, or a box of one.
static void shape(Lattice *lattice, int cells, bool box)
{
    if (box) {
        assert_true(lattice_box(lattice, (int[3]){cells, cells, cells}, SIZE, &(Status){0}));
        return;
    }
    assert_true(lattice_ball(lattice, 0.5 * cells * SIZE, SIZE, &(Status){0}));
    for (int k = 0; k < lattice->count[2]; k++)
        for (int j = 0; j < lattice->count[1]; j++)
            for (int i = 0; i < lattice->count[0]; i++) {
                unsigned char *label = &lattice->label[lattice_index(lattice, i, j, k)];
                if (*label != 0 && i + j > lattice->count[0])
                    *label = 2;
            }
}

static void create_windows(const World *world, CutWindows *windows, TemplateCache *templates,
                           Arena *arena, StateList *state)
{
    const WindowOptions options = {.name = "test",
                                   .kernels = voxel_kernels_find(templates->precision, "auto"),
                                   .lattice = &world->lattice,
                                   .templates = templates,
                                   .material_count = MATERIALS,
                                   .classes = world->classes};
    cut_windows_create(windows, &options, arena, state);
}

static void world_create(World *world, int cells, bool box, VoxelLaw law, Precision precision)
{
    *world = (World){.law = law};
    Lattice lattice = {0};
    const VoxelOptions options = {.body = {.name = "test"}, .split_budget = 8};
    VoxelMaking making = {.options = &options,
                          .capacity = 3 * (cells + 1) * (cells + 1) * (cells + 1)};
    shape(&lattice, cells, box);
    layout_create(&making.layout, &lattice, LEVELS);
    assert_true(lattice_mesh_create(&making.mesh, &making.layout, &(Status){0}));
    assert_true(
        cut_lattice_create(&world->lattice, &making, &world->arena, &world->state, &(Status){0}));
    lattice_mesh_destroy(&making.mesh);
    layout_destroy(&making.layout);
    lattice_destroy(&lattice);
    for (int level = 0; level <= LEVELS; level++)
        for (int m = 0; m < MATERIALS; m++)
            world->classes[level * MATERIALS + m] = class_of(level, m);
    template_cache_create(&world->templates, "test", law, precision, &world->arena);
    create_windows(world, &world->windows, &world->templates, &world->arena, &world->state);
    world->row = zeroed((size_t)world->lattice.vertex_capacity + 1, sizeof *world->row);
}

static void world_destroy(World *world)
{
    arena_destroy(&world->arena);
    state_destroy(&world->state);
    free(world->row);
}

// Displacements and velocities at random, that fit into float.
static void move_vertices(World *world, uint64_t *random)
{
    for (int64_t i = 0; i < *world->lattice.vertex_count; i++) {
        const Vec3 u = vec3_scale(0.3 * SIZE, random_vec3(random));
        const Vec3 v = vec3_scale(0.05, random_vec3(random));
        const double row[ROW] = {u.x, u.y, u.z, 0.0, v.x, v.y, v.z, 0.0};
        for (int c = 0; c < ROW; c++)
            world->row[i][c] = (double)(float)row[c];
    }
}

// Faces in a row along a random line of cells, or anywhere.
static void break_some(World *world, uint64_t *random)
{
    CutLattice *lattice = &world->lattice;
    enum { MOST = 30 };
    int face[MOST][2], count = 0;
    const int axis = random_below(random, 3), along = (axis + 1) % 3;
    int at[3], cells = lattice->level_first[1];
    for (int d = 0; d < 3; d++)
        at[d] = random_below(random, lattice->count[d]);
    for (int k = 0; k < MOST; k++) {
        const bool line = k < 24;
        at[along] = k;
        const int cell =
            line ? cut_lattice_cell(lattice, at[0], at[1], at[2]) : random_below(random, cells);
        const int towards = line ? axis : random_below(random, 3);
        if (cell < 0 || cut_lattice_beyond(lattice, cell, towards) < 0 ||
            (lattice->broken[cell] >> towards & 1))
            continue;
        bool listed = false;
        for (int i = 0; i < count; i++)
            listed |= face[i][0] == cell && face[i][1] == towards;
        if (listed)
            continue;
        face[count][0] = cell, face[count][1] = towards;
        count++;
    }
    if (cut_lattice_has_room(lattice, count))
        cut_lattice_break(lattice, (const int(*)[2])face, count);
}

// One tick's cuts and divisions.
static void change(World *world, uint64_t *random)
{
    cut_lattice_forget_changes(&world->lattice);
    if (random_below(random, 3) > 0)
        break_some(world, random);
    cut_lattice_reconstruct(&world->lattice);
    cut_windows_update(&world->windows);
}

// --- claims ---

static void expect_equal_range(const CutWindows *a, const CutWindows *b, const BatchRange *range,
                               size_t real)
{
    for (int k = 0; k < range->used[BATCH_PLAIN]; k++) {
        const int batch = range->first[BATCH_PLAIN] + k;
        assert_int_equal(a->plain_class[batch], b->plain_class[batch]);
        assert_memory_equal(a->plain_vertex[batch], b->plain_vertex[batch],
                            sizeof a->plain_vertex[batch]);
    }
    for (int k = 0; k < range->used[BATCH_HANGING]; k++) {
        const int batch = range->first[BATCH_HANGING] + k;
        const size_t count = (size_t)a->tables[batch].count;
        assert_int_equal(a->tables[batch].count, b->tables[batch].count);
        assert_int_equal(a->tables[batch].stride, b->tables[batch].stride);
        assert_memory_equal(a->hanging_vertex[batch], b->hanging_vertex[batch],
                            count * LANES * sizeof(int));
        assert_memory_equal(a->hanging_class[batch], b->hanging_class[batch],
                            sizeof a->hanging_class[batch]);
        assert_memory_equal(a->tables[batch].number, b->tables[batch].number,
                            (TABLE_HEAD + count * TABLE_ROW) * (size_t)a->tables[batch].stride *
                                real);
    }
}

static void expect_equal(const World *world, const CutWindows *a, const CutWindows *b)
{
    const CutLattice *lattice = &world->lattice;
    const size_t windows = (size_t)lattice->window_count, groups = (size_t)a->group_count,
                 real = world->templates.precision == PRECISION_SINGLE ? 4 : 8;
    assert_memory_equal(a->full, b->full, windows * sizeof *a->full);
    assert_memory_equal(a->pooled, b->pooled, groups * sizeof *a->pooled);
    assert_memory_equal(a->mixed, b->mixed, groups * sizeof *a->mixed);
    assert_memory_equal(a->lane, b->lane, (size_t)lattice->element_count * sizeof *a->lane);
    assert_memory_equal(a->runs.run_end, b->runs.run_end, sizeof a->runs.run_end);
    for (int k = 0; k < a->runs.run_end[BATCH_HANGING][1]; k++) {
        assert_int_equal(a->runs.run[k].first, b->runs.run[k].first);
        assert_int_equal(a->runs.run[k].count, b->runs.run[k].count);
    }
    for (size_t w = 0; w < windows; w++)
        expect_equal_range(a, b, &a->full[w], real);
    for (size_t g = 0; g < groups; g++) {
        expect_equal_range(a, b, &a->pooled[g], real);
        expect_equal_range(a, b, &a->mixed[g], real);
    }
}

TEST(packing_what_changed_gives_the_same_as_packing_all)
{
    uint64_t random = 11;
    for (int variant = 0; variant < 4; variant++) {
        SCOPED(world_destroy) World world;
        world_create(&world, 16, variant % 2 == 0, variant / 2 ? VOXEL_MIYAZAKI2004 : VOXEL_AFFINE,
                     variant % 2 ? PRECISION_SINGLE : PRECISION_DOUBLE);
        const int leaves = world.lattice.leaf_count;
        for (int tick = 0; tick < EFFORT(120); tick++) {
            change(&world, &random);
            SCOPED(arena_destroy) Arena arena = {0};
            SCOPED(state_destroy) StateList state = {0};
            TemplateCache templates;
            CutWindows fresh;
            template_cache_create(&templates, "test", world.law, world.templates.precision, &arena);
            create_windows(&world, &fresh, &templates, &arena, &state);
            expect_equal(&world, &world.windows, &fresh);
        }
        cut_windows_restored(&world.windows);
        print_message("%d leaves, then %d, %ld templates\n", leaves, world.lattice.leaf_count,
                      world.templates.made);
        assert_true(world.lattice.leaf_count > leaves);
    }
}

// Every element's own rotation, from its number.
static void rotation_of(int element, double q[4])
{
    uint64_t random = (uint64_t)element + 1;
    random_bits(&random);
    const Quat turn = quat_from_rotation(random_vec3(&random));
    q[0] = turn.w, q[1] = turn.x, q[2] = turn.y, q[3] = turn.z;
}

TEST(rotations_go_along_with_elements_and_to_their_children)
{
    uint64_t random = 12;
    SCOPED(world_destroy) World world;
    world_create(&world, 16, false, VOXEL_AFFINE, PRECISION_DOUBLE);
    const CutWindows *windows = &world.windows;
    const CutLattice *lattice = &world.lattice;
    FREED int *owner = zeroed((size_t)lattice->element_count, sizeof *owner); // whose it has
    int inherited = 0;
    for (int e = 0; e < lattice->element_count; e++) {
        owner[e] = e;
        const int place = cut_windows_lane(windows, e);
        if (place >= 0)
            rotation_of(e, windows->runs.last[place / LANES][place % LANES]);
    }
    for (int tick = 0; tick < EFFORT(60); tick++) {
        change(&world, &random);
        int used = 0, turned = 0;
        for (int e = lattice->element_count - 1; e >= 0; e--) { // parents before their children
            const int parent = cut_lattice_parent(lattice, e), place = cut_windows_lane(windows, e);
            if (parent >= 0 && lattice->divided[parent] && owner[e] == e) {
                owner[e] = owner[parent];
                inherited++;
            }
            assert_int_equal(place >= 0, cut_lattice_is_leaf(lattice, e));
            if (place < 0)
                continue;
            double expected[4];
            rotation_of(owner[e], expected);
            assert_memory_equal(windows->runs.last[place / LANES][place % LANES], expected,
                                sizeof expected);
            used++;
        }
        const int batches = batch_runs_capacity(&windows->runs);
        for (int i = 0; i < batches * LANES; i++) {
            const double *q = windows->runs.last[i / LANES][i % LANES];
            turned += memcmp(q, (double[4]){1.0, 0.0, 0.0, 0.0}, 4 * sizeof *q) != 0;
        }
        assert_int_equal(used, turned); // all other lanes have none
    }
    assert_true(inherited > 100);
    assert_true(batch_runs_check(&windows->runs));
}

// --- forces ---

typedef struct Forces {
    void *row, *force[2];
    size_t bytes;
} Forces;

static Forces forces_create(const World *world)
{
    const size_t count = (size_t)world->lattice.vertex_capacity + 1;
    const bool single = world->templates.precision == PRECISION_SINGLE;
    const size_t real = single ? sizeof(float) : sizeof(double);
    Forces f = {.row = zeroed(count * ROW, real), .bytes = count * 4 * real};
    for (int k = 0; k < 2; k++)
        f.force[k] = zeroed(count * 4, real);
    for (size_t i = 0; i < count * ROW; i++)
        if (single)
            ((float *)f.row)[i] = (float)world->row[i / ROW][i % ROW];
        else
            ((double *)f.row)[i] = world->row[i / ROW][i % ROW];
    return f;
}

static void forces_destroy(Forces *f)
{
    free(f->row);
    free(f->force[0]);
    free(f->force[1]);
}

static VoxelPass pass_of(const World *world, const Forces *f)
{
    return (VoxelPass){
        .law = world->law,
        .damped = true,
        .rows = f->row,
        .force = f->force[0],
        .stiffness_scale = 1.25,
        .damping_scale = 0.75,
    };
}

// The same leaves in batches of batch.h. Miyazaki's law: k by the shape of each.
static void dense_forces(const World *world, Forces *f, double *energy)
{
    const CutLattice *lattice = &world->lattice;
    const int count = lattice->leaf_count;
    int(*vertex)[NODE_COUNT] = zeroed((size_t)count, sizeof *vertex), k = 0;
    FREED int *element_class = zeroed((size_t)count, sizeof *element_class);
    FREED ElementClass *classes = zeroed((size_t)count, sizeof *classes);
    for (int e = 0; e < lattice->element_count; e++) {
        if (!cut_lattice_is_leaf(lattice, e))
            continue;
        const int level = lattice->element[e].level, *node = cut_lattice_nodes(lattice, e);
        for (int n = 0; n < NODE_COUNT; n++)
            vertex[k][n] = level == 0 && n >= NODE_CORNERS ? -1 : node[n];
        classes[k] = world->classes[level * MATERIALS + lattice->element[e].material - 1];
        if (world->law == VOXEL_MIYAZAKI2004) {
            Template t;
            template_create(&t, template_mask_of(vertex[k]));
            Vec3 mean = {0.0, 0.0, 0.0};
            double spread = 0.0;
            for (int i = 0; i < t.count; i++)
                mean = vec3_madd(mean, 1.0 / t.count, t.rest[i]);
            for (int i = 0; i < t.count; i++)
                spread += vec3_dot(vec3_sub(t.rest[i], mean), vec3_sub(t.rest[i], mean));
            classes[k].residual *= 6.0 / spread;
            classes[k].damping *= 6.0 / spread;
        }
        element_class[k] = k;
        k++;
    }
    assert_int_equal(k, count);
    SCOPED(arena_destroy) Arena arena = {0};
    Batches batches;
    const BatchOptions options = {"dense",       count,   (const int(*)[NODE_COUNT])vertex,
                                  element_class, classes, lattice->vertex_capacity};
    batches_create(&batches, &options, &arena);
    const size_t total = (size_t)batches_total(&batches);
    double(*last)[LANES][4] = zeroed(total, sizeof *last);
    for (size_t i = 0; i < total * LANES; i++)
        last[i / LANES][i % LANES][0] = 1.0;
    VoxelPass pass = pass_of(world, f);
    pass.plain = &batches.plain;
    pass.hanging = &batches.hanging;
    pass.tables =
        voxel_tables_create(&batches, world->law, world->templates.precision, "dense", &arena);
    pass.classes = batches.classes;
    pass.last = last;
    const VoxelKernels *kernels = voxel_kernels_find(world->templates.precision, "auto");
    kernels->evaluate(&pass);
    *energy = kernels->energy(&pass);
    free(vertex);
    free(last);
}

TEST(windows_have_the_forces_of_dense_batches)
{
    uint64_t random = 13;
    for (int variant = 0; variant < 4; variant++) {
        SCOPED(world_destroy) World world;
        world_create(&world, 16, variant % 2 == 0, variant / 2 ? VOXEL_MIYAZAKI2004 : VOXEL_AFFINE,
                     PRECISION_DOUBLE);
        for (int tick = 0; tick < EFFORT(40); tick++) {
            change(&world, &random);
            if (tick % 10 != 0)
                continue;
            move_vertices(&world, &random);
            Forces dense = forces_create(&world), own = forces_create(&world);
            const VoxelPass pass = pass_of(&world, &own);
            double energy;
            dense_forces(&world, &dense, &energy);
            batch_runs_evaluate(&world.windows.runs, &pass, BATCHES_ALL);
            double worst = 0.0, largest = 0.0;
            // the spare one too: nothing comes to it
            for (int i = 0; i < 4 * (world.lattice.vertex_capacity + 1); i++) {
                const double f = ((double *)dense.force[0])[i], g = ((double *)own.force[0])[i];
                worst = fmax(worst, fabs(f - g));
                largest = fmax(largest, fabs(f));
                assert_true(isfinite(g));
            }
            // Sums of up to eight elements of some hundred operations each, in another order.
            expect_at_most(worst / largest, 1e-13);
            const double total = batch_runs_energy(&world.windows.runs, &pass);
            expect_near(total / energy, 1.0, 1e-12);
            forces_destroy(&dense);
            forces_destroy(&own);
        }
    }
}

// Two halves, as two threads do them.
typedef struct Shared {
    const World *world;
    const Forces *f;
} Shared;

static void evaluate_halves(void *context, int first, int last)
{
    const Shared *shared = context;
    for (int half = first; half < last; half++) {
        VoxelPass pass = pass_of(shared->world, shared->f);
        pass.force = shared->f->force[half];
        batch_runs_evaluate(&shared->world->windows.runs, &pass, half);
    }
}

TEST(halves_and_levels_and_threads_give_the_same_bits)
{
    uint64_t random = 14;
    Team *team = team_create(2);
    assert_non_null(team);
    assert_true(team_start(team, 2, NULL, &(Status){0}));
    for (int variant = 0; variant < 8; variant++) {
        SCOPED(world_destroy) World world;
        world_create(&world, 16, variant % 2 == 0, variant / 4 ? VOXEL_MIYAZAKI2004 : VOXEL_AFFINE,
                     (Precision)(variant / 2 % 2));
        for (int tick = 0; tick < EFFORT(20); tick++)
            change(&world, &random);
        move_vertices(&world, &random);
        SCOPED(forces_destroy) Forces first = {0};
        for (const char *const *level = isa_available(); *level != NULL; level++)
            for (int threads = 1; threads <= 2; threads++) {
                Forces f = forces_create(&world);
                Shared shared = {&world, &f};
                world.windows.runs.kernels = voxel_kernels_find(world.templates.precision, *level);
                if (threads == 2)
                    team_run(team, evaluate_halves, &shared, 2);
                else
                    evaluate_halves(&shared, 0, 2);
                if (first.row == NULL) {
                    first = f;
                    continue;
                }
                assert_memory_equal(f.force[0], first.force[0], f.bytes);
                assert_memory_equal(f.force[1], first.force[1], f.bytes);
                forces_destroy(&f);
            }
        // Together they are all, and neither half has more to do.
        SCOPED(forces_destroy) Forces whole = forces_create(&world);
        const VoxelPass pass = pass_of(&world, &whole);
        batch_runs_evaluate(&world.windows.runs, &pass, BATCHES_ALL);
        double worst = 0.0, largest = 0.0;
        for (int i = 0; i < 4 * world.lattice.vertex_capacity; i++) {
            const bool single = world.templates.precision == PRECISION_SINGLE;
            const double a =
                single ? (double)((float *)first.force[0])[i] : ((double *)first.force[0])[i];
            const double b =
                single ? (double)((float *)first.force[1])[i] : ((double *)first.force[1])[i];
            const double c =
                single ? (double)((float *)whole.force[0])[i] : ((double *)whole.force[0])[i];
            worst = fmax(worst, fabs(a + b - c));
            largest = fmax(largest, fabs(c));
        }
        // Another order of sums.
        expect_at_most(worst / largest,
                       world.templates.precision == PRECISION_SINGLE ? 2e-6 : 4e-15);
        const BatchRuns *runs = &world.windows.runs;
        for (int kind = 0; kind < BATCH_KINDS; kind++) {
            int half = 0;
            for (int r = kind == 0 ? 0 : runs->run_end[kind - 1][1]; r < runs->run_end[kind][0];
                 r++)
                half += runs->run[r].count;
            assert_int_equal(half, batch_runs_count(runs, kind) / 2);
        }
    }
    team_destroy(team);
}

// --- templates ---

TEST(a_template_is_the_same_whatever_was_asked_for_before)
{
    uint64_t random = 15;
    for (VoxelLaw law = VOXEL_AFFINE; law <= VOXEL_MIYAZAKI2004; law++) {
        Arena arena = {0}, other = {0};
        TemplateCache cache, fresh;
        template_cache_create(&cache, "test", law, PRECISION_DOUBLE, &arena);
        for (int k = 0; k < EFFORT(6000); k++) {
            const unsigned mask = (unsigned)random_below(&random, 1 << (k % 2 == 0 ? 18 : 8));
            Template expected;
            template_create(&expected, mask);
            const Template *shape = template_cache_shape(&cache, mask);
            assert_int_equal(shape->mask, mask);
            assert_int_equal(shape->count, expected.count);
            assert_memory_equal(shape->weight, expected.weight, sizeof expected.weight);
            assert_memory_equal(shape->area, expected.area, sizeof expected.area);
            if (k % 50 != 0)
                continue;
            template_cache_create(&fresh, "fresh", law, PRECISION_DOUBLE, &other);
            assert_memory_equal(template_cache_numbers(&cache, mask),
                                template_cache_numbers(&fresh, mask),
                                (size_t)(TABLE_HEAD + shape->count * TABLE_ROW) * sizeof(double));
        }
        assert_true(cache.made > 520); // more than there is room for
        arena_destroy(&arena);
        arena_destroy(&other);
    }
}
