// SPDX-License-Identifier: MIT
// What one tool did: time, path, smoothness, force.
#include "score_parts.h"

#include "base/check.h"

#include <stdlib.h>

static const double LEAST_MOVEMENT_S = 0.25;

// --- stretches: rows without a gap ---------------------------------------------------------------

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Returns the median distance of rows [s]; 0 if there is none.
static double median_distance(const ScoreRow *row, int64_t rows)
{
    enum { SAMPLES = 4096 };
    double distance[SAMPLES];
    int count = 0;
    // Every n-th one of a long series.
    const int64_t stride = rows / SAMPLES + 1;
    for (int64_t i = 1; i < rows && count < SAMPLES; i += stride)
        distance[count++] = row[i].time - row[i - 1].time;
    qsort(distance, (size_t)count, sizeof *distance, by_size);
    return count == 0 ? 0.0 : distance[count / 2];
}

// Returns the first row after the stretch that begins at `first`.
static int64_t stretch_end(const ScoreRow *row, int64_t rows, int64_t first, double gap)
{
    int64_t i = first + 1;
    while (i < rows && row[i].time - row[i - 1].time <= gap)
        i++;
    return i;
}

// --- movements -----------------------------------------------------------------------------------

// The speed of a stretch at a constant rate: lengths of path per 1/60 s, which no rate of rows
// changes much. Returns the number of speeds; the caller frees them.
static int resample(const ScoreRow *row, int64_t rows, double **speed)
{
    const double whole = row[rows - 1].time - row[0].time;
    const int count = (int)floor(whole * SCORE_SPEED_HZ + 1e-6);
    *speed = calloc((size_t)count + 1, sizeof **speed);
    ASSERT(*speed != NULL);
    double path = 0.0, before = 0.0; // at row i, at the last sample
    int64_t i = 0;
    for (int k = 0; k < count; k++) {
        const double until = row[0].time + (double)(k + 1) / SCORE_SPEED_HZ;
        // Rows that are passed on the way, then a part of the next distance.
        while (i + 2 < rows && row[i + 1].time <= until) {
            path += vec3_length(vec3_sub(row[i + 1].position, row[i].position));
            i++;
        }
        const double dt = row[i + 1].time - row[i].time;
        const double share = dt > 0.0 ? fmin(fmax((until - row[i].time) / dt, 0.0), 1.0) : 1.0;
        const double here =
            path + share * vec3_length(vec3_sub(row[i + 1].position, row[i].position));
        (*speed)[k] = (here - before) * SCORE_SPEED_HZ;
        before = here;
    }
    return count;
}

typedef struct Smoothness {
    int64_t movements;
    double weighted, weight; // sum of arc length times samples, and of samples
    int64_t samples, idle;
} Smoothness;

// Adds the movements of a stretch: speeds above that of an idle tool, with what leads to them and
// from them.
static void add_movements(const double *speed, int count, Smoothness *sum)
{
    sum->samples += count;
    for (int i = 0; i < count; i++)
        sum->idle += speed[i] < SCORE_IDLE_SPEED;
    for (int i = 0, ended = 0; i < count; i++) {
        if (speed[i] < SCORE_IDLE_SPEED)
            continue;
        int first = i, last = i;
        while (first > ended && speed[first - 1] < speed[first])
            first--;
        while (last + 1 < count && speed[last + 1] >= SCORE_IDLE_SPEED)
            last++;
        while (last + 1 < count && speed[last + 1] < speed[last])
            last++;
        i = ended = last;
        const int samples = last - first + 1;
        if (samples < LEAST_MOVEMENT_S * SCORE_SPEED_HZ)
            continue;
        sum->movements++;
        sum->weight += samples;
        sum->weighted +=
            samples * score_spectral_arc_length(speed + first, samples, SCORE_SPEED_HZ);
    }
}

// --- forces --------------------------------------------------------------------------------------

// Time of a straight line from a to b during dt that is above the limit.
static double time_above(double a, double b, double limit, double dt)
{
    if (a > limit && b > limit)
        return dt;
    if (!(a > limit) && !(b > limit))
        return 0.0;
    return dt * (fmax(a, b) - limit) / fabs(a - b);
}

