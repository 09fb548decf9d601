// SPDX-License-Identifier: MIT
// The smooth surface of solids: an analytic organ is met by its outer faces, and the sheet of a
// blade by the walls of cuts; lips coincide when they part, and what is published follows from the
// state alone.
#include "test.h"
#include "sim_steps.h"
#include "cut_world.h"

#include "voxel/cut/cut_parts.h"

#include "geometry/generator.h"
#include "sim/follow.h"

// ---------------------------------------------------------------------------------------------
// The organ: two ellipsoids joined smoothly, 13 cm long

static double organ(Vec3 x)
{
    const Vec3 a = vec3(x.x / 0.055, x.y / 0.042, x.z / 0.035);
    const Vec3 b = vec3((x.x - 0.045) / 0.03, (x.y - 0.01) / 0.025, (x.z + 0.005) / 0.022);
    return log(exp(12.0 * (1.0 - vec3_length(a))) + exp(12.0 * (1.0 - vec3_length(b)))) / 12.0;
}

static double ball(Vec3 x)
{
    return 0.05 - vec3_length(x);
}

typedef double Truth(Vec3 x);

static Vec3 gradient(Truth *truth, Vec3 x)
{
    const double e = 1e-6;
    return vec3_scale(0.5 / e,
                      vec3(truth(vec3(x.x + e, x.y, x.z)) - truth(vec3(x.x - e, x.y, x.z)),
                           truth(vec3(x.x, x.y + e, x.z)) - truth(vec3(x.x, x.y - e, x.z)),
                           truth(vec3(x.x, x.y, x.z + e)) - truth(vec3(x.x, x.y, x.z - e))));
}

// Returns the nearest point of its surface.
static Vec3 nearest(Truth *truth, Vec3 x)
{
    for (int step = 0; step < 8; step++) {
        const Vec3 g = gradient(truth, x);
        x = vec3_madd(x, -truth(x) / vec3_dot(g, g), g);
    }
    return x;
}

// ---------------------------------------------------------------------------------------------
// A body made of it

static Vec3 in_cells(const Lattice *lattice, double i, double j, double k)
{
    return vec3(lattice->origin.x + i * lattice->size, lattice->origin.y + j * lattice->size,
                lattice->origin.z + k * lattice->size);
}

static void fill(Lattice *lattice, Truth *truth, double size)
{
    const int count[3] = {(int)(0.15 / size), (int)(0.12 / size), (int)(0.11 / size)};
    assert_true(lattice_create(lattice, count, size, &(Status){0}));
    lattice->origin = vec3(-0.0623, -0.0561, -0.0542);
    for (int k = 0; k < count[2]; k++)
        for (int j = 0; j < count[1]; j++)
            for (int i = 0; i < count[0]; i++)
                lattice->label[lattice_index(lattice, i, j, k)] =
                    truth(in_cells(lattice, i + 0.5, j + 0.5, k + 0.5)) > 0.0;
    assert_true(lattice_crop(lattice, &(Status){0}));
}

// Voxels of `parts` to a cell.
static void make_field(SurfaceField *field, const Lattice *lattice, Truth *truth, int parts)
{
    SolidBlocks blocks = {.low = {-2.0, -2.0, -2.0}};
    size_t voxels = 1;
    for (int a = 0; a < 3; a++) {
        blocks.count[a] = parts * (lattice->count[a] + 4);
        blocks.spacing[a] = 1.0 / parts;
        voxels *= (size_t)blocks.count[a];
    }
    unsigned char *inside = zeroed(voxels, 1), *to = inside;
    for (int k = 0; k < blocks.count[2]; k++)
        for (int j = 0; j < blocks.count[1]; j++)
            for (int i = 0; i < blocks.count[0]; i++)
                *to++ = truth(in_cells(lattice, (i + 0.5) / parts - 2.0, (j + 0.5) / parts - 2.0,
                                       (k + 0.5) / parts - 2.0)) > 0.0;
    blocks.inside = inside;
    surface_field_of_blocks(field, lattice, &blocks);
    free(inside);
}

typedef struct Fitted {
    CutWorld world;
    SurfaceField field;
    Truth *truth;
    float *node; // [3 node_count]
} Fitted;

static void take(Fitted *it)
{
    it->world.body->ops->snapshot(it->world.model, it->node, NULL);
}

