// SPDX-License-Identifier: MIT
// The text that pliant-monitor shows. One thread.
#include "view.h"

#include <math.h>
#include <string.h>

// After so long without news a tool is not shown in contact.
#define STALE_S 0.5

void view_take_status(View *view, const PliantStatus *status)
{
    view->late_before = view->statuses++ > 0 ? view->late : status->late_ticks;
    view->late = status->late_ticks;
}

void view_take_event(View *view, const PliantEvent *event)
{
    int at = (int)(view->events++ % VIEW_EVENTS);
    view->event[at].step = event->step;
    snprintf(view->event[at].text, sizeof view->event[at].text, "%s%s%s: %s", event->body,
             event->body[0] ? " " : "", event->kind, event->text);
}

static void print_head(const PliantStatus *s, FILE *out)
{
    program_print_text(out, s->scene, false);
    fputs("  ", out);
    program_print_text(out, s->state, false);
    fprintf(out, "  tick %lld  simulated %.2f s  %g Hz  real-time factor %.3f\n",
            (long long)s->step, s->time, s->rate_hz, s->real_time_factor);
}

static void print_timing(const View *view, const PliantStatus *s, FILE *out)
{
    // What went wrong, by cause.
    fprintf(out, "late ticks %lld (+%lld)  resets %lld  refused inputs %lld",
            (long long)s->late_ticks, (long long)(view->late - view->late_before),
            (long long)s->resets, (long long)s->rejected);
    for (int k = 0; k < s->reason_count; k++) {
        fputs(k ? ", " : " (", out);
        program_print_text(out, s->reason[k], false);
        fprintf(out, " %lld%s", (long long)s->times[k], k + 1 == s->reason_count ? ")" : "");
    }
    // Distributions of times.
    fprintf(out, "\n\n%10s %9s %9s %9s %9s\n", "[us]", "p50", "p99", "p99.9", "max");
    fprintf(out, "%10s %9.1f %9.1f %9.1f %9.1f\n", "step", s->step_us[0], s->step_us[1],
            s->step_us[2], s->step_us[3]);
    fprintf(out, "%10s %9.1f %9.1f %9.1f %9.1f\n", "wake-up", s->wake_us[0], s->wake_us[1],
            s->wake_us[2], s->wake_us[3]);
    // Where the time of a tick goes.
    fputs("\nstages [us per tick]", out);
    for (int k = 0; k < s->stage_count; k++) {
        fputs("  ", out);
        program_print_text(out, s->stage[k], false);
        fprintf(out, " %.2f", s->stage_us[k]);
    }
    fputs("\n", out);
}

static void print_bodies(const PliantStatus *s, FILE *out)
{
    for (int k = 0; k < s->body_count; k++) {
        const PliantBodyStatus *b = &s->body[k];
        // Names come from the network: print what can be printed.
        fputs("\nbody ", out);
        program_print_text(out, b->name, false);
        fputs("  ", out);
        program_print_text(out, b->model, false);
        fputs("  ", out);
        program_print_text(out, b->integrator, false);
        fprintf(out, "  step %.1f us\n", 1e6 * b->time_step);
        // Its size, and how it moves.
        fprintf(out, "  in use: nodes %d  ", b->nodes);
        if (b->springs > 0)
            fprintf(out, "triangles %d  springs %d  finest level %d", b->elements, b->springs,
                    b->finest_level);
        else
            fprintf(out, "elements %d", b->elements);
        fprintf(out, "  (topology %d)\n", b->topology);
        fprintf(out, "  pieces %d  mass %.4g kg\n", b->pieces, b->mass);
        fprintf(out, "  kinetic %.3e J  elastic %.3e J  largest displacement %.3f mm\n", b->kinetic,
                b->elastic, 1e3 * b->max_displacement);
        if (b->estimated_error > 0.0)
            fprintf(out, "  estimated error of a tick's time steps: %.2g of that displacement\n",
                    b->estimated_error);
    }
}

// Prints an amount of tissue, in cm3 with grams, of walls cm2.
static void print_amount(const char *what, double amount, double density, bool solid, FILE *out)
{
    fprintf(out, "  %s %.3f %s", what, amount * (solid ? 1e6 : 1e4), solid ? "cm3" : "cm2");
    fprintf(out, " (%.3f g)", 1e3 * amount * density);
}

static void print_region(const PliantRegion *r, FILE *out)
{
    fputs("  region ", out);
    program_print_text(out, r->name, false);
    if (r->distance < 0.0) {
        fputs(": nothing was cut or removed", out);
    } else {
        fprintf(out, ": %.2f mm from the nearest ", 1e3 * r->distance);
        program_print_text(out, r->by, false);
    }
    if (r->margin > 0.0)
        fprintf(out, ", margin %.2f mm %s", 1e3 * r->margin,
                r->distance >= 0.0 && r->distance < r->margin ? "NOT kept" : "kept");
    if (r->keep || r->touched)
        fprintf(out, ", %s", r->touched ? "TOUCHED" : "untouched");
    if (r->time > 0.0)
        fprintf(out, ", tools were inside for %.2f s", r->time);
    fputc('\n', out);
}

