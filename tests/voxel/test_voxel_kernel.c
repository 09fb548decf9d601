// SPDX-License-Identifier: MIT
// Every variant of the voxel kernels, in both precisions and at every instruction-set level that
// this machine can run: the forces of element.c, the same bits at all levels, balance, rest.
#include "test.h"
#include "effort.h"
#include "random.h"

#include "voxel/batch.h"
#include "voxel/layout.h"
#include "voxel/lattice_mesh.h"
#include "voxel/template.h"

enum { CLASSES = 12 };
static const double SIZE = 3e-3; // edge of the smallest elements [m]

// The laws, damped and not; viscous damping of the paper's law is that of all but the rigid motion.
// The last ones stiffen, below and beyond the cap in the strains of these tests.
enum { UNDAMPED, DAMPED, VISCOUS };
typedef struct Variant {
    VoxelLaw law;
    int damping;
    Stiffening stiffening;
} Variant;
static const Variant VARIANTS[] = {
    {.law = VOXEL_AFFINE},
    {.law = VOXEL_AFFINE, .damping = DAMPED},
    {.law = VOXEL_MIYAZAKI2004},
    {.law = VOXEL_MIYAZAKI2004, .damping = DAMPED},
    {.law = VOXEL_AFFINE, .damping = VISCOUS},
    {.law = VOXEL_AFFINE, .stiffening = {0.3, 10.0}},
    {.law = VOXEL_AFFINE, .damping = DAMPED, .stiffening = {0.5, 3.0}},
    {.law = VOXEL_AFFINE, .damping = VISCOUS, .stiffening = {0.2, 100.0}}};
#define EACH_VARIANT(v)                                                                            \
    for (const Variant *v = VARIANTS; v < VARIANTS + sizeof VARIANTS / sizeof *VARIANTS; v++)

// What a kernel works on, and where everything is at rest.
typedef struct Problem {
    VoxelLaw law;
    bool damped, viscous;
    Stiffening stiffening;
    int element_count, vertex_count; // without the spare one
    int (*vertex)[NODE_COUNT];
    int *element_class;
    ElementClass classes[CLASSES]; // by level and material
    double (*row)[ROW];            // [vertex_count + 1] numbers that fit into float
    Quat *last;                    // [element]
    Arena arena;
    Batches batches;
    const RestTable *tables[PRECISION_COUNT];
} Problem;

static ElementClass class_of(int level, int material, VoxelLaw law, bool damped)
{
    const double size = SIZE * (1 << level), mu = material == 0 ? 5e3 : 1.3e4;
    ElementClass c = {.size = size,
                      .mu = mu,
                      .lambda = material == 0 ? 0.0 : 2.0 * mu,
                      .residual = mu * size / (law == VOXEL_AFFINE ? 2.2 : 1.0),
                      .share = 1.0};
    c.damping = damped ? 3e-4 * c.residual : 0.0;
    return c;
}

static void prepare(Problem *p)
{
    for (int k = 0; k < CLASSES; k++)
        p->classes[k] = class_of(k / 2, k % 2, p->law, p->damped);
    p->row = zeroed((size_t)p->vertex_count + 1, sizeof *p->row);
    p->last = zeroed((size_t)p->element_count, sizeof *p->last);
    for (int e = 0; e < p->element_count; e++)
        p->last[e] = (Quat){1.0, 0.0, 0.0, 0.0};
    const BatchOptions options = {
        "test",           p->element_count, (const int(*)[NODE_COUNT])p->vertex,
        p->element_class, p->classes,       p->vertex_count};
    batches_create(&p->batches, &options, &p->arena);
    for (int k = 0; k < PRECISION_COUNT; k++)
        p->tables[k] = voxel_tables_create(&p->batches, p->law, (Precision)k, "test", &p->arena);
}

static void destroy(Problem *p)
{
    arena_destroy(&p->arena);
    free(p->vertex);
    free(p->element_class);
    free(p->row);
    free(p->last);
}

static Problem problem_of(const Variant *v)
{
    return (Problem){.law = v->law,
                     .damped = v->damping != UNDAMPED,
                     .viscous = v->damping == VISCOUS,
                     .stiffening = v->stiffening};
}

