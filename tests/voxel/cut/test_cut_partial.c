// SPDX-License-Identifier: MIT
// Real bodies with partly filled elements, while these merge and are divided: forces and energy of
// the kernels against the readable element, leaf by leaf; batches packed bit by bit; the stress
// under which they tear.
#include "test.h"
#include "cut_world.h"
#include "effort.h"
#include "body/patch.h"
#include "voxel_coarse.h"

static VoxelWorldOptions options_of(bool ball, Precision precision)
{
    VoxelWorldOptions options = ball ? voxel_world_ball() : voxel_world_corner();
    options.body.body.levels = 2;
    options.body.body.precision = precision;
    options.body.surface_level = 2;
    options.body.split_budget = 8;
    return options;
}

// --- changes ---

// A third of what can.
static bool merge(Sim *sim, int body, void *context, TopologyChange *change)
{
    uint64_t *random = context;
    VoxelCuts *cuts = ((VoxelModel *)sim->body[body].model)->cuts;
    CutLattice *lattice = &cuts->lattice;
    int merged = 0;
    for (int e = lattice->level_first[1]; e < lattice->element_count; e++)
        if (cut_lattice_can_merge(lattice, e) && random_below(random, 3) == 0) {
            cut_lattice_merge(lattice, e);
            merged++;
        }
    *change = (TopologyChange){0};
    return merged > 0 && cut_body_follow(cuts, &sim->body[body], true, false, change);
}

static void change_some(CutWorld *world, uint64_t *random)
{
    if (random_below(random, 3) == 0)
        change_body(world->sim, 0, merge, random);
    else
        cut_world_divide_some(world, random, 3);
}

static bool is_in_use(const CutLattice *lattice, int vertex)
{
    return lattice->vertex_id[vertex] >= 0 && !cut_lattice_is_carried(lattice, vertex);
}

static void move_vertices(CutWorld *world, double noise, uint64_t *random)
{
    Vertices *vertices = &world->model->vertices;
    for (int v = 0; v < vertices->count; v++) {
        if (!is_in_use(&world->cuts->lattice, v))
            continue;
        const Vec3 x = rows_rest(&vertices->rows, v);
        const Vec3 u = vec3_scale(noise * world->lattice.size, random_vec3(random));
        rows_write(&vertices->rows, vertices->row[vertices->current], v, vec3_add(x, u),
                   random_vec3(random));
    }
}

// --- forces ---

// Forces of the elements alone, [vertex][4].
static double (*kernel_forces(const CutWorld *world, double *energy))[4]
{
    const Vertices *vertices = &world->model->vertices;
    const size_t count = (size_t)vertices->capacity + 1;
    double(*out)[4] = zeroed(count, sizeof *out);
    void *force =
        vertices->rows.precision == PRECISION_SINGLE ? zeroed(count * 4, sizeof(float)) : out[0];
    VoxelPass pass = voxel_pass(world->model, vertices_row(vertices));
    pass.force = force;
    *energy = batch_runs_energy(world->model->batches, &pass);
    batch_runs_evaluate(world->model->batches, &pass, BATCHES_ALL);
    if (force != out[0]) {
        for (size_t i = 0; i < count * 4; i++)
            out[i / 4][i % 4] = (double)((float *)force)[i];
        free(force);
    }
    return out;
}

// The same leaf by leaf. Returns the largest force of one element, by which rounding goes.
static double readable_forces(const CutWorld *world, double (*force)[4], double *energy,
                              int *partial)
{
    const CutLattice *lattice = &world->cuts->lattice;
    const Vertices *vertices = &world->model->vertices;
    double largest = 0.0;
    *energy = 0.0;
    for (int e = 0; e < lattice->element_count; e++) {
        if (!cut_lattice_is_leaf(lattice, e))
            continue;
        const int *node = cut_lattice_nodes(lattice, e), level = lattice->element[e].level;
        const unsigned mask = level == 0 ? 0 : template_mask_of(node);
        const Leaf leaf = {.cell = {lattice->element[e].cell[0], lattice->element[e].cell[1],
                                    lattice->element[e].cell[2]},
                           .level = (unsigned char)level};
        uint64_t solid[8];
        Template shape;
        voxel_coarse_solid(&world->lattice, &leaf, solid);
        if (level == 0)
            template_create(&shape, 0);
        else
            template_create_partial(&shape, mask, level, solid);
        *partial += shape.share < 1.0;
        // The material as voxel_create has it.
        const double nu = world->material.poisson_ratio, size = world->lattice.size * (1 << level),
                     mu = world->material.youngs_modulus / (2.0 * (1.0 + nu)),
                     k = shape.share * mu * size;
        const ElementStiffness stiffness = {.law = VOXEL_AFFINE,
                                            .mu = mu,
                                            .lambda = 2.0 * mu * nu / (1.0 - 2.0 * nu),
                                            .residual = shape.softer * (1.0 + nu) / 3.0 * k,
                                            .damping = k * world->body->damping_time};
        Vec3 rest[NODE_COUNT], area[NODE_COUNT], x[NODE_COUNT], v[NODE_COUNT],
            f[NODE_COUNT] = {{0}};
        for (int i = 0; i < shape.count; i++) {
            rest[i] = vec3_scale(size, shape.rest[i]);
            area[i] = vec3_scale(size * size, shape.area[i]);
            rows_read(&vertices->rows, vertices_row(vertices), node[shape.node[i]], &x[i], &v[i]);
        }
        const Element element = {shape.count, rest, shape.weight, area,
                                 shape.share * size * size * size};
        Quat last = QUAT_NONE;
        *energy += element_forces(&element, &stiffness, x, v, &last, f);
        for (int i = 0; i < shape.count; i++) {
            double *to = force[node[shape.node[i]]];
            to[0] += f[i].x, to[1] += f[i].y, to[2] += f[i].z;
            largest = fmax(largest, vec3_length(f[i]));
        }
    }
    return largest;
}

