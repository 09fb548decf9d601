// SPDX-License-Identifier: MIT
#include "touch/figures.h"

#include <math.h>

static const double PI = 3.14159265358979323846;

#define AT_MOST(high) -HUGE_VAL, high
#define NO_BAR        -HUGE_VAL, HUGE_VAL
// What the trapezoids of a curve may be off: 1 N over 1 um.
#define NO_WORK 1e-3 // [mJ]

const Figure FIGURES[FIGURE_COUNT] = {
    [FIGURE_FORCE] = {"force", "N", NO_BAR, "held press, mean"},
    [FIGURE_STIFFNESS] = {"stiffness", "N/m", NO_BAR, "told to the client in the held press"},
    [FIGURE_FREE] = {"free", "N", AT_MOST(0.0),
                     "largest force down to 0.3 mm before the first touch"},
    [FIGURE_PRESS_TICK] = {"press.tick", "%", AT_MOST(5.0),
                           "largest change in a tick of pressing and lifting, of the peak"},
    [FIGURE_PRESS_WAY] = {"press.way", "%", AT_MOST(5.0),
                          "largest change over 0.1 mm of pressing, of the peak"},
    [FIGURE_PRESS_FALL] = {"press.fall", "%", AT_MOST(1.0),
                           "largest fall of the force while the depth grows, of the peak"},
    [FIGURE_PRESS_ENERGY] = {"press.energy", "mJ", AT_MOST(NO_WORK),
                             "most that the hand got beyond what it gave, pressing and lifting"},
    [FIGURE_HOLD_PEAK] = {"hold.peak", "mN", NO_BAR,
                          "held press, 20 to 300 Hz: largest deflection"},
    [FIGURE_HOLD_RMS] = {"hold.rms", "mN", NO_BAR, "held press, 20 to 300 Hz: rms"},
    [FIGURE_HOLD_SHARE] = {"hold.share", "%", AT_MOST(0.1), "that rms, of the force"},
    [FIGURE_RISE] = {"rise", "ms", NO_BAR,
                     "until the last tenth of the depth, a step at 0.5 m/s, has 90 % of its force"},
    [FIGURE_TOLD] = {"told", "", 0.9, 1.3, "stiffness told then over what this step has felt"},
    [FIGURE_LIFT_FORCE] = {"lift.force", "N", AT_MOST(0.0),
                           "largest force later than 0.1 s after lifting"},
    [FIGURE_LIFT_SHAPE] = {"lift.shape", "mm", AT_MOST(0.1),
                           "farthest node from where it would be untouched, 2 s after lifting"},
    [FIGURE_SLIDE_RATIO] = {"slide.ratio", "", NO_BAR,
                            "sideways over normal force, dragged two fifths of a radius deep"},
    [FIGURE_SLIDE_ERROR] = {"slide.error", "%", AT_MOST(10.0),
                            "that ratio from the scene's friction"},
    [FIGURE_DRAG_PEAK] = {"drag.peak", "times", AT_MOST(2.0),
                          "largest force dragged there and back at full depth, of the press"},
    [FIGURE_DRAG_TICK] = {"drag.tick", "%", AT_MOST(5.0),
                          "its largest change in a tick, of its peak"},
    [FIGURE_DRAG_ENERGY] = {"drag.energy", "mJ", AT_MOST(NO_WORK),
                            "most that the hand got beyond what it gave on that way"},
    [FIGURE_DRAG_FORCE] = {"drag.force", "N", AT_MOST(0.0),
                           "largest force later than 0.1 s after lifting from it"},
    [FIGURE_STREAM_NOISE] = {"stream.noise", "%", AT_MOST(0.5),
                             "spread of the held force with the device's noise, of its mean"},
    [FIGURE_STREAM_TICK] = {"stream.tick", "times", AT_MOST(3.0),
                            "largest change in a tick through device and network, of press.tick"},
    [FIGURE_LOOP_ENERGY] = {"loop.energy", "mJ", AT_MOST(1.0), // the guard's credit
                            "most that a hand of 2 Hz got beyond what it gave, over the network, "
                            "with the client's guard"},
    [FIGURE_LOOP_TICK] = {"loop.tick", "%", AT_MOST(5.0),
                          "largest change that this hand feels in 1 ms, of the peak"},
    [FIGURE_BARE_ENERGY] = {"bare.energy", "mJ", NO_BAR, "the same as loop.energy without guard"},
    [FIGURE_BARE_TICK] = {"bare.tick", "%", NO_BAR, "the same as loop.tick without guard"},
    [FIGURE_WIDTH_1] =
        {"width.1k", "N/m", NO_BAR,
         "stiffness up to which, by octaves from 50 N/m and by thirds in the last, a device pushed "
         "with half the force calms down above this depth, client at 1 kHz"},
    [FIGURE_WIDTH_4] = {"width.4k", "N/m", NO_BAR, "the same at 4 kHz"},
    [FIGURE_WIDTH_10] = {"width.10k", "N/m", NO_BAR, "the same at 10 kHz"},
    [FIGURE_WIDTH_GUARD] = {"width.guard", "N/m", NO_BAR, "the same at 1 kHz with the guard"},
    [FIGURE_GRASP_LAG] = {"grasp.lag", "mm", -1.0, 1.0,
                          "how far what the jaws hold is behind them after a pull"},
};

