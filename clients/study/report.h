// SPDX-License-Identifier: MIT
// The output of a study: progress while it runs, then table, files, pictures and advice.
#ifndef PLIANT_STUDY_REPORT_H
#define PLIANT_STUDY_REPORT_H

#include "fit/results.h"
#include "study/parts.h"
#include "study/study.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

// --- fields --------------------------------------------------------------------------------------

// The fields of runs and references by name, unit and kind: the one list from which every file of a
// study is written. Functions only read.

typedef enum FieldKind {
    FIELD_TEXT,       // char[]
    FIELD_INT,        // int
    FIELD_BOOL,       // bool, written as 0 or 1
    FIELD_REAL,       // double; NAN: missing
    FIELD_INTEGRATOR, // the enums, written as words
    FIELD_PRECISION,
    FIELD_DETAIL,
    FIELD_VERDICT,
} FieldKind;

typedef struct Field {
    const char *name, *unit; // unit "": dimensionless number or text
    FieldKind kind;
    size_t at; // offset in StudyRun or StudyReference
} Field;

// Longest text of a field, including the terminator.
enum { FIELD_TEXT_MAX = STUDY_WHY };

// All of a StudyRun but cpu_s, which is an array.
extern const Field STUDY_RUN_FIELDS[];
extern const int STUDY_RUN_FIELD_COUNT;
extern const Field STUDY_REFERENCE_FIELDS[];
extern const int STUDY_REFERENCE_FIELD_COUNT;

bool field_is_text(const Field *field);
// Returns the word or text of a field for which field_is_text holds.
const char *field_text(const Field *field, const void *of);
// Returns the number of any other field; NAN: missing.
double field_number(const Field *field, const void *of);
// Prints either as in a file; "-": missing. `text` of FIELD_TEXT_MAX.
const char *field_print(const Field *field, const void *of, char *text);
// Prints a number so that it reads back bit-identical; "-" for NAN.
const char *field_print_real(double value, char *text);

const char *study_precision_name(Precision precision);
const char *study_detail_name(StudyDetail detail);
const char *study_verdict_name(StudyVerdict verdict);

// --- progress and files --------------------------------------------------------------------------

// Progress of a study on stderr: on a terminal one line that is rewritten, else a line per tenth.

typedef struct Progress {
    FILE *out;
    bool terminal;
    int columns;    // of the terminal
    double begin_s; // clock at the start
    int told;       // last tenth that was printed; -1: none
    int width;      // of the line on the terminal
} Progress;

// `now_s`: a monotonic clock [s].
void progress_begin(Progress *progress, FILE *out, bool terminal, int columns, double now_s);
// `done` of `count` cases are finished; `name` is being computed.
void progress_print(Progress *progress, int done, int count, const char *name, double now_s);
// Removes the line before other output.
void progress_end(Progress *progress);

// Estimates the remaining seconds from the mean of the cases done; negative: unknown.
double progress_left(double elapsed_s, int done, int count);
// Formats "1:02:03" or "2:03"; "?" for a negative time. `text` of 32 characters.
const char *progress_clock(double seconds, char *text);

// Print progress on stderr.
void report_begin(Progress *progress);
void report_progress(Progress *progress, int done, int count, const char *what);

// Makes the folder of a study (results.h): `wanted`, or study-SCENE.
bool report_make_folder(const char *scene, const char *wanted, char folder[RESULTS_PATH],
                        Status *status);
// The claim of the process that writes the tables.
#define REPORT_CLAIM "report"
// Writes runs.tsv with those of `count` cases that have ended, in any process.
void report_ended(const Parts *parts, int count, const char *folder);

// Prints table and advice; writes runs.tsv, references.tsv, study.h5, the pictures and, if a case
// is advised, advice.cfg (its keys) and advised.cfg (the scene with them). `options` as in the
// context: complete.
bool report_all(const StudyResult *result, const Scene *scene, const StudyOptions *options,
                const char *folder, Status *status);

// Saves a study: every field of every run and reference.

// First bytes of the tables: only files that begin so are replaced.
#define STUDY_RUNS_MARK       "name\tintegrator\t"
#define STUDY_REFERENCES_MARK "of\tlevel\t"

