// The output of a study: progress while it runs, then table, files, pictures and advice.
#ifndef PLIANT_STUDY_REPORT_H
#define PLIANT_STUDY_REPORT_H

#include "study/study.h"

#include <stdbool.h>
#include <stdio.h>

enum { REPORT_PATH = 4096 };

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

// Makes the folder `wanted`, or study-NAME of the scene for NULL, unless it exists. Refuses a
// folder that has files of our names but no table of a study, since they are not ours.
bool report_make_folder(const Scene *scene, const char *wanted, char folder[REPORT_PATH],
                        Status *status);

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
// the fields of field.h follow the costs of all repeats, cpu_1 to cpu_N.
bool study_save_runs(const StudyResult *result, const char *path, Status *status);
// Writes a row per reference: the total one, then those in time, with the mesh in front.
bool study_save_references(const StudyResult *result, const char *path, Status *status);
// Writes both as one HDF5 file, format "pliant-study": /runs/<field> and /references/<field> with a
// row each, /runs/cpu_s [runs][repeats]. `scene_text`: of the scene file. Sets STATUS_FAILED also
// if HDF5 is not built in.
bool study_save_hdf(const StudyResult *result, const char *scene_text, const char *path,
                    Status *status);

// Draws the curves of a study with gnuplot, if installed.

typedef enum PlotResult { PLOT_DRAWN, PLOT_NO_GNUPLOT, PLOT_FAILED } PlotResult;

// Writes folder/study.gp. It contains its data and draws, into its own folder, time.png and
// time.svg (error in time over cost, by integrator, on the scene's own mesh), total.png and
// total.svg (total error over cost, by detail, with the Pareto front). `error`: the limit that is
// drawn, as a fraction.
bool plot_write(const StudyResult *result, const char *folder, double error, Status *status);
// Runs `program` (found by name, "gnuplot") on it. A failed picture is no failure of the study;
// `status` has the reason.
PlotResult plot_draw(const char *program, const char *folder, Status *status);

// The terminal output of a study: inputs, the references and their reliability, a row per case, and
// the reasons for missing cases.

// Prints everything but the advice.
void table_print(const StudyResult *result, FILE *out);
// Prints the cases alone, before any has run.
void table_print_cases(const StudyCase *cases, int count, FILE *out);

// Formats a fraction as "0.123 %"; "-" for NAN. At most 24 characters.
const char *table_percent(double fraction, char *text);

#endif
