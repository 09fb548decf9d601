// Everything that a study leaves behind: progress while it runs, then table, files, pictures,
// advice.
#ifndef PLIANT_STUDY_REPORT_H
#define PLIANT_STUDY_REPORT_H

#include "study/progress.h"
#include "study/study.h"

enum { REPORT_PATH = 4096 };

// Progress on stderr.
void report_begin(Progress *progress);
void report_progress(Progress *progress, int done, int count, const char *what);

// Makes the folder `wanted`, or study-NAME of the scene for NULL, unless it is there.
bool report_make_folder(const Scene *scene, const char *wanted, char folder[REPORT_PATH],
                        Status *status);

// Prints table and advice; writes runs.tsv, references.tsv, study.h5, the pictures and, when a
// case is advised, advice.cfg (its keys) and advised.cfg (the scene with them). `options` as they
// are in the context: complete.
bool report_all(const StudyResult *result, const Scene *scene, const StudyOptions *options,
                const char *folder, Status *status);

#endif
