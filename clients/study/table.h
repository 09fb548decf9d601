// The terminal output of a study: inputs, the references and their reliability, a row per case, and
// the reasons for missing cases.
#ifndef PLIANT_STUDY_TABLE_H
#define PLIANT_STUDY_TABLE_H

#include "study/study.h"

#include <stdio.h>

// Prints everything but the advice.
void table_print(const StudyResult *result, FILE *out);
// Prints the cases alone, before any has run.
void table_print_cases(const StudyCase *cases, int count, FILE *out);

// Formats a fraction as "0.123 %"; "-" for NAN. At most 24 characters.
const char *table_percent(double fraction, char *text);

#endif
