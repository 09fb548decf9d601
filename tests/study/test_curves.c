// SPDX-License-Identifier: MIT
// pliant-fit, and pliant-study --fit, as a user runs it: tables of known laws and of others, good
// and bad ones. What it prints is compared with closed forms that are written down here.
#include "test.h"
#include "study_program.h"

// --- tables --------------------------------------------------------------------------------------

typedef double Law(double strain);

// Writes a table of so many points from strain 0 to `most`; `noise` [Pa] is the same in every run.
static void write_table(const char *name, Law *law, double most, int count, double noise)
{
    FILE *out = fopen(scratch(name), "w");
    assert_non_null(out);
    unsigned long long seed = 1;
    fprintf(out, "strain,stress\n");
    for (int i = 0; i < count; i++) {
        const double strain = most * i / (count - 1);
        double sum = 0.0; // of twelve even numbers: nearly normal, with the deviation 1
        for (int k = 0; k < 12; k++) {
            seed = seed * 6364136223846793005ull + 1442695040888963407ull;
            sum += (double)(seed >> 11) / 9007199254740992.0 - 0.5;
        }
        fprintf(out, "%.12g,%.12g\n", strain, law(strain) + noise * sum);
    }
    assert_int_equal(fclose(out), 0);
}

static double line(double strain)
{
    return 5e4 * strain;
}

// The server's law below its cap: E = 30 kPa, strain = 0.25.
static double exponential(double strain)
{
    return 3e4 * strain * exp(strain * strain / 0.0625);
}

// The same with a cap of 6: (1 + 2 q) exp(q) = 6 at q = 0.820558..., beyond it a straight line.
static double capped(double strain)
{
    const double knee = 0.25 * sqrt(0.8205579511289689);
    const double below = strain < knee ? strain : knee;
    return exponential(below) + 6.0 * 3e4 * (strain - below);
}

// Incompressible Ogden material with one term under tension, nominal stress; as skin has it:
// Shergold, Fleck and Radford 2006 (Int. J. Impact Eng. 32, 1384). The exponents here stiffen
// slowly and suddenly.
static double ogden(double strain, double mu, double alpha)
{
    const double stretch = 1.0 + strain;
    return 2.0 * mu / alpha * (pow(stretch, alpha - 1.0) - pow(stretch, -0.5 * alpha - 1.0));
}

static double ogden_9(double strain)
{
    return ogden(strain, 1.1e5, 9.0);
}

static double ogden_26(double strain)
{
    return ogden(strain, 1e4, 26.0);
}

// A toe and a line, 5 and 14 times as steep.
static double toe_5(double strain)
{
    return 2e4 * (strain < 0.15 ? strain : 0.15 + 5.0 * (strain - 0.15));
}

static double toe_14(double strain)
{
    return 2e4 * (strain < 0.15 ? strain : 0.15 + 14.0 * (strain - 0.15));
}

static double flattening(double strain)
{
    return 1e4 * (1.0 - exp(-4.0 * strain));
}

// --- what it prints ------------------------------------------------------------------------------

typedef struct Row {
    double modulus, strain, cap, rms;
} Row;

// The words behind a line's name in the output; fails if there is none.
static const char *after(const char *name)
{
    const char *at = strstr(result.out, name);
    if (at == NULL)
        fail_msg("no '%s' in\n%s", name, result.out);
    return at + strlen(name);
}

static Row stiffening_row(void)
{
    Row row;
    assert_int_equal(sscanf(after("\nstiffening "), "%lf %lf %lf %lf", &row.modulus, &row.strain,
                            &row.cap, &row.rms),
                     4);
    return row;
}

static double strip_rms(void)
{
    return strtod(after("\n  a strip of it, pulled "), NULL);
}

static double line_rms(double *modulus)
{
    double rms;
    assert_int_equal(sscanf(after("\nlinear "), "%lf - - %lf", modulus, &rms), 2);
    return rms;
}

static bool stiffens(void)
{
    return strstr(result.out, "\nstiffening ") != NULL;
}

// --- tables of laws ------------------------------------------------------------------------------

TEST(a_line_has_a_modulus_and_no_stiffening)
{
    double modulus;
    write_table("line.csv", line, 0.5, 300, 0.0);
    run_well("--fit line.csv");
    expect_near(line_rms(&modulus), 0.0, 0.0);
    expect_near(modulus, 5e4, 0.0);
    assert_false(stiffens());
    expect_printed(&result, "The table determines no stiffening");
    expect_printed(&result, "\nmaterial = { youngs_modulus = 5e+04; };\n");
    // Of a strip that reaches its strain in a second, waves and marks miss by less than 1e-3.
    expect_near(strip_rms(), 0.0, 0.1);
}

