// SPDX-License-Identifier: MIT
// The base room: slot, ring, histogram, arena, state list, status, vectors and quaternions.
#include "test.h"
#include "base/memory.h"
#include "base/clock.h"
#include "base/log.h"
#include "base/handover.h"
#include "base/check.h"
#include "base/vec.h"
#include "random.h"

#include <pthread.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

// ---------------------------------------------------------------------------------------------
// Slot

enum { WORDS = 500, VALUES = 100000 };

typedef struct Value {
    uint64_t word[WORDS]; // all alike, or the value is torn
} Value;

static void *write_values(void *argument)
{
    Slot *slot = argument;
    for (uint64_t n = 1; n <= VALUES; n++) {
        Value *value = slot_back(slot);
        for (int i = 0; i < WORDS; i++)
            value->word[i] = n;
        slot_publish(slot);
    }
    return NULL;
}

TEST(slot_is_never_torn_and_never_goes_back)
{
    static Value memory[3];
    static Slot slot;
    slot_init(&slot, memory, sizeof(Value));
    pthread_t writer;
    assert_int_equal(pthread_create(&writer, NULL, write_values, &slot), 0);
    uint64_t last = 0, torn = 0, older = 0;
    while (last < VALUES) {
        const Value *value = slot_take(&slot);
        if (value == NULL) {
            sched_yield();
            continue;
        }
        for (int i = 1; i < WORDS; i++)
            torn += value->word[i] != value->word[0];
        older += value->word[0] <= last;
        last = value->word[0];
    }
    pthread_join(writer, NULL);
    assert_int_equal(torn, 0);
    assert_int_equal(older, 0);
}

TEST(slot_gives_the_newest_value_once)
{
    int memory[3];
    Slot slot;
    slot_init(&slot, memory, sizeof(int));
    assert_null(slot_take(&slot));
    for (int n = 1; n <= 5; n++) {
        *(int *)slot_back(&slot) = n;
        slot_publish(&slot);
    }
    const int *value = slot_take(&slot);
    assert_int_equal(*value, 5);
    assert_null(slot_take(&slot));
    *(int *)slot_back(&slot) = 6; // being written: the one taken stays as it was
    assert_int_equal(*value, 5);
    slot_publish(&slot);
    assert_int_equal(*value, 5);
    assert_int_equal(*(const int *)slot_take(&slot), 6);
}

// ---------------------------------------------------------------------------------------------
// Ring

enum { ENTRIES = 300000 };

static void *push_entries(void *argument)
{
    Ring *ring = argument;
    for (uint64_t n = 0; n < ENTRIES;) {
        uint64_t entry[3] = {n, ~n, 3 * n};
        if (ring_push(ring, entry))
            n++;
        else
            sched_yield();
    }
    return NULL;
}

TEST(ring_entries_are_filled_in_place)
{
    uint64_t memory[2], pushed = 7;
    Ring ring;
    ring_init(&ring, memory, 2, sizeof memory[0]);
    uint64_t *back = ring_back(&ring);
    *back = 6;
    assert_null(ring_peek(&ring)); // not yet published
    ring_publish(&ring);
    assert_true(ring_push(&ring, &pushed));
    assert_null(ring_back(&ring)); // full
    assert_int_equal(*(const uint64_t *)ring_peek(&ring), 6);
    ring_pop(&ring);
    assert_ptr_equal(ring_back(&ring), back);
    assert_int_equal(*(const uint64_t *)ring_peek(&ring), 7);
    assert_int_equal(ring.high_water, 2);
}

TEST(ring_keeps_the_order_between_two_threads)
{
    static uint64_t memory[16][3];
    static Ring ring;
    ring_init(&ring, memory, 16, sizeof memory[0]);
    pthread_t producer;
    assert_int_equal(pthread_create(&producer, NULL, push_entries, &ring), 0);
    uint64_t wrong = 0;
    for (uint64_t n = 0; n < ENTRIES;) {
        const uint64_t *entry = ring_peek(&ring);
        if (entry == NULL) {
            sched_yield();
            continue;
        }
        wrong += entry[0] != n || entry[1] != ~n || entry[2] != 3 * n;
        ring_pop(&ring);
        n++;
    }
    pthread_join(producer, NULL);
    assert_int_equal(wrong, 0);
    assert_null(ring_peek(&ring));
    assert_true(ring.high_water >= 1 && ring.high_water <= 16);
}

// A ring of four numbers.
static void fill_and_empty(Ring *ring)
{
    for (int n = 0; n < 4; n++)
        assert_true(ring_push(ring, &n));
    int more = 9;
    assert_false(ring_push(ring, &more));
    for (int n = 0; n < 4; n++) {
        assert_int_equal(*(const int *)ring_peek(ring), n);
        ring_pop(ring);
    }
    assert_null(ring_peek(ring));
}

