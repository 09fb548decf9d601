// SPDX-License-Identifier: MIT
// The subject of a study: the scene without what does not affect its motion, its inputs, the
// sampled points and times, and the references. Made once, by study_prepare; identical in every
// process that gets the same scene and options.
#ifndef PLIANT_STUDY_CONTEXT_H
#define PLIANT_STUDY_CONTEXT_H

#include "base/vec.h"
#include "scene/build.h"
#include "study/parts.h"
#include "study/study.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// --- the samples of a run ------------------------------------------------------------------------

// The samples of one run, at times common to all runs of a study. One block of plain data whose
// size follows from the counts alone, so that it can be sent as it is.

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

// --- the context ---------------------------------------------------------------------------------

enum { STUDY_POINTS = 512 };

// The inputs that drive the scene.
typedef enum StudyDrive {
    DRIVE_LOADS, // the scene's own, its gravity, or the built-in one, which is then in `scene`
    DRIVE_LOG,   // a log of inputs
    DRIVE_PRESS, // a tool that presses the body
} StudyDrive;

// The built-in press: the tool's path along a line, by time.
typedef struct StudyPress {
    int tool;
    Quat orientation;
    Vec3 start;                    // of the tool's frame [m]
    Vec3 inward;                   // unit
    double way;                    // from `start` to the deepest point [m]
    double down_s, hold_s, back_s; // durations, one after the other
} StudyPress;

typedef struct StudyInputs {
    StudyDrive drive;
    const char *log; // DRIVE_LOG
    StudyPress press;
    Vec3 center;   // of the pressed patch [m]
    double radius; // [m]
    double end_s;  // end of all inputs [s]
    char text[STUDY_WHY];
} StudyInputs;

// Points of the studied body that every case has: nodes of its coarsest mesh, or of the surface of
// its lattice.
typedef struct StudyPoints {
    int count;
    int id[STUDY_POINTS];      // BodyMesh.id
    int fine_id[STUDY_POINTS]; // in a lattice of half the cell size; -1: none
    Vec3 rest[STUDY_POINTS];
    double weight[STUDY_POINTS]; // weight in the pressed patch, sum 1
} StudyPoints;

typedef struct StudyContext {
    const Scene *given;   // as read; outlives the context
    Scene scene;          // own copy of what the study changes: bodies, loads
    StudyOptions options; // complete: duration, rate, jobs, repeats filled in
    StudyInputs inputs;
    StudyPoints points;
    SceneLoad *own_load; // the built-in one, owned, or NULL
    bool plane;          // the body lies in z = 0
    int body;            // index of the pressed and sampled body
    double extent;       // its largest edge at rest [m]
    double rest_volume;  // enclosed [m3]; NAN: it encloses none
    bool may_halve;      // its lattice can be built with half the cell size
    double sample_s;     // time between samples; a multiple of the scene's tick [s]
    int sample_count;    // the first at sample_s
    double limit_s;      // CPU time after which a run is given up [s]
    int mesh_count;
    StudyMesh mesh[STUDY_MESHES];         // data of each mesh
    StudyTrace *mesh_trace[STUDY_MESHES]; // the finest run of each, or NULL
    StudyReference finest;
    StudyTrace *finest_trace; // of the total error, or NULL
    const Parts *parts;       // where what has ended is kept, and shared; NULL: nowhere
} StudyContext;

// Prepares a study; reads only the log and builds the scene once to examine its body. `scene` and
// the strings of `options` outlive the context. Returns false with `status` if there is no body or
// the scene cannot be built.
bool study_prepare(StudyContext *context, const Scene *scene, const StudyOptions *options,
                   Status *status);
void study_destroy(StudyContext *context);
// Frees the references, if any.
void study_forget_references(StudyContext *context);
// Returns a hash of all that the results depend on, but for files that the scene names.
uint64_t study_key(const StudyContext *context, const StudyCase *cases, int count);
// Sets what is known before the first run: names, inputs, the machine.
void study_describe(const StudyContext *context, StudyResult *result);

// Returns the index in context->mesh of the reference in time of a case; -1: none.
int study_mesh_of(const StudyContext *context, const StudyCase *what);

// --- the scene changed for a case ----------------------------------------------------------------

// A scene that shares all but its bodies with another.
typedef struct StudyScene {
    Scene scene;
    SceneBody *body; // owned
} StudyScene;

// Copies the study's scene without what does not affect its motion: one thread, no skin, no
// prepared file. Returns false if memory runs out.
bool study_copy_scene(const Scene *from, StudyScene *copy);
void study_destroy_scene(StudyScene *copy);
// Changes bodies and rate for the case. `sample_s`: a lower rate's tick divides it.
void study_change_scene(StudyScene *copy, const StudyCase *what, double sample_s);
// Copies, changes and builds. `estimates`: bodies estimate their errors. Returns false with
// `status` if the scene is refused.
bool study_build(const StudyContext *context, const StudyCase *what, bool estimates,
                 StudyScene *copy, World *world, Status *status);

#endif
