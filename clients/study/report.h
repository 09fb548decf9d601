// The output of a study: progress while it runs, then table, files, pictures and advice.
#ifndef PLIANT_STUDY_REPORT_H
#define PLIANT_STUDY_REPORT_H

#include "study/progress.h"
#include "study/study.h"

enum { REPORT_PATH = 4096 };

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

#endif