static int surface_level; // of bodies that are created: 0, or they adapt

static void create_of(Fitted *it, Truth *truth, Lattice lattice, SurfaceField field)
{
    VoxelWorldOptions options = voxel_world_cube(4);
    lattice_destroy(&options.lattice);
    options.lattice = lattice;
    *it = (Fitted){.field = field, .truth = truth};
    options.body.field = field.value != NULL ? &it->field : NULL;
    options.body.tick = 1e-3;
    options.body.body.precision = PRECISION_SINGLE;
    options.body.body.removable = true;
    options.body.surface_level = surface_level;
    cut_world_create(&it->world, &options);
    it->node = zeroed(3 * (size_t)it->world.body->mesh.node_capacity, sizeof *it->node);
    take(it);
}

static void create(Fitted *it, double size, int parts)
{
    Lattice lattice;
    SurfaceField field = {0};
    fill(&lattice, organ, size);
    if (parts > 0)
        make_field(&field, &lattice, organ, parts);
    create_of(it, organ, lattice, field);
}

static void destroy(Fitted *it)
{
    free(it->node);
    surface_field_destroy(&it->field);
    cut_world_destroy(&it->world);
}

static Vec3 node_of(const Fitted *it, int node)
{
    const float *x = it->node + 3L * node;
    return vec3((double)x[0], (double)x[1], (double)x[2]);
}

// ---------------------------------------------------------------------------------------------
// Measures

typedef struct Figures {
    double rms, normals; // [cells], mean angle [degrees]
    double volume;       // enclosed [m3]
    int triangles;
} Figures;

// Of the triangles [first, end) against what `near` returns for a point, with its normal.
typedef Vec3 Near(const Fitted *it, Vec3 x, Vec3 *normal);

static Figures measure(const Fitted *it, int first, int end, Near *near)
{
    static const double WEIGHT[4][3] = {
        {1.0 / 3, 1.0 / 3, 1.0 / 3}, {0.6, 0.2, 0.2}, {0.2, 0.6, 0.2}, {0.2, 0.2, 0.6}};
    const BodyMesh *mesh = &it->world.body->mesh;
    const double size = it->world.lattice.size;
    Figures out = {.triangles = end - first};
    double area = 0.0;
    for (int t = first; t < end; t++) {
        Vec3 x[3], normal;
        for (int c = 0; c < 3; c++)
            x[c] = node_of(it, mesh->triangle[t][c]);
        const Vec3 n = vec3_scale(0.5, vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0])));
        const double a = vec3_length(n);
        for (int k = 0; k < 4; k++) {
            Vec3 p = vec3_scale(WEIGHT[k][0], x[0]);
            p = vec3_madd(vec3_madd(p, WEIGHT[k][1], x[1]), WEIGHT[k][2], x[2]);
            const double off = vec3_length(vec3_sub(near(it, p, &normal), p)) / size;
            out.rms += 0.25 * a * off * off;
            if (k == 0 && a > 0.0)
                out.normals += a * acos(fmin(1.0, fabs(vec3_dot(n, normal)) / a)) * 180.0 / M_PI;
        }
        area += a;
        out.volume += vec3_dot(x[0], vec3_cross(x[1], x[2])) / 6.0;
    }
    out.rms = sqrt(out.rms / area);
    out.normals /= area;
    return out;
}

static Vec3 near_organ(const Fitted *it, Vec3 x, Vec3 *normal)
{
    const Vec3 y = nearest(it->truth, x);
    *normal = vec3_unit(gradient(it->truth, y));
    return y;
}

// Fails unless triangles run along every edge both ways equally often: a hash of the directed edges
// has the same sum as that of their opposites.
static void expect_closed(const BodyMesh *mesh)
{
    uint64_t forward = 0, backward = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int c = 0; c < 3; c++) {
            const uint64_t a = (uint64_t)mesh->triangle[t][c];
            const uint64_t b = (uint64_t)mesh->triangle[t][(c + 1) % 3];
            uint64_t one = (a << 32 | b) + 1, other = (b << 32 | a) + 1;
            forward += random_bits(&one);
            backward += random_bits(&other);
        }
    assert_true(forward == backward);
}

static long corner_key(const Fitted *it, int node)
{
    const int *n = it->world.lattice.count;
    return it->world.body->mesh.id[node] % ((long)(n[0] + 1) * (n[1] + 1) * (n[2] + 1));
}