static void add_force(const ScoreRow *row, int64_t rows, double limit, ScoreTool *tool)
{
    bool above = false;
    for (int64_t i = 0; i < rows; i++) {
        const double f = vec3_length(row[i].force);
        if (f > tool->peak_force_n) {
            tool->peak_force_n = f;
            tool->peak_time_s = row[i].time;
        }
        tool->over_limit_count += f > limit && !above;
        above = f > limit;
        if (i == 0)
            continue;
        const double dt = row[i].time - row[i - 1].time, before = vec3_length(row[i - 1].force);
        tool->contact_time_s += 0.5 * dt * ((f > 0.0) + (before > 0.0));
        tool->force_time_n_s += 0.5 * dt * (f + before);
        tool->over_limit_s += time_above(before, f, limit, dt);
    }
}

// --- curves --------------------------------------------------------------------------------------

static void draw_force(const ScoreRow *row, int64_t rows, double from, double to, ScoreCurve *curve)
{
    curve->count = to > from ? SCORE_CURVE : 0;
    for (int k = 0; k < curve->count; k++) {
        curve->time[k] = from + (to - from) * (k + 0.5) / SCORE_CURVE;
        curve->force[k] = SCORE_UNKNOWN;
    }
    for (int64_t i = 0; i < rows && curve->count > 0; i++) {
        const double at = (row[i].time - from) / (to - from) * SCORE_CURVE;
        const int k = (int)fmin(fmax(at, 0.0), SCORE_CURVE - 1);
        curve->force[k] = fmax(curve->force[k], vec3_length(row[i].force)); // of NaN: the other
    }
}

static void draw_path(const ScoreRow *row, int64_t rows, double gap, ScoreCurve *curve)
{
    // A point of every n-th row, and one without a place where a gap is between two.
    const int64_t stride = 2 * rows / SCORE_CURVE + 1;
    bool gone = false;
    curve->path_count = 0;
    for (int64_t i = 0; i < rows; i++) {
        gone |= i > 0 && row[i].time - row[i - 1].time > gap;
        if (i % stride != 0 || curve->path_count + 2 > SCORE_CURVE)
            continue;
        if (gone)
            curve->path[curve->path_count++] = vec3(SCORE_UNKNOWN, 0.0, 0.0);
        curve->path[curve->path_count++] = row[i].position;
        gone = false;
    }
}

// -------------------------------------------------------------------------------------------------

void score_tool(const ScoreRow *row, int64_t rows, double force_limit, double from, double to,
                ScoreTool *tool)
{
    const int id = tool->id;
    const double median = median_distance(row, rows), gap = SCORE_GAP * median + 1e-9;
    const bool limited = force_limit > 0.0;
    // A spectrum up to 10 Hz needs rows that are closer than half a period.
    const bool fast_enough = median > 0.0 && median < 0.05;
    Smoothness smooth = {0};
    *tool = (ScoreTool){.id = id,
                        .rows = rows,
                        .rate_hz = median > 0.0 ? 1.0 / median : SCORE_UNKNOWN,
                        .peak_time_s = SCORE_UNKNOWN};
    for (int64_t first = 0, end; first < rows; first = end) {
        end = stretch_end(row, rows, first, gap);
        const int64_t count = end - first;
        tool->gaps += end < rows;
        add_force(row + first, count, limited ? force_limit : HUGE_VAL, tool);
        tool->time_s += row[end - 1].time - row[first].time;
        for (int64_t i = first + 1; i < end; i++)
            tool->path_m += vec3_length(vec3_sub(row[i].position, row[i - 1].position));
        // Slower rows show no movements; their speeds would be few.
        if (count < 2 || !fast_enough)
            continue;
        double *speed;
        const int speeds = resample(row + first, count, &speed);
        add_movements(speed, speeds, &smooth);
        free(speed);
    }
    // Ratios, where there is something to divide by.
    tool->movements = smooth.movements;
    tool->smoothness = smooth.weight > 0.0 ? smooth.weighted / smooth.weight : SCORE_UNKNOWN;
    tool->idle_fraction =
        smooth.samples > 0 ? (double)smooth.idle / (double)smooth.samples : SCORE_UNKNOWN;
    tool->mean_speed_m_s = tool->time_s > 0.0 ? tool->path_m / tool->time_s : SCORE_UNKNOWN;
    tool->mean_force_n =
        tool->contact_time_s > 0.0 ? tool->force_time_n_s / tool->contact_time_s : SCORE_UNKNOWN;
    tool->over_limit_fraction =
        tool->time_s > 0.0 ? tool->over_limit_s / tool->time_s : SCORE_UNKNOWN;
    if (!limited) {
        tool->over_limit_fraction = SCORE_UNKNOWN;
        tool->over_limit_s = SCORE_UNKNOWN;
        tool->over_limit_count = 0;
    }
    draw_force(row, rows, from, to, &tool->curve);
    draw_path(row, rows, gap, &tool->curve);
}