// Writes a header line and a row per run, columns separated by tabs, "-" for missing values. After
// the fields of a run follow the costs of all repeats, cpu_1 to cpu_N.
bool study_save_runs(const StudyResult *result, const char *path, Status *status);
// Writes a row per reference: the total one, then those in time, with the mesh in front.
bool study_save_references(const StudyResult *result, const char *path, Status *status);
// Writes both as one HDF5 file, format "pliant-study": /runs/<field> and /references/<field> with a
// row each, /runs/cpu_s [runs][repeats]. `scene_text`: of the scene file. Sets STATUS_FAILED also
// if HDF5 is not built in.
bool study_save_hdf(const StudyResult *result, const char *scene_text, const char *path,
                    Status *status);

// Draws the curves of a study with gnuplot, if installed.

// Writes folder/study.gp. It contains its data and draws, into its own folder, time.png and
// time.svg (error in time over cost, by integrator, on the scene's own mesh), total.png and
// total.svg (total error over cost, by detail, with the Pareto front; the reference's own error as
// a band, the advice circled and written below). `error`: the limit that is drawn, as a fraction.
typedef struct Advice Advice;
bool plot_write(const StudyResult *result, const char *folder, double error, const Advice *total,
                Status *status);
// The terminal output of a study: inputs, the references and their reliability, a row per case, and
// the reasons for missing cases.

// Prints everything but the advice.
void table_print(const StudyResult *result, FILE *out);
// Prints the cases alone, before any has run.
void table_print_cases(const StudyCase *cases, int count, FILE *out);

// Formats a fraction as "0.123 %"; "-" for NAN. At most 24 characters.
const char *table_percent(double fraction, char *text);

// --- advice --------------------------------------------------------------------------------------

// Advises the cheapest case that is accurate enough and keeps the rate.

// Share of a period that 99 of 100 ticks may take; the rest is for the loop, the other threads and
// a busier body.
#define ADVICE_SHARE 0.7

enum { ADVICE_TEXT = 1536 };

struct Advice {
    int run;    // in result->run; -1: none, no case can be compared
    bool met;   // all limits are met; else the nearest case is named and `sentence` says what it
                // misses
    bool holds; // the case holds the rate; else it is only named, and not advised
    bool time_only; // no usable reference of the total error: only the error of the time steps is
                    // judged
    double error;   // of the run and its reference together
    char sentence[ADVICE_TEXT];
};

// Chooses among the runs with verdict ok that a scene can specify (not step doubling). The advised
// run has the least median cost of those whose error plus that of the reference (its estimate, but
// at least the last difference that it is based on) is at most `error` (a fraction), that ran at
// `rate_hz` or more, whose 99th percentile of a tick is at most ADVICE_SHARE of the period, and
// whose median cost is at most ADVICE_SHARE. The error includes how far StudyResult.nudged moves;
// that of the force on the tool, if there is one, must be within `error` too. If none has all that,
// the nearest of those that hold the rate. If the reference of the total error is missing or itself
// has an error above `error`, the error in time counts, for runs on the scene's own mesh alone: it
// does not apply to coarser ones.
void advice_make(const StudyResult *result, double error, double rate_hz, Advice *advice);

// Chooses by the total error alone, within `error` or else the least round number above it that can
// be promised: a mesh of so few levels is seldom within 1 %. Says why if there is no advice.
void advice_make_total(const StudyResult *result, double error, double rate_hz, Advice *advice);

// The Pareto front: runs that no other run beats in both cost and error.

// Returns the error by which runs are compared: that of the pressed patch; without a patch that of
// the surface. NAN: neither.
double study_error(const StudyErrors *errors);

// Sets front[i] if no other candidate has at most its cost and at most its error, one of them less.
// All arrays are [count]; a cost or error that is not finite excludes the candidate. Marks all of
// several equal candidates.
void pareto_front(int count, const double *costs, const double *errors, bool *front);

// Finds the front of total error over median cost, of the runs with verdict ok; front: [run_count].
void study_front_total(const StudyResult *result, bool *front);

// Returns the run that is exactly the scene's own choice, or NULL.
const StudyRun *study_scene_run(const StudyResult *result);
// Returns the reference in time of a case's mesh, or NULL.
const StudyReference *study_time_reference(const StudyResult *result, const StudyCase *of);
// Returns the name of a case's mesh: the part after the comma in the names of its cases.
const char *study_mesh_words(const StudyResult *result, const StudyCase *like);

#endif