// ---------------------------------------------------------------------------------------------
// The outer surface

TEST(fitted_surface_of_an_organ_is_near_it)
{
    // Cells [m], voxels to a cell (0: faces of cells), and bounds: distance [cells], angle.
    static const struct {
        double size;
        int parts;
        double rms, normals;
    } rows[] = {{0.004, 4, 0.06, 6.0}, {0.005, 5, 0.06, 6.0}, {0.005, 1, 0.11, 8.0}};
    for (int k = 0; k < 3; k++) {
        SCOPED(destroy) Fitted blocks, it;
        create(&blocks, rows[k].size, 0);
        create(&it, rows[k].size, rows[k].parts);
        const BodyMesh *mesh = &it.world.body->mesh;
        const Figures old = measure(&blocks, 0, mesh->triangle_count, near_organ);
        const Figures now = measure(&it, 0, mesh->triangle_count, near_organ);
        const double truth = it.field.volume * pow(rows[k].size, 3.0);
        print_message("cells of %g mm, %d voxels each: %.3f cells, %.1f degrees, volume %+.2f %%; "
                      "blocks %.3f, %.1f\n",
                      1e3 * rows[k].size, rows[k].parts, now.rms, now.normals,
                      100.0 * (now.volume / truth - 1.0), old.rms, old.normals);
        assert_true(now.rms < rows[k].rms && now.normals < rows[k].normals);
        assert_true(old.rms > 2.5 * now.rms && old.normals > 40.0);
        expect_near(now.volume, truth, 2e-3 * truth);
        expect_closed(mesh);
    }
}

TEST(fitted_surface_of_a_mesh_is_near_it)
{
    TriMesh mesh;
    Lattice lattice;
    SurfaceField field;
    SCOPED(destroy) Fitted it;
    assert_true(generate_ico_sphere(&mesh, 4, 0.05, &(Status){0}));
    assert_true(voxelise(&lattice, &mesh, 0.005, false, &(Status){0}));
    surface_field_of_mesh(&field, &lattice, &mesh);
    mesh_destroy(&mesh);
    create_of(&it, ball, lattice, field);
    const Figures now = measure(&it, 0, it.world.body->mesh.triangle_count, near_organ);
    print_message("closed mesh: %.3f cells, %.1f degrees\n", now.rms, now.normals);
    assert_true(now.rms < 0.04 && now.normals < 4.0);
}

// Nodes follow vertices as the tissue between them does.
static void follow_affine(void)
{
    SCOPED(destroy) Fitted it;
    create(&it, 0.006, 3);
    Vertices *vertices = &it.world.model->vertices;
    const int nodes = it.world.body->mesh.node_count;
    FREED float *rest = calloc(3 * (size_t)nodes, sizeof *rest);
    memcpy(rest, it.node, 3 * (size_t)nodes * sizeof *rest);
    const double a[3][3] = {{0.3, -0.8, 0.2}, {0.9, 0.4, 0.1}, {-0.1, 0.3, 1.2}};
    for (int i = 0; i < vertices->count; i++) {
        Vec3 x, v;
        void *row = vertices->row[vertices->current];
        rows_read(&vertices->rows, row, i, &x, &v);
        const Vec3 y = vec3(a[0][0] * x.x + a[0][1] * x.y + a[0][2] * x.z + 0.1,
                            a[1][0] * x.x + a[1][1] * x.y + a[1][2] * x.z,
                            a[2][0] * x.x + a[2][1] * x.y + a[2][2] * x.z);
        rows_write(&vertices->rows, row, i, y, v);
    }
    if (it.world.cuts->carry != NULL) {
        cut_carry_forget(it.world.cuts->carry);
        assert_true(cut_carry_count(it.world.cuts->carry) > nodes / 2);
    }
    take(&it);
    double most = 0.0;
    for (int i = 0; i < nodes; i++)
        for (int r = 0; r < 3; r++) {
            double y = r == 0 ? 0.1 : 0.0;
            for (int c = 0; c < 3; c++)
                y += a[r][c] * (double)rest[3 * i + c];
            most = fmax(most, fabs(y - (double)it.node[3 * i + r]));
        }
    print_message("off by %.2g m\n", most);
    expect_near(most, 0.0, 2e-7); // floats of 0.2 m
}

