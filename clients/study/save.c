// SPDX-License-Identifier: MIT
// Runs and references as tables: tab-separated text, and HDF5.
#include "study/report.h"

#include "base/check.h"
#include "base/output.h"
#include "io/data_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// --- the list of fields, and their values as text and numbers ------------------------------------

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
    {"estimated", "", FIELD_REAL, OF(estimated)},
    {"estimated_force", "", FIELD_REAL, OF(estimated_force)},
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

// --- files ---------------------------------------------------------------------------------------

enum { NAME = 64, STUDY_FILE_VERSION = 1 };

// --- references as rows --------------------------------------------------------------------------

// The run that a reference belongs to, in front of its own fields. Level and threshold do not apply
// to the total reference.
typedef struct ReferenceRow {
    char of[NAME]; // "all", or the detail of a reference in time
    int level;
    double threshold;
    bool paper_rule;
    StudyReference reference;
} ReferenceRow;

#define OF(member) offsetof(ReferenceRow, member)
static const Field HEAD[] = {
    {"of", "", FIELD_TEXT, OF(of)},
    {"level", "", FIELD_INT, OF(level)},
    {"threshold", "", FIELD_REAL, OF(threshold)},
    {"paper_rule", "", FIELD_BOOL, OF(paper_rule)},
};
#undef OF
enum { HEAD_COUNT = sizeof HEAD / sizeof HEAD[0], ROW_FIELDS = HEAD_COUNT + 16 };

static int reference_fields(Field *fields)
{
    memcpy(fields, HEAD, sizeof HEAD);
    for (int i = 0; i < STUDY_REFERENCE_FIELD_COUNT; i++) {
        fields[HEAD_COUNT + i] = STUDY_REFERENCE_FIELDS[i];
        fields[HEAD_COUNT + i].at += offsetof(ReferenceRow, reference);
    }
    return HEAD_COUNT + STUDY_REFERENCE_FIELD_COUNT;
}

static int reference_rows(const StudyResult *result, ReferenceRow *rows)
{
    rows[0] = (ReferenceRow){.of = "all", .threshold = (double)NAN, .reference = result->finest};
    for (int i = 0; i < result->mesh_count; i++) {
        const StudyMesh *mesh = &result->mesh[i];
        ReferenceRow *row = &rows[1 + i];
        *row = (ReferenceRow){.level = mesh->level,
                              .threshold = mesh->threshold,
                              .paper_rule = mesh->paper_rule,
                              .reference = mesh->reference};
        snprintf(row->of, sizeof row->of, "time, %s", study_detail_name(mesh->detail));
    }
    return 1 + result->mesh_count;
}

// --- text ----------------------------------------------------------------------------------------

static void print_names(const Field *fields, int count, FILE *file)
{
    for (int f = 0; f < count; f++)
        fprintf(file, "%s%s", f > 0 ? "\t" : "", fields[f].name);
}

static void print_values(const Field *fields, int count, const void *of, FILE *file)
{
    char text[FIELD_TEXT_MAX];
    for (int f = 0; f < count; f++)
        fprintf(file, "%s%s", f > 0 ? "\t" : "", field_print(&fields[f], of, text));
}

static int most_repeats(const StudyResult *result)
{
    int most = 0;
    for (int i = 0; i < result->run_count; i++)
        most = result->run[i].repeats > most ? result->run[i].repeats : most;
    return most;
}

static double repeat_cost(const StudyRun *run, int repeat)
{
    return repeat < run->repeats ? run->cpu_s[repeat] : (double)NAN;
}

bool study_save_runs(const StudyResult *result, const char *path, Status *status)
{
    char text[FIELD_TEXT_MAX];
    Output output;
    int repeats = most_repeats(result);
    FILE *file = output_begin_text(&output, path, STUDY_RUNS_MARK, status);
    if (file == NULL)
        return false;
    // Names first: by them a reader knows the columns.
    print_names(STUDY_RUN_FIELDS, STUDY_RUN_FIELD_COUNT, file);
    for (int r = 0; r < repeats; r++)
        fprintf(file, "\tcpu_%d", r + 1);
    fputc('\n', file);
    // A row a run, with the cost of every repeat.
    for (int i = 0; i < result->run_count; i++) {
        const StudyRun *run = &result->run[i];
        print_values(STUDY_RUN_FIELDS, STUDY_RUN_FIELD_COUNT, run, file);
        for (int r = 0; r < repeats; r++)
            fprintf(file, "\t%s", field_print_real(repeat_cost(run, r), text));
        fputc('\n', file);
    }
    return output_end_text(&output, file, true, true, status);
}

