// SPDX-License-Identifier: MIT
#include "run/ledger.h"

#include <math.h>
#include <string.h>

static bool has_account(Sim *sim, int body)
{
    return sim_body(sim, body)->ops->account != NULL;
}

static const BodySections *sections_of(Sim *sim, int body)
{
    const Body *of = sim_body(sim, body);
    return of->ops->sections != NULL ? of->ops->sections(of->model) : NULL;
}

size_t ledger_bytes(Sim *sim, const Scene *scene)
{
    int bodies = 0, tissues = 0;
    for (int b = 0; b < sim_body_count(sim); b++)
        if (has_account(sim, b)) {
            const Body *body = sim_body(sim, b);
            bodies++;
            tissues += body->ops->account(body->model, NULL, 0);
        }
    tissues = tissues < LEDGER_TISSUES ? tissues : LEDGER_TISSUES;
    const size_t lines = (size_t)(bodies + tissues + scene->score.region_count);
    return bodies == 0 ? 0 : sizeof(Ledger) + lines * sizeof(RecordingLedger);
}

// Returns a number that differs whenever an account has changed.
static int64_t version_of(Sim *sim)
{
    uint64_t version = 0;
    for (int b = 0; b < sim_body_count(sim); b++) {
        const BodySections *sections = sections_of(sim, b);
        const int64_t of = sections != NULL ? sections->version : sim_body(sim, b)->mesh.topology;
        if (has_account(sim, b))
            version = version * 1000003u + (uint64_t)of;
    }
    return (int64_t)version;
}

LedgerClock ledger_clock(Sim *sim)
{
    LedgerClock clock = {.on = false};
    for (int b = 0; b < sim_body_count(sim); b++)
        clock.on |= has_account(sim, b);
    return clock;
}

static int64_t visits_of(Sim *sim)
{
    int64_t visits = 0;
    for (int b = 0; b < sim_body_count(sim); b++)
        visits += sections_of(sim, b) != NULL ? sections_of(sim, b)->visits : 0;
    return visits;
}

bool ledger_is_due(LedgerClock *clock, Sim *sim, bool now)
{
    if (!clock->on)
        return false;
    const int64_t step = sim_steps(sim), version = version_of(sim), visits = visits_of(sim);
    const double age = (double)(step - clock->step) * sim_tick(sim); // below 0 after a reset
    const bool first = !clock->drawn || age < 0.0;
    const bool changed = version != clock->version, visited = visits != clock->visits;
    if (!first && !(changed && (now || age * LEDGER_HZ >= 1.0)) &&
        !(visited && (now || age >= 1.0)))
        return false;
    *clock = (LedgerClock){
        .on = true, .version = version, .visits = visits, .step = step, .drawn = true};
    return true;
}

static RecordingLedger *add(Ledger *ledger, Sim *sim, LedgerLine kind, const char *body,
                            const char *name)
{
    RecordingLedger *line = &ledger->line[ledger->count++];
    *line = (RecordingLedger){.time = sim_time(sim), .step = sim_steps(sim), .line = (int32_t)kind};
    snprintf(line->body, sizeof line->body, "%s", body);
    snprintf(line->name, sizeof line->name, "%s", name);
    return line;
}

// Adds the tissues of a body, at most `room`; returns how many.
static int add_tissues(Ledger *ledger, Sim *sim, int b, int room)
{
    const Body *body = sim_body(sim, b);
    TissueAccount account[LEDGER_TISSUES];
    int count = body->ops->account(body->model, account, room);
    count = count < room ? count : room;
    for (int t = 0; t < count; t++) {
        RecordingLedger *line = add(ledger, sim, LEDGER_TISSUE, body->name, account[t].name);
        line->value[LEDGER_DENSITY] = account[t].density;
        line->value[LEDGER_AT_LOAD] = account[t].at_load;
        line->value[LEDGER_ATTACHED] = account[t].attached;
        line->value[LEDGER_CUT_OFF] = account[t].cut_off;
        line->value[LEDGER_REMOVED] = account[t].removed;
        line->value[LEDGER_COAGULATED] = account[t].coagulated;
    }
    return count;
}

static const char *word_of(AccountCause cause)
{
    static const char *const words[ACCOUNT_CAUSES] = {"", "cut", "tear", "removal"};
    return words[cause];
}

// Adds a region with the nearest distance of all bodies.
static void add_region(Ledger *ledger, Sim *sim, const SceneRegion *region, int index)
{
    RegionAccount nearest = {.distance = (double)INFINITY};
    const char *body = "";
    bool touched = false;
    int64_t visits = 0;
    for (int b = 0; b < sim_body_count(sim); b++) {
        const BodySections *sections = sections_of(sim, b);
        if (sections == NULL || index >= sections->region_count)
            continue;
        const RegionAccount *of = &sections->region[index];
        touched |= of->touched;
        visits = of->visits > visits ? of->visits : visits;
        if (of->distance < nearest.distance) {
            nearest = *of;
            body = sim_body(sim, b)->name;
        }
    }
    RecordingLedger *line = add(ledger, sim, LEDGER_REGION, body, region->name);
    snprintf(line->by, sizeof line->by, "%s", word_of(nearest.cause));
    line->flag = (region->keep ? LEDGER_KEEP : 0) | (touched ? LEDGER_TOUCHED : 0);
    line->value[LEDGER_MARGIN] = region->margin;
    line->value[LEDGER_TIME] = (double)visits * sim_tick(sim);
    line->value[LEDGER_DISTANCE] = isfinite(nearest.distance) ? nearest.distance : -1.0;
}

void ledger_draw(Ledger *ledger, Sim *sim, const Scene *scene)
{
    int tissues = 0;
    ledger->count = 0;
    for (int b = 0; b < sim_body_count(sim); b++) {
        const BodySections *sections = sections_of(sim, b);
        if (!has_account(sim, b))
            continue;
        RecordingLedger *line = add(ledger, sim, LEDGER_BODY, sim_body(sim, b)->name, "");
        line->flag = sim_body(sim, b)->surface.solid ? LEDGER_SOLID : 0;
        line->value[LEDGER_CUT] = sections != NULL ? sections->cut : 0.0;
        line->value[LEDGER_TORN] = sections != NULL ? sections->torn : 0.0;
    }
    for (int b = 0; b < sim_body_count(sim); b++)
        if (has_account(sim, b))
            tissues += add_tissues(ledger, sim, b, LEDGER_TISSUES - tissues);
    for (int r = 0; r < scene->score.region_count; r++)
        add_region(ledger, sim, &scene->score.region[r], r);
}
