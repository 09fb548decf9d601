// SPDX-License-Identifier: MIT
// The ledger that a server publishes.
#include "kit.h"

#include "wire.h"

#include <stdlib.h>

static PliantTissue *copy_tissues(const pliant_ledger_t *m)
{
    PliantTissue *tissue = calloc((size_t)m->num_tissues + 1, sizeof *tissue);
    for (int k = 0; k < m->num_tissues && tissue; k++) {
        const pliant_ledger_tissue_t *t = &m->tissue[k];
        tissue[k] = (PliantTissue){.body = t->body,
                                   .name = t->name,
                                   .density = t->density,
                                   .at_load = t->at_load,
                                   .attached = t->attached,
                                   .cut_off = t->cut_off,
                                   .removed = t->removed,
                                   .coagulated = t->coagulated};
    }
    return tissue;
}

static PliantSections *copy_bodies(const pliant_ledger_t *m)
{
    PliantSections *body = calloc((size_t)m->num_bodies + 1, sizeof *body);
    for (int k = 0; k < m->num_bodies && body; k++)
        body[k] = (PliantSections){.body = m->body[k].name,
                                   .solid = m->body[k].solid,
                                   .cut = m->body[k].cut,
                                   .torn = m->body[k].torn};
    return body;
}

static PliantRegion *copy_regions(const pliant_ledger_t *m)
{
    PliantRegion *region = calloc((size_t)m->num_regions + 1, sizeof *region);
    for (int k = 0; k < m->num_regions && region; k++) {
        const pliant_ledger_region_t *r = &m->region[k];
        region[k] = (PliantRegion){.name = r->name,
                                   .keep = r->keep,
                                   .touched = r->touched,
                                   .margin = r->margin,
                                   .distance = r->distance,
                                   .time = r->time,
                                   .body = r->body,
                                   .by = r->by};
    }
    return region;
}

void kit_forget_ledger(PliantClient *kit)
{
    if (kit->ledger_message)
        pliant_ledger_t_destroy(kit->ledger_message);
    kit->ledger_message = NULL;
    free((void *)kit->ledger.body);
    free((void *)kit->ledger.tissue);
    free((void *)kit->ledger.region);
    kit->ledger = (PliantLedger){.step = 0};
}

void kit_take_ledger(PliantClient *kit, const void *data, size_t size)
{
    pliant_ledger_t m;
    if (!wire_check(&WIRE_LEDGER, data, size) || pliant_ledger_t_decode(data, 0, (int)size, &m) < 0)
        return;
    kit_forget_ledger(kit);
    kit->ledger_message = pliant_ledger_t_copy(&m);
    pliant_ledger_t_decode_cleanup(&m);
    const pliant_ledger_t *l = kit->ledger_message;
    if (!l)
        return;
    kit->ledgers++;
    kit->news++;
    kit->ledger = (PliantLedger){.step = l->step,
                                 .time = l->time,
                                 .received = pliant_now(),
                                 .body = copy_bodies(l),
                                 .tissue = copy_tissues(l),
                                 .region = copy_regions(l)};
    if (!kit->ledger.body || !kit->ledger.tissue || !kit->ledger.region)
        abort(); // the machine is out of memory
    kit->ledger.body_count = l->num_bodies;
    kit->ledger.tissue_count = l->num_tissues;
    kit->ledger.region_count = l->num_regions;
}

const PliantLedger *pliant_ledger(const PliantClient *kit)
{
    return kit->ledger_message ? &kit->ledger : NULL;
}

const PliantLedger *pliant_wait_ledger(PliantClient *kit, double seconds)
{
    return kit_wait_published(kit, "LEDGER", seconds, &kit->ledgers,
                              "none with a body that can be cut")
               ? &kit->ledger
               : NULL;
}
