// SPDX-License-Identifier: MIT
#include "run/modes.h"

static void print_times(const char *name, const Histogram *histogram, FILE *out)
{
    double us[4];
    histogram_summarize(histogram, us);
    fprintf(out, "%s: p50 %.0f, p99 %.0f, p99.9 %.0f, max %.0f us\n", name, us[0], us[1], us[2],
            us[3]);
}

// Prints a hash by which two runs can be compared: the same bits give the same hash.
static void print_end(World *world, FILE *out)
{
    fprintf(out, "step: %lld, time: %.9g s\nstate: %016llx\n", (long long)sim_steps(world->sim),
            sim_time(world->sim), (unsigned long long)state_hash(&world->state));
}

static void print_team(const World *world, FILE *out)
{
    if (world->team != NULL)
        fprintf(out, "threads: %d, late workers: %lld\n", team_threads(world->team),
                (long long)team_late(world->team));
}

static void print_refused(World *world, FILE *out)
{
    // Where room was too small: contacts,
    int64_t refused = sim_refused_faces(world->sim);
    if (refused > 0)
        fprintf(out, "faces near tools without room in the contact arrays: %lld\n",
                (long long)refused);
    // holding,
    refused = sim_refused_holds(world->sim);
    if (refused > 0)
        fprintf(out, "nodes and points without room in graspers and attachments: %lld\n",
                (long long)refused);
    refused = sim_refused_touches(world->sim);
    if (refused > 0)
        fprintf(out, "points and faces of touching bodies without room: %lld\n",
                (long long)refused);
    // and division.
    for (int b = 0; b < sim_body_count(world->sim); b++) {
        const Body *body = sim_body(world->sim, b);
        BodyMeasure measure;
        body->ops->measure(body->model, &measure);
        if (measure.refused > 0)
            fprintf(out, "body %s: divisions of faces without room (capacity): %lld\n", body->name,
                    (long long)measure.refused);
    }
}

static void print_messages(const LiveResult *result, FILE *out)
{
    const BusCounts *bus = &result->bus;
    fprintf(out, "messages: in %lld, out %lld, rejected %lld\n", (long long)bus->received,
            (long long)bus->published, (long long)bus->refused);
    // By cause.
    for (int i = ACCEPTED + 1; i < REFUSAL_COUNT; i++)
        if (bus->reason[i] > 0)
            fprintf(out, "  rejected %s: %lld\n", refusal_name((Refusal)i),
                    (long long)bus->reason[i]);
    // What never reached a client.
    if (bus->failed > 0 || result->lost > 0)
        fprintf(out, "  not published: %lld, lost on the way to the bus: %lld\n",
                (long long)bus->failed, (long long)result->lost);
    fprintf(out, "high water: requests %u, answers %u, contacts %u, events %u, logged inputs %u\n",
            result->requests_high, result->answers_high, result->contacts_high, result->events_high,
            result->applied_high);
}

static void print_guard(const World *world, FILE *out)
{
    for (int i = 0; i < GUARD_REASONS; i++) {
        const char *name;
        int64_t count = guard_reason(sim_guard_counts(world->sim), i, &name);
        if (count > 0)
            fprintf(out, "  %s: %lld\n", name, (long long)count);
    }
}

void report_live(World *world, const LiveResult *result, FILE *out)
{
    // Time: ticks, and how long they took.
    fprintf(out, "ticks: %lld\nlate ticks: %lld\nresets: %lld\n", (long long)result->ticks,
            (long long)result->late_ticks, (long long)result->resets);
    if (result->quota.held_us > 0)
        fprintf(out, "stopped by the processor quota (cpu.max %s): %.1f s\n", result->quota.limit,
                1e-6 * (double)result->quota.held_us);
    print_guard(world, out);
    print_times("step time", &result->step, out);
    print_times("wake-up", &result->wake, out);
    print_team(world, out);
    // Messages and what was refused.
    print_refused(world, out);
    if (result->governor_actions > 0)
        fprintf(out, "governor: %lld actions, stage %lld at the end\n",
                (long long)result->governor_actions, (long long)result->governor_stage);
    print_messages(result, out);
    // Files.
    if (result->checkpoints > 0)
        fprintf(out, "checkpoints: %lld\n", (long long)result->checkpoints);
    if (result->recorded + result->recorded_lost > 0)
        fprintf(out, "recorded frames: %lld, dropped %lld, high water %u\n",
                (long long)result->recorded, (long long)result->recorded_lost,
                result->recorded_high);
    print_end(world, out);
}

void report_offline(World *world, const OfflineResult *result, FILE *out)
{
    fprintf(out, "ticks: %lld\nresets: %lld\n", (long long)result->ticks,
            (long long)sim_resets(world->sim));
    // The same lines as of a live run, as far as they apply.
    print_guard(world, out);
    print_times("step time", &result->step, out);
    print_team(world, out);
    print_refused(world, out);
    // What became of the log.
    fprintf(out, "inputs: applied %lld, rejected %lld\n", (long long)result->applied,
            (long long)result->refused);
    if (result->log_ended)
        fprintf(out, "log: all of it\n");
    if (result->recorded > 0)
        fprintf(out, "recorded frames: %lld, dropped 0\n", (long long)result->recorded);
    print_end(world, out);
}
