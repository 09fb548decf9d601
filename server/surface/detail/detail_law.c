// SPDX-License-Identifier: MIT
// Dashpots of springs whose tables are packed again (README.md, "Relaxation across changes"): a
// spring keeps the strain of its dashpots, a new one takes that of the spring it came from, which
// leaves what a homogeneous strain has relaxed, and its energy, as they were. Step thread, when the
// topology changes.
#include "surface/detail/detail.h"

#include "surface/law.h"

#include <string.h>

void detail_law_create(SurfaceModel *model, const SurfaceMaterial *material, size_t entries,
                       const char *name, Arena *arena, StateList *state)
{
    Detail *detail = model->detail;
    const DetailPack *pack = &detail->pack;
    const int nodes = detail->set.node_count, chunks = model->springs.chunk_count;
    law_create(model, material, entries, name, arena, state);
    if (model->relaxation == NULL)
        return;
    DetailLaw *law = detail->law = ALLOCATE(ARENA_TOPOLOGY, 1, DetailLaw, "dashpots of changes");
    law->saved = ALLOCATE(ARENA_TOPOLOGY, pack->window_count, bool, "saved windows");
    law->lane = ALLOCATE(ARENA_TOPOLOGY, model->basis.count, int, "saved lanes");
    law->start = ALLOCATE(ARENA_TOPOLOGY, chunks, int, "saved spring start");
    law->end = ALLOCATE(ARENA_TOPOLOGY, chunks, int, "saved spring end");
    law->neighbour = ALLOCATE(ARENA_TOPOLOGY, entries, int, "saved spring neighbours");
    law->rest_length = model_allocate_reals(model, entries, name, "saved rest lengths", arena);
    law->before = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "nodes before a change");
    for (int i = 0; i < nodes; i++)
        law->before[i] = i;
}

// --- before the tables are packed ---

// The dashpots that are not current hold those before the change, until it is over.
static size_t entry_bytes(const SurfaceModel *model)
{
    return (size_t)model->relaxation->count * LANES * model_real_size(model);
}

static void copy_dashpots(const SurfaceModel *model, int from, int first, int count)
{
    const size_t bytes = entry_bytes(model);
    void *const *strain = model->relaxation->strain;
    memcpy((char *)strain[1 - from] + (size_t)first * bytes,
           (char *)strain[from] + (size_t)first * bytes, (size_t)count * bytes);
}

static void save_window(SurfaceModel *model, int w)
{
    const DetailPack *pack = &model->detail->pack;
    DetailLaw *law = model->detail->law;
    const SpringTable *springs = &model->springs;
    const int chunk = w * pack->window_chunks, first = springs->start[chunk],
              count = springs->start[chunk + pack->window_chunks] - first;
    const size_t real = model_real_size(model), at = (size_t)first * LANES,
                 numbers = (size_t)count * LANES;
    law->saved[w] = true;
    memcpy(law->lane + w * pack->width, model->lane + w * pack->width,
           (size_t)pack->width * sizeof *law->lane);
    memcpy(law->start + chunk, springs->start + chunk,
           (size_t)pack->window_chunks * sizeof *law->start);
    memcpy(law->end + chunk, springs->end + chunk, (size_t)pack->window_chunks * sizeof *law->end);
    memcpy(law->neighbour + at, springs->neighbour + at, numbers * sizeof *law->neighbour);
    memcpy((char *)law->rest_length + at * real, (char *)springs->rest_length + at * real,
           numbers * real);
    copy_dashpots(model, model->relaxation->current, first, count);
    memset((char *)model->relaxation->strain[model->relaxation->current] +
               (size_t)first * entry_bytes(model),
           0, (size_t)count * entry_bytes(model));
}

void detail_law_save(SurfaceModel *model)
{
    Detail *detail = model->detail;
    const TopologyChange *change = &detail->report.change;
    for (int w = 0; w < detail->pack.window_count; w++)
        if (detail->pack.stale_window[w])
            save_window(model, w);
    for (int i = 0; i < change->born_count; i++)
        if (change->born[i].parent[0] == change->born[i].parent[1]) // a copy
            detail->law->before[change->born[i].node] = change->born[i].parent[0];
}

// --- after ---

// The dashpots of a spring before the change.
typedef struct Dashpots {
    bool found;
    double r; // rest length [m]
    double d[MAXWELL_BRANCHES];
} Dashpots;

static Dashpots find_spring(const SurfaceModel *model, int a, int b)
{
    const DetailLaw *law = model->detail->law;
    const SpringTable *springs = &model->springs;
    const Relaxation *relaxation = model->relaxation;
    const int slot = model->slot[law->before[a]], other = model->slot[law->before[b]];
    const bool saved = law->saved[slot / model->detail->pack.width];
    const int lane = saved ? law->lane[slot] : model->lane[slot], chunk = lane / LANES;
    Dashpots found = {.found = false};
    if (lane < 0)
        return found;
    const int *neighbour = saved ? law->neighbour : springs->neighbour;
    const int end = saved ? law->end[chunk] : springs->end[chunk];
    for (int e = saved ? law->start[chunk] : springs->start[chunk]; e < end; e++) {
        const long at = (long)e * LANES + lane % LANES;
        if (neighbour[at] != other)
            continue;
        const int from = saved ? 1 - relaxation->current : relaxation->current;
        found.found = true;
        found.r = model_get(model, saved ? law->rest_length : springs->rest_length, at);
        for (int n = 0; n < relaxation->count; n++)
            found.d[n] = model_get(model, relaxation->strain[from],
                                   ((long)e * relaxation->count + n) * LANES + lane % LANES);
        break;
    }
    return found;
}

