// SPDX-License-Identifier: MIT
// One element in every state: what the force is the gradient of, and what it never does. Shapes are
// about one in size and so are stiffnesses, so that tolerances read as relative ones.
#include "effort.h"
#include "test.h"
#include "random.h"

#include "voxel/barrier.h"
#include "voxel/element.h"
#include "voxel/template.h"

typedef struct Shape {
    Element element;
    Vec3 rest[NODE_COUNT], area[NODE_COUNT];
    double weight[NODE_COUNT];
} Shape;

static void point_to_own(Shape *shape, int count, double volume)
{
    shape->element = (Element){count, shape->rest, shape->weight, shape->area, volume};
}

// Random weights for odd seeds: the law is not one of equal weights.
static void add_weights(Shape *shape, int count, uint64_t *random)
{
    bool equal = random_below(random, 2) == 0;
    for (int i = 0; i < count; i++)
        shape->weight[i] = equal ? 1.0 : random_between(random, 0.2, 2.0);
}

static void make_tetrahedron(Shape *shape, uint64_t *random)
{
    static const int TRIANGLE[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    double volume = 0.0;
    while (volume < 0.1) {
        for (int i = 0; i < 4; i++)
            shape->rest[i] = random_vec3(random);
        element_polyhedron(shape->rest, 4, TRIANGLE, 4, shape->area, &volume);
    }
    add_weights(shape, 4, random);
    point_to_own(shape, 4, volume);
}

// Two tips over a ring of 3 to 10, the ring's radii and heights all different. Convex for little
// variation; with much of it a star with notches.
static void make_polyhedron(Shape *shape, uint64_t *random, double variation)
{
    int ring = 3 + random_below(random, 8), triangle[20][3], count = 0;
    for (int i = 0; i < ring; i++) {
        double angle = 2.0 * 3.141592653589793 * i / ring;
        double radius = random_between(random, 1.0 - variation, 1.0 + 0.5 * variation);
        shape->rest[i] = vec3(radius * cos(angle), radius * sin(angle),
                              random_between(random, -0.3, 0.3) * variation);
        int next = (i + 1) % ring;
        memcpy(triangle[count++], (int[3]){i, next, ring}, sizeof triangle[0]);
        memcpy(triangle[count++], (int[3]){next, i, ring + 1}, sizeof triangle[0]);
    }
    shape->rest[ring] = vec3(0.1, 0.05, 1.0);
    // Above the plane of the ring: the body is a cup.
    shape->rest[ring + 1] = vec3(-0.05, 0.1, variation > 0.5 ? 0.4 : -0.7);
    double volume;
    element_polyhedron(shape->rest, ring + 2, (const int(*)[3])triangle, count, shape->area,
                       &volume);
    assert_true(volume > 0.0);
    add_weights(shape, ring + 2, random);
    point_to_own(shape, ring + 2, volume);
}

static void make_template(Shape *shape, unsigned mask, double size)
{
    Template t;
    template_create(&t, mask);
    for (int i = 0; i < t.count; i++) {
        shape->rest[i] = vec3_scale(size, t.rest[i]);
        shape->area[i] = vec3_scale(size * size, t.area[i]);
        shape->weight[i] = t.weight[i];
    }
    point_to_own(shape, t.count, size * size * size);
}

enum { SHAPES = 6 };
static void make_shape(Shape *shape, int kind, uint64_t *random)
{
    switch (kind) {
    case 0:
        make_tetrahedron(shape, random);
        break;
    case 1:
        make_template(shape, 0, 1.0);
        break;
    case 2:
        make_polyhedron(shape, random, 0.1);
        break;
    case 3:
        make_polyhedron(shape, random, 0.7);
        break;
    case 4: // all hanging vertices
        make_template(shape, (1u << (NODE_COUNT - NODE_CORNERS)) - 1, 1.0);
        break;
    default:
        make_template(shape, (unsigned)random_below(random, 1 << (NODE_COUNT - NODE_CORNERS)), 1.0);
        break;
    }
}

// Half of the affine ones stiffen, as far as the cap or beyond it in the strains of these tests.
static ElementStiffness random_stiffness(uint64_t *random, VoxelLaw law)
{
    ElementStiffness stiffness = {.law = law,
                                  .mu = random_between(random, 0.5, 2.0),
                                  .lambda = random_between(random, 0.0, 4.0),
                                  .residual = random_between(random, 0.2, 2.0),
                                  .damping = random_between(random, 0.2, 2.0)};
    if (law == VOXEL_AFFINE && random_below(random, 2) != 0)
        stiffness.stiffening =
            (Stiffening){random_between(random, 0.3, 2.0), random_between(random, 1.0, 10.0)};
    return stiffness;
}

static Quat random_quat(uint64_t *random)
{
    return quat_from_rotation(vec3_scale(3.0, random_vec3(random)));
}

// A random matrix with the given stretches (one may be negative) in random directions.
typedef struct Map {
    Quat left, right;
    double stretch[3];
} Map;

static Vec3 apply(const Map *map, Vec3 x)
{
    Vec3 y = quat_rotate(quat_conjugate(map->right), x);
    y = vec3(map->stretch[0] * y.x, map->stretch[1] * y.y, map->stretch[2] * y.z);
    return quat_rotate(map->left, y);
}

static Map random_map(uint64_t *random, double low, double high, double third)
{
    return (Map){random_quat(random),
                 random_quat(random),
                 {random_between(random, low, high), random_between(random, low, high), third}};
}

static void zero(Vec3 *a, int count)
{
    for (int i = 0; i < count; i++)
        a[i] = vec3(0.0, 0.0, 0.0);
}

static double *component(Vec3 *a, int c)
{
    return c == 0 ? &a->x : c == 1 ? &a->y : &a->z;
}

// Central differences of step 1e-5: the third derivative, which turning makes up to about 1e2,
// leaves 1e-8, and rounding of an energy around 10 leaves 1e-10.
static void expect_gradient(const Element *element, const ElementStiffness *stiffness,
                            Vec3 *position)
{
    static const double STEP = 1e-5;
    Vec3 force[NODE_COUNT], unused[NODE_COUNT];
    Quat last = {1.0, 0.0, 0.0, 0.0};
    zero(force, element->count);
    element_forces(element, stiffness, position, NULL, &last, force);
    for (int i = 0; i < element->count; i++) {
        for (int c = 0; c < 3; c++) {
            double *x = component(&position[i], c), middle = *x, energy[2];
            for (int side = 0; side < 2; side++) {
                *x = middle + (side == 0 ? -STEP : STEP);
                zero(unused, element->count);
                energy[side] = element_forces(element, stiffness, position, NULL, &last, unused);
            }
            *x = middle;
            expect_near(*component(&force[i], c), (energy[0] - energy[1]) / (2.0 * STEP), 1e-6);
        }
    }
}

TEST(force_is_the_negative_gradient_of_the_energy)
{
    uint64_t random = 31;
    for (int n = 0; n < EFFORT(600); n++) {
        Shape shape;
        make_shape(&shape, n % SHAPES, &random);
        const Element *element = &shape.element;
        // Half of them inverted; s2 + s3 stays above 0.3: the energy has a kink at 0.
        Map map = random_map(&random, 0.7, 1.4,
                             n % 4 < 2 ? random_between(&random, 0.3, 1.5)
                                       : random_between(&random, -0.3, 0.0));
        Vec3 position[NODE_COUNT];
        for (int i = 0; i < element->count; i++)
            position[i] = vec3_madd(apply(&map, element->rest[i]), 0.02, random_vec3(&random));
        for (int law = 0; law < 2; law++) {
            ElementStiffness stiffness = random_stiffness(&random, (VoxelLaw)law);
            expect_gradient(element, &stiffness, position);
        }
    }
}

// In all of them.
enum { STATES = 10 };
static void any_state(uint64_t *random, int kind, const Element *element, Vec3 *position)
{
    static const struct {
        double times[3], noise, scale; // of a random map
    } KINDS[STATES - 1] = {
        {{1.0, 1.0, 1.0}, 0.1, 1.0},  // deformed
        {{1.0, 1.0, 1.0}, 2.0, 1.0},  // scrambled
        {{1.0, 1.0, 0.0}, 0.0, 1.0},  // flat
        {{1.0, 0.0, 0.0}, 0.0, 1.0},  // a line
        {{0.0, 0.0, 0.0}, 0.0, 1.0},  // a point
        {{1.0, 1.0, -0.4}, 0.1, 1.0}, // inverted
        {{1.0, 1.0, 1.0}, 0.0, 1.0},  // mirrored
        {{1.0, 1.0, 1.0}, 0.3, 1e-6}, // tiny
        {{1.0, 1.0, 1.0}, 0.3, 1e6},  // huge
    };
    Map map = random_map(random, 0.5, 1.5, random_between(random, 0.5, 1.5));
    double noise = 0.0, scale = 1.0;
    if (kind < STATES - 1) {
        noise = KINDS[kind].noise, scale = KINDS[kind].scale;
        for (int c = 0; c < 3; c++)
            map.stretch[c] =
                kind == 6 ? (c == 2 ? -1.0 : 1.0) : KINDS[kind].times[c] * map.stretch[c];
    } else { // nearly a line or a plane
        double thin = pow(10.0, random_between(random, -17.0, -1.0));
        map.stretch[1] *= random_below(random, 2) == 0 ? thin : 1.0;
        map.stretch[2] *= thin;
    }
    for (int i = 0; i < element->count; i++)
        position[i] =
            vec3_scale(scale, vec3_madd(apply(&map, element->rest[i]), noise, random_vec3(random)));
}

// Resultant and moment below 1e-12 of sum |f| and of sum |f| times the larger of the element's
// sizes, at rest and now: sums of up to 26 terms, rounded at 1e-16 each, of forces that are
// themselves differences.
static void expect_balanced(const Element *element, const Vec3 *position, const Vec3 *force)
{
    Vec3 sum = {0.0, 0.0, 0.0}, moment = {0.0, 0.0, 0.0};
    double total = 0.0, size = 1.0;
    for (int i = 0; i < element->count; i++) {
        sum = vec3_add(sum, force[i]);
        moment = vec3_add(moment, vec3_cross(position[i], force[i]));
        total += vec3_length(force[i]);
        size = fmax(size, vec3_length(position[i]));
    }
    assert_true(isfinite(total));
    expect_at_most(vec3_length(sum), 1e-12 * total);
    expect_at_most(vec3_length(moment), 1e-12 * total * size);
}

TEST(no_state_has_a_resultant_or_a_moment)
{
    uint64_t random = 32;
    for (int n = 0; n < EFFORT(60000); n++) {
        Shape shape;
        make_shape(&shape, n % SHAPES, &random);
        const Element *element = &shape.element;
        Vec3 position[NODE_COUNT], velocity[NODE_COUNT], force[NODE_COUNT], damped[NODE_COUNT];
        any_state(&random, n / SHAPES % STATES, element, position);
        for (int law = 0; law < 2; law++) {
            ElementStiffness stiffness = random_stiffness(&random, (VoxelLaw)law);
            Quat last = random_quat(&random), other = last;
            zero(force, element->count);
            element_forces(element, &stiffness, position, NULL, &last, force);
            expect_balanced(element, position, force);
            // Damping alone, which is to be balanced by itself and never to give energy.
            double power = 0.0, scale = 0.0;
            for (int i = 0; i < element->count; i++) {
                velocity[i] = random_vec3(&random);
                damped[i] = vec3_scale(-1.0, force[i]);
            }
            element_forces(element, &stiffness, position, velocity, &other, damped);
            double largest = 0.0;
            for (int i = 0; i < element->count; i++) {
                power += vec3_dot(damped[i], velocity[i]);
                scale += vec3_length(damped[i]);
                largest = fmax(largest, vec3_length(force[i]));
            }
            expect_at_most(power, 1e-12 * (scale + largest));
            if (largest < 1e2) // else rounding of what was subtracted is all there is
                expect_balanced(element, position, damped);
        }
    }
}

TEST(no_force_at_rest_and_under_rigid_motion)
{
    uint64_t random = 33;
    for (int n = 0; n < EFFORT(1200); n++) {
        Shape shape;
        make_shape(&shape, n % SHAPES, &random);
        const Element *element = &shape.element;
        Quat turn = n < SHAPES ? (Quat){1.0, 0.0, 0.0, 0.0} : random_quat(&random);
        Vec3 shift = n < SHAPES ? vec3(0.0, 0.0, 0.0) : random_vec3(&random);
        Vec3 drift = random_vec3(&random), spin = random_vec3(&random);
        Vec3 position[NODE_COUNT], velocity[NODE_COUNT], force[NODE_COUNT];
        for (int i = 0; i < element->count; i++) {
            position[i] = vec3_add(quat_rotate(turn, element->rest[i]), shift);
            velocity[i] = vec3_add(drift, vec3_cross(spin, position[i]));
        }
        for (int law = 0; law < 2; law++) {
            ElementStiffness stiffness = random_stiffness(&random, (VoxelLaw)law);
            Quat last = random_quat(&random);
            zero(force, element->count);
            double energy = element_forces(element, &stiffness, position, velocity, &last, force);
            // Coordinates round at 1e-16; a flat tetrahedron loses two digits of its F.
            expect_at_most(energy, 1e-24);
            for (int i = 0; i < element->count; i++)
                expect_at_most(vec3_length(force[i]), 1e-12);
        }
    }
}

// Whether the barrier acts (voxel/barrier.h), which the paper's law does not have.
static bool is_crushed(const Element *element, const Vec3 *position)
{
    Vec3 column[3] = {{0.0, 0.0, 0.0}};
    for (int i = 0; i < element->count; i++) {
        const Vec3 x = vec3_scale(1.0 / element->volume, vec3_sub(position[i], position[0]));
        column[0] = vec3_madd(column[0], element->area[i].x, x);
        column[1] = vec3_madd(column[1], element->area[i].y, x);
        column[2] = vec3_madd(column[2], element->area[i].z, x);
    }
    return vec3_dot(column[0], vec3_cross(column[1], column[2])) < BARRIER_VOLUME;
}

TEST(eight_corners_without_lambda_are_the_paper_s_element)
{
    uint64_t random = 34;
    for (int n = 0; n < EFFORT(2000); n++) {
        double size = random_between(&random, 0.5, 2.0), mu = random_between(&random, 0.5, 2.0);
        Shape shape;
        make_template(&shape, 0, size);
        ElementStiffness affine = {.law = VOXEL_AFFINE, .mu = mu, .residual = mu * size};
        ElementStiffness paper = {.law = VOXEL_MIYAZAKI2004, .residual = mu * size};
        Vec3 position[8], force[8], expected[8];
        do
            any_state(&random, n % 2, &shape.element, position);
        while (is_crushed(&shape.element, position));
        Quat last = {1.0, 0.0, 0.0, 0.0}, other = last;
        zero(force, 8);
        zero(expected, 8);
        double energy = element_forces(&shape.element, &affine, position, NULL, &last, force);
        double same = element_forces(&shape.element, &paper, position, NULL, &other, expected);
        expect_near(energy, same, 1e-12 * (1.0 + same));
        // Random states may come near to a kink, where rounding turns the element.
        for (int i = 0; i < 8; i++)
            expect_at_most(vec3_length(vec3_sub(force[i], expected[i])), 1e-11);
    }
}

TEST(homogeneous_deformation_has_the_energy_of_the_continuum)
{
    uint64_t random = 35;
    for (int n = 0; n < EFFORT(1200); n++) {
        Shape shape;
        make_shape(&shape, n % SHAPES, &random);
        const Element *element = &shape.element;
        // Not crushed: the barrier is not in it.
        Map map = random_map(&random, 0.7, 2.0, random_between(&random, 0.7, 2.0));
        ElementStiffness stiffness = random_stiffness(&random, VOXEL_AFFINE);
        stiffness.stiffening = (Stiffening){0};
        Vec3 position[NODE_COUNT], force[NODE_COUNT];
        for (int i = 0; i < element->count; i++)
            position[i] = apply(&map, element->rest[i]);
        zero(force, element->count);
        Quat last = {1.0, 0.0, 0.0, 0.0};
        double energy = element_forces(element, &stiffness, position, NULL, &last, force);
        // |F - R|^2 = sum (s - 1)^2 and tr(R^T F - 1) = sum (s - 1), s the stretches.
        double square = 0.0, trace = 0.0;
        for (int i = 0; i < 3; i++) {
            square += (map.stretch[i] - 1.0) * (map.stretch[i] - 1.0);
            trace += map.stretch[i] - 1.0;
        }
        double expected =
            element->volume * (stiffness.mu * square + 0.5 * stiffness.lambda * trace * trace);
        expect_near(energy, expected, 1e-12 * (1.0 + expected));
    }
}

// The area vectors give the mean gradient of any affine field, and a closed surface has none.
TEST(area_vectors_of_a_polyhedron_close_and_reproduce_its_volume)
{
    uint64_t random = 36;
    for (int n = 0; n < EFFORT(1200); n++) {
        Shape shape;
        make_polyhedron(&shape, &random, n % 2 == 0 ? 0.1 : 0.7);
        const Element *element = &shape.element;
        double m[3][3] = {{0.0}};
        Vec3 sum = {0.0, 0.0, 0.0};
        for (int i = 0; i < element->count; i++) {
            sum = vec3_add(sum, element->area[i]);
            for (int r = 0; r < 3; r++) {
                for (int c = 0; c < 3; c++)
                    m[r][c] += *component(&shape.rest[i], r) * *component(&shape.area[i], c);
            }
        }
        expect_at_most(vec3_length(sum), 1e-14);
        for (int i = 0; i < 9; i++)
            expect_near(m[i / 3][i % 3], i % 4 == 0 ? element->volume : 0.0, 1e-14);
    }
}

// Two vertices are a spring between them, three a triangle that keeps its shape.
TEST(the_paper_s_law_works_with_two_and_three_vertices)
{
    uint64_t random = 37;
    for (int n = 0; n < EFFORT(600); n++) {
        Shape shape;
        int count = 2 + n % 2;
        for (int i = 0; i < count; i++)
            shape.rest[i] = vec3_add(random_vec3(&random), vec3(3.0 * (i == 1), 3.0 * (i == 2), 0));
        add_weights(&shape, count, &random);
        point_to_own(&shape, count, 0.0);
        ElementStiffness stiffness = random_stiffness(&random, VOXEL_MIYAZAKI2004);
        Vec3 position[3], velocity[3], force[3];
        for (int i = 0; i < count; i++) {
            position[i] = vec3_add(random_vec3(&random), vec3(0.0, 3.0 * (i == 1), 3.0 * (i == 2)));
            velocity[i] = random_vec3(&random);
        }
        expect_gradient(&shape.element, &stiffness, position);
        Quat last = random_quat(&random);
        zero(force, count);
        element_forces(&shape.element, &stiffness, position, NULL, &last, force);
        expect_balanced(&shape.element, position, force);
        if (count == 2) {
            Vec3 d = vec3_sub(position[1], position[0]);
            double rest = vec3_length(vec3_sub(shape.rest[1], shape.rest[0]));
            double w = shape.weight[0] * shape.weight[1] / (shape.weight[0] + shape.weight[1]);
            double pull = stiffness.residual * w * (vec3_length(d) - rest);
            Vec3 expected = vec3_scale(pull, vec3_unit(d));
            expect_at_most(vec3_length(vec3_sub(force[0], expected)), 1e-13);
        }
        zero(force, count);
        element_forces(&shape.element, &stiffness, position, velocity, &last, force);
        expect_balanced(&shape.element, position, force);
    }
}

// All vertices of the rest shape in a plane: across it the affine fit knows nothing, and there is
// still no resultant, no moment and nothing infinite.
TEST(a_flat_rest_shape_is_balanced_too)
{
    uint64_t random = 38;
    for (int n = 0; n < EFFORT(600); n++) {
        Shape shape;
        Quat turn = random_quat(&random);
        Vec3 sum = {0.0, 0.0, 0.0}, position[6], force[6];
        for (int i = 0; i < 6; i++) {
            Vec3 x = random_vec3(&random);
            shape.rest[i] = quat_rotate(turn, vec3(x.x, x.y, 0.0));
            shape.area[i] = i < 5 ? random_vec3(&random) : vec3_scale(-1.0, sum);
            sum = vec3_add(sum, shape.area[i]);
            position[i] = random_vec3(&random);
            force[i] = vec3(0.0, 0.0, 0.0);
        }
        add_weights(&shape, 6, &random);
        point_to_own(&shape, 6, 1.0);
        ElementStiffness stiffness = random_stiffness(&random, VOXEL_AFFINE);
        Quat last = {1.0, 0.0, 0.0, 0.0};
        element_forces(&shape.element, &stiffness, position, NULL, &last, force);
        expect_balanced(&shape.element, position, force);
    }
}
