// SPDX-License-Identifier: MIT
// Every variant of the spring kernel at every instruction-set level that this machine can run: the
// same bits at all levels, and the numbers of a plain evaluation.
#include "test.h"
#include "random.h"
#include "base/isa.h"
#include "surface/kernel.h"

enum { NODES = 40, SLOTS = 48, SPRINGS = 400, RULES = 4 };

static const EvaluationRule rules[RULES] = {EVALUATION_RK4_FIRST, EVALUATION_RK4_MIDDLE,
                                            EVALUATION_RK4_LAST, EVALUATION_KICK};

// A network and one state of it, in the kernel's layout.
typedef struct Problem {
    int node_count, spring_count;
    int end[SPRINGS][2];
    double rest_length[SPRINGS], stiffness[SPRINGS]; // of springs
    // the kernel's tables
    int start[SLOTS / LANES + 1];
    int neighbour[2 * SPRINGS * LANES];
    double table_length[2 * SPRINGS * LANES], table_stiffness[2 * SPRINGS * LANES];
    double inverse_mass[SLOTS], shape_rate[SLOTS], shape_drag[SLOTS], drag[SLOTS];
    double rest[SLOTS * 3], external[SLOTS * 3];
    double present[SLOTS * ROW], base[SLOTS * ROW], sum[SLOTS * 6];
    SpringTable springs;
    NodeTable nodes;
    FramePose frame;
    SpringPass pass;
} Problem;

// What one pass wrote.
typedef struct Result {
    double next[SLOTS * ROW], sum[SLOTS * 6];
    bool bad;
} Result;

static bool are_joined(const Problem *p, int a, int b)
{
    for (int s = 0; s < p->spring_count; s++)
        if ((p->end[s][0] == a && p->end[s][1] == b) || (p->end[s][0] == b && p->end[s][1] == a))
            return true;
    return false;
}

static void lay_out_springs(Problem *p)
{
    int chunks = (p->node_count + LANES - 1) / LANES;
    int count[SLOTS] = {0};
    for (int s = 0; s < p->spring_count; s++)
        for (int side = 0; side < 2; side++)
            count[p->end[s][side]]++;
    for (int c = 0; c < chunks; c++) {
        int most = 0;
        for (int lane = 0; lane < LANES; lane++)
            most = count[c * LANES + lane] > most ? count[c * LANES + lane] : most;
        p->start[c + 1] = p->start[c] + most;
        for (int e = p->start[c]; e < p->start[c + 1]; e++)
            for (int lane = 0; lane < LANES; lane++)
                p->neighbour[e * LANES + lane] = c * LANES + lane; // padding: itself, k = 0
    }
    int used[SLOTS] = {0};
    for (int s = 0; s < p->spring_count; s++)
        for (int side = 0; side < 2; side++) {
            int own = p->end[s][side];
            int at = (p->start[own / LANES] + used[own]++) * LANES + own % LANES;
            p->neighbour[at] = p->end[s][1 - side];
            p->table_length[at] = p->rest_length[s];
            p->table_stiffness[at] = p->stiffness[s];
        }
    p->springs = (SpringTable){.chunk_count = chunks,
                               .start = p->start,
                               .neighbour = p->neighbour,
                               .rest_length = p->table_length,
                               .stiffness = p->table_stiffness};
}