void view_print_ledger(const PliantLedger *ledger, FILE *out)
{
    fprintf(out, "\nledger of tick %lld\n", (long long)ledger->step);
    for (int b = 0; b < ledger->body_count; b++) {
        const PliantSections *body = &ledger->body[b];
        fputs("  body ", out);
        program_print_text(out, body->body, false);
        fprintf(out, "  cut %.1f mm2  torn %.1f mm2\n", 1e6 * body->cut, 1e6 * body->torn);
        for (int k = 0; k < ledger->tissue_count; k++) {
            const PliantTissue *t = &ledger->tissue[k];
            if (strcmp(t->body, body->body) != 0)
                continue;
            fputs("    ", out);
            program_print_text(out, t->name, false);
            print_amount("at load", t->at_load, t->density, body->solid, out);
            print_amount("attached", t->attached, t->density, body->solid, out);
            print_amount("cut off", t->cut_off, t->density, body->solid, out);
            print_amount("removed", t->removed, t->density, body->solid, out);
            print_amount("coagulated", t->coagulated, t->density, body->solid, out);
            fputc('\n', out);
        }
    }
    for (int r = 0; r < ledger->region_count; r++)
        print_region(&ledger->region[r], out);
}

// Prints an error, or that it is unknown.
static void print_error(const char *what, double error, double scale, const char *unit, FILE *out)
{
    if (error < 0.0)
        fprintf(out, "  %s ?", what);
    else
        fprintf(out, "  %s %.3g %s", what, scale * error, unit);
}

static void print_errors(const PliantErrors *errors, FILE *out)
{
    fprintf(out, "\nerrors, estimated at tick %lld\n", (long long)errors->step);
    for (int b = 0; b < errors->body_count; b++) {
        const PliantErrorOfBody *body = &errors->body[b];
        fputs("  body ", out);
        program_print_text(out, body->body, false);
        print_error("space", body->space, 1e3, "mm", out);
        print_error("steps", body->steps, 1e3, "mm", out);
        print_error("together", body->total, 1e3, "mm", out);
        print_error("of the displacement", body->relative, 100.0, "%", out);
        fputc('\n', out);
    }
    for (int t = 0; t < errors->tool_count; t++) {
        const PliantErrorOfTool *tool = &errors->tool[t];
        fprintf(out, "  tool %d  %.4f N", tool->tool, tool->force);
        print_error("+-", tool->error, 1.0, "N", out);
        print_error("", tool->share, 100.0, "%", out);
        fputc('\n', out);
    }
}

static double force_of(const PliantContact *c)
{
    return sqrt(c->force[0] * c->force[0] + c->force[1] * c->force[1] + c->force[2] * c->force[2]);
}

static void print_tools(const PliantClient *client, FILE *out)
{
    const int tools = pliant_tool_count(client);
    for (int k = 0; k < tools; k++) {
        const PliantContact *c = pliant_tool(client, k);
        bool stale = pliant_now() - c->received > STALE_S;
        fprintf(out, "%stool %d  %-9s force %8.4f %8.4f %8.4f N  |F| %7.4f N  depth %6.2f mm\n",
                k ? "" : "\n", c->tool,
                stale        ? "no news"
                : c->contact ? "touching"
                             : "free",
                c->force[0], c->force[1], c->force[2], force_of(c), 1e3 * c->depth);
    }
}

static void print_event(const View *view, int64_t number, FILE *out)
{
    int at = (int)(number % VIEW_EVENTS);
    fprintf(out, "event at tick %lld: ", (long long)view->event[at].step);
    program_print_text(out, view->event[at].text, false);
    fputc('\n', out);
}

void view_print(const View *view, const PliantClient *client, FILE *out)
{
    const PliantStatus *status = pliant_status(client);
    if (!status) {
        fputs("no status yet\n", out);
    } else {
        print_head(status, out);
        double age = pliant_now() - status->received;
        if (age > 3.0)
            fprintf(out, "NO STATUS FOR %.0f s: the following is old\n", age);
        print_timing(view, status, out);
        print_bodies(status, out);
    }
    if (pliant_ledger(client))
        view_print_ledger(pliant_ledger(client), out);
    if (pliant_errors(client))
        print_errors(pliant_errors(client), out);
    print_tools(client, out);
    int64_t first = view->events > VIEW_EVENTS ? view->events - VIEW_EVENTS : 0;
    for (int64_t k = first; k < view->events; k++) {
        if (k == first)
            fputc('\n', out);
        print_event(view, k, out);
    }
}

void view_print_line(const View *view, const PliantClient *client, FILE *out)
{
    const PliantStatus *s = pliant_status(client);
    // Time and state, then the figures that show trouble.
    fprintf(out, "%.2f s  ", s->time);
    program_print_text(out, s->state, false);
    fprintf(
        out,
        "  x%.3f  late %lld (+%lld)  resets %lld  refused %lld  step p50 %.0f p99 %.0f max %.0f "
        "us  wake-up p99 %.0f us",
        s->real_time_factor, (long long)s->late_ticks, (long long)(view->late - view->late_before),
        (long long)s->resets, (long long)s->rejected, s->step_us[0], s->step_us[1], s->step_us[3],
        s->wake_us[1]);
    // Each body and each tool in short.
    for (int k = 0; k < s->body_count; k++) {
        fputs("  | ", out);
        const PliantBodyStatus *b = &s->body[k];
        program_print_text(out, b->name, false);
        fprintf(out, " displacement %.3f mm  nodes %d  %s %d", 1e3 * b->max_displacement, b->nodes,
                b->springs > 0 ? "triangles" : "elements", b->elements);
        if (b->springs > 0)
            fprintf(out, "  level %d", b->finest_level);
    }
    const int tools = pliant_tool_count(client);
    for (int k = 0; k < tools; k++)
        fprintf(out, "  | tool %d %.4f N", pliant_tool(client, k)->tool,
                force_of(pliant_tool(client, k)));
    fputc('\n', out);
}

void view_print_last_event(const View *view, FILE *out)
{
    if (view->events)
        print_event(view, view->events - 1, out);
}
