// SPDX-License-Identifier: MIT
// Two hosts joined by a bad link: two private networks whose only way to each other is a thread of
// the test, which loses, delays, reorders and repeats packets as configured, from a seed, and
// counts what it did. Not every kernel has tc's netem, and that counts nothing and has no seed. The
// test runs inside in_namespace.sh. Link thread: hosts.c's own; all else: the test's thread.
#ifndef PLIANT_TESTS_FAULT_INJECTION_HOSTS_H
#define PLIANT_TESTS_FAULT_INJECTION_HOSTS_H

#include "harness.h"

typedef enum Host { HOST_SERVER, HOST_CLIENT } Host;

typedef struct LinkFaults {
    double loss, duplicate; // share of the packets, each way [0, 1]
    double delay_ms;        // of every packet
    double jitter_ms;       // more, uniform: with it packets overtake each other
    bool cut;               // nothing passes
} LinkFaults;

typedef struct LinkCounts {
    int64_t packets[2], lost[2]; // sent by HOST_SERVER, by HOST_CLIENT
    int64_t repeated, delayed;
} LinkCounts;

// Builds both and starts the link, which is whole. The calling thread is then on HOST_SERVER, and
// LCM_DEFAULT_URL names the network between the two. Returns 0, or the exit status of the test
// after having said why: 77 (skipped) where that is not permitted, 1.
int hosts_create(uint64_t seed);
// Sockets that this thread opens and programs that it starts from now on are on that host.
void hosts_enter(Host host);
// From now on; packets that are delayed already keep their time. NULL: a good link.
void hosts_fault(const LinkFaults *faults);
// Since the last hosts_fault.
LinkCounts hosts_counts(void);
// Puts an IP packet on the wire to that host, whatever address it says that it comes from.
void hosts_forge(Host to, const void *packet, size_t size);
void hosts_destroy(void);

// Around tests that need two hosts: makes them, with faults from a seed that is the same each time;
// takes them down.
int hosts_begin(void **state);
int hosts_end(void **state);

#endif
