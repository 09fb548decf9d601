// Saves a study: every field of every run and reference.
#ifndef PLIANT_STUDY_SAVE_H
#define PLIANT_STUDY_SAVE_H

#include "study/study.h"

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

#endif