// A graded cube of `cells`^3 cells, elements of two materials mixed at random.
static void make_cube(Problem *p, int cells, int levels, const Variant *v)
{
    *p = problem_of(v);
    SCOPED(lattice_destroy) Lattice lattice = {0};
    SCOPED(layout_destroy) Layout layout;
    SCOPED(lattice_mesh_destroy) LatticeMesh mesh;
    const int count[3] = {cells, cells, cells};
    assert_true(lattice_box(&lattice, count, SIZE, &(Status){0}));
    layout_create(&layout, &lattice, levels);
    assert_true(lattice_mesh_create(&mesh, &layout, &(Status){0}));
    p->element_count = mesh.element_count;
    p->vertex_count = mesh.vertex_count;
    p->vertex = zeroed((size_t)p->element_count, sizeof *p->vertex);
    p->element_class = zeroed((size_t)p->element_count, sizeof *p->element_class);
    uint64_t random = 77;
    for (int e = 0; e < p->element_count; e++) {
        memcpy(p->vertex[e], mesh.vertex[e], sizeof p->vertex[e]);
        p->element_class[e] = 2 * layout.leaf[e].level + random_below(&random, 2);
    }
    prepare(p);
}

// Elements that share no vertex: cubes and random rest shapes in turn.
static void make_loose(Problem *p, int count, const Variant *v, uint64_t *random)
{
    *p = problem_of(v);
    p->element_count = count;
    p->vertex = zeroed((size_t)count, sizeof *p->vertex);
    p->element_class = zeroed((size_t)count, sizeof *p->element_class);
    unsigned mask = 0;
    for (int e = 0; e < count; e++) {
        if (e % 20 == 0) // so that batches are not all padding
            mask = (unsigned)random_bits(random) & (unsigned)random_bits(random);
        p->element_class[e] = random_below(random, CLASSES);
        for (int n = 0; n < NODE_COUNT; n++) {
            bool present = n < NODE_CORNERS || (e % 2 != 0 && (mask >> (n - NODE_CORNERS) & 1));
            p->vertex[e][n] = present ? p->vertex_count++ : -1;
        }
    }
    prepare(p);
}

// Vectors of one element's vertices.
typedef struct Shape {
    Element element;
    Vec3 rest[NODE_COUNT], area[NODE_COUNT];
    double weight[NODE_COUNT];
    int vertex[NODE_COUNT];
} Shape;

static void shape_of(const Problem *p, int e, Shape *out)
{
    Template t;
    unsigned mask = 0;
    for (int n = NODE_CORNERS; n < NODE_COUNT; n++)
        mask |= p->vertex[e][n] >= 0 ? 1u << (n - NODE_CORNERS) : 0u;
    template_create(&t, mask);
    const double size = p->classes[p->element_class[e]].size;
    for (int i = 0; i < t.count; i++) {
        out->rest[i] = vec3_scale(size, t.rest[i]);
        out->area[i] = vec3_scale(size * size, t.area[i]);
        out->weight[i] = p->law == VOXEL_AFFINE ? t.weight[i] : 1.0;
        out->vertex[i] = p->vertex[e][t.node[i]];
    }
    out->element = (Element){t.count, out->rest, out->weight, out->area, size * size * size};
}

static Vec3 vector_at(const double *from)
{
    return vec3(from[0], from[1], from[2]);
}

static void put_vector(double *to, Vec3 a)
{
    // Rounded, so that both precisions see the same state.
    to[0] = (double)(float)a.x, to[1] = (double)(float)a.y, to[2] = (double)(float)a.z;
}

// Forces of element.c and what they are measured by: the largest force of an element deformed by
// its own size, and of its velocities.
static void expected_forces(Problem *p, double (*force)[3], double *scale)
{
    *scale = 0.0;
    for (int e = 0; e < p->element_count; e++) {
        Shape s;
        shape_of(p, e, &s);
        const ElementClass *c = &p->classes[p->element_class[e]];
        const bool viscous = p->viscous && p->law == VOXEL_AFFINE;
        const ElementStiffness stiffness = {.law = p->law,
                                            .mu = c->mu,
                                            .lambda = c->lambda,
                                            .residual = c->residual,
                                            .damping = c->damping,
                                            .damping_time =
                                                viscous ? c->damping / (c->mu * c->size) : 0.0,
                                            .stiffening = p->stiffening};
        Vec3 position[NODE_COUNT], velocity[NODE_COUNT], f[NODE_COUNT] = {{0}};
        double fastest = 0.0;
        for (int i = 0; i < s.element.count; i++) {
            position[i] = vec3_add(s.rest[i], vector_at(p->row[s.vertex[i]]));
            velocity[i] = vector_at(p->row[s.vertex[i]] + 4);
            fastest = fmax(fastest, vec3_length(velocity[i]));
        }
        element_forces(&s.element, &stiffness, position, velocity, &p->last[e], f);
        for (int i = 0; i < s.element.count; i++) {
            force[s.vertex[i]][0] += f[i].x;
            force[s.vertex[i]][1] += f[i].y;
            force[s.vertex[i]][2] += f[i].z;
        }
        *scale = fmax(*scale, stiffening_cap(&p->stiffening) * c->residual * c->size +
                                  c->damping * fastest);
    }
}