TEST(noise_is_not_taken_for_stiffening)
{
    double modulus;
    write_table("noisy.csv", line, 0.5, 300, 500.0);
    run_well("--fit noisy.csv");
    assert_false(stiffens());
    // 500 of 25000 Pa; 300 numbers show their deviation within 5 % or so. E: 500/sqrt(300 x
    // 0.29^2).
    expect_near(line_rms(&modulus), 2.0, 0.2);
    expect_near(modulus, 5e4, 300.0);
}

TEST(a_curve_of_the_law_is_found_again)
{
    write_table("capped.csv", capped, 0.4, 400, 0.0);
    run_well("--fit capped.csv");
    Row row = stiffening_row();
    // All but rounding to four digits.
    expect_near(row.modulus, 3e4, 30.0);
    expect_near(row.strain, 0.25, 2e-4);
    expect_near(row.cap, 6.0, 6e-3);
    expect_near(row.rms, 0.0, 0.02);
    expect_near(strip_rms(), 0.0, 1.0); // the bound
    expect_printed(&result, "The cap is reached within the table");
}

// What the table does not reach is the least that has no effect: the slope at its end.
TEST(a_cap_beyond_the_table_is_the_slope_at_its_end)
{
    write_table("below.csv", exponential, 0.25, 200, 0.0);
    run_well("--fit below.csv");
    Row row = stiffening_row();
    expect_near(row.modulus, 3e4, 30.0);
    expect_near(row.strain, 0.25, 2e-4);
    expect_near(row.cap, 3.0 * exp(1.0), 0.02); // q = 1; rounded up by 5e-4
    expect_near(row.rms, 0.0, 0.02);
    expect_near(strip_rms(), 0.0, 1.0);
    expect_printed(&result, "The table ends before any cap");
}

TEST(curves_of_other_laws_are_met_within_three_percent)
{
    // Fivefold and fourteenfold slopes, as of skin; Ogden's at the strain where they are reached.
    static const struct {
        Law *law;
        double most;
    } curve[] = {{ogden_9, 0.354},  {ogden_9, 0.571}, {ogden_26, 0.0884},
                 {ogden_26, 0.137}, {toe_5, 0.4},     {toe_14, 0.4}};
    for (size_t i = 0; i < sizeof curve / sizeof curve[0]; i++) {
        double modulus;
        write_table("other.csv", curve[i].law, curve[i].most, 200, 0.0);
        run_well("--fit other.csv");
        const Row row = stiffening_row();
        printf("curve %zu: line %.2f %%, stiffening %.2f %%, strip %.2f %%\n", i,
               line_rms(&modulus), row.rms, strip_rms());
        expect_at_most(row.rms, 3.0);     // the bound
        expect_at_most(strip_rms(), 3.0); // here, too
        expect_at_least(line_rms(&modulus), 3.0);
    }
}

TEST(a_surface_gets_the_modulus_times_its_thickness)
{
    write_table("capped.csv", capped, 0.4, 400, 0.0);
    run_well("--fit capped.csv --model surface --thickness 0.002 --out wall");
    expect_near(strtod(after("youngs_modulus_2d = "), NULL), 60.0, 0.06);
    expect_near(strip_rms(), 0.0, 1.0);
    expect_printed(&result, "across them it misses the table by ");
}

TEST(a_curve_that_flattens_is_said_to)
{
    double modulus;
    write_table("flat.csv", flattening, 0.5, 100, 0.0);
    run_well("--fit flat.csv");
    assert_false(stiffens());
    expect_at_least(line_rms(&modulus), 10.0);
    expect_printed(&result, "The slope falls along the pull");
}

// --- files ---------------------------------------------------------------------------------------

TEST(the_group_makes_a_scene_that_runs)
{
    write_table("capped.csv", capped, 0.4, 400, 0.0);
    for (int surface = 0; surface < 2; surface++) {
        run_well(surface ? "--fit capped.csv --out again --model surface --thickness 1e-3"
                         : "--fit capped.csv --out again");
        assert_true(is_there("again/fit.tsv"));
        assert_true(is_there("again/fit.gp"));
        run_daemon_well(&result, "--offline 0.01 again/strip.cfg");
    }
}

