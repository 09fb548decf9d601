// Checks that a state from outside (a checkpoint) is one that a body with levels can have, before
// anything is derived from it: its numbers are indices. Load time.
#include "surface/detail/detail.h"

#include <limits.h>

static bool is_within(int64_t number, int64_t low, int64_t high)
{
    return number >= low && number <= high;
}

static bool is_number(double number)
{
    return number >= 0.0 && number <= 1e300;
}

// True if the bits belong to existing faces, with neighbours at most one level apart.
static bool check_bits(const Detail *detail)
{
    for (int l = 0; l < detail->set.levels.finest; l++) {
        const Level *at = &detail->set.levels.level[l];
        for (int f = 0; f < at->face_count; f++) {
            int number = detail->set.face_base[l] + f;
            if (detail->set.refined[number] > 1 || detail->adapt.calm_since[number] < 0)
                return false;
            if (detail->set.refined[number] == 0)
                continue;
            if (!detail_exists(&detail->set, l, f))
                return false;
            for (int k = 0; k < 3; k++) {
                int across = levels_beyond(at, at->face_edge[f][k], f);
                if (across >= 0 && !detail_exists(&detail->set, l, across))
                    return false;
            }
        }
    }
    return true;
}

static bool check_sweep(const Detail *detail)
{
    const Sweep *sweep = detail->adapt.sweep;
    int roots = detail->set.levels.level[0].face_count;
    bool ok = is_within(sweep->root, 0, roots - 1) &&
              is_within(sweep->urgent, 0, (int64_t)detail->set.levels.finest * roots) &&
              is_number(sweep->credit) && is_number(sweep->scale) &&
              is_within(sweep->level, 0, detail->set.levels.finest) &&
              is_within(sweep->topology, 0, INT64_MAX / 2) && sweep->refined >= 0 &&
              sweep->coarsened >= 0 && sweep->refused >= 0;
    for (int k = 0; k < 3; k++)
        ok = ok && is_number(sweep->thresholds[k]);
    ok = ok && is_within(*detail->adapt.felt_count, 0, detail->adapt.felt_capacity);
    for (int f = 0; ok && f < detail->set.face_base[detail->set.levels.finest + 1]; f++)
        ok = detail->adapt.crease[f] <= CREASE_SHARP;
    for (int64_t i = 0; ok && i < *detail->adapt.felt_count; i++)
        ok = is_within(detail->adapt.felt[i].node, 0, detail->set.node_count - 1);
    return ok;
}

// Fills table->slot, which is derived from table->thing; false when something has two slots or does
// not exist. Returns the number of slots in `used`.
static bool find_slots(const SlotTable *table, int *used)
{
    *used = 0;
    for (int i = 0; i < table->thing_count; i++)
        table->slot[i] = -1;
    for (int s = 0; s < table->capacity; s++) {
        int thing = table->thing[s];
        if (thing == -1)
            continue;
        if (!is_within(thing, 0, table->thing_count - 1) || table->slot[thing] >= 0)
            return false;
        table->slot[thing] = s;
        ++*used;
    }
    return true;
}

static bool is_on(const LeafSet *set, int node)
{
    if (set->cut != NULL && node >= set->cut->base_count)
        return node - set->cut->base_count < *set->cut->copies;
    int born = levels_of_node(&set->levels, node);
    return born == 0 ||
           detail_status_of_midpoint(set, born - 1,
                                     node - set->levels.level[born - 1].node_count) != NODE_OFF;
}

// True if exactly the nodes that are on have slots.
static bool check_node_slots(const Detail *detail)
{
    const SlotTable *table = &detail->faces.slots->node;
    int used;
    if (!find_slots(table, &used))
        return false;
    for (int i = 0; i < detail->set.node_count; i++)
        if ((table->slot[i] >= 0) != is_on(&detail->set, i))
            return false;
    return true;
}

// True if exactly the places at which leaves are drawn have slots; a leaf is one triangle more than
// it has midpoints.
static bool check_face_slots(const Detail *detail)
{
    const SlotTable *table = &detail->faces.slots->face;
    int used, drawn = 0;
    if (!find_slots(table, &used))
        return false;
    for (int l = 0; l <= detail->set.levels.finest; l++) {
        const Level *at = &detail->set.levels.level[l];
        for (int f = 0; f < at->face_count; f++) {
            if (!detail_is_leaf(&detail->set, l, f))
                continue;
            int pieces = 1;
            for (int k = 0; k < 3 && l < detail->set.levels.finest; k++)
                pieces +=
                    detail_status_of_midpoint(&detail->set, l, at->face_edge[f][k]) != NODE_OFF;
            for (int k = 0; k < pieces; k++)
                if (table->slot[l < detail->set.levels.finest
                                    ? detail_place(&detail->set, l + 1, 4 * f + k)
                                    : f] < 0)
                    return false;
            drawn += pieces;
        }
    }
    return drawn == used;
}

bool detail_check(const Detail *detail)
{
    return check_bits(detail) && check_sweep(detail) &&
           (detail->set.cut == NULL || detail_cut_check(detail)) && check_node_slots(detail) &&
           check_face_slots(detail);
}
