// SPDX-License-Identifier: MIT
// What a study tells of runs that are known: the Pareto front, the table, the files, progress.
#include "test.h"
#include "scratch_folder.h"
#include "study_sample.h"

#include "study/report.h"

#include <sys/stat.h>

#ifdef PLIANT_WITH_HDF5
#include "recording_view.h"
#endif

static StudyResult result;

// What a function prints.
static char said[1 << 16];

static const char *printed_table(void)
{
    FILE *out = fmemopen(said, sizeof said, "w");
    assert_non_null(out);
    table_print(&result, out);
    fclose(out);
    return said;
}

static void fill(void)
{
    sample_begin(&result, 0.001, 1e-6);
    sample_add(&result, "leapfrog bound single, level 1", 0.05, 60e-6, 0.002, 0.03)->what.is_scene =
        true;
    sample_add(&result, "rk4 bound single, level 1", 0.2, 240e-6, 1e-6, 0.029);
    StudyRun *refused = sample_add(&result, "rk4 10 ms single, level 1", 1.0, 1.0, 0.0, 0.0);
    refused->verdict = STUDY_REFUSED;
    snprintf(refused->why, sizeof refused->why, "time_step 0.01 exceeds\tthe bound 0.001\n");
    refused->repeats = 0;
    refused->cpu_median = refused->tick_p99 = (double)NAN;
    refused->total = refused->time =
        (StudyErrors){(double)NAN, (double)NAN, (double)NAN, (double)NAN, (double)NAN};
    StudyRun *finer =
        sample_add(&result, "leapfrog bound single, level 2", 0.4, 500e-6, 0.001, 0.004);
    finer->what.detail = DETAIL_HELD;
    finer->what.level = 2;
}

// --- front ---------------------------------------------------------------------------------------

AROUND_ALL(scratch_begin, scratch_end)

TEST(front_holds_what_nothing_beats)
{
    const double nan_value = (double)NAN;
    //                       best  beaten  cheap  equal  equal  unknown    no cost
    const double costs[] = {2.0, 3.0, 1.0, 4.0, 4.0, 0.5, nan_value};
    const double errors[] = {0.2, 0.2, 0.9, 0.1, 0.1, nan_value, 0.01};
    const bool expected[] = {true, false, true, true, true, false, false};
    bool front[7];
    pareto_front(7, costs, errors, front);
    for (int i = 0; i < 7; i++)
        assert_int_equal(front[i], expected[i]);
}

// Against the definition, on points by chance: on the front exactly when no point is in the closed
// quarter below it but itself and its equals.
TEST(front_is_what_its_definition_says)
{
    enum { COUNT = 200 };
    double costs[COUNT], errors[COUNT];
    bool front[COUNT];
    unsigned seed = 1;
    for (int i = 0; i < COUNT; i++) {
        seed = seed * 1664525u + 1013904223u;
        costs[i] = (seed >> 16) % 37; // few values: many ties
        seed = seed * 1664525u + 1013904223u;
        errors[i] = (seed >> 16) % 37;
    }
    pareto_front(COUNT, costs, errors, front);
    for (int i = 0; i < COUNT; i++) {
        int better = 0;
        for (int j = 0; j < COUNT; j++)
            better += (costs[j] < costs[i] && errors[j] <= errors[i]) ||
                      (costs[j] <= costs[i] && errors[j] < errors[i]);
        assert_int_equal(front[i], better == 0);
    }
}

TEST(refused_runs_are_on_no_front)
{
    bool front[STUDY_CASES];
    fill();
    result.run[2].cpu_median = 1e-6; // as if it had been the best of all
    result.run[2].total.patch = 1e-9;
    study_front_total(&result, front);
    assert_true(front[0]);
    assert_false(front[2]);
    assert_true(front[3]);
}

TEST(surface_counts_where_nothing_is_pressed)
{
    StudyErrors errors = {.patch = (double)NAN, .surface = 0.25};
    assert_true(study_error(&errors) == 0.25);
    errors.patch = 0.5;
    assert_true(study_error(&errors) == 0.5);
}

// --- table ---------------------------------------------------------------------------------------

