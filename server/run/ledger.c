// SPDX-License-Identifier: MIT
#include "run/ledger.h"

#include <math.h>
#include <string.h>

static const BodyAccount *account_of(Sim *sim, int body)
{
    const Body *of = sim_body(sim, body);
    return of->ops->account != NULL ? of->ops->account(of->model) : NULL;
}

size_t ledger_bytes(Sim *sim, const Scene *scene)
{
    int bodies = 0, tissues = 0;
    for (int b = 0; b < sim_body_count(sim); b++) {
        const BodyAccount *account = account_of(sim, b);
        bodies += account != NULL;
        tissues += account != NULL ? account->tissue_count : 0;
    }
    tissues = tissues < LEDGER_TISSUES ? tissues : LEDGER_TISSUES;
    const size_t lines = (size_t)(bodies + tissues + scene->score.region_count);
    return bodies == 0 ? 0 : sizeof(Ledger) + lines * sizeof(RecordingLedger);
}

// Versions only grow, so their sum tells whether any did.
static int64_t version_of(Sim *sim)
{
    int64_t version = 0;
    for (int b = 0; b < sim_body_count(sim); b++) {
        const BodyAccount *account = account_of(sim, b);
        version += account != NULL ? account->version : 0;
    }
    return version;
}

LedgerClock ledger_clock(Sim *sim)
{
    LedgerClock clock = {.on = false};
    for (int b = 0; b < sim_body_count(sim); b++)
        clock.on |= account_of(sim, b) != NULL;
    return clock;
}

bool ledger_is_due(LedgerClock *clock, Sim *sim, bool now)
{
    if (!clock->on)
        return false;
    const int64_t step = sim_steps(sim), version = version_of(sim);
    const bool early = clock->drawn && step >= clock->step &&
                       (double)(step - clock->step) * sim_tick(sim) * LEDGER_HZ < 1.0;
    if ((clock->drawn && version == clock->version) || (early && !now))
        return false;
    *clock = (LedgerClock){.on = true, .version = version, .step = step, .drawn = true};
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

static void add_tissue(Ledger *ledger, Sim *sim, const char *body, const TissueAccount *tissue)
{
    RecordingLedger *line = add(ledger, sim, LEDGER_TISSUE, body, tissue->name);
    line->value[LEDGER_DENSITY] = tissue->density;
    line->value[LEDGER_AT_LOAD] = tissue->at_load;
    line->value[LEDGER_ATTACHED] = tissue->attached;
    line->value[LEDGER_CUT_OFF] = tissue->cut_off;
    line->value[LEDGER_REMOVED] = tissue->removed;
    line->value[LEDGER_COAGULATED] = tissue->coagulated;
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
    for (int b = 0; b < sim_body_count(sim); b++) {
        const BodyAccount *account = account_of(sim, b);
        if (account == NULL || index >= account->region_count)
            continue;
        const RegionAccount *of = &account->region[index];
        touched |= of->touched;
        if (of->distance < nearest.distance) {
            nearest = *of;
            body = sim_body(sim, b)->name;
        }
    }
    RecordingLedger *line = add(ledger, sim, LEDGER_REGION, body, region->name);
    snprintf(line->by, sizeof line->by, "%s", word_of(nearest.cause));
    line->flag = (region->keep ? LEDGER_KEEP : 0) | (touched ? LEDGER_TOUCHED : 0);
    line->value[LEDGER_MARGIN] = region->margin;
    line->value[LEDGER_DISTANCE] = isfinite(nearest.distance) ? nearest.distance : -1.0;
}

void ledger_draw(Ledger *ledger, Sim *sim, const Scene *scene)
{
    int tissues = 0;
    ledger->count = 0;
    for (int b = 0; b < sim_body_count(sim); b++) {
        const BodyAccount *account = account_of(sim, b);
        if (account == NULL)
            continue;
        RecordingLedger *line = add(ledger, sim, LEDGER_BODY, sim_body(sim, b)->name, "");
        line->flag = sim_body(sim, b)->surface.solid ? LEDGER_SOLID : 0;
        line->value[LEDGER_CUT] = account->cut;
        line->value[LEDGER_TORN] = account->torn;
    }
    for (int b = 0; b < sim_body_count(sim); b++) {
        const BodyAccount *account = account_of(sim, b);
        for (int t = 0; account != NULL && t < account->tissue_count; t++)
            if (tissues++ < LEDGER_TISSUES)
                add_tissue(ledger, sim, sim_body(sim, b)->name, &account->tissue[t]);
    }
    for (int r = 0; r < scene->score.region_count; r++)
        add_region(ledger, sim, &scene->score.region[r], r);
}