// Nodes on a strip with a border: each joined to up to eight others, lengths of the order of
// `size`, some of no length, some nodes fixed.
static void make_problem(Problem *p, int node_count, double size, uint64_t seed)
{
    memset(p, 0, sizeof *p);
    p->node_count = node_count;
    uint64_t random = seed * 7919 + (uint64_t)node_count;
    random_bits(&random);
    for (int i = 0; i < node_count; i++) {
        double *row = p->present + i * ROW, *base = p->base + i * ROW;
        double *rest = p->rest + (i / LANES) * 3 * LANES + i % LANES;
        double *external = p->external + (i / LANES) * 3 * LANES + i % LANES;
        for (int c = 0; c < 3; c++) {
            row[c] = size * random_between(&random, -1.0, 1.0);
            row[4 + c] = size * random_between(&random, -5.0, 5.0);
            base[c] = size * random_between(&random, -1.0, 1.0);
            base[4 + c] = size * random_between(&random, -5.0, 5.0);
            rest[c * LANES] = size * random_between(&random, -1.0, 1.0);
            external[c * LANES] = size * random_between(&random, -1.0, 1.0);
        }
        for (int k = 0; k < 6; k++)
            p->sum[(i / LANES) * 6 * LANES + k * LANES + i % LANES] =
                size * random_between(&random, -1.0, 1.0);
        if (i > 0 && random_below(&random, 10) == 0)
            memcpy(row, row - ROW, 3 * sizeof *row); // the same place as its neighbour
        if (random_below(&random, 8) == 0)
            continue; // fixed: all rates are 0
        p->inverse_mass[i] = random_between(&random, 100.0, 1000.0);
        p->shape_rate[i] = random_between(&random, 0.0, 2500.0);
        p->shape_drag[i] = random_between(&random, 0.0, 10.0);
        p->drag[i] = random_between(&random, 0.0, 10.0);
    }
    for (int i = 0; i < node_count; i++)
        for (int k = 1; k <= 4; k++) {
            int other = k == 1 ? i + 1 : i + 1 + random_below(&random, 12);
            if (other >= node_count || are_joined(p, i, other) || random_below(&random, 6) == 0)
                continue;
            p->end[p->spring_count][0] = i;
            p->end[p->spring_count][1] = other;
            p->rest_length[p->spring_count] =
                random_below(&random, 9) == 0 ? 0.0 : size * random_between(&random, 0.0, 2.0);
            p->stiffness[p->spring_count++] = random_between(&random, 0.0, 200.0);
        }
    lay_out_springs(p);
    p->nodes = (NodeTable){p->inverse_mass, p->rest, p->shape_rate, p->shape_drag, p->drag};
    for (int c = 0; c < 3; c++) {
        p->frame.center[c] = size * random_between(&random, -1.0, 1.0);
        p->frame.rest_center[c] = size * random_between(&random, -1.0, 1.0);
        p->frame.velocity[c] = size * random_between(&random, -1.0, 1.0);
        p->frame.angular[c] = random_between(&random, -1.0, 1.0);
        for (int k = 0; k < 3; k++) // the kernel does not ask whether it is a rotation
            p->frame.rotation[c][k] = random_between(&random, -1.0, 1.0);
    }
    p->pass = (SpringPass){
        .last_chunk = p->springs.chunk_count,
        .springs = &p->springs,
        .nodes = &p->nodes,
        .present = p->present,
        .external = p->external,
        .frame = &p->frame,
        .h = 1e-3,
        .damping_time = 2e-4,
        .stiffness_scale = 1.3,
        .gravity = {0.3 * size, -0.2 * size, -9.81 * size},
        .position_limit = 1e6 * size,
    };
}

static void run(const SpringKernels *kernels, const Problem *p, EvaluationRule rule, int kind,
                int shape, int external, Result *result)
{
    memset(result, 0, sizeof *result);
    memcpy(result->sum, p->sum, sizeof p->sum);
    SpringPass pass = p->pass;
    if (!external)
        pass.external = NULL;
    pass.evaluation =
        (Evaluation){.rule = rule, .at = 0.5, .weight = 1.0 / 3.0, .advance = 0.5, .last = true};
    pass.sum = result->sum;
    pass.next = result->next;
    pass.bad = &result->bad;
    pass.base =
        rule == EVALUATION_RK4_FIRST ? NULL : p->base; // the first stage starts at its own rows
    kernels->evaluate[kind][shape](&pass);
}

// --- the plain evaluation ---

// A sum and the sizes of its terms, which rounding is relative to.
typedef struct Sum {
    double value, size;
} Sum;

