// SPDX-License-Identifier: MIT
// Runs of cases: with steps of their own choice, one case, all of them, and the references that
// they are compared with.
#ifndef PLIANT_STUDY_RUN_H
#define PLIANT_STUDY_RUN_H

#include "scene/build.h"
#include "study/context.h"

// --- adaptive steps ------------------------------------------------------------------------------

// RK4 with adaptive steps: each tick is computed with n substeps and again with 2 n from the same
// state. The difference is about 15 times the error of the finer one, which is kept (Press et al.,
// Numerical Recipes in C, 2nd ed., 16.2; used by Choi et al. 2005, section 5). For comparison only:
// the daemon, whose ticks must have a bounded cost, does not have it.

typedef struct StepDoubling {
    World *world;
    int body;
    double tolerance;               // of the difference, in metres
    int substeps;                   // of the coarse pass in the next tick
    unsigned char *before;          // the state before the tick
    Vec3 *coarse, *fine, *velocity; // rows of read_state
    int rows;
    int most_substeps;
    long passes, refused; // refused: ticks repeated with more substeps
    double worst;         // largest difference of an accepted tick [m]
    int64_t resets;       // of accepted passes
} StepDoubling;

// `tolerance` [m]. Returns false if memory runs out.
bool step_doubling_create(StepDoubling *doubling, World *world, int body, double tolerance);
void step_doubling_destroy(StepDoubling *doubling);
// Computes one tick; returns the CPU time of its passes without copying [ns].
int64_t step_doubling_step(StepDoubling *doubling);

// --- cases ---------------------------------------------------------------------------------------

// Runs one case: builds its world, drives it, samples it, and measures its cost.

// Fills `run`; its verdict is the outcome; errors are set if the context has references. Returns
// false if memory runs out. Depends on its arguments alone, except for times.
bool study_run_case(const StudyContext *context, const StudyCase *what, StudyRun *run);

// Does the same once, without errors, with the samples in `trace` (made with the context's counts)
// or NULL.
bool study_trace_case(const StudyContext *context, const StudyCase *what, int repeats,
                      StudyRun *run, StudyTrace *trace);

// Measures how far a case moves if loads, the way of the press or, without both, gravity are larger
// by STUDY_NUDGE: a body that buckles amplifies it. NAN: with a log, or if a run fails. Returns
// false with `status` if memory runs out.
bool study_nudge(const StudyContext *context, const StudyCase *what, StudyErrors *moved,
                 Status *status);

// Runs all cases of a study, several at a time.

// The kind of the parts that are cases, each a StudyRun.
#define STUDY_CASE_PART "case"

// Receives a finished case; in the parent, in order of completion.
typedef void StudyProgress(void *user, int done, int count, const StudyRun *run);

// Runs the cases with up to `jobs` processes. result->run [count] are in the order of the cases,
// and the same (except for times) for any number of jobs. A case whose process dies is STUDY_BAD,
// one that takes too long STUDY_SKIPPED. Needs the references. `progress` may be NULL. With
// context->parts, cases that have ended are not run again, and those of other processes are waited
// for.
bool study_run_all(const StudyContext *context, const StudyCase *cases, int count, int jobs,
                   StudyProgress *progress, void *user, StudyResult *result, Status *status);

// --- references ----------------------------------------------------------------------------------

// The converged runs that cases are compared with: one for each mesh among the cases (error of the
// time steps alone), and the finest mesh of all (total error). Each is the last of three runs,
// every one twice as fine as the one before, from which its own error is estimated.

// Reports progress: first with done = 0 and a description of the work, then each run.
typedef void StudyReferenceProgress(void *user, int done, int count, const char *what);

// Makes all references that `cases` need, up to options.jobs at a time; the context owns them, and
// their data is copied to `result`. A reference that cannot be made has `known = false` and the
// reason in `what`. `progress` may be NULL. Returns false with `status` if memory or processes run
// out.
bool study_make_references(StudyContext *context, const StudyCase *cases, int count,
                           StudyReferenceProgress *progress, void *user, StudyResult *result,
                           Status *status);

// --- ranks of MPI --------------------------------------------------------------------------------

// With the build option PLIANT_MPI, mpirun starts several processes that share a study by its parts
// (parts.h). MPI says who begins it; from then on a rank is a process like any other, whose death
// ends nothing but itself.

// Called first by main; returns this process's rank, 0 without mpirun.
int ranks_begin(int *argc, char ***argv);
// Called once by every rank, also after a failure: returns true if all ranks pass true, when the
// first has made the folder. Leaves MPI.
bool ranks_go(bool ok);

#endif