static void expect_readable(const CutWorld *world, double tolerance, int *partial)
{
    double energy, expected_energy;
    const Vertices *vertices = &world->model->vertices;
    FREED double(*force)[4] = kernel_forces(world, &energy);
    FREED double(*expected)[4] = zeroed((size_t)vertices->count, sizeof *expected);
    const double scale = readable_forces(world, expected, &expected_energy, partial);
    for (int v = 0; v < vertices->count; v++)
        for (int c = 0; c < 3; c++)
            expect_near(force[v][c], expected[v][c], tolerance * scale);
    expect_near(energy / expected_energy, 1.0, tolerance);
}

TEST(a_body_s_forces_are_those_of_its_leaves_while_they_change)
{
    uint64_t random = 71;
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        VoxelWorldOptions options = options_of(true, (Precision)precision);
        options.material.poisson_ratio = 0.3;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        int partial = 0;
        for (int round = 0; round < EFFORT(30); round++) {
            change_some(&world, &random);
            move_vertices(&world, 0.1, &random);
            // Sums over up to eight elements; displacements of 0.1 cells in single precision.
            expect_readable(&world, precision == PRECISION_SINGLE ? 2e-5 : 1e-12, &partial);
        }
        print_message("%d partly filled leaves looked at\n", partial);
        assert_true(partial > EFFORT(30) * 10);
    }
}

// Bits: lanes that had other elements, shapes that fell out of the cache.
TEST(packing_what_changed_leaves_the_bits_of_packing_all)
{
    uint64_t random = 72;
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        VoxelWorldOptions options = options_of(false, (Precision)precision);
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        CutWindows *windows = &world.cuts->windows;
        TemplateCache *cache = &world.cuts->templates;
        const size_t slots = (size_t)1 << cache->slot_bits,
                     lanes = (size_t)windows->capacity[BATCH_HANGING] * LANES;
        for (int round = 0; round < EFFORT(40); round++) {
            double energy[2];
            change_some(&world, &random);
            move_vertices(&world, 0.1, &random);
            FREED double(*before)[4] = kernel_forces(&world, &energy[0]);
            for (size_t k = 0; k < slots; k++)
                cache->key[k] = 0;
            for (size_t k = 0; k < lanes; k++) // no shape at all: every lane is written again
                windows->hanging_shape[k / LANES][k % LANES] = ~(TemplateKey)0;
            cut_windows_restored(windows);
            FREED double(*after)[4] = kernel_forces(&world, &energy[1]);
            assert_memory_equal(before, after,
                                (size_t)world.model->vertices.count * sizeof *before);
            assert_true(energy[0] == energy[1]);
        }
    }
}

// --- stress ---

// All leaves have the stress of a uniform strain, also those that are hardly filled.
TEST(a_uniform_strain_is_the_same_stress_in_every_leaf)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        VoxelWorldOptions options = options_of(true, (Precision)precision);
        options.material.poisson_ratio = 0.3;
        const double strain = 0.1, mu = options.material.youngs_modulus / 2.6,
                     lambda = 2.0 * mu * 0.3 / 0.4;
        // Pulled along x: |P|, and P_xx, the most across any face.
        const double stress = sqrt(pow((2.0 * mu + lambda) * strain, 2.0) +
                                   2.0 * pow(lambda * strain, 2.0)),
                     pull = (2.0 * mu + lambda) * strain;
        for (int side = 0; side < 2; side++) {
            const double near = side == 0 ? 1.001 : 0.999;
            VoxelWorldOptions own = options_of(true, (Precision)precision);
            own.material.poisson_ratio = 0.3;
            own.body.tear_stress = near * pull;
            SCOPED(cut_world_destroy) CutWorld world;
            cut_world_create(&world, &own);
            Vertices *vertices = &world.model->vertices;
            CutLattice *lattice = &world.cuts->lattice;
            for (int v = 0; v < vertices->count; v++) {
                const Vec3 x = rows_rest(&vertices->rows, v);
                if (is_in_use(lattice, v))
                    rows_write(&vertices->rows, vertices->row[vertices->current], v,
                               vec3((1.0 + strain) * x.x, x.y, x.z), vec3(0.0, 0.0, 0.0));
            }
            const VoxelPass pass = voxel_pass(world.model, vertices_row(vertices));
            const size_t batches = (size_t)batch_runs_capacity(world.model->batches);
            FREED uint16_t *high = zeroed(batches, sizeof *high);
            FREED int *stressed = zeroed((size_t)lattice->element_count, sizeof *stressed);
            batch_runs_stress(world.model->batches, &pass, near * stress, BATCHES_ALL, high);
            assert_int_equal(cut_windows_stressed(&world.cuts->windows, high, stressed),
                             side == 0 ? 0 : lattice->leaf_count);
            // And tears by it, or not: across the pull, where cells are on both sides.
            CutTear *tear = &world.cuts->tear;
            assert_true(cut_tear_find(tear, &pass) == (side == 1));
            int partial = 0;
            for (int k = 0; k < tear->hit_count; k++) {
                assert_true(tear->hit[k][0] >= 0 && tear->hit[k][1] == 0);
                assert_true(cut_lattice_beyond(lattice, tear->hit[k][0], 0) >= 0);
                const int leaf = cut_lattice_leaf_of(lattice, tear->hit[k][0]);
                partial += cut_shape_is_partial(lattice, leaf);
            }
            assert_true(partial > 0 || side == 0);
        }
        lattice_destroy(&options.lattice);
    }
}

