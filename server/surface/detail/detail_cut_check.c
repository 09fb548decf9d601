// Whether broken edges and copies of nodes that came from outside (a checkpoint) are such as cuts
// can have led to: asked before anything is made of them, for their numbers are indices. Load time.
#include "surface/detail/detail.h"

#include <string.h>

// Bits of inner edges, the same on both sides.
static bool check_bits(const Detail *detail)
{
    const DetailCut *cut = detail->cut;
    const Level *finest = &detail->levels.level[detail->finest];
    for (int f = 0; f < finest->face_count; f++) {
        if (cut->broken[f] > 7)
            return false;
        for (int k = 0; k < 3; k++) {
            if ((cut->broken[f] >> k & 1) == 0)
                continue;
            int edge = finest->face_edge[f][k], across = levels_beyond(finest, edge, f), j = 0;
            while (across >= 0 && finest->face_edge[across][j] != edge)
                j++;
            if (across < 0 || (cut->broken[across] >> j & 1) == 0)
                return false;
        }
    }
    return true;
}

// Corners are nodes of the uncut mesh or copies of them, each copy of one node, none left out.
static bool check_copies(const Detail *detail)
{
    DetailCut *cut = detail->cut;
    int64_t copies = *cut->copies, used = 0;
    bool *is_used = detail->is_redrawn; // false between changes
    if (copies < 0 || copies > cut->copy_capacity)
        return false;
    for (int f = 0; f < detail->place_count; f++)
        for (int k = 0; k < 3; k++) {
            int node = cut->node[f][k], copy = node - cut->base_count;
            if (node == cut->base[f][k])
                continue;
            if (copy < 0 || copy >= copies)
                return false;
            cut->origin[copy] = cut->base[f][k];
        }
    bool ok = true;
    for (int f = 0; f < detail->place_count; f++)
        for (int k = 0; k < 3; k++) {
            int node = cut->node[f][k];
            if (node < cut->base_count)
                continue;
            ok &= cut->origin[node - cut->base_count] == cut->base[f][k];
            used += !is_used[node];
            is_used[node] = true;
        }
    memset(is_used + cut->base_count, 0, (size_t)cut->copy_capacity * sizeof *is_used);
    return ok && used == copies;
}

// Ends of broken edges may have been moved onto a blade, once; a little more for rounding.
static bool check_places(const Detail *detail)
{
    const DetailCut *cut = detail->cut;
    const double most = 1.001 * CUT_SNAP_MOST * cut->finder.h;
    for (int i = 0; i < cut->base_count; i++) {
        double moved = vec3_length(vec3_sub(cut->rest[i], cut->built[i]));
        if (!(moved <= (cut->is_end[i] ? most : 0.0)))
            return false;
    }
    return true;
}

bool detail_cut_check(const Detail *detail)
{
    if (!check_bits(detail) || !check_copies(detail) || !detail_cut_parts_match(detail))
        return false;
    // What is locked is refined.
    detail_cut_lock(detail);
    if (!check_places(detail) || !cut_find_check(&detail->cut->finder) ||
        !detail_tear_check(detail) || !detail_frames_check(detail))
        return false;
    for (int f = 0; f < detail->face_base[detail->finest]; f++)
        if (detail->cut->locked[f] != 0 && detail->refined[f] == 0)
            return false;
    return true;
}