// What one evaluation leaves behind.
typedef struct Result {
    double (*force)[4];
    double (*last)[LANES][4];
    size_t force_bytes, last_bytes;
} Result;

static void result_destroy(Result *result)
{
    free(result->force);
    free(result->last);
}

static Result run(const Problem *p, const VoxelKernels *kernels, double start)
{
    const bool single = kernels->precision == PRECISION_SINGLE;
    const size_t vertices = (size_t)p->vertex_count + 1, real = single ? 4 : 8;
    Result r = {.force_bytes = vertices * sizeof *r.force};
    int batches = batches_total(&p->batches);
    r.last_bytes = (size_t)batches * sizeof *r.last;
    r.force = zeroed(vertices, sizeof *r.force);
    r.last = zeroed((size_t)batches, sizeof *r.last);
    for (int b = 0; b < batches * LANES; b++)
        r.last[b / LANES][b % LANES][0] = start;
    // Rows are whole cache lines in the server; here they may lie anywhere.
    void *rows = zeroed(vertices * ROW, real), *force = zeroed(vertices * 4, real);
    for (size_t i = 0; i < vertices * ROW; i++) {
        double value = i < (vertices - 1) * ROW ? p->row[i / ROW][i % ROW] : 0.0;
        if (single)
            ((float *)rows)[i] = (float)value;
        else
            ((double *)rows)[i] = value;
    }
    const VoxelStiffening stiffening = {p->stiffening.strain,
                                        stiffening_curve(fmax(p->stiffening.cap, 1.0))};
    const VoxelPass pass = {
        .plain = &p->batches.plain,
        .hanging = &p->batches.hanging,
        .tables = p->tables[kernels->precision],
        .classes = p->batches.classes,
        .law = p->law,
        .damped = p->damped,
        .viscous = p->viscous,
        .stiffening = stiffening_is_on(&p->stiffening) ? &stiffening : NULL,
        .rows = rows,
        .force = force,
        .last = r.last,
        .stiffness_scale = 1.0,
        .damping_scale = 1.0,
    };
    kernels->evaluate(&pass);
    for (size_t i = 0; i < vertices * 4; i++)
        r.force[i / 4][i % 4] = single ? (double)((float *)force)[i] : ((double *)force)[i];
    free(rows);
    free(force);
    return r;
}

// All levels of both precisions: the same bits in each, and within tolerance [precision] (relative
// to `scale`, or to the largest force if that is 0) of what is expected.
static void expect_forces(Problem *p, const char *what, const double tolerance[PRECISION_COUNT])
{
    double(*expected)[3] = zeroed((size_t)p->vertex_count, sizeof *expected), scale;
    expected_forces(p, expected, &scale);
    for (int k = 0; k < PRECISION_COUNT; k++) {
        SCOPED(result_destroy) Result first = {0};
        double worst = 0.0;
        for (const char *const *level = isa_available(); *level != NULL; level++) {
            const VoxelKernels *kernels = voxel_kernels_find((Precision)k, *level);
            assert_non_null(kernels);
            assert_string_equal(kernels->level, *level);
            Result r = run(p, kernels, 1.0);
            if (first.force == NULL) {
                first = r;
                continue;
            }
            assert_memory_equal(r.force, first.force, r.force_bytes);
            assert_memory_equal(r.last, first.last, r.last_bytes);
            result_destroy(&r);
        }
        for (int i = 0; i < p->vertex_count; i++)
            for (int c = 0; c < 3; c++)
                worst = fmax(worst, isfinite(first.force[i][c])
                                        ? fabs(first.force[i][c] - expected[i][c]) / scale
                                        : HUGE_VAL);
        print_message("%s, %s, %s, %s: off by %.2g\n", what,
                      p->law != VOXEL_AFFINE             ? "paper's"
                      : stiffening_is_on(&p->stiffening) ? "stiffening"
                                                         : "affine",
                      p->viscous  ? "viscous"
                      : p->damped ? "damped"
                                  : "undamped",
                      k == PRECISION_SINGLE ? "single" : "double", worst);
        expect_at_most(worst, tolerance[k]);
    }
    free(expected);
}

