#include "dynamics/cost.h"

// Time per spring and per element, each substep [s]: 24 walls of 500 and 2000 nodes took 13 to 17
// ns per node, which has three springs; 8 solids 38 to 78 ns per element, more for larger ones.
static const double SPRING = 5e-9, ELEMENT = 4.5e-8;
// Time of every substep, however small the body [s]: contact and loops of 50 to 200 nodes.
static const double SUBSTEP = 5e-7;
// Time per spring of each linear solve of the implicit step [s]: 330 to 450 us with 2000 nodes.
static const double IMPLICIT_SPRING = 7e-8;

double cost_tick(const Body *body, int substeps)
{
    double each = (double)body->spring_count * SPRING;
    if (body->spring_count == 0)
        each = (double)body->element_count * ELEMENT;
    else if (body->integrator == INTEGRATOR_IMPLICIT)
        each = cost_implicit(body->spring_count);
    else
        each *= integrator_get(body->integrator)->stage_count; // evaluations of the forces
    return (double)substeps * (each + SUBSTEP);
}

double cost_implicit(int springs)
{
    return (double)springs * IMPLICIT_SPRING;
}
