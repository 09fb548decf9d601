// SPDX-License-Identifier: MIT
// Tables of anything: what is read has a fit within the ranges of the scene's keys, all else a
// reason. (test_curves.c tries tables of known laws with the real program.)
#include "test.h"
#include "random.h"
#include "scratch_folder.h"

#include "fit/fit.h"

enum { TABLES = 1500, TEXT = 4096 };

static uint64_t seed = 20;

static int pick(int count)
{
    return random_below(&seed, count);
}

// Words of tables in any order.
static size_t write_words(char *text)
{
    static const char *const word[] = {
        "0",      "0.1",         "1e-3",         ",",     ",",    "\n",   "\n",     "#",
        "nan",    "-",           "\t",           "1e308", ";",    " ",    "\"",     "10",
        "0.5",    "1e12",        "\xEF\xBB\xBF", "0.2",   ",5\n", "\r\n", ",1e5\n", "9e-320",
        "strain", "0,0\n0.1,1\n"};
    size_t length = 0;
    for (int i = pick(60); i > 0; i--)
        length += (size_t)sprintf(text + length, "%s", word[pick(sizeof word / sizeof word[0])]);
    return length;
}

// Rows with strains that do not fall and stresses of any size and sign.
static size_t write_rows(char *text)
{
    const double unit = pow(10.0, pick(24) - 12);
    double strain = 0.0;
    size_t length = 0;
    for (int i = pick(40); i > 0; i--) {
        const double stress =
            unit * (random_between(&seed, -0.1, 0.9)) * (pick(2) == 0 ? 1.0 : strain);
        length += (size_t)sprintf(text + length, "%.6g,%.6g\n", strain, stress);
        strain += pick(3) == 0 ? 0.0 : pow(10.0, -pick(8));
    }
    return length;
}

static void check(const char *path)
{
    FitTable table;
    Fit fit;
    Status status = {0};
    if (!fit_table_read(path, &table, &status)) {
        assert_int_equal(status.code, STATUS_INVALID);
        return;
    }
    if (fit_make(&table, path, &fit, &status)) {
        expect_at_least(fit.linear.rms, 0.0);
        assert_true(fit.linear.modulus > 0.0 && fit.linear.modulus <= 1e12);
        if (fit.shape == FIT_STIFFENS) {
            expect_at_most(fit.stiff.rms, fit.linear.rms);
            assert_true(fit.stiff.modulus > 0.0 && fit.stiff.modulus <= 1e12);
            assert_true(fit.stiff.strain > 0.0 && fit.stiff.strain <= 10.0);
            assert_true(fit.stiff.cap > 1.0 && fit.stiff.cap <= 100.0);
        }
    } else {
        assert_int_equal(status.code, STATUS_INVALID);
    }
    fit_table_destroy(&table);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(any_table_has_a_fit_in_range_or_a_reason)
{
    static char text[TEXT];
    for (int n = 0; n < TABLES; n++) {
        size_t length = n % 2 == 0 ? write_words(text) : write_rows(text);
        // Of every fifth table one byte is another.
        if (length > 0 && n % 5 == 0)
            text[pick((int)length)] = (char)pick(256);
        scratch_write(&scratch_space, "any.csv", text, length);
        check(scratch_at("any.csv"));
    }
}

// Across the edges a small strain meets the same modulus, and a large one 1.22 times it: measured
// on a simulated strip of 24 rows (1.227; what its border carries is known to 1 %).
TEST(a_sheet_across_its_edges_turns_into_the_pull)
{
    const FitLaw law = {.modulus = 100.0, .cap = 1.0};
    expect_near(fit_stress_across(&law, 1e-6), 1e-4, 1e-9);
    expect_near(fit_stress_across(&law, 0.5), 61.35, 0.6);
}
