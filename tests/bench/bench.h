// SPDX-License-Identifier: MIT
// The benchmark's table and what its cases share.
#ifndef PLIANT_TESTS_BENCH_BENCH_H
#define PLIANT_TESTS_BENCH_BENCH_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

enum { BENCH_REPEATS_MAX = 64 };

typedef struct Bench {
    FILE *table;        // tab-separated, or NULL: rows are only printed
    const char *prefix; // cases to run; "" for all
    const char *isa;    // instruction-set level of the server's kernels; "auto" for the best
    bool quick;         // few repeats of small sizes: checks the program, not the speed
    bool failed;
} Bench;

// Whether a case is asked for: its name begins with the prefix.
bool bench_wants(const Bench *bench, const char *name);
// One row: case, size (nodes), metric, value, unit.
void bench_row(const Bench *bench, const char *name, int size, const char *metric, double value,
               const char *unit);
// Says why a case gives no rows.
void bench_skip(const Bench *bench, const char *name, const char *why);
// The same, and the program ends with exit code 1.
void bench_fail(Bench *bench, const char *name, const char *why);

// Times of one piece of work, repeated.
typedef struct Samples {
    int count;
    double us[BENCH_REPEATS_MAX];
} Samples;

void samples_add(Samples *samples, double us);
double samples_min(const Samples *samples);
double samples_median(const Samples *samples);
// Ascending.
void bench_sort(double *value, int count);

// Prints two tables that were written before, row by row, and their ratios. False, with a sentence
// on stderr, when one is no such table.
bool bench_compare(const char *old_path, const char *new_path);

void bench_springs(Bench *bench);
void bench_spring_laws(Bench *bench);
void bench_implicit(Bench *bench);
void bench_contacts(Bench *bench);
void bench_pairs(Bench *bench);
void bench_load(Bench *bench);
void bench_levels(Bench *bench);
void bench_live(Bench *bench);
void bench_record(Bench *bench);
void bench_play(Bench *bench);
void bench_cuts(Bench *bench);
void bench_estimates(Bench *bench);
void bench_guards(Bench *bench);
void bench_checkpoints(Bench *bench);
void bench_publish(Bench *bench);
// Where voxel bodies are built in.
void bench_voxels(Bench *bench);
void bench_voxel_presses(Bench *bench);
void bench_windows(Bench *bench);
void bench_divisions(Bench *bench);
void bench_adaptations(Bench *bench);
void bench_removals(Bench *bench);
void bench_fitted(Bench *bench);
void bench_touches(Bench *bench);
void bench_guard_voxels(Bench *bench);

#endif