TEST(files_of_others_are_not_replaced)
{
    write_table("line.csv", line, 0.5, 300, 0.0);
    assert_int_equal(mkdir(scratch("others"), 0777), 0);
    write_text(scratch("others/strip.cfg"), "mine");
    run("--fit line.csv --out others");
    expect_refusal(&result, 2, "others/strip.cfg: is not of a fit and would be replaced");
    run("--fit line.csv --out nowhere/there");
    expect_refusal(&result, 1, "nowhere/there: cannot be made or written to");
}

// --- tables as users have them -------------------------------------------------------------------

TEST(spreadsheets_and_rigs_are_read)
{
    static const char *const good[] = {
        // As a spreadsheet writes it.
        "\xEF\xBB\xBFStrain,Stress [Pa]\r\n# test 3\r\n\r\n0,0\r\n0.1,100\r\n0.2,200\r\n0.3,300",
        "0,0,0\n0.1,100,1\n0.2,200,2\n0.2,200,3\n0.3,300,4\n",
        "  0 , 0 \n\t1e-1 ,1e2\n+.2,200.\n# 9,9\n0.3,300\n\n\n",
    };
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        double modulus;
        write_text(scratch("good.csv"), good[i]);
        run_well("--fit good.csv");
        line_rms(&modulus);
        expect_near(modulus, 1000.0, 0.0);
        assert_true((strstr(result.out, "column 3, time, is not used") != NULL) == (i == 1));
    }
}

#define FOUR "0,0\n0.1,100\n0.2,200\n"

TEST(bad_tables_are_refused_by_line)
{
    static const char *const bad[][2] = {
        {"", "bad.csv: has 0 points of strain and stress, fewer than 4"},
        {"strain,stress\n" FOUR, "bad.csv: has 3 points"},
        {FOUR "0.3;300\n", "bad.csv:4: has a semicolon"},
        {"0,0;0,0\n", "bad.csv:1: has a semicolon"},
        {FOUR "0.3\t300\n", "bad.csv:4: '0.3 300' is one column"},
        {FOUR "0.3\n", "bad.csv:4: '0.3' is one column"},
        {FOUR "0.3,300,1,2\n", "bad.csv:4: '0.3,300,1,2' has more columns"},
        {FOUR "0.3,three\n", "bad.csv:4: 'three' is not a number"},
        {FOUR "0.3,\n", "bad.csv:4: '' is not a number"},
        {FOUR "0.3,300 Pa\n", "bad.csv:4: '300 Pa' is not a number"},
        {FOUR "0.3,0x1F\n", "bad.csv:4: '0x1F' is not a number"},
        {FOUR "0.3,300,soon\n", "bad.csv:4: 'soon' is not a number"},
        {FOUR "\"0.3\",\"300\"\n", "bad.csv:4: '\"0.3\"' is not a number"},
        {"strain,stress\n-,Pa\n" FOUR, "bad.csv:2: '-' is not a number"},
        {FOUR "0.3,nan\n", "bad.csv:4: 'nan' is not finite"},
        {FOUR "inf,300\n", "bad.csv:4: 'inf' is not finite"},
        {FOUR "0.3,1e999\n", "bad.csv:4: '1e999' is not finite"},
        {FOUR "0.3,300,nan\n", "bad.csv:4: 'nan' is not finite"},
        {FOUR "0.3,2e13\n", "bad.csv:4: '2e13' is a stress beyond 1e13 Pa"},
        {"-0.1,0\n" FOUR, "bad.csv:1: '-0.1' is a negative strain"},
        {FOUR "0.19,300\n", "bad.csv:4: '0.19' is a strain below the one before"},
        {FOUR "20,300\n", "bad.csv:4: '20' is a strain beyond 10: is it in percent?"},
        {"strain (%),stress\n" FOUR, "bad.csv:1: '%' is in a header: strain must be a fraction"},
        {"strain,stress [kPa]\n" FOUR, "bad.csv:1: 'kPa' is in a header: stress must be in Pa"},
        {FOUR "0.3,\x01\x1b[31m\n", "bad.csv:4: '??[31m' is not a number"},
        {"0,1\n0,1\n0,1\n0,1\n", "bad.csv: its strain stays below 1e-06"},
        {"0,0\n0.1,-1\n0.2,-2\n0.3,-3\n", "bad.csv: fits a Young's modulus of -10 Pa, outside"},
        {"0,0\n0.1,0\n0.2,0\n0.3,0\n", "bad.csv: fits a Young's modulus of 0 Pa, outside"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        write_text(scratch("bad.csv"), bad[i][0]);
        run("--fit bad.csv");
        expect_refusal(&result, 2, bad[i][1]);
        assert_string_equal(result.out, "");
    }
    assert_false(is_there("fit-bad"));
    run("--fit nowhere.csv");
    expect_refusal(&result, 2, "nowhere.csv: No such file or directory");
    run("--fit /");
    expect_refusal(&result, 2, "/: Is a directory");
    run("--fit /dev/zero");
    expect_refusal(&result, 2, "/dev/zero:1: is longer than 1022 characters, or no text");
}

TEST(tables_of_up_to_a_hundred_thousand_points_are_read)
{
    write_table("long.csv", capped, 0.4, 100000, 500.0);
    run_well("--fit long.csv");
    // E within its standard error, 500 Pa / sqrt(100000 x 0.5 x 0.13^2) = 17, times three for the
    // two others, and four of these.
    expect_near(stiffening_row().modulus, 3e4, 200.0);
    write_table("long.csv", capped, 0.4, 100001, 0.0);
    run("--fit long.csv");
    expect_refusal(&result, 2, "long.csv:100002: has more than 100000 points");
}

TEST(what_is_hardly_meant_is_noted)
{
    static const char *const odd[][2] = {
        {"0,0\n0.1,0.5\n0.2,1\n0.3,1.5\n", "5 Pa is softer than any tissue: is stress in kPa"},
        {"0,0\n0.1,2e9\n0.2,4e9\n0.3,6e9\n", "2e+10 Pa is stiffer than bone"},
        {"0,0\n1,100\n2,200\n5,500\n", "a strain of 5 is 500 %"},
        {"0,50\n0.1,150\n0.2,250\n0.3,350\n", "the stress at strain 0 is 14 % of the largest"},
    };
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        char note[128];
        write_text(scratch("odd.csv"), odd[i][0]);
        run_well("--fit odd.csv");
        snprintf(note, sizeof note, "note: %s", odd[i][1]);
        expect_printed(&result, note);
    }
}

