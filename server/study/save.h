// What a study leaves in files: every field of every run and reference.
#ifndef PLIANT_STUDY_SAVE_H
#define PLIANT_STUDY_SAVE_H

#include "study/study.h"

// A row a run, a header line, columns separated by tabs, "-" for what is missing; behind the fields
// of field.h the cost of each repeat, cpu_1 to cpu_N.
bool study_save_runs(const StudyResult *result, const char *path, Status *status);
// A row a reference: "in all" and then those in time, with the mesh in front.
bool study_save_references(const StudyResult *result, const char *path, Status *status);
// Both as one HDF5 file (design.md section 7), format "pliant-study": /runs/<field> and
// /references/<field> with a row each, /runs/cpu_s [runs][repeats]. `scene_text`: of the scene
// file. STATUS_FAILED also when HDF5 is not built in.
bool study_save_hdf(const StudyResult *result, const char *scene_text, const char *path,
                    Status *status);

#endif
