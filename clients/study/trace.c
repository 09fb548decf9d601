#include "study/trace.h"

#include <stdlib.h>

size_t study_trace_bytes(int sample_count, int point_count)
{
    size_t samples = (size_t)sample_count;
    return sizeof(StudyTrace) + samples * sizeof(StudySample) +
           samples * (size_t)point_count * sizeof(Vec3);
}

StudyTrace *study_trace_create(int sample_count, int point_count)
{
    StudyTrace *trace = calloc(1, study_trace_bytes(sample_count, point_count));
    if (trace != NULL) {
        trace->sample_count = sample_count;
        trace->point_count = point_count;
    }
    return trace;
}

StudySample *study_trace_sample(const StudyTrace *trace, int index)
{
    return (StudySample *)(uintptr_t)(trace + 1) + index;
}

Vec3 *study_trace_points(const StudyTrace *trace, int index)
{
    Vec3 *first = (Vec3 *)(uintptr_t)(study_trace_sample(trace, trace->sample_count));
    return first + (size_t)index * (size_t)trace->point_count;
}
