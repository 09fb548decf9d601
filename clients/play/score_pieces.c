// SPDX-License-Identifier: MIT
// The connected pieces of a body at the end, and which of them were removed.
#include "score_body.h"

#include "base/check.h"
#include "base/sets.h"

#include <stdlib.h>
#include <string.h>

// Numbers the connected parts of the mesh: part[node]. Returns how many; a node without triangles
// is one.
static int find_parts(const ScoreTissue *tissue, int *part)
{
    union_find_reset(part, tissue->node_count);
    for (int t = 0; t < tissue->triangle_count; t++)
        for (int k = 0; k < 2; k++)
            union_find_join(part, tissue->triangle[t][k], tissue->triangle[t][k + 1]);
    return union_find_number(part, tissue->node_count);
}

typedef struct Part {
    double size;  // area [m2], of a solid the volume [m3]: negative around a hole in it
    int of;       // part of the first mesh that it was in; 0 if that is not known
    bool fixed;   // has nodes that the scene fixes
    bool removed; // neither that nor the largest of its part
} Part;

static bool is_fixed(const ScoreTissue *tissue, int id, Vec3 place)
{
    const ScoreRules *rules = tissue->rules;
    for (int b = 0; b < rules->fixed_count; b++)
        for (int k = 0; k < rules->fixed[b].count; k++) {
            const FixedRegion *region = &rules->fixed[b].region[k];
            if (strcmp(rules->fixed[b].body, tissue->body) != 0)
                break;
            if (region->kind != FIXED_NODES && fixed_contains(region, place))
                return true;
            for (int n = 0; region->kind == FIXED_NODES && n < region->node_count; n++)
                if (region->node[n] == id)
                    return true;
        }
    return false;
}

// Measures the connected parts of the newest mesh; the caller frees them.
static Part *measure_parts(const ScoreTissue *tissue, int *number, int *count)
{
    *count = find_parts(tissue, number);
    Part *part = score_allocate(*count, sizeof *part);
    Vec3 *from = score_allocate(*count, sizeof *from); // a node of each
    for (int i = 0; i < tissue->node_count; i++) {
        Part *of = &part[number[i]];
        const Node *node = score_find_node(tissue, tissue->id[i]);
        from[number[i]] = tissue->place[i];
        of->of = node->part > of->of ? node->part : of->of;
        of->fixed = of->fixed || is_fixed(tissue, tissue->id[i], tissue->place[i]);
    }
    for (int t = 0; t < tissue->triangle_count; t++) {
        const int at = number[tissue->triangle[t][0]];
        Vec3 x[3];
        score_corners(tissue, t, x);
        const Vec3 a = vec3_sub(x[0], from[at]), b = vec3_sub(x[1], from[at]),
                   c = vec3_sub(x[2], from[at]);
        part[at].size +=
            tissue->first_wall > 0 ? vec3_dot(a, vec3_cross(b, c)) / 6.0 : score_area(x);
    }
    free(from);
    return part;
}

void score_note_parts(ScoreTissue *tissue)
{
    int *number = score_allocate(tissue->node_count, sizeof *number), count;
    Part *part = measure_parts(tissue, number, &count);
    for (int i = 0; i < count; i++) {
        tissue->parts += part[i].size > 0.0;
        tissue->whole += part[i].size;
    }
    for (int i = 0; i < tissue->node_count; i++)
        score_find_node(tissue, tissue->id[i])->part = number[i];
    free(part);
    free(number);
}

static int by_falling_size(const void *a, const void *b)
{
    const ScorePiece *x = a, *y = b;
    return (x->size < y->size) - (x->size > y->size);
}

// Marks what was removed: of each part of the first mesh all but its largest piece and what is
// fixed.
static void mark_removed(Part *part, int count, int parts)
{
    int *largest = score_allocate(parts, sizeof *largest);
    for (int i = 0; i < parts; i++)
        largest[i] = -1;
    for (int i = 0; i < count; i++) {
        int *of = &largest[part[i].of];
        if (part[i].size > 0.0 && (*of < 0 || part[i].size > part[*of].size))
            *of = i;
    }
    for (int i = 0; i < count; i++)
        part[i].removed = part[i].size > 0.0 && !part[i].fixed;
    for (int i = 0; i < parts; i++)
        if (largest[i] >= 0)
            part[largest[i]].removed = false;
    free(largest);
}

void score_tissue_pieces(const ScoreTissue *tissue, ScoreBody *body)
{
    int *number = score_allocate(tissue->node_count, sizeof *number), count, most = 0;
    Part *part = measure_parts(tissue, number, &count);
    for (int i = 0; i < count; i++)
        most = part[i].of > most ? part[i].of : most;
    mark_removed(part, count, most + 1);
    body->solid = tissue->first_wall > 0;
    body->pieces_first = tissue->parts;
    body->whole_size = tissue->whole;
    ScorePiece *piece = score_allocate(count, sizeof *piece);
    for (int i = 0; i < count; i++) {
        body->pieces_last += part[i].size > 0.0;
        if (!part[i].removed)
            continue;
        piece[body->removed++].size = part[i].size;
        body->removed_size += part[i].size;
    }
    qsort(piece, (size_t)body->removed, sizeof *piece, by_falling_size);
    for (int i = 0; i < body->removed && i < SCORE_PIECES; i++)
        body->piece[i] = piece[i];
    free(piece);
    free(part);
    free(number);
}
