// The text that pliant-monitor shows: the daemon's last status, contacts and events. One thread.
#ifndef PLIANT_CLIENTS_VIEW_H
#define PLIANT_CLIENTS_VIEW_H

#include "program.h"

#include "pliant_contact_t.h"
#include "pliant_event_t.h"
#include "pliant_status_t.h"

enum { VIEW_TOOLS = 16, VIEW_EVENTS = 6 };

typedef struct ViewTool {
    pliant_contact_t contact; // the last one
    int64_t come_ns;
} ViewTool;

typedef struct View {
    pliant_status_t *status; // the last one, or NULL; owned
    int64_t status_ns;       // arrival of it
    int64_t late_before;     // late ticks of the previous status
    ViewTool tool[VIEW_TOOLS];
    int tools;
    struct {
        int64_t step;
        char text[200];
    } event[VIEW_EVENTS]; // the newest ones, event[events % VIEW_EVENTS] the oldest
    int64_t events;       // since the start
} View;

// Starts zeroed.
void view_take_status(View *view, const pliant_status_t *status, int64_t now_ns);
void view_take_contact(View *view, const pliant_contact_t *contact, int64_t now_ns);
void view_take_event(View *view, const pliant_event_t *event);
// Prints everything, on several lines; without a status it says so.
void view_print(const View *view, FILE *out, int64_t now_ns);
// Prints one line on the last status.
void view_print_line(const View *view, FILE *out);
void view_print_last_event(const View *view, FILE *out);
void view_destroy(View *view);

#endif