TEST(table_tells_every_case_and_why_some_have_no_row)
{
    fill();
    printed_table();
    for (int i = 0; i < result.run_count; i++)
        expect_in(said, result.run[i].what.name);
    expect_in(said, "leapfrog bound single, level 1 (the scene)");
    expect_in(said, "refused: rk4 10 ms single, level 1: time_step 0.01 exceeds");
    expect_in(said, "\n* leapfrog bound single, level 2");
    expect_in(said, "observed order 2.00, own error 0.1 %");
}

// Columns stand below each other: of a table's rows none is longer than its titles allow.
TEST(rows_of_the_table_have_one_length)
{
    fill();
    result.run[3].cpu_median = 123456.0;
    result.run[3].nodes_least = 12;
    char *row = strstr(printed_table(), "  case");
    assert_non_null(row);
    size_t length = strcspn(row, "\n");
    for (int i = 0; i < 5; i++, row += length + 1)
        assert_int_equal(strcspn(row, "\n"), length);
}

TEST(references_without_an_estimate_are_said_to_have_none)
{
    fill();
    result.finest.order = (double)NAN;
    expect_in(printed_table(), "not monotone: no order observed, own error 0.1 %, the "
                               "larger of both");
    result.finest.own_error = (double)NAN;
    result.mesh[0].reference.known = false;
    snprintf(result.mesh[0].reference.what, STUDY_NAME, "none: out of time");
    printed_table();
    expect_in(said, "not monotone: no order observed, own error unknown");
    expect_in(said, "in time, level 1: none: out of time");
}

// --- files ---------------------------------------------------------------------------------------

static int columns_of(const char *line)
{
    int count = 1;
    for (; *line != '\n'; line++)
        count += *line == '\t';
    return count;
}

static char *read_back(const char *name)
{
    size_t size;
    char *text = (char *)scratch_read(&scratch_space, name, &size);
    text[size] = '\0';
    return text;
}

static int check_columns(const char *text)
{
    int rows = 0, columns = columns_of(text);
    for (const char *line = text; *line != '\0'; line = strchr(line, '\n') + 1, rows++)
        assert_int_equal(columns_of(line), columns);
    return rows;
}

// The text in a column of a row, of a table that read_back gave.
static void cell_of(const char *text, int row, const char *column, char cell[STUDY_WHY])
{
    int index = 0;
    const char *at = text;
    while (strncmp(at, column, strlen(column)) != 0 || strchr("\t\n", at[strlen(column)]) == NULL) {
        at += strcspn(at, "\t\n");
        assert_int_equal(*at, '\t'); // else there is no such column
        at++;
        index++;
    }
    for (at = text; row >= 0; row--)
        at = strchr(at, '\n') + 1;
    while (index-- > 0)
        at += strcspn(at, "\t\n") + 1;
    snprintf(cell, STUDY_WHY, "%.*s", (int)strcspn(at, "\t\n"), at);
}

TEST(tables_have_a_column_for_every_field_of_every_run)
{
    char cell[STUDY_WHY];
    Status status = {0};
    fill();
    result.run[1].cpu_median = 0.1 + 0.2; // not a short decimal
    assert_true(study_save_runs(&result, scratch_at("runs.tsv"), &status));
    char *text = read_back("runs.tsv");
    assert_int_equal(check_columns(text), 1 + result.run_count);
    assert_int_equal(columns_of(text), STUDY_RUN_FIELD_COUNT + 3);
    cell_of(text, 1, "cpu_median", cell);
    assert_true(strtod(cell, NULL) == result.run[1].cpu_median);
    cell_of(text, 1, "cpu_3", cell);
    assert_true(strtod(cell, NULL) == result.run[1].cpu_s[2]);
    cell_of(text, 2, "cpu_1", cell);
    assert_string_equal(cell, "-");
    cell_of(text, 2, "total_patch", cell);
    assert_string_equal(cell, "-");
    cell_of(text, 2, "verdict", cell);
    assert_string_equal(cell, "refused");
    cell_of(text, 2, "why", cell); // what would end a column is gone
    assert_string_equal(cell, "time_step 0.01 exceeds the bound 0.001 ");
    cell_of(text, 3, "detail", cell);
    assert_string_equal(cell, "held");
    free(text);
    assert_true(study_save_references(&result, scratch_at("references.tsv"), &status));
    text = read_back("references.tsv");
    assert_int_equal(check_columns(text), 1 + 1 + result.mesh_count);
    cell_of(text, 1, "own_error", cell);
    assert_true(strtod(cell, NULL) == 1e-6);
    free(text);
    assert_string_equal(status.text, "");
}

