// SPDX-License-Identifier: MIT
// Least squares of two laws. E is a factor of the stress, so it follows in closed form; strain and
// cap are searched for on a grid, which a smaller one follows around its best point, again and
// again: slow enough to never miss a narrow valley, and the same on every machine.
#include "fit/fit.h"

#include "body/stiffening.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { GROUPS = 2000, STRAINS = 80, CAPS = 40, ROUNDS = 300 };
// Ranges of the scene's keys, and of strains that the table can determine, in its largest strain.
static const double STRAIN_MOST = 10.0, CAP_MOST = 100.0, SHARE_LEAST = 0.005, SHARE_MOST = 20.0;
// Stiffening is printed if it is worth a shorter time step: a straight line misses the table by
// more than a fifth of a percent, stiffening by a tenth less, and chance would do that in less than
// one table of a hundred.
static const double MISS_LEAST = 0.002, GAIN_LEAST = 0.9, CHANCE_MOST = 1e-2;
static const double MODULUS_MOST = 1e12; // [Pa], as the key's

// Means of consecutive points, so that the search costs the same for any table.
typedef struct Groups {
    int count;
    double strain[GROUPS], stress[GROUPS], weight[GROUPS];
} Groups;

typedef struct Search {
    const Groups *groups;
    double low[2], high[2]; // of the logarithms of strain and cap
    double best[2], least;  // with the sum of squares there
} Search;

// --- the law -------------------------------------------------------------------------------------

// Returns the stress of E = 1.
static double unit_stress(const StiffeningCurve *curve, double scale, double strain)
{
    const double ratio = strain / scale;
    return strain * stiffening_factor(curve, ratio * ratio);
}

double fit_stress(const FitLaw *law, double strain)
{
    if (!(law->cap > 1.0))
        return law->modulus * strain;
    const StiffeningCurve curve = stiffening_curve(law->cap);
    return law->modulus * unit_stress(&curve, law->strain, strain);
}

// Springs along the pull are gone, those at 30 degrees to it carry it, and those across it, which
// get shorter and so do not stiffen, keep them apart: the width is where these balance.
double fit_stress_across(const FitLaw *law, double strain)
{
    const StiffeningCurve curve = stiffening_curve(law->cap);
    const double along = 0.5 * sqrt(3.0) * (1.0 + strain);
    double low = 0.0, high = 1.0, pull = 0.0, length = 1.0;
    // Edges of length 1 and of stiffness 1; 50 halvings reach the last digit.
    for (int i = 0; i < 50; i++) {
        const double width = 0.5 * (low + high);
        length = sqrt(along * along + 0.25 * width * width);
        const double ratio = law->cap > 1.0 ? (length - 1.0) / law->strain : 0.0;
        pull = (length - 1.0) * stiffening_factor(&curve, ratio * ratio);
        if (pull * 0.5 * width / length > 1.0 - width)
            high = width;
        else
            low = width;
    }
    // Two springs of 0.5 sqrt(3) E to each unit of width.
    return law->modulus * sqrt(3.0) * pull * along / length;
}

// Sets E and rms for the strain and the cap of a law.
static void complete(const FitTable *table, FitLaw *law)
{
    double along = 0.0, size = 0.0, squares = 0.0;
    char text[32];
    law->modulus = 1.0;
    for (int i = 0; i < table->count; i++) {
        const double f = fit_stress(law, table->strain[i]);
        along += f * table->stress[i];
        size += f * f;
    }
    // As it is printed.
    snprintf(text, sizeof text, "%.4g", along / size);
    law->modulus = strtod(text, NULL);
    for (int i = 0; i < table->count; i++) {
        const double off = table->stress[i] - fit_stress(law, table->strain[i]);
        squares += off * off;
    }
    law->rms = sqrt(squares / table->count);
}

// --- the search ----------------------------------------------------------------------------------

static void group_points(const FitTable *table, Groups *groups)
{
    groups->count = table->count < GROUPS ? table->count : GROUPS;
    for (int g = 0; g < groups->count; g++) {
        const int begin = (int)((long long)table->count * g / groups->count),
                  end = (int)((long long)table->count * (g + 1) / groups->count);
        double strain = 0.0, stress = 0.0;
        for (int i = begin; i < end; i++) {
            strain += table->strain[i];
            stress += table->stress[i];
        }
        groups->strain[g] = strain / (end - begin);
        groups->stress[g] = stress / (end - begin);
        groups->weight[g] = end - begin;
    }
}

// Returns what the best E leaves of the sum of squares.
static double squares_left(const Groups *groups, double scale, double cap)
{
    const StiffeningCurve curve = stiffening_curve(cap);
    double along = 0.0, size = 0.0, all = 0.0;
    for (int g = 0; g < groups->count; g++) {
        const double f = unit_stress(&curve, scale, groups->strain[g]), s = groups->stress[g],
                     weight = groups->weight[g];
        along += weight * f * s;
        size += weight * f * f;
        all += weight * s * s;
    }
    return along > 0.0 ? all - along * along / size : all;
}

static void try_point(Search *search, double log_strain, double log_cap)
{
    const double at[2] = {fmin(fmax(log_strain, search->low[0]), search->high[0]),
                          fmin(fmax(log_cap, search->low[1]), search->high[1])};
    const double left = squares_left(search->groups, exp(at[0]), exp(at[1]));
    if (left >= search->least)
        return;
    search->least = left;
    search->best[0] = at[0];
    search->best[1] = at[1];
}