// u of a place X under x -> turn X + noise.
static void move_vertices(Problem *p, Quat turn, double noise, uint64_t *random)
{
    Vec3 shift = vec3_scale(SIZE, random_vec3(random)), spin = random_vec3(random);
    FREED bool *done = zeroed((size_t)p->vertex_count, sizeof *done);
    for (int e = 0; e < p->element_count; e++) {
        Shape s;
        shape_of(p, e, &s);
        for (int i = 0; i < s.element.count; i++) {
            double *row = p->row[s.vertex[i]];
            if (done[s.vertex[i]])
                continue;
            done[s.vertex[i]] = true;
            Vec3 u = vec3_sub(quat_rotate(turn, s.rest[i]), s.rest[i]);
            u = vec3_madd(vec3_add(u, shift), noise * SIZE, random_vec3(random));
            put_vector(row, u);
            put_vector(row + 4, vec3_madd(vec3_cross(spin, s.rest[i]), 0.01, random_vec3(random)));
        }
    }
}

static const Quat STILL = {1.0, 0.0, 0.0, 0.0};

// Some hundred operations with numbers of the size of F and its squares, up to 30 after half a
// turn: a few dozen times rounding, of the force that an element would have if deformed by its own
// size.
static const double CLOSE[PRECISION_COUNT] = {
    [PRECISION_DOUBLE] = 3e-14, [PRECISION_SINGLE] = 4e-6};

TEST(graded_cube_has_the_forces_of_its_elements)
{
    uint64_t random = 5;
    EACH_VARIANT(v)
    {
        SCOPED(destroy) Problem p;
        make_cube(&p, 16, 2, v);
        assert_in_range(p.batches.template_count, 26, 60);
        move_vertices(&p, STILL, 0.3, &random);
        expect_forces(&p, "cube", CLOSE);
    }
}

TEST(any_rest_shape_and_turn_has_the_forces_of_the_element)
{
    uint64_t random = 6;
    EACH_VARIANT(v)
    {
        SCOPED(destroy) Problem p;
        make_loose(&p, EFFORT(600), v, &random);
        for (int round = 0; round < 4; round++) {
            // up to half a turn about any axis
            Vec3 axis = vec3_unit(random_vec3(&random));
            move_vertices(&p, quat_from_rotation(vec3_scale(round * 3.14159 / 3.0, axis)), 0.2,
                          &random);
            expect_forces(&p, "turned", CLOSE);
        }
    }
}

// What the fast path cannot do stands among what it can.
static void deform_badly(Problem *p, bool only_unique, uint64_t *random)
{
    for (int e = 0; e < p->element_count; e++) {
        Shape s;
        shape_of(p, e, &s);
        const double size = p->classes[p->element_class[e]].size;
        int kind = random_below(random, only_unique ? 6 : 10);
        Vec3 stretch = kind == 1   ? vec3(1.0, 0.9, 0.0)    // flat
                       : kind == 2 ? vec3(1.1, 1.0, -0.5)   // inverted
                       : kind == 3 ? vec3(1.3, 0.06, 0.05)  // a needle
                       : kind == 4 ? vec3(0.07, 0.1, 0.06)  // shrunk
                       : kind == 5 ? vec3(1.0, 0.9, 0.25)   // crushed
                       : kind == 6 ? vec3(1.0, 0.0, 0.0)    // a line
                       : kind == 7 ? vec3(0.0, 0.0, 0.0)    // a point
                       : kind == 8 ? vec3(1.0, 1.0, -1.0)   // mirrored
                       : kind == 9 ? vec3(-1.0, -1.0, -1.0) // turned inside out
                                   : vec3(1.05, 1.0, 0.95);
        Quat turn = quat_from_rotation(random_vec3(random));
        double noise = kind >= 6 || kind == 3 || kind == 4 ? 0.0 : 0.05;
        for (int i = 0; i < s.element.count; i++) {
            Vec3 x = s.rest[i];
            x = vec3(stretch.x * x.x, stretch.y * x.y, stretch.z * x.z);
            x = vec3_madd(quat_rotate(turn, x), noise * size, random_vec3(random));
            double *row = p->row[s.vertex[i]];
            put_vector(row, vec3_sub(x, s.rest[i]));
            put_vector(row + 4, vec3_scale(0.01, random_vec3(random)));
        }
    }
}