// Adds the part of one frequency, k periods in all samples but the last, to `sum`; returns its mean
// square. Without the line from the first sample to the last one, whose jump at the end would be in
// all frequencies.
static double add_part(const double *x, int periods, int k, double *sum)
{
    double a = 0.0, b = 0.0;
    const double w = 2.0 * PI * k / periods, slope = (x[periods] - x[0]) / periods;
    for (int i = 0; i < periods; i++) {
        const double rest = x[i] - x[0] - slope * i;
        a += rest * cos(w * i) * 2.0 / periods;
        b += rest * sin(w * i) * 2.0 / periods;
    }
    for (int i = 0; i < periods; i++)
        sum[i] += a * cos(w * i) + b * sin(w * i);
    return 0.5 * (a * a + b * b);
}

double figure_band(const double *x, int count, double rate, double low, double high, double *peak)
{
    enum { MOST = 4096 };
    double sum[MOST] = {0.0}, square = 0.0;
    const int periods = (count < MOST ? count : MOST) - 1;
    for (int k = 1; 2 * k < periods; k++) {
        const double hz = k * rate / periods;
        if (hz >= low && hz <= high)
            square += add_part(x, periods, k, sum);
    }
    *peak = 0.0;
    for (int i = 0; i < periods; i++)
        *peak = fmax(*peak, fabs(sum[i]));
    return sqrt(square);
}

double figure_rise(const double *x, int count, int settled)
{
    const double end = figure_mean(x + count - settled, settled), rise = end - x[0];
    for (int i = 1; i < count && rise > 0.0; i++) {
        const double gone = x[i] - x[0];
        if (gone >= 0.9 * rise)
            return i - (gone - 0.9 * rise) / (x[i] - x[i - 1]);
    }
    return (double)NAN;
}

double figure_change(const double *way, const double *x, int count, double distance)
{
    double most = 0.0;
    // Rounding of ways must not lengthen the distance by a sample.
    for (int i = 0, k = 0; i < count; i++) {
        while (k < count && way[k] - way[i] < distance * (1.0 - 1e-9))
            k++;
        if (k < count)
            most = fmax(most, fabs(x[k] - x[i]));
    }
    return most;
}

double figure_fall(const double *x, int count)
{
    double reached = -HUGE_VAL, most = 0.0;
    for (int i = 0; i < count; i++) {
        reached = fmax(reached, x[i]);
        most = fmax(most, reached - x[i]);
    }
    return most;
}

double figure_mean(const double *x, int count)
{
    double sum = 0.0;
    for (int i = 0; i < count; i++)
        sum += x[i];
    return sum / count;
}

double figure_tick(const Vec3 *force, int count)
{
    double most = 0.0;
    for (int i = 1; i < count; i++)
        most = fmax(most, vec3_length(vec3_sub(force[i], force[i - 1])));
    return most;
}

double figure_largest(const Vec3 *force, int count)
{
    double most = 0.0;
    for (int i = 0; i < count; i++)
        most = fmax(most, vec3_length(force[i]));
    return most;
}

double figure_energy(const Vec3 *hand, const Vec3 *force, int count, bool held)
{
    double given = 0.0, most = 0.0;
    for (int i = 1; i < count; i++) {
        const Vec3 mean = held ? force[i - 1] : vec3_scale(0.5, vec3_add(force[i - 1], force[i]));
        given -= vec3_dot(mean, vec3_sub(hand[i], hand[i - 1]));
        most = fmax(most, -given);
    }
    return most;
}
