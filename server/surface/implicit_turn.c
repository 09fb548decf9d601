// Corrects a violent step of an implicit body: floating islands turn on a circle. Step thread.
//
// The step moves nodes in a straight line, x' = x + h v', so that a body that turns by an angle a
// grows by a^2 / 2, and sufficiently stiff springs then store more energy than the motion has. With
// c the middle, V and W the rigid part of v', u the rest of it, and R the rotation by h W, this
// correction uses
//
//     x' = c + h V + R (r + h u),    v' = V + R (v' - V) + D x r'
//
// where the spin D restores the angular momentum, which the straight step conserves exactly.
#include "surface/implicit_quad.h"

#include <math.h>

typedef struct Spin {
    double weight;        // [kg]
    double inertia[3][3]; // about the middle [kg m2]
    Quad middle, velocity;
    Quad momentum; // angular, about the middle [N s m]
} Spin;

// Solves inertia w = momentum; no spin about directions without inertia.
INLINE Quad angular_velocity(const Spin *spin, Quad momentum)
{
    double m[3][3];
    const double soft =
        1e-15 * (spin->inertia[0][0] + spin->inertia[1][1] + spin->inertia[2][2]) + 1e-300;
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            m[a][b] = spin->inertia[a][b] + (a == b ? soft : 0.0);
    return quad_solve_positive(m, momentum);
}

// Sums inertia and angular momentum of an island's members from rows, about the given middle and
// velocity.
static void add_spin(const Implicit *system, const int *member, int count, const double *rows,
                     Spin *spin)
{
    for (int k = 0; k < count; k++) {
        const int i = member[k], slot = system->slot[i];
        const double w = system->inertia[i];
        const Quad r = quad_row(rows, slot, 0) - spin->middle,
                   v = quad_row(rows, slot, 4) - spin->velocity;
        const double square = quad_dot(r, r);
        spin->momentum += w * quad_cross(r, v);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                spin->inertia[a][b] += w * ((a == b ? square : 0.0) - r[a] * r[b]);
    }
}

// Returns v turned by a rotation vector (Rodrigues).
INLINE Quad turned(Quad v, Quad rotation, double angle)
{
    const Quad n = rotation / angle, across = quad_cross(n, v);
    const double half = sin(0.5 * angle);
    return v + sin(angle) * across + (2.0 * half * half) * quad_cross(n, across);
}

INLINE void put(double *rows, int slot, Quad x, Quad v)
{
    for (int c = 0; c < 3; c++) {
        rows[(long)slot * ROW + c] = x[c];
        rows[(long)slot * ROW + c + 4] = v[c];
    }
}

static bool turn_island(const Implicit *system, int island, double *next)
{
    const int first = system->island_start[island], *member = system->member + first;
    const int count = system->island_start[island + 1] - first;
    const double h = system->h;
    Spin before = {0};
    // Undo the straight step; the velocities are already those at its end.
    for (int k = 0; k < count; k++) {
        const int i = member[k], slot = system->slot[i];
        const Quad v = quad_row(next, slot, 4);
        put(next, slot, quad_row(next, slot, 0) - h * v, v);
        before.weight += system->inertia[i];
        before.middle += system->inertia[i] * quad_row(next, slot, 0);
        before.velocity += system->inertia[i] * v;
    }
    before.middle /= before.weight;
    before.velocity /= before.weight;
    // The rigid rotation of the island during the step.
    add_spin(system, member, count, next, &before);
    const Quad spin = angular_velocity(&before, before.momentum), rotation = h * spin;
    const double angle = fmax(sqrt(quad_dot(rotation, rotation)), 1e-300);
    Spin after = {.middle = before.middle + h * before.velocity, .velocity = before.velocity};
    // Turn positions and velocities about the middle, which moves straight.
    for (int k = 0; k < count; k++) {
        const int slot = system->slot[member[k]];
        const Quad r = quad_row(next, slot, 0) - before.middle,
                   v = quad_row(next, slot, 4) - before.velocity;
        put(next, slot, after.middle + turned(r + h * (v - quad_cross(spin, r)), rotation, angle),
            after.velocity + turned(v, rotation, angle));
    }
    // Restore the angular momentum by a spin.
    add_spin(system, member, count, next, &after);
    const Quad more = angular_velocity(&after, before.momentum - after.momentum);
    for (int k = 0; k < count; k++) {
        const int slot = system->slot[member[k]];
        const Quad x = quad_row(next, slot, 0);
        put(next, slot, x, quad_row(next, slot, 4) + quad_cross(more, x - after.middle));
    }
    return isfinite(quad_dot(more, more));
}

bool implicit_turn(const Implicit *system, double *next)
{
    bool good = true;
    for (int k = 0; k < system->island_count; k++)
        if (!system->held[k])
            good &= turn_island(system, k, next);
    return good;
}