static void add(Sum *sum, double term)
{
    sum->value += term;
    sum->size += fabs(term);
}

static void plain_springs(const Problem *p, int node, bool damped, Sum force[3])
{
    for (int s = 0; s < p->spring_count; s++)
        for (int side = 0; side < 2; side++) {
            if (p->end[s][side] != node)
                continue;
            const double *own = p->present + node * ROW;
            const double *other = p->present + p->end[s][1 - side] * ROW;
            double d[3], u[3], square = 0.0, approach = 0.0, approach_size = 0.0;
            for (int c = 0; c < 3; c++) {
                d[c] = own[c] - other[c];
                u[c] = own[4 + c] - other[4 + c];
                square += d[c] * d[c];
                approach += u[c] * d[c];
                approach_size += fabs(u[c] * d[c]);
            }
            double length = sqrt(square);
            if (length < 1e-12)
                continue;
            double k = p->stiffness[s] * p->pass.stiffness_scale;
            for (int c = 0; c < 3; c++) {
                add(&force[c], -k * d[c]);
                add(&force[c], k * p->rest_length[s] * d[c] / length);
                if (damped) {
                    double factor = k * p->pass.damping_time * d[c] / square;
                    force[c].value -= factor * approach;
                    force[c].size += fabs(factor) * approach_size;
                }
            }
        }
}

static void plain_shape(const Problem *p, int node, int shape, Sum a[3])
{
    const double *row = p->present + node * ROW;
    const double *rest = p->rest + (node / LANES) * 3 * LANES + node % LANES;
    const FramePose *f = &p->frame;
    double along = 0.0, size = 0.0, square = 0.0; // of the velocity along the spring
    for (int c = 0; c < 3; c++) {
        const double away = row[c] - rest[c * LANES];
        along += row[4 + c] * away;
        size += fabs(row[4 + c]) * (fabs(row[c]) + fabs(rest[c * LANES]));
        square += away * away;
    }
    for (int c = 0; c < 3; c++) {
        add(&a[c], -p->drag[node] * row[4 + c]);
        double rate = p->shape_rate[node], drag = p->shape_drag[node];
        if (shape_stands((ShapeVariant)shape)) {
            add(&a[c], -rate * row[c]);
            add(&a[c], rate * rest[c * LANES]);
            if (shape == SHAPE_FRAME_WORLD_RADIAL && square > 1e-24) {
                const double by = drag * (row[c] - rest[c * LANES]) / square;
                a[c].value -= by * along;
                a[c].size += fabs(by) * size;
            }
            continue;
        }
        add(&a[c], -rate * row[c]);
        add(&a[c], rate * f->center[c]);
        for (int k = 0; k < 3; k++) {
            double turn = rate * f->rotation[c][k];
            add(&a[c], turn * rest[k * LANES]);
            add(&a[c], -turn * f->rest_center[k]);
        }
        int k = (c + 1) % 3, l = (c + 2) % 3;
        add(&a[c], -drag * row[4 + c]);
        add(&a[c], drag * f->velocity[c]);
        add(&a[c], drag * f->angular[k] * row[l]);
        add(&a[c], -drag * f->angular[k] * f->center[l]);
        add(&a[c], -drag * f->angular[l] * row[k]);
        add(&a[c], drag * f->angular[l] * f->center[k]);
    }
}

