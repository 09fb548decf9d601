// The list of fields, and their values as text and numbers.
#include "study/field.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define OF(member) offsetof(StudyRun, member)
const Field STUDY_RUN_FIELDS[] = {
    {"name", "", FIELD_TEXT, OF(what.name)},
    {"integrator", "", FIELD_INTEGRATOR, OF(what.integrator)},
    {"step_doubling", "", FIELD_BOOL, OF(what.step_doubling)},
    {"tolerance", "", FIELD_REAL, OF(what.tolerance)},
    {"time_step_asked", "s", FIELD_REAL, OF(what.time_step)},
    {"precision", "", FIELD_PRECISION, OF(what.precision)},
    {"detail", "", FIELD_DETAIL, OF(what.detail)},
    {"level", "", FIELD_INT, OF(what.level)},
    {"threshold", "", FIELD_REAL, OF(what.threshold)},
    {"paper_rule", "", FIELD_BOOL, OF(what.paper_rule)},
    {"is_scene", "", FIELD_BOOL, OF(what.is_scene)},
    {"verdict", "", FIELD_VERDICT, OF(verdict)},
    {"why", "", FIELD_TEXT, OF(why)},
    {"substeps", "", FIELD_INT, OF(substeps)},
    {"rate", "Hz", FIELD_REAL, OF(rate_hz)},
    {"time_step", "s", FIELD_REAL, OF(time_step)},
    {"nodes_least", "", FIELD_INT, OF(nodes_least)},
    {"nodes_most", "", FIELD_INT, OF(nodes_most)},
    {"links", "", FIELD_INT, OF(links)},
    {"repeats", "", FIELD_INT, OF(repeats)},
    {"cpu_median", "s/s", FIELD_REAL, OF(cpu_median)},
    {"cpu_least", "s/s", FIELD_REAL, OF(cpu_least)},
    {"cpu_most", "s/s", FIELD_REAL, OF(cpu_most)},
    {"tick_p50", "s", FIELD_REAL, OF(tick_p50)},
    {"tick_p99", "s", FIELD_REAL, OF(tick_p99)},
    {"tick_most", "s", FIELD_REAL, OF(tick_most)},
    {"time_patch", "", FIELD_REAL, OF(time.patch)},
    {"time_surface", "", FIELD_REAL, OF(time.surface)},
    {"time_volume", "", FIELD_REAL, OF(time.volume)},
    {"time_energy", "", FIELD_REAL, OF(time.energy)},
    {"time_force", "", FIELD_REAL, OF(time.force)},
    {"total_patch", "", FIELD_REAL, OF(total.patch)},
    {"total_surface", "", FIELD_REAL, OF(total.surface)},
    {"total_volume", "", FIELD_REAL, OF(total.volume)},
    {"total_energy", "", FIELD_REAL, OF(total.energy)},
    {"total_force", "", FIELD_REAL, OF(total.force)},
};
#undef OF
const int STUDY_RUN_FIELD_COUNT = (int)(sizeof STUDY_RUN_FIELDS / sizeof STUDY_RUN_FIELDS[0]);

#define OF(member) offsetof(StudyReference, member)
const Field STUDY_REFERENCE_FIELDS[] = {
    {"what", "", FIELD_TEXT, OF(what)},
    {"step_coarse", "", FIELD_REAL, OF(step[0])},
    {"step_middle", "", FIELD_REAL, OF(step[1])},
    {"step_fine", "", FIELD_REAL, OF(step[2])},
    {"difference_coarse", "", FIELD_REAL, OF(difference[0])},
    {"difference_fine", "", FIELD_REAL, OF(difference[1])},
    {"order", "", FIELD_REAL, OF(order)},
    {"own_error", "", FIELD_REAL, OF(own_error)},
    {"known", "", FIELD_BOOL, OF(known)},
};
#undef OF
const int STUDY_REFERENCE_FIELD_COUNT =
    (int)(sizeof STUDY_REFERENCE_FIELDS / sizeof STUDY_REFERENCE_FIELDS[0]);

const char *study_precision_name(Precision precision)
{
    return precision == PRECISION_SINGLE ? "single" : "double";
}

const char *study_detail_name(StudyDetail detail)
{
    switch (detail) {
    case DETAIL_SCENE:
        return "scene";
    case DETAIL_HELD:
        return "held";
    case DETAIL_ADAPTIVE:
        return "adaptive";
    }
    return "?";
}

const char *study_verdict_name(StudyVerdict verdict)
{
    switch (verdict) {
    case STUDY_OK:
        return "ok";
    case STUDY_REFUSED:
        return "refused";
    case STUDY_BAD:
        return "bad";
    case STUDY_SKIPPED:
        return "skipped";
    }
    return "?";
}

bool field_is_text(const Field *field)
{
    return field->kind != FIELD_INT && field->kind != FIELD_BOOL && field->kind != FIELD_REAL;
}

const char *field_text(const Field *field, const void *of)
{
    const void *value = (const char *)of + field->at;
    switch (field->kind) {
    case FIELD_INTEGRATOR:
        return integrator_name(*(const IntegratorKind *)value);
    case FIELD_PRECISION:
        return study_precision_name(*(const Precision *)value);
    case FIELD_DETAIL:
        return study_detail_name(*(const StudyDetail *)value);
    case FIELD_VERDICT:
        return study_verdict_name(*(const StudyVerdict *)value);
    default:
        return value;
    }
}

double field_number(const Field *field, const void *of)
{
    const void *value = (const char *)of + field->at;
    switch (field->kind) {
    case FIELD_INT:
        return *(const int *)value;
    case FIELD_BOOL:
        return *(const bool *)value ? 1.0 : 0.0;
    default:
        return *(const double *)value;
    }
}

const char *field_print_real(double value, char *text)
{
    if (isnan(value))
        return strcpy(text, "-");
    for (int digits = 6; digits <= 17; digits++) {
        snprintf(text, FIELD_TEXT_MAX, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    return text;
}

const char *field_print(const Field *field, const void *of, char *text)
{
    if (!field_is_text(field))
        return field_print_real(field_number(field, of), text);
    snprintf(text, FIELD_TEXT_MAX, "%s", field_text(field, of));
    for (char *c = text; *c != '\0'; c++) // characters that would end a column or a row
        if (*c == '\t' || *c == '\n' || *c == '\r')
            *c = ' ';
    return text[0] != '\0' ? text : strcpy(text, "-");
}
