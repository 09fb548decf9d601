// For a scene that is refused because its steps would be unstable: which of its keys would have to
// be how much smaller. Load time only.
#include "dynamics/sim_data.h"

#include <stdio.h>
#include <string.h>

// Keys that shorten the bound, each by itself. The first with a reasonable change is advised: the
// tissue's material comes last.
typedef enum Knob {
    KNOB_CONTACT_DAMPING,
    KNOB_GRIP_DAMPING,
    KNOB_CONTACT,
    KNOB_GRIP,
    KNOB_DAMPING,
    KNOB_STIFFNESS,
    KNOB_COUNT,
} Knob;

static const double LEAST = 1e-15; // practically zero
static const double WORTH = 1e-4;  // a smaller factor would leave nothing of it

static void turn(Sim *sim, Body *body, Knob knob, double factor)
{
    switch (knob) {
    case KNOB_STIFFNESS: // contacts take their share of it
        body->lambda *= factor;
        body->finest_lambda *= factor;
        body->contact_lambda *= factor;
        break;
    case KNOB_DAMPING:
        body->damping *= factor;
        body->finest_damping *= factor;
        break;
    case KNOB_CONTACT:
        body->contact_ratio *= factor;
        break;
    case KNOB_CONTACT_DAMPING:
        body->contact_damping *= factor;
        break;
    default:
        for (int t = 0; t < sim->tool_count; t++)
            *(knob == KNOB_GRIP ? &sim->tool[t].grip_stiffness : &sim->tool[t].grip_damping) *=
                factor;
    }
}

// A value that is at most `x`, in three digits.
static double round_down(double x)
{
    double unit = pow(10.0, floor(log10(x)) - 2.0);
    return floor(x / unit) * unit;
}

static void describe(const Sim *sim, const Body *body, Knob knob, double factor, char *text,
                     size_t size)
{
    double grip = 0.0, grip_damping = 0.0;
    for (int t = 0; t < sim->tool_count; t++) {
        if (sim->tool[t].kind != TOOL_GRASPER)
            continue;
        grip = fmax(grip, sim->tool[t].grip_stiffness);
        grip_damping = fmax(grip_damping, sim->tool[t].grip_damping);
    }
    static const char *const names[KNOB_COUNT] = {
        "contact.damping_time of at most",      "grip_damping_ratio of at most",
        "contact.stiffness of at most",         "grip_stiffness of at most",
        "damping (material, shape) of at most", "a stiffness (material, shape) of at most",
    };
    static const char *const units[KNOB_COUNT] = {" s", "", "", "", " times that", " times that"};
    const double value[KNOB_COUNT] = {
        body->contact_damping, grip_damping, body->contact_ratio, grip, 1.0, 1.0};
    snprintf(text, size, ", or %s %.3g%s", names[knob], round_down(factor * value[knob]),
             units[knob]);
}

// Returns the largest factor, up to 1, with which the body can take steps of h; 0: none.
static double find_factor(Sim *sim, Body *body, Knob knob, double h)
{
    const Body own = *body;
    ToolOptions tools[SIM_TOOLS];
    const size_t bytes = (size_t)sim->tool_count * sizeof *tools;
    if (bytes > 0) // without tools there is no array
        memcpy(tools, sim->tool, bytes);
    double low = log10(LEAST), high = 0.0;
    for (int i = 0; i <= 50; i++) {
        const double middle = i == 0 ? low : 0.5 * (low + high);
        turn(sim, body, knob, pow(10.0, middle));
        const bool fits = time_step_bound(sim, body) >= h;
        *body = own;
        if (bytes > 0)
            memcpy(sim->tool, tools, bytes);
        if (i == 0 && !fits)
            return 0.0;
        *(fits ? &low : &high) = middle;
    }
    return pow(10.0, low);
}

void time_step_advise(Sim *sim, Body *body, double h, char *text, size_t size)
{
    Knob best = KNOB_COUNT;
    double factor = 0.0;
    for (Knob knob = 0; knob < KNOB_COUNT && factor < WORTH; knob++) {
        double found = find_factor(sim, body, knob, h);
        if (found > factor) {
            factor = found;
            best = knob;
        }
    }
    text[0] = '\0';
    if (best < KNOB_COUNT)
        describe(sim, body, best, factor, text, size);
}