// Checks one node of a result: every number within 1e-12 of its terms' sizes. A dozen roundings a
// term, some ten terms: about 1e-14 is expected.
static void check_node(const Problem *p, const Result *result, int node, EvaluationRule rule,
                       int damped, int shape, int external)
{
    Sum a[3] = {{0}};
    plain_springs(p, node, damped, a);
    const double *outside = p->external + (node / LANES) * 3 * LANES + node % LANES;
    bool fixed = p->inverse_mass[node] == 0.0;
    for (int c = 0; c < 3; c++) {
        if (external)
            add(&a[c], outside[c * LANES]);
        a[c].value *= p->inverse_mass[node];
        a[c].size *= p->inverse_mass[node];
        add(&a[c], fixed ? 0.0 : p->pass.gravity[c]);
    }
    if (shape != SHAPE_FRAME_NONE)
        plain_shape(p, node, shape, a);

    const double h = p->pass.h, weight = (1.0 / 3.0), ahead = 0.5, close = 1e-12;
    const double *row = p->present + node * ROW;
    const double *base = rule == EVALUATION_RK4_FIRST ? row : p->base + node * ROW;
    const double *next = result->next + node * ROW;
    assert_true(next[3] == 0.0 && next[7] == 0.0);
    for (int c = 0; c < 3; c++) {
        if (rule == EVALUATION_KICK) {
            double v = row[4 + c] + h * a[c].value, size = fabs(row[4 + c]) + h * a[c].size;
            expect_near(next[4 + c], v, (close * size));
            expect_near(next[c], (row[c] + ahead * h * v), (close * (fabs(row[c]) + h * size)));
            continue;
        }
        for (int half = 0; half < 2; half++) { // positions, then velocities
            double slope = half == 0 ? row[4 + c] : a[c].value;
            double size = half == 0 ? fabs(row[4 + c]) : a[c].size;
            long at = (node / LANES) * 6 * LANES + (half * 3 + c) * LANES + node % LANES;
            double start = rule == EVALUATION_RK4_FIRST ? base[half * 4 + c] : p->sum[at];
            double sum = start + weight * h * slope, scale = fabs(start) + h * size;
            if (rule != EVALUATION_RK4_LAST)
                expect_near(result->sum[at], sum, (close * scale));
            if (rule != EVALUATION_RK4_LAST) {
                sum = base[half * 4 + c] + ahead * h * slope;
                scale = fabs(base[half * 4 + c]) + h * size;
            }
            expect_near(next[half * 4 + c], sum, (close * scale));
        }
    }
}

typedef void Visit(const Problem *p, EvaluationRule rule, int kind, int shape, int external);

// Calls `visit` for every variant and rule. A law without branches and stiffening is linear.
static void each_variant(const Problem *p, Visit *visit)
{
    for (int kind = 0; kind <= SPRINGS_LAW; kind++)
        for (int shape = 0; shape < SHAPE_VARIANTS; shape++)
            for (int external = 0; external < 2; external++)
                for (int rule = 0; rule < RULES; rule++)
                    visit(p, rules[rule], kind, shape, external);
}

static void check_levels(const Problem *p, EvaluationRule rule, int kind, int shape, int external)
{
    const char *const *isa = isa_available();
    Result first, other;
    run(kernels_find(PRECISION_DOUBLE, isa[0]), p, rule, kind, shape, external, &first);
    for (int k = 1; isa[k] != NULL; k++) {
        run(kernels_find(PRECISION_DOUBLE, isa[k]), p, rule, kind, shape, external, &other);
        if (memcmp(&first, &other, sizeof first) != 0)
            print_error("%s against %s: rule %d kind %d shape %d external %d\n", isa[k], isa[0],
                        rule, kind, shape, external);
        assert_memory_equal(first.next, other.next, sizeof first.next);
        assert_memory_equal(first.sum, other.sum, sizeof first.sum);
        assert_int_equal(first.bad, other.bad);
    }
}

static void check_plain(const Problem *p, EvaluationRule rule, int kind, int shape, int external)
{
    Result result;
    run(kernels_find(PRECISION_DOUBLE, "auto"), p, rule, kind, shape, external, &result);
    assert_false(result.bad);
    for (int i = 0; i < p->node_count; i++)
        check_node(p, &result, i, rule, kind >= SPRINGS_DAMPED, shape, external);
}

static void check_both(const Problem *p, EvaluationRule rule, int kind, int shape, int external)
{
    check_levels(p, rule, kind, shape, external);
    check_plain(p, rule, kind, shape, external);
}