// No member of a run is left out: the fields and the array of costs fill it but for padding.
TEST(fields_cover_a_run)
{
    static unsigned char covered[sizeof(StudyRun)];
    memset(covered, 0, sizeof covered);
    memset(covered + offsetof(StudyRun, cpu_s), 1, sizeof(double) * STUDY_REPEATS);
    for (int f = 0; f < STUDY_RUN_FIELD_COUNT; f++) {
        const Field *field = &STUDY_RUN_FIELDS[f];
        size_t size = field->kind == FIELD_REAL   ? sizeof(double)
                      : field->kind == FIELD_BOOL ? sizeof(bool)
                                                  : sizeof(int);
        if (field->kind == FIELD_TEXT)
            size = strcmp(field->name, "name") == 0 ? STUDY_NAME : STUDY_WHY;
        for (size_t i = 0; i < size; i++)
            assert_false(covered[field->at + i]++);
    }
    // What is left is padding: shorter than a double in front of one (or of the end), shorter than
    // an int in front of an int.
    for (size_t i = 0; i < sizeof covered;) {
        size_t begin = i;
        while (i < sizeof covered && !covered[i])
            i++;
        if (i > begin)
            assert_in_range(i - begin, 1, i % sizeof(double) == 0 ? 7 : 3);
        else
            i++;
    }
}

TEST(a_folder_that_is_none_is_said)
{
    Status status = {0};
    fill();
    assert_false(study_save_runs(&result, "/nowhere/runs.tsv", &status));
    assert_int_equal(status.code, STATUS_FAILED);
    assert_string_equal(status.text, "/nowhere/runs.tsv: No such file or directory");
}

#ifdef PLIANT_WITH_HDF5
static void read_set(hid_t file, const char *name, hid_t type, void *to, const char *unit)
{
    view_get(file, name, type, to);
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    expect_attribute(set, "unit", unit);
    H5Dclose(set);
}

static herr_t has_unit(hid_t file, const char *name, const H5O_info_t *info, void *count)
{
    if (info->type != H5O_TYPE_DATASET)
        return 0;
    ++*(int *)count;
    return H5Aexists_by_name(file, name, "unit", H5P_DEFAULT) > 0 ? 0 : -1;
}

TEST(hdf5_holds_every_run)
{
    const char *path = scratch_at("study.h5");
    double costs[4], repeats[4][3];
    int nodes[4], count = 0;
    static char verdicts[4][FIELD_TEXT_MAX];
    Status status = {0};
    fill();
    bool ok = study_save_hdf(&result, "name = \"sample\";\n", path, &status);
    assert_string_equal(status.text, "");
    assert_true(ok);
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_true(file >= 0);
    expect_attribute(file, "format", "pliant-study");
    expect_attribute(file, "scene", "name = \"sample\";\n");
    expect_attribute(file, "created_by", "pliant-study " PLIANT_VERSION);
    assert_true(H5Aexists(file, "version") > 0);
    read_set(file, "/runs/cpu_median", H5T_NATIVE_DOUBLE, costs, "s/s");
    read_set(file, "/runs/nodes_most", H5T_NATIVE_INT, nodes, "");
    read_set(file, "/runs/cpu_s", H5T_NATIVE_DOUBLE, repeats, "s/s");
    hid_t word = H5Tcopy(H5T_C_S1);
    H5Tset_size(word, FIELD_TEXT_MAX);
    read_set(file, "/runs/verdict", word, verdicts, "");
    H5Tclose(word);
    for (int i = 0; i < 4; i++) {
        assert_true(costs[i] == result.run[i].cpu_median || isnan(result.run[i].cpu_median));
        assert_int_equal(nodes[i], result.run[i].nodes_most);
        assert_string_equal(verdicts[i], i == 2 ? "refused" : "ok");
    }
    assert_true(repeats[3][2] == result.run[3].cpu_s[2]);
    assert_true(isnan(repeats[2][0]));
    // Every data set says its unit: runs, references, duration and rate.
    assert_true(H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_NATIVE, has_unit, &count, H5O_INFO_BASIC) >=
                0);
    assert_int_equal(count,
                     STUDY_RUN_FIELD_COUNT + 1 + STUDY_REFERENCE_FIELD_COUNT + 4 /* head */ + 2);
    H5Fclose(file);
}
#endif