TEST(surface_follows_an_affine_motion)
{
    for (surface_level = 2; surface_level >= 0; surface_level -= 2)
        follow_affine();
    surface_level = 0;
}

// ---------------------------------------------------------------------------------------------
// Cut walls

static const Vec3 NORMAL = {0.62, 0.7, 0.35}, MIDDLE = {0.005, 0.002, 0.0};

static void cut_plane(Fitted *it, Vec3 middle, Vec3 normal)
{
    CutOutcome outcome;
    const Vec3 edge = vec3_cross(normal, vec3(0.3, -0.2, 0.9));
    const CutOptions cut = cut_world_sweep(middle, edge, vec3_cross(normal, edge), 0.2, -0.2, 0.2);
    assert_true(cut_world_cut(&it->world, &cut, &outcome));
}

static void run(Fitted *it, int ticks)
{
    sim_ticks(it->world.sim, ticks);
}

static Vec3 near_plane(const Fitted *it, Vec3 x, Vec3 *normal)
{
    (void)it;
    *normal = vec3_unit(NORMAL);
    return vec3_madd(x, -vec3_dot(*normal, vec3_sub(x, MIDDLE)), *normal);
}

static double sine(double x)
{
    return 0.012 * sin(2.0 * M_PI * x / 0.09);
}

// The sheet y = sine(x), ruled along z; what the blade swept are its chords.
static Vec3 near_sine(const Fitted *it, Vec3 x, Vec3 *normal)
{
    (void)it;
    double best = x.x;
    for (int step = 0; step < 20; step++) { // Newton for the nearest abscissa
        const double k = 2.0 * M_PI / 0.09, s = sine(best), d = 0.012 * k * cos(k * best);
        const double f = best - x.x + (s - x.y) * d, g = 1.0 + d * d - (s - x.y) * k * k * s;
        best -= f / g;
    }
    const double slope = 0.012 * 2.0 * M_PI / 0.09 * cos(2.0 * M_PI * best / 0.09);
    *normal = vec3_unit(vec3(-slope, 1.0, 0.0));
    return vec3(best, sine(best), x.z);
}

// Volume of each side of a sheet, by sampling the organ.
static void true_volumes(bool (*side)(Vec3 x), double volume[2])
{
    const double step = 0.001;
    volume[0] = volume[1] = 0.0;
    for (double x = -0.07; x < 0.09; x += step)
        for (double y = -0.06; y < 0.06; y += step)
            for (double z = -0.05; z < 0.05; z += step) {
                const Vec3 at = vec3(x, y, z);
                if (organ(at) > 0.0)
                    volume[side(at)] += step * step * step;
            }
}

static bool beyond_plane(Vec3 x)
{
    return vec3_dot(NORMAL, vec3_sub(x, MIDDLE)) > 0.0;
}

static bool beyond_sine(Vec3 x)
{
    return x.y > sine(x.x);
}

// Volumes of the pieces as published.
static void expect_volumes(const Fitted *it, bool (*side)(Vec3 x))
{
    const BodyMesh *mesh = &it->world.body->mesh;
    double truth[2], piece[2] = {0.0};
    true_volumes(side, truth);
    assert_int_equal(body_count_pieces(mesh), 2);
    const int first = mesh->piece[mesh->triangle[0][0]];
    for (int t = 0; t < mesh->triangle_count; t++) {
        Vec3 x[3];
        for (int c = 0; c < 3; c++)
            x[c] = node_of(it, mesh->triangle[t][c]);
        piece[mesh->piece[mesh->triangle[t][0]] != first] +=
            vec3_dot(x[0], vec3_cross(x[1], x[2])) / 6.0;
    }
    const int swapped = fabs(piece[0] - truth[0]) > fabs(piece[0] - truth[1]);
    for (int k = 0; k < 2; k++) {
        print_message("piece of %.2f cm3: off by %.2f %%\n", 1e6 * truth[k ^ swapped],
                      100.0 * (piece[k] / truth[k ^ swapped] - 1.0));
        expect_near(piece[k], truth[k ^ swapped], 0.02 * truth[k ^ swapped]);
    }
}