TEST(full_ring_refuses)
{
    int memory[4];
    Ring ring;
    ring_init(&ring, memory, 4, sizeof(int));
    assert_null(ring_peek(&ring));
    for (int round = 0; round < 10; round++) // past the end of the memory
        fill_and_empty(&ring);
    assert_int_equal(ring.high_water, 4);
}

TEST(ring_counts_on_when_its_counters_wrap)
{
    int memory[4];
    Ring ring;
    ring_init(&ring, memory, 4, sizeof(int));
    atomic_store(&ring.head, 0xfffffffeu);
    atomic_store(&ring.tail, 0xfffffffeu);
    fill_and_empty(&ring);
}

// ---------------------------------------------------------------------------------------------
// Histogram

static int compare_times(const void *a, const void *b)
{
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

TEST(percentiles_are_right_to_a_bin)
{
    static Histogram histogram;
    enum { COUNT = 20000 };
    static int64_t ns[COUNT];
    uint64_t random = 77;
    for (int i = 0; i < COUNT; i++) { // most below 1 ms, some to 40 ms
        double u = random_between(&random, 0.0, 1.0);
        ns[i] = (int64_t)(2e5 + 4e7 * pow(u, 60.0));
        histogram_add(&histogram, ns[i]);
    }
    qsort(ns, COUNT, sizeof *ns, compare_times);
    double us[4];
    histogram_summarize(&histogram, us);
    static const double part[3] = {0.5, 0.99, 0.999};
    for (int k = 0; k < 3; k++) {
        double exact = (double)ns[(int)(part[k] * COUNT) - 1] * 1e-3;
        double bin = exact < 1000.0 ? 1.0 : 100.0; // widths of clock.h [us]
        expect_at_least(us[k], exact);
        expect_at_most(us[k], exact + bin);
    }
    expect_near(us[3], (double)ns[COUNT - 1] * 1e-3, 1e-9); // exact but for rounding
    histogram_clear(&histogram);
    histogram_summarize(&histogram, us);
    for (int k = 0; k < 4; k++)
        expect_near(us[k], 0.0, 0.0);
}

TEST(histogram_takes_any_duration)
{
    static Histogram histogram;
    double us[4];
    histogram_add(&histogram, -5);
    histogram_summarize(&histogram, us);
    expect_near(us[3], 0.0, 0.0);
    histogram_add(&histogram, INT64_C(3600000000000)); // an hour
    histogram_add(&histogram, INT64_MAX);
    histogram_summarize(&histogram, us);
    expect_near(us[3], (double)INT64_MAX * 1e-3, 1e4); // rounding of a double near 9e15
    for (int k = 0; k < 3; k++)
        expect_at_most(us[k], us[k + 1]);
    assert_int_equal(histogram.count, 3);
}

TEST(percentile_never_exceeds_the_maximum)
{
    static Histogram histogram;
    double us[4];
    histogram_add(&histogram, 1500);
    histogram_summarize(&histogram, us);
    for (int k = 0; k < 4; k++)
        expect_near(us[k], 1.5, 1e-12);
}

// ---------------------------------------------------------------------------------------------
// Arena and state

TEST(arena_gives_zeroed_aligned_memory_and_counts_it)
{
    Arena arena = {0};
    size_t total = 0;
    for (int k = 0; k < 200; k++) { // more than its list starts with
        size_t count = (size_t)(7 * k % 23);
        unsigned char *memory = arena_allocate(&arena, k % 2 == 0 ? ARENA_STEP : ARENA_OUTPUT,
                                               count, 3, "body%d/%s", k, "array");
        assert_non_null(memory);
        assert_int_equal((uintptr_t)memory % 64, 0);
        for (size_t i = 0; i < 3 * count; i++)
            assert_int_equal(memory[i], 0);
        memset(memory, 0xab, 3 * count);
        total += 3 * count;
    }
    assert_int_equal(arena_bytes(&arena), total);
    assert_int_equal(arena_bytes_of(&arena, ARENA_STEP) + arena_bytes_of(&arena, ARENA_OUTPUT),
                     total);
    assert_int_equal(arena_bytes_of(&arena, ARENA_CONTACT), 0);
    assert_string_equal(arena.block[12].name, "body12/array");
    arena_destroy(&arena);
    assert_int_equal(arena_bytes(&arena), 0);
}

// Memory that the machine does not have ends the program with a sentence, as anything else from
// outside. The sanitizers end it themselves.
TEST(memory_that_is_not_to_be_had_is_no_fault_of_the_program)
{
    char said[400] = "";
    int out[2], code = 0;
    assert_int_equal(pipe(out), 0);
    const pid_t child = fork();
    if (child == 0) {
        dup2(out[1], STDERR_FILENO);
        Arena arena = {0};
        arena_allocate(&arena, ARENA_STEP, (size_t)1 << 40, (size_t)1 << 20, "body/array");
        _exit(0);
    }
    close(out[1]);
    assert_int_equal(waitpid(child, &code, 0), child);
    assert_true(read(out[0], said, sizeof said - 1) > 0);
    close(out[0]);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    assert_true(WIFEXITED(code));
    assert_int_equal(WEXITSTATUS(code), STATUS_INVALID);
    assert_non_null(strstr(said, "MB of memory for body/array are not to be had"));
#endif
}

TEST(arena_cuts_long_names)
{
    Arena arena = {0};
    arena_allocate(&arena, ARENA_STEP, 1, 1, "%s",
                   "a name that is much longer than the forty-seven bytes that a block keeps");
    assert_int_equal(strlen(arena.block[0].name), 47);
    arena_destroy(&arena);
}

TEST(state_is_copied_out_and_in_whole)
{
    int64_t a = 1, first[2] = {2, 3}, second[2] = {4, 5};
    int current = 0;
    StateList list = {0};
    state_add(&list, &a, sizeof a, "%s/a", "body");
    state_add_pair(&list, first, second, &current, sizeof first, "body/pair");
    assert_int_equal(state_bytes(&list), 24);
    unsigned char copy[24];
    state_copy_out(&list, copy);
    uint64_t hash = state_hash(&list);

    // The other buffer is the current one: the copy goes there.
    current = 1;
    a = 9;
    first[0] = 7;
    assert_true(state_hash(&list) != hash);
    state_copy_in(&list, copy);
    assert_int_equal(a, 1);
    assert_int_equal(second[0], 2);
    assert_int_equal(second[1], 3);
    assert_true(state_hash(&list) == hash);
    // And to the one that is written next: a tick that leaves a place alone leaves the same there.
    assert_memory_equal(first, second, sizeof second);
    assert_ptr_equal(state_memory(&list.array[1]), second);
    state_destroy(&list);
}

// Arrays of any length, with runs of any length at any place, and none.
TEST(packed_state_comes_back_whatever_repeats_in_it)
{
    enum { ARRAYS = 40, MOST = 2000 };
    static unsigned char memory[ARRAYS][2][MOST], before[ARRAYS][MOST];
    uint64_t seed = 5;
    int current = 1;
    StateList list = {0};
    for (int k = 0; k < ARRAYS; k++) {
        const int bytes = k < 3 ? k : 1 + random_below(&seed, MOST);
        for (int i = 0, unit = 0; i < bytes; i++) {
            if (i % 32 == 0 && random_below(&seed, 1 + k % 7) == 0)
                unit = random_below(&seed, 256);
            memory[k][1][i] = (unsigned char)(unit + i % 32);
        }
        memcpy(before[k], memory[k][1], MOST);
        state_add_pair(&list, memory[k][0], memory[k][1], &current, (size_t)bytes, "array %d", k);
    }
    const size_t packed = state_pack(&list, NULL);
    assert_in_range(packed, 1, state_bytes(&list) - 1);
    FREED unsigned char *block = malloc(packed + 1);
    block[packed] = 77;
    assert_int_equal(state_pack(&list, block), packed);
    assert_int_equal(block[packed], 77);
    memset(memory, 0x5a, sizeof memory);
    state_unpack(&list, block);
    for (int k = 0; k < ARRAYS; k++)
        for (int which = 0; which < 2; which++) {
            assert_memory_equal(memory[k][which], before[k], list.array[k].bytes);
            if (list.array[k].bytes < MOST) // and nothing behind it
                assert_int_equal(memory[k][which][list.array[k].bytes], 0x5a);
        }
    state_destroy(&list);
}

TEST(hash_sees_every_byte)
{
    unsigned char bytes[64] = {0};
    StateList list = {0};
    for (int k = 0; k < 8; k++)
        state_add(&list, bytes + 8 * k, 8, "array %d", k);
    uint64_t empty = state_hash(&list);
    for (int i = 0; i < 64; i++) {
        bytes[i] = 1;
        assert_true(state_hash(&list) != empty);
        bytes[i] = 0;
    }
    assert_true(state_hash(&list) == empty);
    state_destroy(&list);
}

// ---------------------------------------------------------------------------------------------
// Status, log level

TEST(status_keeps_the_first_failure)
{
    Status status = {0};
    assert_false(status_fail(&status, STATUS_INVALID, "scene.cfg:%d: rate_hz %g", 12, 0.5));
    assert_int_equal(status.code, STATUS_INVALID);
    assert_string_equal(status.text, "scene.cfg:12: rate_hz 0.5");
    assert_false(status_fail(&status, STATUS_FAILED, "later"));
    assert_int_equal(status.code, STATUS_INVALID);
    assert_string_equal(status.text, "scene.cfg:12: rate_hz 0.5");
    assert_false(status_fail(NULL, STATUS_FAILED, "nobody asks"));
}

TEST(status_cuts_long_texts)
{
    char text[2000];
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    Status status = {0};
    assert_false(status_fail(&status, STATUS_FAILED, "%s", text));
    assert_int_equal(strlen(status.text), sizeof status.text - 1);
}

TEST(log_levels_are_read_by_name)
{
    LogLevel level = LOG_INFO;
    assert_true(log_parse_level("debug", &level));
    assert_int_equal(level, LOG_DEBUG);
    assert_true(log_parse_level("error", &level));
    assert_int_equal(level, LOG_ERROR);
    assert_false(log_parse_level("loud", &level));
    assert_false(log_parse_level("", &level));
    assert_int_equal(level, LOG_ERROR);
}

// ---------------------------------------------------------------------------------------------
// Vectors and quaternions; tolerances are a few roundings of numbers near 1

TEST(vectors_obey_their_identities)
{
    uint64_t random = 5;
    for (int k = 0; k < 1000; k++) {
        Vec3 a = random_vec3(&random), b = random_vec3(&random), c = random_vec3(&random);
        Vec3 n = vec3_cross(a, b);
        expect_near(vec3_dot(n, a), 0.0, 1e-15);
        expect_near(vec3_dot(n, b), 0.0, 1e-15);
        // Lagrange: |a x b|^2 + (a . b)^2 = |a|^2 |b|^2
        expect_near(vec3_dot(n, n) + vec3_dot(a, b) * vec3_dot(a, b),
                    vec3_dot(a, a) * vec3_dot(b, b), 1e-14);
        Vec3 sum = vec3_sub(vec3_madd(vec3_add(a, b), 2.0, c), vec3_scale(2.0, c));
        expect_near(vec3_length(vec3_sub(vec3_sub(sum, a), b)), 0.0, 1e-15);
        expect_near(vec3_length(vec3_unit(a)), 1.0, 1e-15);
    }
    expect_near(vec3_length(vec3_unit(vec3(0.0, 0.0, 0.0))), 0.0, 0.0);
    assert_true(vec3_finite(vec3(1.0, -2.0, 1e300)));
    assert_false(vec3_finite(vec3(1.0, (double)NAN, 0.0)));
    assert_false(vec3_finite(vec3(1.0, 0.0, (double)INFINITY)));
}

TEST(quaternions_rotate_as_rodrigues_says)
{
    uint64_t random = 6;
    for (int k = 0; k < 1000; k++) {
        Vec3 axis = vec3_unit(random_vec3(&random)), v = random_vec3(&random);
        double angle = random_between(&random, 0.0, 3.1);
        Quat q = quat_from_rotation(vec3_scale(angle, axis));
        // v cos + (n x v) sin + n (n . v)(1 - cos)
        Vec3 expected = vec3_scale(cos(angle), v);
        expected = vec3_madd(expected, sin(angle), vec3_cross(axis, v));
        expected = vec3_madd(expected, vec3_dot(axis, v) * (1.0 - cos(angle)), axis);
        expect_at_most(vec3_length(vec3_sub(quat_rotate(q, v), expected)), 4e-15);
        expect_at_most(vec3_length(vec3_sub(quat_rotate(quat_conjugate(q), quat_rotate(q, v)), v)),
                       4e-15);
        Vec3 back = quat_to_rotation(q);
        expect_at_most(vec3_length(vec3_sub(back, vec3_scale(angle, axis))), 1e-14);
    }
}

TEST(quaternion_products_are_rotations_in_turn)
{
    uint64_t random = 8;
    for (int k = 0; k < 1000; k++) {
        Quat a = quat_from_rotation(random_vec3(&random));
        Quat b = quat_from_rotation(random_vec3(&random));
        Vec3 v = random_vec3(&random);
        Vec3 both = quat_rotate(quat_multiply(a, b), v);
        expect_at_most(vec3_length(vec3_sub(both, quat_rotate(a, quat_rotate(b, v)))), 4e-15);
    }
}

TEST(tiny_and_missing_rotations_are_the_identity)
{
    Quat q = quat_from_rotation(vec3(0.0, 0.0, 0.0));
    expect_near(q.w, 1.0, 0.0);
    q = quat_from_rotation(vec3(1e-13, 0.0, 0.0));
    expect_near(quat_to_rotation(q).x, 1e-13, 1e-28);
    q = quat_unit((Quat){0.0, 0.0, 0.0, 0.0});
    expect_near(q.w, 1.0, 0.0);
    // The other sign is the same rotation: by less than half a turn.
    Vec3 r = quat_to_rotation((Quat){-cos(0.1), 0.0, -sin(0.1), 0.0});
    expect_near(r.y, 0.2, 1e-15);
}