static void search_law(const Groups *groups, double strain_most, FitLaw *law)
{
    Search search = {
        .groups = groups,
        .low = {log(SHARE_LEAST * strain_most), 0.0},
        .high = {log(fmin(SHARE_MOST * strain_most, STRAIN_MOST)), log(CAP_MOST)},
        .least = HUGE_VAL,
    };
    double step[2] = {(search.high[0] - search.low[0]) / STRAINS, search.high[1] / CAPS};
    for (int i = 0; i <= STRAINS; i++)
        for (int k = 0; k <= CAPS; k++)
            try_point(&search, search.low[0] + i * step[0], k * step[1]);
    // The step shrinks when no neighbour is better.
    for (int round = 0; round < ROUNDS && step[0] > 1e-6; round++) {
        const double center[2] = {search.best[0], search.best[1]}, before = search.least;
        for (int i = -2; i <= 2; i++)
            for (int k = -2; k <= 2; k++)
                try_point(&search, center[0] + 0.5 * i * step[0], center[1] + 0.5 * k * step[1]);
        if (!(search.least < before)) {
            step[0] *= 0.5;
            step[1] *= 0.5;
        }
    }
    law->strain = exp(search.best[0]);
    law->cap = exp(search.best[1]);
}

// --- the choice ----------------------------------------------------------------------------------

// Rounds to four digits.
static double rounded(double value)
{
    char text[32];
    snprintf(text, sizeof text, "%.4g", value);
    return strtod(text, NULL);
}

// Fits a stress with a bend, a e + b e^2; returns its rms [Pa] and sets b.
static double fit_bend(const FitTable *table, double *bend)
{
    double s2 = 0.0, s3 = 0.0, s4 = 0.0, y1 = 0.0, y2 = 0.0, squares = 0.0;
    for (int i = 0; i < table->count; i++) {
        const double e = table->strain[i], y = table->stress[i];
        s2 += e * e;
        s3 += e * e * e;
        s4 += e * e * e * e;
        y1 += e * y;
        y2 += e * e * y;
    }
    const double determinant = s2 * s4 - s3 * s3;
    // All points at one strain: no bend is known.
    *bend = determinant > 1e-12 * s2 * s4 ? (s2 * y2 - s3 * y1) / determinant : 0.0;
    const double slope = (y1 - *bend * s3) / s2;
    for (int i = 0; i < table->count; i++) {
        const double e = table->strain[i], off = table->stress[i] - e * (slope + *bend * e);
        squares += off * off;
    }
    return sqrt(squares / table->count);
}

// True if a law with `more` parameters than the line is worth them. The chance is that of an F test
// with two degrees in the numerator, (squares / squares of the line)^(n/2), and holds for noise
// without memory.
static bool is_better(const FitTable *table, double line_rms, double rms, int more)
{
    const int spare = table->count - 1 - more;
    return line_rms > MISS_LEAST * fabs(table->peak) && rms < GAIN_LEAST * line_rms && spare > 0 &&
           spare * log(rms / line_rms) < log(CHANCE_MOST);
}

// Returns the slope over E at a strain if there were no cap.
static double free_slope(const FitLaw *law, double strain)
{
    const double ratio = strain / law->strain, q = ratio * ratio;
    return (1.0 + 2.0 * q) * exp(q);
}

// What lies below the cap does not depend on it. Where the table does as well without a cap, takes
// the least one that it does not reach: it costs the least time.
static void lower_cap(const Groups *groups, const FitTable *table, Fit *fit)
{
    const double last = 1.0005 * free_slope(&fit->stiff, table->strain[table->count - 1]);
    if (last > CAP_MOST)
        return;
    const double with = squares_left(groups, fit->stiff.strain, fit->stiff.cap),
                 without = squares_left(groups, fit->stiff.strain, last);
    const double scale = 1e-8 * table->count * table->peak * table->peak; // a rms of 1e-4 of it
    fit->cap_unmet = without <= 1.02 * with + scale;
    if (fit->cap_unmet)
        fit->stiff.cap = last;
}

bool fit_make(const FitTable *table, const char *path, Fit *fit, Status *status)
{
    static Groups groups;
    const double strain_most = table->strain[table->count - 1];
    *fit = (Fit){.linear.cap = 1.0};
    complete(table, &fit->linear);
    if (!(fit->linear.modulus > 0.0 && fit->linear.modulus <= MODULUS_MOST))
        return status_fail(status, STATUS_INVALID,
                           "%s: fits a Young's modulus of %g Pa, outside (0, %g]: stress must be "
                           "positive in tension, column 2, in Pa",
                           path, fit->linear.modulus, MODULUS_MOST);
    // Stiffening, if the table has it.
    group_points(table, &groups);
    search_law(&groups, strain_most, &fit->stiff);
    fit->stiff.strain = rounded(fit->stiff.strain);
    lower_cap(&groups, table, fit);
    fit->stiff.cap = rounded(fit->stiff.cap);
    complete(table, &fit->stiff);
    if (fit->stiff.cap > 1.0 && fit->stiff.modulus > 0.0 &&
        is_better(table, fit->linear.rms, fit->stiff.rms, 2)) {
        const StiffeningCurve curve = stiffening_curve(fit->stiff.cap);
        const double ratio = strain_most / fit->stiff.strain;
        fit->shape = FIT_STIFFENS;
        fit->slope[0] = fit->stiff.modulus;
        fit->slope[1] = fit->stiff.modulus * stiffening_tangent(&curve, ratio * ratio);
        return true;
    }
    // Or the opposite of it.
    double bend;
    const double rms = fit_bend(table, &bend);
    fit->shape =
        bend < 0.0 && is_better(table, fit->linear.rms, rms, 1) ? FIT_FLATTENS : FIT_STRAIGHT;
    return true;
}