TEST(walls_lie_on_the_sheet_of_the_blade)
{
    for (int curved = 0; curved < 2; curved++) {
        SCOPED(destroy) Fitted it;
        create(&it, 0.005, 5);
        const BodyMesh *mesh = &it.world.body->mesh;
        const int outer = mesh->triangle_count;
        assert_int_equal(mesh->first_wall, outer);
        if (curved == 0)
            cut_plane(&it, MIDDLE, NORMAL);
        for (double x = -0.1; curved == 1 && x < 0.1; x += 0.004) {
            CutOutcome outcome;
            CutOptions cut = {.body = 0};
            for (int k = 0; k < 2; k++) {
                cut.before.end[k] = vec3(x, sine(x), k == 0 ? -0.1 : 0.1);
                cut.after.end[k] = vec3(x + 0.004, sine(x + 0.004), k == 0 ? -0.1 : 0.1);
            }
            cut_world_cut(&it.world, &cut, &outcome);
        }
        run(&it, 60); // divisions that wait
        take(&it);
        const Figures wall =
            measure(&it, outer, mesh->triangle_count, curved ? near_sine : near_plane);
        const Figures skin = measure(&it, 0, outer, near_organ);
        print_message("%s: wall of %d triangles %.3f cells, %.1f degrees; outer surface %.3f\n",
                      curved ? "curved" : "plane", wall.triangles, wall.rms, wall.normals,
                      skin.rms);
        assert_true(wall.triangles > 500);
        assert_true(wall.rms < 0.05 && wall.normals < 6.0);
        assert_true(skin.rms < 0.08);
        expect_closed(mesh);
        expect_volumes(&it, curved ? beyond_sine : beyond_plane);
    }
}

// ---------------------------------------------------------------------------------------------
// The moment of a cut, and what follows from the state

// What clients see after the current tick.
static void show(Fitted *it, float *out)
{
    const BodyMesh *mesh = &it->world.body->mesh;
    const BodyFit *fit = &mesh->fit;
    FREED float *row = zeroed(3 * (size_t)fit->row_count, sizeof *row);
    FREED double *scratch = zeroed(FIT_SCRATCH * (size_t)fit->row_count, sizeof *scratch);
    it->world.body->ops->snapshot_rows(it->world.model, row, NULL);
    fit_nodes(fit, mesh->node_count, row, scratch, out);
    fit_fade(fit, it->world.body->step + 1, row, out);
}

static void part_lips(void)
{
    SCOPED(destroy) Fitted it;
    uint64_t seed = 5;
    create(&it, 0.005, 5);
    cut_world_shake(&it.world, 1.5, &seed); // strains of 0.2
    const BodyMesh *mesh = &it.world.body->mesh;
    const double size = it.world.lattice.size;
    const int before = mesh->node_count;
    FREED float *was = calloc(3 * (size_t)mesh->node_capacity, sizeof *was);
    show(&it, was);
    cut_plane(&it, MIDDLE, NORMAL);
    show(&it, it.node);
    double jump = 0.0, lips = 0.0, later = 0.0;
    int pairs = 0;
    for (int i = 0; i < before; i++)
        for (int c = 0; c < 3; c++)
            jump = fmax(jump, fabs((double)it.node[3 * i + c] - (double)was[3 * i + c]) / size);
    assert_true(mesh->fit.fade_count > 100);
    FREED float *ended = calloc(3 * (size_t)mesh->node_capacity, sizeof *ended);
    it.world.body->ops->snapshot(it.world.model, ended, NULL);
    for (int i = before; i < mesh->node_count; i++)
        for (int j = 0; j < i; j++) {
            if (corner_key(&it, i) != corner_key(&it, j))
                continue;
            const Vec3 apart = vec3_sub(node_of(&it, i), node_of(&it, j));
            lips = fmax(lips, vec3_length(apart) / size);
            for (int c = 0; c < 3; c++)
                later =
                    fmax(later, fabs((double)ended[3 * i + c] - (double)ended[3 * j + c]) / size);
            pairs++;
        }
    print_message("%d pairs apart by %.2g cells, nodes jump by %.2g; without fades %.2g\n", pairs,
                  lips, jump, later);
    assert_true(pairs > 50);
    expect_near(lips, 0.0, 1e-6);
    expect_near(jump, 0.0, 2e-5); // floats of 0.1 m, four of them added
    assert_true(later > 1e-3);    // there is something to hide
}

TEST(lips_coincide_at_the_tick_of_the_cut)
{
    for (surface_level = 2; surface_level >= 0; surface_level -= 2)
        part_lips();
    surface_level = 0;
}