TEST(flat_and_inverted_elements_among_others_have_their_forces)
{
    // As above; smaller numbers (zeta, moments of inertia of needles) come from differences.
    static const double tolerance[PRECISION_COUNT] = {
        [PRECISION_DOUBLE] = 1e-13, [PRECISION_SINGLE] = 2e-5};
    uint64_t random = 9;
    EACH_VARIANT(v)
    {
        SCOPED(destroy) Problem p;
        make_loose(&p, EFFORT(600), v, &random);
        deform_badly(&p, true, &random);
        expect_forces(&p, "bad", tolerance);
    }
}

TEST(no_state_gives_a_resultant_or_moment)
{
    uint64_t random = 10;
    EACH_VARIANT(v)
    {
        SCOPED(destroy) Problem p;
        make_loose(&p, EFFORT(600), v, &random);
        deform_badly(&p, false, &random);
        SCOPED(result_destroy)
        Result r = run(&p, voxel_kernels_find(PRECISION_DOUBLE, "auto"), 1.0);
        double worst = 0.0;
        for (int e = 0; e < p.element_count; e++) {
            Shape s;
            shape_of(&p, e, &s);
            Vec3 sum = {0.0, 0.0, 0.0}, moment = sum;
            double size = 0.0, arm = p.classes[p.element_class[e]].size;
            for (int i = 0; i < s.element.count; i++) {
                Vec3 f = vector_at(r.force[s.vertex[i]]);
                Vec3 x = vec3_add(s.rest[i], vector_at(p.row[s.vertex[i]]));
                sum = vec3_add(sum, f);
                moment = vec3_add(moment, vec3_cross(x, f));
                size += vec3_length(f);
            }
            // An element all of whose forces are rounding has nothing to compare with.
            size += 1e-3 * p.classes[p.element_class[e]].residual * arm;
            worst = fmax(worst, vec3_length(sum) / size);
            worst = fmax(worst, vec3_length(moment) / (size * arm));
        }
        print_message("balance: off by %.2g\n", worst);
        // Rounding. The spin of a line of the width of rounding about itself is not known: its
        // moment, a 1e-8th of that of the other velocities, is left over. Damping's part in all
        // forces is about a 1e-3rd here.
        expect_at_most(worst, v->damping != UNDAMPED ? 3e-11 : 1e-12);
    }
}

TEST(healthy_elements_leave_the_last_rotations_alone)
{
    uint64_t random = 11;
    SCOPED(destroy) Problem p;
    make_cube(&p, 16, 2, &VARIANTS[1]);
    move_vertices(&p, STILL, 0.2, &random);
    for (int k = 0; k < PRECISION_COUNT; k++)
        for (const char *const *level = isa_available(); *level != NULL; level++) {
            SCOPED(result_destroy)
            Result r = run(&p, voxel_kernels_find((Precision)k, *level), (double)NAN);
            for (int b = 0; b < batches_total(&p.batches) * LANES; b++) {
                assert_true(isnan(r.last[b / LANES][b % LANES][0]));
                assert_true(r.last[b / LANES][b % LANES][1] == 0.0);
            }
            for (int i = 0; i < p.vertex_count; i++)
                assert_true(isfinite(r.force[i][0] + r.force[i][1] + r.force[i][2]));
        }
}

// Near rest single precision knows forces relative to the deformation, not to the element: errors
// relative to the largest force stay the same down to strains far below rounding of 1 + strain.
TEST(single_precision_is_relative_to_the_deformation)
{
    for (double noise = 1e-2; noise > 1e-10; noise *= 0.01) {
        uint64_t random = 12;
        SCOPED(destroy) Problem p;
        make_cube(&p, 8, 1, &VARIANTS[0]);
        for (int i = 0; i < p.vertex_count; i++)
            put_vector(p.row[i], vec3_scale(noise * SIZE, random_vec3(&random)));
        double(*expected)[3] = zeroed((size_t)p.vertex_count, sizeof *expected), scale;
        expected_forces(&p, expected, &scale);
        SCOPED(result_destroy)
        Result r = run(&p, voxel_kernels_find(PRECISION_SINGLE, "auto"), 1.0);
        double worst = 0.0, largest = 0.0;
        for (int i = 0; i < p.vertex_count; i++)
            for (int c = 0; c < 3; c++) {
                worst = fmax(worst, fabs(r.force[i][c] - expected[i][c]));
                largest = fmax(largest, fabs(expected[i][c]));
            }
        print_message("strains of %.0e: off by %.2g of the largest force\n", noise,
                      worst / largest);
        // The reference itself rounds positions: 1e-16 over the strain.
        expect_at_most(worst / largest, 2e-6 + 1e-15 / noise);
        free(expected);
    }
}

