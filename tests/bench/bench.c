// SPDX-License-Identifier: MIT
// pliant-bench: one row a figure (case, size, metric, value, unit). Times are thread CPU times
// unless the metric says otherwise; cases that are compared run interleaved; denormals are flushed
// to zero, as in the daemon.
#include "bench.h"

#include "base/arguments.h"
#include "base/log.h"
#include "surface/kernel.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

bool bench_wants(const Bench *bench, const char *name)
{
    return strncmp(name, bench->prefix, strlen(bench->prefix)) == 0;
}

void bench_row(const Bench *bench, const char *name, int size, const char *metric, double value,
               const char *unit)
{
    printf("%-27s %7d  %-22s %12.6g  %s\n", name, size, metric, value, unit);
    fflush(stdout);
    if (bench->table != NULL)
        fprintf(bench->table, "%s\t%d\t%s\t%.6g\t%s\n", name, size, metric, value, unit);
}

void bench_skip(const Bench *bench, const char *name, const char *why)
{
    (void)bench;
    fprintf(stderr, "pliant-bench: %s skipped: %s\n", name, why);
}

void bench_fail(Bench *bench, const char *name, const char *why)
{
    fprintf(stderr, "pliant-bench: %s failed: %s\n", name, why);
    bench->failed = true;
}