static void divide_all(CutWorld *world)
{
    const CutLattice *lattice = &world->cuts->lattice;
    FREED int *leaf = malloc((size_t)lattice->element_count * sizeof *leaf);
    int count = 0;
    for (int e = lattice->level_first[1]; e < lattice->element_count; e++)
        if (cut_lattice_is_leaf(lattice, e))
            leaf[count++] = e;
    cut_world_divide(world, leaf, count);
}

// Merges all that can where vertices move by less than 0.3 of a cell.
static bool merge_all(Sim *sim, int b, void *context, TopologyChange *change)
{
    VoxelCuts *cuts = context;
    CutLattice *lattice = &cuts->lattice;
    for (int e = lattice->level_first[1]; e < lattice->element_count; e++)
        if (cut_lattice_can_merge(lattice, e) && cut_masses_residual(&cuts->masses, e) < 0.3)
            cut_lattice_merge(lattice, e);
    return cut_body_follow(cuts, &sim->body[b], true, false, change);
}

// What is shown does not jump where elements merge either: it goes on from where it was.
TEST(no_node_jumps_where_elements_merge)
{
    uint64_t seed = 6;
    surface_level = 2;
    SCOPED(destroy) Fitted it;
    create(&it, 0.006, 3);
    surface_level = 0;
    VoxelCuts *cuts = it.world.cuts;
    for (int k = 0; k < 2; k++)
        divide_all(&it.world);
    assert_int_equal(cuts->lattice.leaf_count, cuts->lattice.leaf_at_level[0]);
    cut_world_shake(&it.world, 0.4, &seed);
    const size_t numbers = 3 * (size_t)it.world.body->mesh.node_count;
    FREED float *was = calloc(numbers, sizeof *was), *ended = calloc(numbers, sizeof *ended);
    show(&it, was);
    const int leaves = cuts->lattice.leaf_count;
    change_body(it.world.sim, 0, merge_all, cuts);
    assert_true(cuts->lattice.leaf_count < leaves - 100);
    show(&it, it.node);
    it.world.body->ops->snapshot(it.world.model, ended, NULL);
    double jump = 0.0, hidden = 0.0;
    for (size_t i = 0; i < numbers; i++) {
        jump = fmax(jump, fabs((double)it.node[i] - (double)was[i]));
        hidden = fmax(hidden, fabs((double)ended[i] - (double)was[i]));
    }
    print_message("nodes jump by %.2g cells, without fades %.2g; %d fade\n",
                  jump / it.world.lattice.size, hidden / it.world.lattice.size,
                  it.world.body->mesh.fit.fade_count);
    assert_true(hidden > 0.03 * it.world.lattice.size);
    // What is left: gradients around nodes, which change a little too.
    expect_at_most(jump, 0.3 * hidden);
}

static bool burr_once(Sim *sim, int b, void *context, TopologyChange *change)
{
    RemovalOutcome outcome;
    return sim->body[b].ops->remove(&sim->body[b], context, &outcome, change);
}

// Takes away all that a burr touches.
static void burr(Fitted *it, Vec3 at, double radius)
{
    Removal removal = {.kind = REMOVER_DRILL,
                       .mouth = {.kind = REGION_CAPSULE, .from = at, .to = at, .radius = radius},
                       .volume = (double)INFINITY,
                       .tick = 1e-3};
    for (int before = -1; before != it->world.cuts->present;) {
        before = it->world.cuts->present;
        change_body(it->world.sim, 0, burr_once, &removal);
    }
}

// Nodes of the hole that are not on the outer surface, too.
TEST(a_burr_leaves_a_smooth_hole)
{
    SCOPED(destroy) Fitted it;
    create(&it, 0.004, 5);
    const double size = it.world.lattice.size, radius = 0.0163;
    const Vec3 at = vec3(0.005, -0.034, 0.002);
    burr(&it, at, radius);
    take(&it);
    const BodyMesh *mesh = &it.world.body->mesh;
    const CutFit *fit = it.world.cuts->fit;
    double square = 0.0, most = 0.0;
    int count = 0;
    for (int i = 0; i < mesh->node_count; i++) {
        int point[3];
        const int vertex = it.world.cuts->faces.slot_vertex[i];
        cut_lattice_point(&it.world.cuts->lattice, vertex, point);
        if (mesh->id[i] < 0 ||
            fit->is_outer[cut_parts_index(it.world.cuts->lattice.scratch, point)])
            continue;
        const double off =
            (vec3_length(vec3_sub(node_of(&it, i), at)) - radius - 0.87 * size) / size;
        square += off * off;
        most = fmax(most, fabs(off));
        count++;
    }
    print_message("%d nodes off the ball by %.3f cells rms, %.3f at most\n", count,
                  sqrt(square / count), most);
    assert_true(count > 100);
    expect_at_most(sqrt(square / count), 0.1);
}

