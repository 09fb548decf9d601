// SPDX-License-Identifier: MIT
// Checks that broken edges and copies of nodes from outside (a checkpoint) can be the result of
// cuts, before anything is derived from them: their numbers are indices. Load time.
#include "surface/detail/detail.h"

#include <string.h>

// True if the bits belong to inner edges, the same on both sides, or say that a face is removed.
static bool check_bits(const LeafSet *set)
{
    const DetailCut *cut = set->cut;
    const Level *finest = &set->levels.level[set->levels.finest];
    for (int f = 0; f < finest->face_count; f++) {
        if (cut->broken[f] > (7 | CUT_GONE | CUT_COAGULATED))
            return false;
        for (int k = 0; k < 3; k++) {
            int edge = finest->face_edge[f][k], across = levels_beyond(finest, edge, f), j = 0;
            // All inner edges of a removed face are broken.
            if ((cut->broken[f] >> k & 1) == 0) {
                if (detail_cut_is_gone(cut, f) && across >= 0)
                    return false;
                continue;
            }
            while (across >= 0 && finest->face_edge[across][j] != edge)
                j++;
            if (across < 0 || (cut->broken[across] >> j & 1) == 0)
                return false;
        }
    }
    return true;
}

// True if corners are nodes of the uncut mesh or copies of them, each copy belongs to one node, and
// none is unused unless its faces are removed.
static bool check_copies(const Detail *detail)
{
    DetailCut *cut = detail->set.cut;
    int64_t copies = *cut->copies, used = 0;
    bool *is_used = detail->faces.is_redrawn, whole = true; // false between changes
    if (copies < 0 || copies > cut->copy_capacity)
        return false;
    for (int f = 0; f < detail->set.face_count; f++)
        for (int k = 0; k < 3; k++) {
            int node = cut->node[f][k], copy = node - cut->base_count;
            whole &= !detail_cut_is_gone(cut, f);
            if (node == cut->base[f][k])
                continue;
            if (detail_cut_is_gone(cut, f) || copy < 0 || copy >= copies)
                return false;
            cut->origin[copy] = cut->base[f][k];
        }
    // All corners of a copy must belong to one node; count the copies that occur.
    bool ok = true;
    for (int f = 0; f < detail->set.face_count; f++)
        for (int k = 0; k < 3; k++) {
            int node = cut->node[f][k];
            if (node < cut->base_count)
                continue;
            ok &= cut->origin[node - cut->base_count] == cut->base[f][k];
            used += !is_used[node];
            is_used[node] = true;
        }
    memset(is_used + cut->base_count, 0, (size_t)cut->copy_capacity * sizeof *is_used);
    return ok && (used == copies || !whole);
}

bool detail_cut_check(const Detail *detail)
{
    if (!check_bits(&detail->set) || !check_copies(detail) || !detail_cut_parts_match(&detail->set))
        return false;
    // Locked faces are refined.
    detail_cut_lock(&detail->set);
    if (!detail_lips_check(&detail->set) || !cut_find_check(&detail->set.cut->finder) ||
        !detail_heat_check(detail) || !detail_tear_check(&detail->set) ||
        !detail_frames_check(detail))
        return false;
    for (int f = 0; f < detail->set.face_base[detail->set.levels.finest]; f++)
        if (detail->set.cut->locked[f] != 0 && detail->set.refined[f] == 0)
            return false;
    return true;
}
