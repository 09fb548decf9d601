// SPDX-License-Identifier: MIT
// Error against run time: a scene is run offline in many ways, each compared with a reference that
// is finer in every respect. This header has the types that the study's parts share: cases,
// measurements and references, and makes the grid. run.h runs the cases and the references;
// report.h presents the result and advises. The result of a case is plain data of fixed size, so
// that other processes and machines can compute and send it.
#ifndef PLIANT_STUDY_STUDY_H
#define PLIANT_STUDY_STUDY_H

#include "base/isa.h"
#include "body/integrator.h"
#include "scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

enum { STUDY_CASES = 512, STUDY_REPEATS = 32, STUDY_NAME = 80, STUDY_WHY = 400 };

// How finely the bodies are subdivided.
typedef enum StudyDetail {
    DETAIL_SCENE,    // as in the scene
    DETAIL_HELD,     // all faces (elements) at `level`
    DETAIL_ADAPTIVE, // surface: from level 0 to `level`, thresholds scaled by `threshold`; voxel:
                     // elements follow tools, steered to the error `threshold` unless UNSTEERED
} StudyDetail;

#define UNSTEERED 1.0

// One way to run the scene: a row of the table.
typedef struct StudyCase {
    char name[STUDY_NAME]; // unique and readable: "leapfrog 0.5 ms single, adaptive 2"
    IntegratorKind integrator;
    bool step_doubling; // RK4 with adaptive steps (Press et al.), controlled by `tolerance`
    double tolerance;   // of the difference of a doubled step, relative to the size of the body
    double time_step; // [s] at most; 0: the stability bound. Above the tick: the rate is lowered to
                      // 1 / time_step
    Precision precision;
    StudyDetail detail;
    int level;
    double threshold;
    bool paper_rule; // adjust = "choi2005", law = "miyazaki2004"; else ours
    bool is_scene;   // exactly the scene's own choice
} StudyCase;

typedef enum StudyVerdict {
    STUDY_OK,
    STUDY_REFUSED, // at load: `why`
    STUDY_BAD,     // resets of the state, bad numbers, or motion beyond all bounds: `why`
    STUDY_SKIPPED, // not run: `why`
} StudyVerdict;

// Differences from a reference, each relative to the reference's largest value (for patch and force
// to its L2 norm over time). NAN: no reference, or the scene lacks the quantity.
typedef struct StudyErrors {
    double patch;   // L2 in time of the displacement of the pressed patch
    double surface; // largest distance of any sampled point at any sampled time
    double volume;  // largest difference of the enclosed volume, relative to that at rest
    double energy;  // largest difference of kinetic + elastic energy
    double force;   // L2 in time of the force on the tool
} StudyErrors;

typedef struct StudyRun {
    StudyCase what;
    StudyVerdict verdict;
    char why[STUDY_WHY];
    int substeps;                       // per tick, at the start
    double rate_hz;                     // of ticks, as run
    double time_step;                   // [s] as run, at the start
    int nodes_least, nodes_most, links; // springs or elements, at the most
    int repeats;
    double cpu_s[STUDY_REPEATS]; // of the steps alone, per simulated second [s]
    double cpu_median, cpu_least, cpu_most;
    double tick_p50, tick_p99, tick_most; // [s] of the repeat with the median cost
    StudyErrors time;  // from the converged run of the same mesh: of the steps in time alone
    StudyErrors total; // from the finest reference: of everything
    // What the body says of itself as pliantd publishes it: the error of its discretisation in
    // space, L2 in time over that of its displacements, and of the force on tools. NAN: unknown.
    double estimated, estimated_force;
} StudyRun;

#define STUDY_NUDGE 1e-4 // relative: far above rounding, far below what a hand controls

// Estimate of a reference's own error from three runs, each twice as fine as the one before.
typedef struct StudyReference {
    char what[STUDY_NAME]; // "rk4 double, 0.0625 ms, level 4"
    double step[3];        // [s], or the edge length of the level [m]
    double difference[2];  // patch error between neighbours: coarse to middle, middle to fine
    double order;          // observed: log2 of their ratio; NAN: not monotone
    double own_error;      // of the finest, by Richardson extrapolation at min(order, expected)
    bool known;
} StudyReference;

// The common reference in time of all cases with the same detail and rule.
typedef struct StudyMesh {
    StudyDetail detail;
    int level;
    double threshold;
    bool paper_rule;
    StudyReference reference;
} StudyMesh;

enum { STUDY_MESHES = 32 };

typedef struct StudyResult {
    char scene[SCENE_NAME_MAX], body[BODY_NAME_MAX],
        inputs[STUDY_WHY];   // inputs: how it is pressed, in words
    char machine[STUDY_WHY]; // processor, kernels' level, compiler
    double duration_s, rate_hz;
    bool wall;  // the body is a surface,
    bool bends; // and its wall resists bending
    int mesh_count, run_count;
    StudyMesh mesh[STUDY_MESHES];
    StudyReference finest; // of the total error
    // How far the scene's own run moves if its inputs differ by STUDY_NUDGE: no error below is
    // meaningful. 0 or NAN: unknown.
    StudyErrors nudged;
    StudyRun run[STUDY_CASES];
} StudyResult;

typedef struct StudyOptions {
    const char *scene_path, *input_log, *out_folder, *only; // only: cases whose name has this
    double duration_s; // 0: until the inputs end, and then long enough to return
    double rate_hz;    // required rate; 0: the scene's
    double error;      // required error, as a fraction (0.01)
    int jobs, repeats;
    bool quick; // a coarse grid
    const char *isa;
} StudyOptions;

// --- the grid of cases ---------------------------------------------------------------------------

// The grid of cases: every axis varied around the scene's own choice, and the combinations that the
// curves need: integrator x time step on the scene's mesh and on the coarsest; detail x the scene's
// integrator, the default one and the paper's.

// Fills `cases` [STUDY_CASES] and returns their number. The first is the scene itself. Names are
// unique, and no two cases are equal. With options->only: the scene itself and the cases whose name
// contains this text.
int study_make_cases(const Scene *scene, const StudyOptions *options, StudyCase *cases);

// Returns the case that the scene specifies for its first body; the others follow it.
StudyCase study_scene_case(const Scene *scene);

// True if both have the same detail, rule and thresholds, whatever their time steps. DETAIL_SCENE
// equals the detail that it stands for, given by its level and threshold (0: held).
bool study_same_mesh(const StudyCase *a, const StudyCase *b);
// Writes the name of a case's mesh: "level 2", "adaptive 2 x 0.5, choi2005".
void study_name_mesh(const Scene *scene, const StudyCase *what, char *name, size_t size);
// Sets the name that follows from the other members.
void study_name_case(const Scene *scene, StudyCase *what);

#endif