// Returns the mean strain, as extensions at a rest length of 1 m where lengths differ. The same
// bits in any order.
static Dashpots mean_of(const Dashpots *a, const Dashpots *b)
{
    if (!a->found || !b->found)
        return a->found ? *a : *b;
    Dashpots mean = *a;
    const bool same = a->r == b->r;
    mean.r = same ? a->r : 1.0;
    for (int n = 0; n < MAXWELL_BRANCHES; n++)
        mean.d[n] =
            same
                ? 0.5 * (a->d[n] + b->d[n])
                : 0.5 * ((a->r > 0.0 ? a->d[n] / a->r : 0.0) + (b->r > 0.0 ? b->d[n] / b->r : 0.0));
    return mean;
}

static Dashpots find_edge(const SurfaceModel *model, int level, int face, int k)
{
    const int *corner = model->detail->set.levels.level[level].face[face];
    return find_spring(model, corner[k], corner[(k + 1) % 3]);
}

// Looks for the halves of an edge of a face: edge k of its children at both ends.
static Dashpots find_below(const SurfaceModel *model, int level, int face, int k)
{
    Dashpots half[2] = {{.found = false}, {.found = false}};
    for (int i = 0; i < 2 && level < model->detail->set.levels.finest; i++) {
        const int child = 4 * face + (k + i) % 3;
        half[i] = find_edge(model, level + 1, child, k);
        if (!half[i].found)
            half[i] = find_below(model, level + 1, child, k);
    }
    return mean_of(&half[0], &half[1]);
}

// Looks for the edge of the parent that is parallel: edge k of the children at corners, edge k + 2
// of the one in the middle.
static Dashpots find_above(const SurfaceModel *model, int level, int face, int k)
{
    Dashpots found = {.found = false};
    while (level > 0 && !found.found) {
        k = face % 4 == 3 ? (k + 2) % 3 : k;
        face /= 4;
        level--;
        found = find_edge(model, level, face, k);
    }
    return found;
}

// Returns the dashpots that a spring had, or those of the springs that it came from: on both sides
// where they differ.
static Dashpots find_origin(const SurfaceModel *model, int a, int b)
{
    const LeafSet *set = &model->detail->set;
    Dashpots sum = find_spring(model, a, b);
    if (sum.found)
        return sum;
    Leaf *leaf = set->ring[0];
    const int count = detail_leaves_around(set, a, leaf);
    for (int i = 0; i < count; i++) {
        const int *corner = set->levels.level[leaf[i].level].face[leaf[i].face];
        for (int back = 0; back < 2; back++) {
            const int k = (leaf[i].corner + 2 * back) % 3;
            if (corner[back ? k : (k + 1) % 3] != b)
                continue;
            Dashpots side = find_below(model, leaf[i].level, leaf[i].face, k);
            if (!side.found)
                side = find_above(model, leaf[i].level, leaf[i].face, k);
            sum = mean_of(&sum, &side);
        }
    }
    return sum;
}

static void move_lane(const SurfaceModel *model, int slot)
{
    const SpringTable *springs = &model->springs;
    const Relaxation *relaxation = model->relaxation;
    const int *of_slot = model->detail->pack.of_slot, lane = model->lane[slot],
              chunk = lane / LANES;
    for (int e = springs->start[chunk]; lane >= 0 && e < springs->end[chunk]; e++) {
        const long at = (long)e * LANES + lane % LANES;
        if (springs->neighbour[at] == slot)
            continue; // padding, or a gap around a cavity
        const Dashpots from = find_origin(model, of_slot[slot], of_slot[springs->neighbour[at]]);
        const double r = model_get(model, springs->rest_length, at);
        for (int n = 0; n < relaxation->count && from.found; n++)
            model_put(model, relaxation->strain[relaxation->current],
                      ((long)e * relaxation->count + n) * LANES + lane % LANES,
                      r == from.r    ? from.d[n]
                      : from.r > 0.0 ? from.d[n] * (r / from.r)
                                     : 0.0);
    }
}

void detail_law_move(SurfaceModel *model)
{
    Detail *detail = model->detail;
    const DetailPack *pack = &detail->pack;
    DetailLaw *law = detail->law;
    const TopologyChange *change = &detail->report.change;
    for (int w = 0; w < pack->window_count; w++)
        for (int s = w * pack->width; law->saved[w] && s < (w + 1) * pack->width; s++)
            if (model->lane[s] >= 0)
                move_lane(model, s);
    // What is not in use is alike in both arrays: neither is written there.
    for (int w = 0; w < pack->window_count; w++) {
        const int chunk = w * pack->window_chunks, first = model->springs.start[chunk];
        if (law->saved[w])
            copy_dashpots(model, model->relaxation->current, first,
                          model->springs.start[chunk + pack->window_chunks] - first);
        law->saved[w] = false;
    }
    for (int i = 0; i < change->born_count; i++)
        law->before[change->born[i].node] = change->born[i].node;
}