bool study_save_references(const StudyResult *result, const char *path, Status *status)
{
    static ReferenceRow rows[1 + STUDY_MESHES];
    Field fields[ROW_FIELDS];
    Output output;
    int field_count = reference_fields(fields), count = reference_rows(result, rows);
    FILE *file = output_begin_text(&output, path, STUDY_REFERENCES_MARK, status);
    if (file == NULL)
        return false;
    // A row for each reference, with the same fields as in the HDF5 file.
    print_names(fields, field_count, file);
    fputc('\n', file);
    for (int i = 0; i < count; i++) {
        print_values(fields, field_count, &rows[i], file);
        fputc('\n', file);
    }
    return output_end_text(&output, file, true, true, status);
}

// --- HDF5 ----------------------------------------------------------------------------------------

// Writes one field of `rows` records, `size` bytes apart, as the data set /group/field.
static bool write_field(DataFile *file, const char *group, const Field *field, const void *records,
                        size_t size, int rows)
{
    char name[NAME];
    snprintf(name, sizeof name, "/%s/%s", group, field->name);
    // A column in each form; one of them is written.
    char *texts = calloc((size_t)rows + 1, FIELD_TEXT_MAX);
    double *reals = calloc((size_t)rows + 1, sizeof *reals);
    int *ints = calloc((size_t)rows + 1, sizeof *ints);
    ASSERT(texts != NULL && reals != NULL && ints != NULL);
    for (int i = 0; i < rows; i++) {
        const void *record = (const char *)records + (size_t)i * size;
        if (field_is_text(field)) {
            snprintf(texts + (size_t)i * FIELD_TEXT_MAX, FIELD_TEXT_MAX, "%s",
                     field_text(field, record));
        } else {
            reals[i] = field_number(field, record);
            ints[i] = field->kind == FIELD_REAL ? 0 : (int)reals[i];
        }
    }
    // In the form of the field.
    bool ok = field_is_text(field) ? data_file_write_texts(file, name, rows, FIELD_TEXT_MAX, texts)
              : field->kind == FIELD_REAL
                  ? data_file_write_reals(file, name, rows, 0, reals, field->unit)
                  : data_file_write_ints(file, name, rows, ints);
    free(texts);
    free(reals);
    free(ints);
    return ok;
}

static bool write_repeats(DataFile *file, const StudyResult *result)
{
    int repeats = most_repeats(result), rows = result->run_count;
    if (repeats == 0 || rows == 0)
        return true;
    double *costs = calloc((size_t)rows * (size_t)repeats, sizeof *costs);
    ASSERT(costs != NULL);
    for (int i = 0; i < rows; i++)
        for (int r = 0; r < repeats; r++)
            costs[i * repeats + r] = repeat_cost(&result->run[i], r);
    bool ok = data_file_write_reals(file, "/runs/cpu_s", rows, repeats, costs, "s/s");
    free(costs);
    return ok;
}

static bool write_heads(DataFile *file, const StudyResult *result)
{
    return data_file_write_text(file, "scene_name", result->scene) &&
           data_file_write_text(file, "body", result->body) &&
           data_file_write_text(file, "inputs", result->inputs) &&
           data_file_write_text(file, "machine", result->machine) &&
           data_file_write_reals(file, "/duration", 0, 0, &result->duration_s, "s") &&
           data_file_write_reals(file, "/rate", 0, 0, &result->rate_hz, "Hz");
}

bool study_save_hdf(const StudyResult *result, const char *scene_text, const char *path,
                    Status *status)
{
    static ReferenceRow rows[1 + STUDY_MESHES];
    Field fields[ROW_FIELDS];
    int field_count = reference_fields(fields), count = reference_rows(result, rows);
    DataFile *file = data_file_create(path, "pliant-study", STUDY_FILE_VERSION, scene_text,
                                      "pliant-study", status);
    if (file == NULL)
        return false;
    // Groups of data sets: a field each, with its unit.
    bool ok = write_heads(file, result) && write_repeats(file, result);
    for (int f = 0; f < STUDY_RUN_FIELD_COUNT && result->run_count > 0; f++)
        ok = ok && write_field(file, "runs", &STUDY_RUN_FIELDS[f], result->run,
                               sizeof result->run[0], result->run_count);
    for (int f = 0; f < field_count; f++)
        ok = ok && write_field(file, "references", &fields[f], rows, sizeof rows[0], count);
    ok = ok && data_file_save(file);
    data_file_destroy(file);
    return ok;
}
