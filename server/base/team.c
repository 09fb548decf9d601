// SPDX-License-Identifier: MIT
#include "base/team.h"

#include "base/check.h"
#include "base/clock.h"

#include <linux/futex.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

enum {
    PIECES = 8,         // per share: bounds how long a late worker can delay the caller
    LOOKS_A_CLOCK = 64, // polls of a spinning thread between two readings of the clock
};

// One thread's share of the loop, in cache lines of its own: the other shares change at the same
// time.
typedef struct Share {
    // Loop number * 16 + next piece to begin. The thread that advances it by one owns the piece;
    // the loop number keeps a thread that slept from beginning a piece of another loop.
    _Alignas(64) atomic_ullong next;
    atomic_uint done; // pieces that the worker has finished
    atomic_int asleep;
    pthread_t thread;
    Team *team;
    int number;
} Share;

struct Team {
    Share share[TEAM_THREADS_MOST]; // 0 is the caller's
    int threads, running;           // as created; started so far, the caller included
    atomic_bool ends;

    // The current loop; valid for threads that own a piece of it.
    TeamWork *work;
    void *context;
    int count;
    uint64_t loop;
    uint64_t woken;    // the loop before which workers were last woken
    int alone;         // loops still to run without help,
    int leave;         // of so many since a worker was last late,
    uint64_t last;     // which was in this loop
    atomic_llong late; // how often a worker exceeded TEAM_LATE_NS
};

static inline void pause_briefly(void)
{
#if defined(__x86_64__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("yield");
#endif
}

// Claims the next piece of a share in that loop; returns -1 if none is left.
static int begin_piece(Share *share, uint64_t loop)
{
    unsigned long long next = atomic_load_explicit(&share->next, memory_order_acquire);
    while (next >> 4 == loop && next % 16 < PIECES)
        if (atomic_compare_exchange_weak_explicit(&share->next, &next, next + 1,
                                                  memory_order_acq_rel, memory_order_acquire))
            return (int)(next % 16);
    return -1;
}

// Returns the first item of a piece; pieces are counted through all shares.
static int piece_start(const Team *team, int piece)
{
    return (int)((int64_t)team->count * piece / (PIECES * team->running));
}

static void do_piece(const Team *team, int share, int piece)
{
    int at = share * PIECES + piece;
    int first = piece_start(team, at), last = piece_start(team, at + 1);
    if (first < last)
        team->work(team->context, first, last);
}

// --- workers ---

static uint64_t loop_of(Share *share)
{
    return atomic_load_explicit(&share->next, memory_order_acquire) >> 4;
}

// Sleeps until there is a loop other than `seen`, or the team ends.
static void sleep_until_called(Share *share, uint64_t seen)
{
    atomic_store(&share->asleep, 1);
    while (atomic_load(&share->asleep) == 1 && loop_of(share) == seen &&
           !atomic_load(&share->team->ends))
        syscall(SYS_futex, &share->asleep, FUTEX_WAIT_PRIVATE, 1, NULL, NULL, 0);
    atomic_store(&share->asleep, 0);
}

static void wake(Share *share)
{
    // Sequential consistency: the store of the new loop comes before this load in both threads'
    // order.
    if (atomic_load(&share->asleep) == 0)
        return;
    atomic_store(&share->asleep, 0);
    syscall(SYS_futex, &share->asleep, FUTEX_WAKE_PRIVATE, 1, NULL, NULL, 0);
}

// Returns the number of the next loop after `seen`, or `seen` itself when the team ends.
static uint64_t wait_for_loop(Share *share, uint64_t seen)
{
    int64_t until = clock_now_ns() + TEAM_SPIN_NS;
    for (int looks = 1;; looks++) {
        uint64_t loop = loop_of(share);
        // A loop has begun, or the team ends.
        if (loop != seen || atomic_load_explicit(&share->team->ends, memory_order_relaxed))
            return loop;
        pause_briefly();
        // The clock is not asked every time: that costs more than a look.
        if (looks % LOOKS_A_CLOCK == 0 && clock_now_ns() > until) {
            sleep_until_called(share, seen);
            until = clock_now_ns() + TEAM_SPIN_NS;
        }
    }
}

static void *worker_main(void *argument)
{
    Share *share = argument;
    const Team *team = share->team;
    uint64_t seen = 0;
    for (;;) {
        uint64_t loop = wait_for_loop(share, seen);
        if (loop == seen) // the team ends
            return NULL;
        seen = loop;
        // Take pieces until none is left, and count them for the caller.
        for (int piece; (piece = begin_piece(share, loop)) >= 0;) {
            do_piece(team, share->number, piece);
            atomic_fetch_add_explicit(&share->done, 1, memory_order_release);
        }
    }
}