static void cut_twice(Fitted *it, bool other_first)
{
    const Vec3 normal = vec3(-0.3, 0.9, 0.2), middle = vec3(0.0, 0.004, 0.003);
    for (int k = 0; k < 2; k++) {
        if ((k == 0) == other_first)
            cut_plane(it, middle, normal);
        else
            cut_plane(it, MIDDLE, NORMAL);
        run(it, 30);
    }
}

static int by_id(const void *a, const void *b)
{
    const float *x = a, *y = b;
    return memcmp(x, y, 4 * sizeof *x);
}

// Crossing cuts in either order; of a body at rest, so that its vertices are where they were.
TEST(order_of_cuts_does_not_matter)
{
    float *row[2];
    int count[2];
    for (int k = 0; k < 2; k++) {
        SCOPED(destroy) Fitted it;
        create(&it, 0.005, 5);
        cut_twice(&it, k == 1);
        take(&it);
        const BodyMesh *mesh = &it.world.body->mesh;
        count[k] = mesh->node_count;
        row[k] = zeroed(4 * (size_t)count[k], sizeof *row[k]);
        for (int i = 0; i < count[k]; i++) {
            memcpy(row[k] + 4L * i, &mesh->id[i], sizeof(int));
            memcpy(row[k] + 4L * i + 1, it.node + 3L * i, 3 * sizeof(float));
        }
        qsort(row[k], (size_t)count[k], 4 * sizeof(float), by_id);
    }
    assert_int_equal(count[0], count[1]);
    // A link that both cut keeps the crossing of the first: a few points along the crossing line.
    int differ = 0;
    for (int i = 0; i < count[0]; i++)
        differ += memcmp(row[0] + 4L * i, row[1] + 4L * i, 4 * sizeof(float)) != 0;
    print_message("%d of %d nodes differ\n", differ, count[0]);
    assert_true(differ < count[0] / 20);
    free(row[0]);
    free(row[1]);
}

static void check_brought_back(Fitted *it, Fitted *again)
{
    const BodyMesh *mesh = &it->world.body->mesh, *other = &again->world.body->mesh;
    FREED void *block = copy_state(&it->world.state);
    state_copy_in(&again->world.state, block);
    again->world.body->ops->restored(again->world.body);
    again->world.body->step = it->world.body->step;
    FREED void *kept = copy_state(&again->world.state); // deriving changes no state
    assert_memory_equal(kept, block, state_bytes(&again->world.state));
    assert_int_equal(mesh->node_count, other->node_count);
    assert_int_equal(mesh->fit.fade_count, other->fit.fade_count);
    assert_true(mesh->fit.fade_count > 0);
    assert_memory_equal(mesh->triangle, other->triangle,
                        (size_t)mesh->triangle_count * sizeof *mesh->triangle);
    show(it, it->node);
    show(again, again->node);
    assert_memory_equal(it->node, again->node, 3 * (size_t)mesh->node_count * sizeof *it->node);
}

TEST(state_that_was_brought_back_shows_the_same)
{
    uint64_t seed = 9;
    for (int adapts = 0; adapts <= 1; adapts++) {
        SCOPED(destroy) Fitted it, again;
        surface_level = 2 * adapts;
        create(&it, 0.005, 5);
        create(&again, 0.005, 5);
        surface_level = 0;
        cut_world_shake(&it.world, 0.7, &seed);
        if (adapts) {
            cut_plane(&it, MIDDLE, NORMAL);
            run(&it, 1); // most of the cut's faces are in larger elements yet
        } else {
            cut_twice(&it, false); // the last fades are under way
            burr(&it, vec3(0.01, -0.03, 0.0), 0.012);
        }
        check_brought_back(&it, &again);
    }
}
