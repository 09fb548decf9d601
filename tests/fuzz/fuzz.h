// SPDX-License-Identifier: MIT
// What the fuzzers share. Each fuzz_<name>.c is one harness: LLVMFuzzerTestOneInput takes an input
// as it may come from outside and must return, whatever it holds. With clang it is driven by
// libFuzzer, in every other build replay.c runs it over the files of corpus/<name>/. One thread.
#ifndef PLIANT_TESTS_FUZZ_H
#define PLIANT_TESTS_FUZZ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

// Ends the program with a sentence, so that the input is kept: what must hold does not.
_Noreturn void fuzz_failed(const char *what, const char *file, int line);
#define MUST(condition) ((condition) ? (void)0 : fuzz_failed(#condition, __FILE__, __LINE__))

// The path of `name` in a folder of our own, made on the first call and removed at exit. Valid
// until the fourth next call.
const char *fuzz_path(const char *name);
// Writes a file of that folder and returns its path.
const char *fuzz_write(const char *name, const void *data, size_t size);
// Prints what became of an input if PLIANT_FUZZ_PRINT is set.
void fuzz_print(const char *text);

// An input that is read piece by piece; what is beyond its end reads as zero.
typedef struct Feed {
    const uint8_t *at;
    size_t left;
} Feed;

static inline uint8_t feed_byte(Feed *feed)
{
    if (feed->left == 0)
        return 0;
    feed->left--;
    return *feed->at++;
}

static inline uint64_t feed_word(Feed *feed, int bytes)
{
    uint64_t word = 0;
    for (int i = 0; i < bytes; i++)
        word = word << 8 | feed_byte(feed);
    return word;
}

// A part of at most `most` bytes, as long as two bytes say.
static inline Feed feed_part(Feed *feed, size_t most)
{
    size_t size = feed_word(feed, 2);
    size = size < most ? size : most;
    size = size < feed->left ? size : feed->left;
    Feed part = {feed->at, size};
    feed->at += size;
    feed->left -= size;
    return part;
}

// A number near `scale`, mostly: two bytes are a share of it. Some are as large, small or strange
// as numbers can be.
double feed_number(Feed *feed, double scale);

#endif