// --- the caller ---

Team *team_create(int threads)
{
    ASSERT(threads >= 1 && threads <= TEAM_THREADS_MOST);
    // Aligned, since shares of different threads must not lie in one cache line.
    Team *team = aligned_alloc(_Alignof(Team), sizeof *team);
    if (team == NULL)
        return NULL;
    memset(team, 0, sizeof *team);
    team->threads = threads;
    team->running = 1;
    // Each share knows its team and its place.
    for (int i = 0; i < threads; i++) {
        team->share[i].team = team;
        team->share[i].number = i;
    }
    return team;
}

bool team_start(Team *team, int threads, TeamPin *pin, Status *status)
{
    while (team->running < team->threads && team->running < threads) {
        Share *share = &team->share[team->running];
        int error = pthread_create(&share->thread, NULL, worker_main, share);
        if (error != 0)
            return status_fail(status, STATUS_FAILED, "cannot start a step worker: %s",
                               strerror(error));
        // A name for debuggers, and a processor of its own.
        pthread_setname_np(share->thread, "pliant-worker");
        if (pin != NULL)
            pin(share->thread, share->number);
        team->running++;
    }
    return true;
}

void team_destroy(Team *team)
{
    if (team == NULL)
        return;
    atomic_store(&team->ends, true);
    for (int i = 1; i < team->running; i++) {
        wake(&team->share[i]);
        pthread_join(team->share[i].thread, NULL);
    }
    free(team);
}

size_t team_bytes(void)
{
    return sizeof(Team);
}

int team_threads(const Team *team)
{
    return team->threads;
}

int64_t team_late(const Team *team)
{
    return atomic_load_explicit(&team->late, memory_order_relaxed);
}

// Waits for the pieces that a worker has begun; one may take as long as all that the caller did.
static void wait_for_worker(Team *team, Share *share, unsigned pieces, int64_t patience)
{
    int64_t since = 0;
    for (int looks = 1; atomic_load_explicit(&share->done, memory_order_acquire) < pieces;
         looks++) {
        pause_briefly();
        if (looks % LOOKS_A_CLOCK != 0)
            continue;
        // Too late: count it, and go on alone for some time.
        int64_t now = clock_now_ns();
        since = since == 0 ? now : since;
        if (now - since > patience && team->alone == 0) {
            atomic_fetch_add_explicit(&team->late, 1, memory_order_relaxed);
            const bool soon = team->leave > 0 && team->loop - team->last < TEAM_SOON_LOOPS;
            team->leave = soon ? 2 * team->leave : 1;
            if (team->leave > TEAM_ALONE_MOST)
                team->leave = TEAM_ALONE_MOST;
            team->alone = team->leave;
            team->last = team->loop;
        }
    }
}

void team_wake(Team *team)
{
    if (team == NULL || team->alone > 0 || team->woken == team->loop)
        return;
    team->woken = team->loop;
    for (int i = 1; i < team->running; i++)
        wake(&team->share[i]);
}

void team_run(Team *team, TeamWork *work, void *context, int count)
{
    if (team->running == 1 || team->alone > 0) {
        team->alone -= team->alone > 0;
        work(context, 0, count);
        return;
    }
    // Publish the loop, then its shares; the store to `next` starts the workers.
    team->work = work;
    team->context = context;
    team->count = count;
    team->loop++;
    for (int i = 0; i < team->running; i++) {
        atomic_store_explicit(&team->share[i].done, 0, memory_order_relaxed);
        atomic_store(&team->share[i].next, team->loop << 4);
        if (i > 0)
            wake(&team->share[i]);
    }
    // Do the own share first, then what is left of the others: a late worker costs at most the
    // pieces it began.
    const int64_t began = clock_now_ns();
    unsigned taken[TEAM_THREADS_MOST] = {0}; // pieces of each share that the caller did
    for (int i = 0; i < team->running; i++)
        for (int piece; (piece = begin_piece(&team->share[i], team->loop)) >= 0; taken[i]++)
            do_piece(team, i, piece);
    const int64_t patience = TEAM_LATE_NS + clock_now_ns() - began;
    for (int i = 1; i < team->running; i++)
        wait_for_worker(team, &team->share[i], PIECES - taken[i], patience);
}