TEST(all_levels_agree_with_a_plain_evaluation)
{
    FREED Problem *p = malloc(sizeof *p);
    for (int nodes = 4; nodes <= NODES; nodes++)
        for (uint64_t seed = 1; seed <= 4; seed++) {
            make_problem(p, nodes, 0.05, seed);
            each_variant(p, check_both);
        }
}

TEST(huge_and_tiny_bodies_are_no_exception)
{
    FREED Problem *p = malloc(sizeof *p);
    // Below 1e-12 m springs have no direction; beyond 3e8 m/s a velocity counts as bad.
    static const double sizes[] = {1e-13, 1e-12, 1e-9, 1e-5, 1e2, 1e4};
    for (int k = 0; k < 6; k++)
        for (int nodes = 4; nodes <= NODES; nodes += 9) {
            make_problem(p, nodes, sizes[k], 3);
            each_variant(p, check_both);
        }
}

TEST(coincident_nodes_pull_nowhere)
{
    FREED Problem *p = malloc(sizeof *p);
    make_problem(p, 19, 0.05, 2);
    for (int i = 0; i < p->node_count; i++)
        memcpy(p->present + i * ROW, p->present, 3 * sizeof(double));
    each_variant(p, check_both);
}

static void check_bad(const Problem *p, EvaluationRule rule, int kind, int shape, int external)
{
    for (const char *const *isa = isa_available(); *isa != NULL; isa++) {
        Result result;
        run(kernels_find(PRECISION_DOUBLE, *isa), p, rule, kind, shape, external, &result);
        bool spreads = false; // into the sum, and with it into the last stage's result
        for (int at = 0; at < 6; at++) {
            double sum = result.sum[20 / LANES * 6 * LANES + at * LANES + 20 % LANES];
            spreads |= !(fabs(sum) <= 1e110);
        }
        assert_true(rule == EVALUATION_RK4_FIRST || rule == EVALUATION_RK4_MIDDLE ? spreads
                                                                                  : result.bad);
    }
}

TEST(every_level_notices_bad_numbers)
{
    FREED Problem *p = malloc(sizeof *p);
    static const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY, 1e120, -1e120};
    for (int k = 0; k < 5; k++)
        for (int component = 0; component < 7; component++) {
            if (component == 3)
                continue;
            make_problem(p, 21, 0.05, 5);
            // In the last node, so that padding lanes beside it do not hide it.
            p->present[20 * ROW + component] = bad[k];
            p->base[20 * ROW + component] = bad[k];
            for (int at = 0; at < 6; at++)
                p->sum[20 / LANES * 6 * LANES + at * LANES + 20 % LANES] = bad[k];
            each_variant(p, check_bad);
        }
}

TEST(padding_nodes_stay_at_the_origin)
{
    FREED Problem *p = malloc(sizeof *p);
    make_problem(p, 21, 0.05, 6);
    memset(p->sum, 0, sizeof p->sum);
    for (int shape = 0; shape < SHAPE_VARIANTS; shape++)
        for (int rule = 0; rule < RULES; rule++) {
            Result result;
            run(kernels_find(PRECISION_DOUBLE, "auto"), p, rules[rule], 1, shape, 1, &result);
            for (int s = 21; s < 32; s++)
                for (int c = 0; c < ROW; c++)
                    assert_true(result.next[s * ROW + c] == 0.0);
        }
}

TEST(levels_are_found_by_name)
{
    const char *const *isa = isa_available();
    int count = 0;
    assert_non_null(isa[0]);
    assert_string_equal(kernels_find(PRECISION_DOUBLE, "auto")->level, isa[0]);
    for (; isa[count] != NULL; count++)
        assert_string_equal(kernels_find(PRECISION_DOUBLE, isa[count])->level, isa[count]);
    assert_string_equal(isa[count - 1], "baseline");
    assert_null(kernels_find(PRECISION_DOUBLE, "x86-64-v9"));
    assert_null(kernels_find(PRECISION_DOUBLE, ""));
    print_message("%d levels, the best is %s\n", count, isa[0]);
}
