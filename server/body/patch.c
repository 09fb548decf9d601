// SPDX-License-Identifier: MIT
// Sums a patch's blocks. Step thread, except patch_create.
#include "body/patch.h"

#include <string.h>

Patch *patch_create(int slot_count, const char *name, Arena *arena)
{
    Patch *patch = arena_allocate(arena, ARENA_CONTACT, 1, sizeof *patch, "%s/patch", name);
    patch->slot_count = slot_count;
    patch->local = arena_allocate(arena, ARENA_CONTACT, (size_t)slot_count + 1,
                                  sizeof *patch->local, "%s/patch numbers", name);
    memset(patch->local, 0xff, ((size_t)slot_count + 1) * sizeof *patch->local); // -1
    return patch;
}

void patch_begin(Patch *patch, const Region *region, double time, bool tensed)
{
    for (int i = 0; i < patch->node_count; i++)
        patch->local[patch->node[i]] = -1;
    for (int i = 0; i < patch->tie_count; i++)
        patch->local[patch->tie[i].node] = -1;
    patch->region = *region;
    patch->time = time;
    patch->tensed = tensed;
    patch->pass = 0;
    patch->next = 0;
    patch->full = false;
    patch->relaxation = 0.0;
    patch->node_count = patch->tie_count = patch->block_count = 0;
}

bool patch_add_node(Patch *patch, int node, double mass, double drag, double stiffness)
{
    if (patch->node_count == PATCH_NODES) {
        patch->full = true;
        return false;
    }
    int i = patch->node_count++;
    double alone = mass / (patch->time * patch->time) + drag / patch->time + stiffness;
    patch->local[node] = (short)i;
    patch->node[i] = node;
    patch->mass[i] = alone;
    patch->drag[i] = drag;
    patch->first[i] = -1;
    patch->diagonal[i] = (Sym3){alone, alone, alone, 0.0, 0.0, 0.0};
    return true;
}

bool patch_add_tie(Patch *patch, int node, int count, const int *carrier, const double *share)
{
    if (patch->tie_count == PATCH_TIES) {
        patch->full = true;
        return false;
    }
    PatchTie *tie = &patch->tie[patch->tie_count];
    tie->node = node;
    tie->count = 0;
    for (int k = 0; k < count && k < PATCH_CARRIERS; k++) {
        if (patch->local[carrier[k]] < 0)
            continue;
        tie->local[tie->count] = patch->local[carrier[k]];
        tie->share[tie->count++] = share[k];
    }
    patch->local[node] = (short)(-2 - patch->tie_count++);
    return true;
}

int patch_carriers(const Patch *patch, int node, short *local, double *share)
{
    int at = patch->local[node];
    if (at == -1)
        return 0;
    if (at >= 0) {
        local[0] = (short)at;
        share[0] = 1.0;
        return 1;
    }
    const PatchTie *tie = &patch->tie[-2 - at];
    memcpy(local, tie->local, (size_t)tie->count * sizeof *local);
    memcpy(share, tie->share, (size_t)tie->count * sizeof *share);
    return tie->count;
}

static void add_diagonal(Patch *patch, int a, double s, const double m[9])
{
    Sym3 *d = &patch->diagonal[a];
    d->xx += s * m[0];
    d->yy += s * m[4];
    d->zz += s * m[8];
    d->yz += 0.5 * s * (m[5] + m[7]);
    d->zx += 0.5 * s * (m[2] + m[6]);
    d->xy += 0.5 * s * (m[1] + m[3]);
}

// Returns the block of a row and a later column; NULL beyond the capacity.
static PatchBlock *find_block(Patch *patch, int row, int column)
{
    for (int at = patch->first[row]; at >= 0; at = patch->block[at].next)
        if (patch->block[at].column == column)
            return &patch->block[at];
    if (patch->block_count == PATCH_BLOCKS) {
        patch->full = true;
        return NULL;
    }
    PatchBlock *block = &patch->block[patch->block_count];
    *block = (PatchBlock){.row = (short)row, .column = (short)column, .next = patch->first[row]};
    patch->first[row] = patch->block_count++;
    return block;
}

static void add_scaled(Patch *patch, int a, int b, double s, const double m[9])
{
    if (a == b) {
        add_diagonal(patch, a, s, m);
        return;
    }
    PatchBlock *block = a < b ? find_block(patch, a, b) : find_block(patch, b, a);
    for (int k = 0; k < 9 && block != NULL; k++)
        block->m[k] += s * m[a < b ? k : 3 * (k % 3) + k / 3];
}

void patch_add_block(Patch *patch, int a, int b, const double m[9])
{
    add_scaled(patch, a, b, 1.0, m);
}

void patch_add_form(Patch *patch, int count, const short *local, const double *share,
                    const double m[9])
{
    for (int i = 0; i < count; i++) {
        add_diagonal(patch, local[i], share[i] * share[i], m);
        for (int k = i + 1; k < count; k++) // a pair of the same node counts in both orders
            add_scaled(patch, local[i], local[k],
                       (local[i] == local[k] ? 2.0 : 1.0) * share[i] * share[k], m);
    }
}

static Vec3 times(const double m[9], Vec3 x)
{
    return vec3(m[0] * x.x + m[1] * x.y + m[2] * x.z, m[3] * x.x + m[4] * x.y + m[5] * x.z,
                m[6] * x.x + m[7] * x.y + m[8] * x.z);
}

static Vec3 times_transposed(const double m[9], Vec3 x)
{
    return vec3(m[0] * x.x + m[3] * x.y + m[6] * x.z, m[1] * x.x + m[4] * x.y + m[7] * x.z,
                m[2] * x.x + m[5] * x.y + m[8] * x.z);
}

void patch_multiply(const Patch *patch, const PatchColumns *x, PatchColumns *y, int first, int last)
{
    for (int i = 0; i < patch->node_count && first == 0; i++)
        for (int c = 0; c < 3; c++)
            y[i].of[c] = sym3_times(patch->diagonal[i], x[i].of[c]);
    for (int k = first; k < last; k++) {
        const PatchBlock *block = &patch->block[k];
        const Vec3 *a = x[block->row].of, *b = x[block->column].of;
        Vec3 *to_row = y[block->row].of, *to_column = y[block->column].of;
        for (int c = 0; c < 3; c++) {
            to_row[c] = vec3_add(to_row[c], times(block->m, b[c]));
            to_column[c] = vec3_add(to_column[c], times_transposed(block->m, a[c]));
        }
    }
}
