// The samples of one run, at times common to all runs of a study. One block of plain data whose
// size follows from the counts alone, so that it can be sent as it is.
#ifndef PLIANT_STUDY_TRACE_H
#define PLIANT_STUDY_TRACE_H

#include "base/vec.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct StudySample {
    Vec3 patch;     // mean displacement of the pressed patch [m]
    Vec3 force;     // on the tool, mean since the last sample [N]
    double volume;  // enclosed [m3]
    double kinetic; // [J]
    double elastic; // [J]
} StudySample;

typedef struct StudyTrace {
    int sample_count, point_count; // capacity
    int used;                      // samples taken
    bool has_volume, has_force;
    double extent, rest_volume; // of the body [m], [m3]
    // followed in memory by StudySample [sample_count], Vec3 displacement
    // [sample_count][point_count]
} StudyTrace;

size_t study_trace_bytes(int sample_count, int point_count);
// Returns a zeroed trace, which the caller frees; NULL: out of memory.
StudyTrace *study_trace_create(int sample_count, int point_count);
StudySample *study_trace_sample(const StudyTrace *trace, int index);
// Returns the displacements of all points from their rest positions [m].
Vec3 *study_trace_points(const StudyTrace *trace, int index);

#endif