void samples_add(Samples *samples, double us)
{
    if (samples->count < BENCH_REPEATS_MAX)
        samples->us[samples->count++] = us;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void bench_sort(double *value, int count)
{
    qsort(value, (size_t)count, sizeof *value, compare);
}

double samples_min(const Samples *samples)
{
    double least = samples->us[0];
    for (int i = 1; i < samples->count; i++)
        least = samples->us[i] < least ? samples->us[i] : least;
    return least;
}

double samples_median(const Samples *samples)
{
    double sorted[BENCH_REPEATS_MAX];
    memcpy(sorted, samples->us, (size_t)samples->count * sizeof *sorted);
    bench_sort(sorted, samples->count);
    return sorted[samples->count / 2];
}

typedef struct Arguments {
    const char *table;
    const char *prefix;
    const char *isa;
    const char *older, *newer; // tables to compare
    bool quick, facts;
} Arguments;

#define AT(member) offsetof(Arguments, member)

static bool take_newer(void *target, const char *text, Status *why)
{
    Arguments *arguments = target;
    if (arguments->older == NULL || arguments->newer != NULL)
        return status_fail(why, STATUS_INVALID, "'%s' is not an option", text);
    arguments->newer = text;
    return true;
}

static const ArgumentRow ROWS[] = {
    {NULL, 0, ARGUMENT_OPERAND, .handler = take_newer},
    {.type = ARGUMENT_HEADING, .help = "What to measure:"},
    {"tsv", 't', ARGUMENT_TEXT, "FILE", AT(table),
     .help = "write the rows to FILE, tab-separated, with a header line"},
    {"facts", 'f', ARGUMENT_FLAG, NULL, AT(facts),
     .help = "begin the table with comment lines: machine, compiler, date"},
    {"case", 'c', ARGUMENT_TEXT, "PREFIX", AT(prefix), .preset_text = "",
     .help = "only cases whose name begins with PREFIX"},
    {"isa", 'i', ARGUMENT_TEXT, "LEVEL", AT(isa), .preset_text = "auto",
     .help = "run springs and elements with the kernels of this level (pliantd --isa)"},
    {"quick", 'q', ARGUMENT_FLAG, NULL, AT(quick),
     .help = "few repeats of small sizes: shows that it works, not how fast it is"},
    {"compare", 'C', ARGUMENT_TEXT, "OLD.tsv", AT(older),
     .help = "measure nothing: compare OLD.tsv with the table named last"},
    {0}};

static bool check(void *target, Status *why)
{
    const Arguments *arguments = target;
    return arguments->older == NULL || arguments->newer != NULL ||
           status_fail(why, STATUS_INVALID,
                       "--compare needs two tables: --compare OLD.tsv NEW.tsv");
}

#if defined(__clang__)
static const char COMPILER[] = ""; // its version names it
#else
static const char COMPILER[] = "gcc ";
#endif

// What figures depend on besides this program.
static void print_facts(FILE *out, const char *isa)
{
    char line[256], date[16] = "";
    const time_t now = time(NULL);
    FILE *file = fopen("/proc/cpuinfo", "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        if (strncmp(line, "model name", 10) == 0 && strchr(line, ':') != NULL) {
            fprintf(out, "# processor%s", strchr(line, ':'));
            break;
        }
    if (file != NULL)
        fclose(file);
    strftime(date, sizeof date, "%Y-%m-%d", gmtime(&now));
    fprintf(out, "# processors: %ld\n# kernels: %s\n# compiler: %s%s\n# date: %s\n",
            sysconf(_SC_NPROCESSORS_ONLN), kernels_find(PRECISION_SINGLE, isa)->level, COMPILER,
            __VERSION__, date);
}

static const char CASES[] =
    "Cases: spring.textbook.rk4 (an array of structures, springs scattered to their two nodes, in "
    "double; compiled with the project's flags and -O3 for the compiler's default instruction "
    "set), "
    "spring.double.rk4, spring.single.rk4 and their leapfrogs (the server's step), "
    "spring.cavity.* (a pressure inside), spring.bullet.1 and spring.bullet.10 (Bullet's "
    "btSoftBody, iterations of its position "
    "solver), contact.sphere, "
    "contact.capsule, contact.voxel.* (a press, with and without the tool), pair.FEATURE.with and "
    ".without (what a "
    "feature costs), bytes.rk4, "
    "load.start (from nothing to the first tick, 100 000 triangles), load.levels (the same with "
    "levels of detail, made and read), check.mesh and check.labels (pliant-prepare --check), "
    "levels.sphere.1N, levels.sphere.0.2N and levels.stomach "
    "(a body that adapts against the same wholly refined), levels.topology (what following a tool "
    "costs a tick), voxel.textbook, voxel.double and voxel.single (whole steps of cubes of "
    "elements), "
    "voxel.graded.single and voxel.hanging.single (elements with hanging vertices), "
    "voxel.relaxing.* and voxel.stiffening.* (element passes with these laws over one without), "
    "voxel.windows.* (elements of a body that can be cut against others, and what a division "
    "costs), voxel.tear.* (looking whether it tears), "
    "voxel.press.level0 to voxel.press.level3 (a ball pressed into a cube of elements of several "
    "sizes and of one), live.loop, live.rk4, live.voxel and live.voxel.pressed (a cube of 32 cells "
    "an edge, free and with a ball in it) and live.largest.* (the real pliantd at 1 kHz in a "
    "private network), cut.* (a blade through half of a cube, cut messages) and live.cuts (a "
    "hundred cuts a second while a tool presses), play.seek (a frame and its mesh out of an hour's "
    "recording with 500 cuts), fitted.* (the smooth surface of a solid), "
    "touch.solids and touch.balls (two bodies, without contact, apart and at rest on each other), "
    "touch.folds (a hollow body with itself).";

static const ArgumentTable TABLE = {.program = "pliant-bench",
                                    .usage = "[NEW.tsv]",
                                    .about = "Measures the cost of Pliant's steps.",
                                    .end = CASES,
                                    .rows = ROWS,
                                    .check = check};

int main(int argc, char **argv)
{
    Arguments arguments = {0};
    Status status = {0};
    if (!arguments_parse(&TABLE, argc, argv, &arguments, &status))
        return arguments_exit(&status);
    log_set_program("pliant-bench");
    log_set_level(LOG_ERROR); // the damping of fine meshes is shortened: known
    if (arguments.older != NULL)
        return bench_compare(arguments.older, arguments.newer) ? 0 : 2;
#if defined(__x86_64__)
    _mm_setcsr(_mm_getcsr() | 0x8040); // flush denormals, as the daemon does
#endif
    if (kernels_find(PRECISION_SINGLE, arguments.isa) == NULL) {
        fprintf(stderr, "pliant-bench: --isa %s is not a level that this machine can run\n",
                arguments.isa);
        return 2;
    }
    Bench bench = {.prefix = arguments.prefix, .isa = arguments.isa, .quick = arguments.quick};
    if (arguments.table != NULL) {
        bench.table = fopen(arguments.table, "w");
        if (bench.table == NULL) {
            fprintf(stderr, "pliant-bench: cannot write %s: %s\n", arguments.table,
                    strerror(errno));
            return 1;
        }
        if (arguments.facts)
            print_facts(bench.table, arguments.isa);
        fprintf(bench.table, "case\tsize\tmetric\tvalue\tunit\n");
    }
    bench_springs(&bench);
    bench_spring_laws(&bench);
    bench_implicit(&bench);
    bench_contacts(&bench);
    bench_pairs(&bench);
    bench_load(&bench);
    bench_levels(&bench);
#ifdef PLIANT_WITH_VOXEL
    bench_voxels(&bench);
    bench_voxel_presses(&bench);
    bench_windows(&bench);
    bench_divisions(&bench);
    bench_adaptations(&bench);
    bench_removals(&bench);
    bench_fitted(&bench);
    bench_touches(&bench);
    bench_guard_voxels(&bench);
#endif
    bench_live(&bench);
#ifdef PLIANT_BENCH_RECORD
    bench_record(&bench);
    bench_play(&bench);
#endif
    bench_cuts(&bench);
    bench_estimates(&bench);
    bench_guards(&bench);
    bench_checkpoints(&bench);
    bench_publish(&bench);
    if (bench.table != NULL && fclose(bench.table) != 0) {
        fprintf(stderr, "pliant-bench: cannot write %s: %s\n", arguments.table, strerror(errno));
        return 1;
    }
    return bench.failed ? 1 : 0;
}