// --- what hands feel ---

// The matrix for haptic clients at rest is the slope of the forces.
TEST(the_stiffness_around_a_contact_has_that_of_partly_filled_leaves)
{
    uint64_t random = 73;
    VoxelWorldOptions options = options_of(true, PRECISION_DOUBLE);
    options.material.poisson_ratio = 0.3;
    options.body.damping = 0.0;
    SCOPED(cut_world_destroy) CutWorld world;
    SCOPED(arena_destroy) Arena arena = {0};
    cut_world_create(&world, &options);
    Patch *patch = patch_create(world.cuts->lattice.vertex_capacity, "patch", &arena);
    const Region all = {.kind = REGION_CAPSULE, .radius = 1.0};
    patch_begin(patch, &all, 1e6, false); // slow: no mass
    while (!world.body->ops->gather_patch(world.body->model, patch, 3000))
        ;
    assert_false(patch->full);
    // Displacements at random, and differences of forces, exact to 1e-8 of the strain.
    const int count = patch->node_count;
    FREED PatchColumns *x = zeroed((size_t)count, sizeof *x), *y = zeroed((size_t)count, sizeof *y);
    Vertices *vertices = &world.model->vertices;
    const double step = 1e-8 * world.lattice.size;
    for (int i = 0; i < count; i++)
        x[i].of[0] = random_vec3(&random);
    patch_multiply(patch, x, y, 0, patch->block_count);
    double(*force[2])[4], energy, largest = 0.0;
    for (int side = 0; side < 2; side++) {
        for (int i = 0; i < count; i++)
            rows_write(&vertices->rows, vertices->row[vertices->current], patch->node[i],
                       vec3_madd(rows_rest(&vertices->rows, patch->node[i]),
                                 side == 0 ? step : -step, x[i].of[0]),
                       vec3(0.0, 0.0, 0.0));
        force[side] = kernel_forces(&world, &energy);
    }
    for (int i = 0; i < count; i++)
        largest = fmax(largest, vec3_length(y[i].of[0]));
    for (int i = 0; i < count; i++) {
        const double *low = force[0][patch->node[i]], *high = force[1][patch->node[i]];
        const Vec3 slope =
            vec3_scale(0.5 / step, vec3(high[0] - low[0], high[1] - low[1], high[2] - low[2]));
        expect_near(vec3_length(vec3_sub(y[i].of[0], slope)), 0.0, 1e-6 * largest);
    }
    free(force[0]);
    free(force[1]);
}

// --- the leaves ---

// What merging comes to is what the plain reference comes to.
TEST(an_untouched_body_has_the_elements_of_the_reference)
{
    VoxelWorldOptions options = options_of(true, PRECISION_DOUBLE);
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options);
    const CutLattice *lattice = &world.cuts->lattice;
    SCOPED(layout_destroy) Layout layout;
    SCOPED(lattice_mesh_destroy) LatticeMesh mesh;
    voxel_coarse_create(&world.lattice, 2, NULL, &layout, &mesh);
    assert_int_equal(lattice->leaf_count, layout.leaf_count);
    for (int l = 0; l < layout.leaf_count; l++) {
        const Leaf *leaf = &layout.leaf[l];
        int found = -1;
        for (int e = lattice->level_first[leaf->level];
             e < lattice->element_count && lattice->element[e].level == leaf->level; e++) {
            int place[3];
            cut_lattice_place(lattice, e, place);
            if (memcmp(place, leaf->cell, sizeof place) == 0)
                found = e;
        }
        assert_true(found >= 0 && cut_lattice_is_leaf(lattice, found));
        const int *node = cut_lattice_nodes(lattice, found);
        for (int n = 0; n < (leaf->level == 0 ? NODE_CORNERS : NODE_COUNT); n++)
            assert_int_equal(node[n] >= 0, mesh.vertex[l][n] >= 0);
    }
}