TEST(options_that_do_not_go_together_are_refused)
{
    static const char *const bad[][2] = {
        {"--fit a.csv b.cfg", "pliant-study: --fit takes a table and no scene, got 'b.cfg'"},
        {"--fit a.csv --model voxel", "pliant-study: --model 'voxel' is neither solid nor surface"},
        {"--fit a.csv --model surface", "pliant-study: --model surface needs the --thickness"},
        {"--fit a.csv --thickness 0.01", "pliant-study: --thickness is of --model surface"},
        {"--fit a.csv --model surface --thickness 0", "--thickness '0' is not a number in [1e-06"},
        {"--fit a.csv --quick",
         "pliant-study: --fit goes with --model, --thickness and --out alone"},
        {"--fit a.csv --rate 100", "pliant-study: --fit goes with --model"},
        {"--model surface a.cfg", "pliant-study: --model and --thickness belong to --fit"},
        {"--fit", "pliant-study: '--fit' is no option or lacks its value"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        run(bad[i][0]);
        expect_refusal(&result, 2, bad[i][1]);
    }
    run_well("--help");
    expect_printed(&result, "--fit=CURVE.csv");
    expect_printed(&result, "nominal strain [-]");
}

TEST(the_program_alone_does_the_same)
{
    write_text(scratch("same.csv"), "0,0\n0.1,100\n0.2,200\n0.3,330\n0.4,520\n");
    run_well("--fit same.csv --out by-study");
    process_run(&result, program_path("pliant-fit"), "same.csv --out by-fit");
    expect_code(&result, 0);
    expect_printed(&result, "material = { youngs_modulus = ");
    process_run(&result, "cmp", "by-study/fit.tsv by-fit/fit.tsv");
    expect_code(&result, 0);
    static const char *const bad[][2] = {
        {"", "pliant-fit: no table given"},
        {"a.csv b.csv", "pliant-fit: one table at a time, got 'a.csv' and 'b.csv'"},
        {"a.csv --model surface", "pliant-fit: --model surface needs the --thickness"},
        {"nowhere.csv", "nowhere.csv: "},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        process_run(&result, program_path("pliant-fit"), "%s", bad[i][0]);
        expect_refusal(&result, 2, bad[i][1]);
    }
}
