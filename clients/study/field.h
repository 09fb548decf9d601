// The fields of runs and references by name, unit and kind: the one list from which every file of a
// study is written. Functions only read.
#ifndef PLIANT_STUDY_FIELD_H
#define PLIANT_STUDY_FIELD_H

#include "study/study.h"

#include <stddef.h>

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

#endif
