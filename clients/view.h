// SPDX-License-Identifier: MIT
// The text that pliant-monitor shows: the server's last status, contacts and events. One thread.
#ifndef PLIANT_CLIENTS_VIEW_H
#define PLIANT_CLIENTS_VIEW_H

#include "program.h"

enum { VIEW_EVENTS = 6 };

typedef struct View {
    int64_t late, late_before; // late ticks of the last status, and of the one before
    int64_t statuses;
    struct {
        int64_t step;
        char text[200];
    } event[VIEW_EVENTS]; // the newest ones, event[events % VIEW_EVENTS] the oldest
    int64_t events;       // since the start
} View;

// Starts zeroed.
void view_take_status(View *view, const PliantStatus *status);
void view_take_event(View *view, const PliantEvent *event);
// Prints everything that the client has, on several lines; without a status it says so.
void view_print(const View *view, const PliantClient *client, FILE *out);
// Prints one line on the last status, which is there.
void view_print_line(const View *view, const PliantClient *client, FILE *out);
// Prints the ledger in lines of a body, a tissue and a region each.
void view_print_ledger(const PliantLedger *ledger, FILE *out);
void view_print_last_event(const View *view, FILE *out);

#endif
