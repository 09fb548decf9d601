// Connected pieces of a body that can be cut. Always labelled from scratch: some ten nanoseconds
// per face. Step thread, after a cut.
#include "surface/detail/detail.h"

#include "base/sets.h"

void detail_pieces_label(LeafSet *set)
{
    DetailCut *cut = set->cut;
    const Level *finest = &set->levels.level[set->levels.finest];
    int *piece = cut->piece;
    union_find_reset(piece, finest->face_count);
    for (int f = 0; f < finest->face_count; f++)
        for (int k = 0; k < 3; k++) {
            int across = levels_beyond(finest, finest->face_edge[f][k], f);
            if (across >= f && (cut->broken[f] >> k & 1) == 0)
                union_find_join(piece, f, across);
        }
    cut->piece_count = cut->small_count = 0;
    for (int f = 0; f < finest->face_count; f++) { // lower ones are final
        piece[f] = piece[piece[f]];
        cut->piece_count += piece[f] == f;
        for (int k = 0; k < 3; k++)
            cut->node_piece[cut->node[f][k]] = piece[f];
    }
    // A piece of one face has no unbroken edge.
    for (int f = 0; f < finest->face_count; f++) {
        bool alone = piece[f] == f;
        for (int k = 0; k < 3 && alone; k++)
            alone = (cut->broken[f] >> k & 1) != 0 ||
                    levels_beyond(finest, finest->face_edge[f][k], f) < 0;
        cut->small_count += alone;
    }
}
