// What a study says on the terminal: what was run, the references and how far they can be trusted,
// a row a case, and why cases have none.
#ifndef PLIANT_STUDY_TABLE_H
#define PLIANT_STUDY_TABLE_H

#include "study/study.h"

#include <stdio.h>

// Everything but the advice.
void table_print(const StudyResult *result, FILE *out);
// The cases alone, before any was run.
void table_print_cases(const StudyCase *cases, int count, FILE *out);

// "0.123 %", of a fraction; "-" for NAN. At most 24 characters.
const char *table_percent(double fraction, char *text);

#endif