// --- pictures ------------------------------------------------------------------------------------

static Advice advice;

TEST(missing_gnuplot_leaves_the_script)
{
    Status status = {0};
    fill();
    advice_make_total(&result, 0.01, 1000.0, &advice);
    assert_true(plot_write(&result, scratch_space.folder, 0.01, &advice, &status));
    assert_int_equal(results_draw("no-such-gnuplot", scratch_space.folder, "study.gp", &status),
                     DRAW_NO_GNUPLOT);
    FREED char *script = read_back("study.gp");
    expect_in(script, "set output 'time.png'");
    expect_in(script, "set output 'total.svg'");
    expect_in(script, "Pareto front");
}

static bool there(const char *name)
{
    struct stat info;
    return stat(scratch_at(name), &info) == 0 && info.st_size > 1000;
}

TEST(gnuplot_draws_all_four)
{
    Status status = {0};
    fill();
    snprintf(result.scene, sizeof result.scene, "it's a_scene");
    advice_make_total(&result, 0.01, 1000.0, &advice);
    assert_true(plot_write(&result, scratch_space.folder, 0.01, &advice, &status));
    DrawResult drawn = results_draw("gnuplot", scratch_space.folder, "study.gp", &status);
    if (drawn == DRAW_NO_GNUPLOT)
        skip();
    assert_string_equal(status.text, "");
    assert_int_equal(drawn, DRAWN);
    assert_true(there("time.png") && there("time.svg"));
    assert_true(there("total.png") && there("total.svg"));
}

TEST(a_script_without_points_is_no_error)
{
    Status status = {0};
    sample_begin(&result, 0.001, 1e-6);
    assert_true(plot_write(&result, scratch_space.folder, 0.01, &advice, &status));
    DrawResult drawn = results_draw("gnuplot", scratch_space.folder, "study.gp", &status);
    assert_true(drawn == DRAWN || drawn == DRAW_NO_GNUPLOT);
}

// --- progress ------------------------------------------------------------------------------------

TEST(time_left_is_that_of_cases_like_those_done)
{
    char text[32];
    assert_true(progress_left(30.0, 3, 12) == 90.0);
    assert_true(progress_left(30.0, 12, 12) == 0.0);
    assert_true(progress_left(30.0, 0, 12) < 0.0);
    assert_string_equal(progress_clock(59.6, text), "1:00");
    assert_string_equal(progress_clock(3600.0 + 62.0, text), "1:01:02");
    assert_string_equal(progress_clock(-1.0, text), "?");
    assert_string_equal(progress_clock((double)NAN, text), "?");
}

TEST(without_a_terminal_a_line_a_tenth)
{
    Progress progress;
    memset(said, 0, sizeof said);
    FILE *out = fmemopen(said, sizeof said, "w");
    progress_begin(&progress, out, false, 80, 100.0);
    for (int done = 0; done <= 1000; done++)
        progress_print(&progress, done, 1000, "a case", 100.0 + done);
    progress_end(&progress);
    fclose(out);
    int lines = 0;
    for (const char *c = said; *c != '\0'; c++)
        lines += *c == '\n';
    assert_int_equal(lines, 11);
    expect_in(said, " 50 %  8:20 elapsed, 8:20 left  a case\n");
    assert_null(strchr(said, '\r'));
}

TEST(on_a_terminal_one_line_is_written_over)
{
    Progress progress;
    memset(said, 0, sizeof said);
    FILE *out = fmemopen(said, sizeof said, "w");
    progress_begin(&progress, out, true, 60, 0.0);
    progress_print(&progress, 1, 4, "a case with a name that is far too long for the line", 1.0);
    size_t first = strlen(said);
    assert_int_equal(first, 1 + 59); // never the last column, where some terminals wrap
    progress_print(&progress, 2, 4, "b", 2.0);
    assert_int_equal(strlen(said), 2 * first); // the rest of the longer line is overwritten
    assert_null(strchr(said, '\n'));
    progress_end(&progress);
    fclose(out);
}