TEST(rest_gives_no_force_at_all)
{
    EACH_VARIANT(v)
    {
        SCOPED(destroy) Problem p;
        make_cube(&p, 16, 2, v);
        for (int i = 0; i < p.vertex_count; i++) {
            put_vector(p.row[i], vec3(0.1, -0.2, 0.3));
            put_vector(p.row[i] + 4, vec3(-0.5, 0.25, 0.7));
        }
        // The paper's A of elements with hanging vertices is no multiple of 1 at rest: its rotation
        // is found to rounding.
        double limit[PRECISION_COUNT] = {0.0, 0.0};
        if (v->law == VOXEL_MIYAZAKI2004) {
            double stiff = p.classes[5].residual * p.classes[5].size;
            limit[PRECISION_DOUBLE] = 2e-15 * stiff;
            limit[PRECISION_SINGLE] = 1e-6 * stiff;
        }
        for (int k = 0; k < PRECISION_COUNT; k++)
            for (const char *const *level = isa_available(); *level != NULL; level++) {
                SCOPED(result_destroy)
                Result r = run(&p, voxel_kernels_find((Precision)k, *level), 1.0);
                for (int i = 0; i < p.vertex_count; i++)
                    for (int c = 0; c < 4; c++)
                        expect_at_most(fabs(r.force[i][c]), limit[k]);
            }
    }
}

TEST(scales_multiply_stiffness_and_damping)
{
    uint64_t random = 14;
    SCOPED(destroy) Problem p;
    make_loose(&p, 200, &VARIANTS[1], &random);
    move_vertices(&p, STILL, 0.2, &random);
    // Once by the scales, once by the classes: the same numbers go into the kernel up to rounding.
    const VoxelKernels *kernels = voxel_kernels_find(PRECISION_DOUBLE, "auto");
    const double stiffness = 1.7, damping = 0.3;
    FREED double(*force)[4] = zeroed((size_t)p.vertex_count + 1, sizeof *force);
    FREED double(*last)[LANES][4] = zeroed((size_t)batches_total(&p.batches), sizeof *last);
    const VoxelPass pass = {
        .plain = &p.batches.plain,
        .hanging = &p.batches.hanging,
        .tables = p.tables[PRECISION_DOUBLE],
        .classes = p.batches.classes,
        .law = p.law,
        .damped = true,
        .rows = p.row,
        .force = force,
        .last = last,
        .stiffness_scale = stiffness,
        .damping_scale = damping,
    };
    kernels->evaluate(&pass);
    for (int c = 0; c < p.batches.class_count; c++) {
        ElementClass *k = &p.batches.classes[c];
        k->mu *= stiffness, k->lambda *= stiffness, k->residual *= stiffness;
        k->damping *= stiffness * damping;
    }
    SCOPED(result_destroy) Result r = run(&p, kernels, 1.0);
    for (int i = 0; i < p.vertex_count; i++)
        for (int c = 0; c < 3; c++)
            expect_near(force[i][c], r.force[i][c], 1e-14 * p.classes[11].residual * 0.1);
}

TEST(bad_numbers_stay_bad)
{
    uint64_t random = 15;
    SCOPED(destroy) Problem p;
    make_loose(&p, 64, &VARIANTS[1], &random);
    move_vertices(&p, STILL, 0.2, &random);
    p.row[p.vertex[20][3]][1] = (double)NAN;
    p.row[p.vertex[21][3]][5] = HUGE_VAL;
    for (int k = 0; k < PRECISION_COUNT; k++)
        for (const char *const *level = isa_available(); *level != NULL; level++) {
            SCOPED(result_destroy)
            Result r = run(&p, voxel_kernels_find((Precision)k, *level), 1.0);
            for (int e = 0; e < p.element_count; e++) {
                bool finite = true;
                for (int n = 0; n < NODE_CORNERS; n++)
                    for (int c = 0; c < 3; c++)
                        finite = finite && isfinite(r.force[p.vertex[e][n]][c]);
                assert_true(finite == (e != 20 && e != 21));
            }
        }
}

TEST(unknown_levels_are_not_found)
{
    assert_null(voxel_kernels_find(PRECISION_SINGLE, "x86-64-v9"));
    assert_ptr_equal(voxel_kernels_find(PRECISION_SINGLE, "auto"),
                     voxel_kernels_find(PRECISION_SINGLE, isa_available()[0]));
}
