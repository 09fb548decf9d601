// SPDX-License-Identifier: MIT
#include "law_trial.h"

#include "sim_steps.h"
#include "extreme.h"
#include "random.h"

void law_expect_gradient(const LawBody *body, const Vec3 *x, uint64_t *random)
{
    const double step = 1e-7; // [m]
    const size_t count = (size_t)body->count;
    FREED Vec3 *d = calloc(count, sizeof *d), *moved = calloc(count, sizeof *moved),
               *f = calloc(count, sizeof *f), *still = calloc(count, sizeof *still);
    double energy[2], slope = 0.0, size = 0.0;
    Vec3 sum = {0.0, 0.0, 0.0}, moment = {0.0, 0.0, 0.0};
    for (size_t i = 0; i < count; i++)
        d[i] = random_vec3(random);
    for (int side = 0; side < 2; side++) {
        for (size_t i = 0; i < count; i++)
            moved[i] = vec3_madd(x[i], side == 0 ? -step : step, d[i]);
        body->write(body->of, moved, still);
        energy[side] = measure_of(body->body).elastic;
    }
    body->write(body->of, x, still);
    body->forces(body->of, f);
    for (size_t i = 0; i < count; i++) {
        slope -= vec3_dot(f[i], d[i]);
        size += vec3_length(f[i]);
        sum = vec3_add(sum, f[i]);
        moment = vec3_add(moment, vec3_cross(x[i], f[i]));
    }
    print_message("%s: the slope is off by %.2g of the forces\n", body->name,
                  ((energy[1] - energy[0]) / (2.0 * step) - slope) / size);
    // Of differences 1e-7 m apart the error is 1e-10; of an energy that grows by powers of a strain
    // of 0.02 the third derivatives times the square of the step are 1e-9 of the slope.
    expect_near((energy[1] - energy[0]) / (2.0 * step), slope, 1e-6 * size);
    expect_at_most(vec3_length(sum), 1e-12 * size);
    expect_at_most(vec3_length(moment), 1e-12 * body->length * size);
}

static Momentum read_momentum(const LawBody *body)
{
    body->read(body->of);
    return momentum_of(body->count, body->mass, body->x, body->v);
}

void law_expect_momentum(const LawBody *body, int ticks, Precision precision, double angular,
                         double left)
{
    const bool single = precision == PRECISION_SINGLE;
    const double before = energy_of(body->body);
    const Momentum first = read_momentum(body);
    sim_ticks(body->sim, ticks);
    const Momentum last = read_momentum(body);
    const double scale = vec3_length(first.angular), now = energy_of(body->body),
                 p = vec3_length(vec3_sub(last.linear, first.linear)) * body->length / scale,
                 l = vec3_length(vec3_sub(last.angular, first.angular)) / scale;
    print_message("%s, %s: momentum off by %.2g, angular by %.2g, %.3f of the energy left\n",
                  body->name, single ? "single" : "double", p, l, now / before);
    // Rounding; in single precision of each kick.
    expect_at_most(p, single ? 1e-5 : 1e-11);
    expect_at_most(l, single ? angular : 1e-10);
    assert_true(now < left * before);
}

void law_expect_loss(const LawBody *body, const Vec3 *shape, double speed, double loss)
{
    const size_t count = (size_t)body->count;
    FREED Vec3 *rest = calloc(count, sizeof *rest), *v = calloc(count, sizeof *v);
    Extremes extremes = {0};
    double growth = 0.0;
    bool more = true;
    body->read(body->of);
    for (size_t i = 0; i < count; i++) {
        rest[i] = body->x[i];
        v[i] = vec3_scale(speed, shape[i]);
    }
    body->write(body->of, rest, v);
    double before = energy_of(body->body);
    for (int tick = 1; tick < 20000 && more; tick++) {
        double part = 0.0; // of the swing's shape
        sim_step(body->sim);
        body->read(body->of);
        for (size_t i = 0; i < count; i++)
            part += body->mass[i] * vec3_dot(shape[i], vec3_sub(body->x[i], rest[i]));
        more = add_sample(&extremes, part);
        const double now = energy_of(body->body);
        growth = fmax(growth, now / before);
        before = now;
    }
    assert_false(more);
    double decrement;
    const double frequency = 0.5 / (half_swing(&extremes, &decrement) * sim_tick(body->sim));
    // Half a swing: a decrement of pi times the damping ratio, half of the loss factor.
    const double got = 2.0 * decrement / 3.14159265358979323846;
    print_message("%s at %.3g Hz: loss factor %.4f, asked %.2f; energy at most %.6f of that a "
                  "tick before\n",
                  body->name, frequency, got, loss, growth);
    expect_near(got, loss, 0.2 * loss);
    expect_at_most(growth, 1.0 + 1e-3); // leapfrog's elastic energy oscillates in a step
}

LawFall law_fall(const LawBody *body, const Vec3 *x, const Vec3 *v, int ticks)
{
    body->write(body->of, x, v);
    const double first = energy_of(body->body);
    LawFall fall = {.left = 1.0};
    for (int tick = 0; tick < ticks; tick++) {
        sim_step(body->sim);
        const double now = energy_of(body->body) / first;
        fall.most = fmax(fall.most, now);
        fall.growth = fmax(fall.growth, now - fall.left);
        fall.left = now;
    }
    return fall;
}

double law_stress(Stiffening law, double strain)
{
    double low = 0.0, high = 10.0 * law.strain;
    for (int i = 0; i < 200; i++) {
        const double middle = 0.5 * (low + high), q = middle * middle / (law.strain * law.strain);
        *((1.0 + 2.0 * q) * exp(q) < law.cap ? &low : &high) = middle;
    }
    const double e = fmin(strain, low);
    return e * exp(e * e / (law.strain * law.strain)) + law.cap * (strain - e);
}
