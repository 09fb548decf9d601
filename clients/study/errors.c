#include "study/errors.h"

#include <math.h>

// Differences that decrease more slowly do not show a limit, and cannot be extrapolated.
static const double LEAST_ORDER = 0.5;

StudyErrors study_no_errors(void)
{
    return (StudyErrors){.patch = (double)NAN,
                         .surface = (double)NAN,
                         .volume = (double)NAN,
                         .energy = (double)NAN,
                         .force = (double)NAN};
}

// Returns a difference divided by a size, if that is positive.
static double relative(double difference, double size)
{
    return size > 0.0 ? difference / size : difference > 0.0 ? HUGE_VAL : (double)NAN;
}

static double square(Vec3 v)
{
    return vec3_dot(v, v);
}

static double energy_of(const StudySample *sample)
{
    return sample->kinetic + sample->elastic;
}

static double surface_error(const StudyTrace *trace, const StudyTrace *reference, int samples)
{
    double farthest = 0.0, size = 0.0;
    for (int s = 0; s < samples; s++) {
        const Vec3 *x = study_trace_points(trace, s), *y = study_trace_points(reference, s);
        for (int p = 0; p < reference->point_count; p++) {
            farthest = fmax(farthest, square(vec3_sub(x[p], y[p])));
            size = fmax(size, square(y[p]));
        }
    }
    return relative(sqrt(farthest), sqrt(size));
}

StudyErrors study_errors(const StudyTrace *trace, const StudyTrace *reference)
{
    StudyErrors errors = study_no_errors();
    int samples = trace->used < reference->used ? trace->used : reference->used;
    if (samples == 0 || trace->point_count != reference->point_count)
        return errors;
    double patch = 0.0, patch_size = 0.0, force = 0.0, force_size = 0.0;
    double energy = 0.0, energy_size = 0.0, volume = 0.0;
    for (int s = 0; s < samples; s++) {
        const StudySample *a = study_trace_sample(trace, s), *b = study_trace_sample(reference, s);
        patch += square(vec3_sub(a->patch, b->patch));
        patch_size += square(b->patch);
        force += square(vec3_sub(a->force, b->force));
        force_size += square(b->force);
        energy = fmax(energy, fabs(energy_of(a) - energy_of(b)));
        energy_size = fmax(energy_size, energy_of(b));
        volume = fmax(volume, fabs(a->volume - b->volume)); // skips unknown values
    }
    errors.patch = relative(sqrt(patch), sqrt(patch_size));
    errors.surface = surface_error(trace, reference, samples);
    errors.energy = relative(energy, energy_size);
    if (trace->has_force && reference->has_force)
        errors.force = relative(sqrt(force), sqrt(force_size));
    if (trace->has_volume && reference->has_volume)
        errors.volume = relative(volume, fabs(reference->rest_volume));
    return errors;
}

void study_richardson(StudyReference *reference, double expected)
{
    const double coarse = reference->difference[0], fine = reference->difference[1];
    reference->known = isfinite(coarse) && isfinite(fine);
    reference->order = (double)NAN;
    reference->own_error = (double)NAN;
    if (!reference->known)
        return;
    reference->own_error = fmax(coarse, fine);
    if (!(coarse > fine))
        return;
    reference->order = fine > 0.0 ? log2(coarse / fine) : HUGE_VAL;
    if (reference->order < LEAST_ORDER)
        return;
    double order = fmin(reference->order, expected);
    reference->own_error = fine / (exp2(order) - 1.0);
}
