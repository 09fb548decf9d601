// SPDX-License-Identifier: MIT
// Shared by the files that follow one body through its meshes: score_tissue.c, score_region.c,
// score_pieces.c.
#ifndef PLIANT_PLAY_SCORE_BODY_H
#define PLIANT_PLAY_SCORE_BODY_H

#include "score_parts.h"

typedef struct Node {
    int id;
    int origin, parent[2]; // ids, as in RecordingTopology
    bool used, placed;
    int part; // connected part of the first mesh; -1: neither it nor what it was made of was there
    Vec3 place; // in the reference shape [m], if placed
} Node;

struct ScoreTissue {
    const ScoreRules *rules;
    char body[RECORDING_BODY_TEXT];
    int first_wall;
    Node *node; // [capacity], open addressing
    size_t count, capacity;
    bool any;      // the reference shape is known
    Severed total; // of the mesh before: half of all borders or walls
    int parts;     // connected parts of the first mesh
    double whole;  // their area or volume
    // the newest mesh
    int node_count, triangle_count;
    int *id;
    int (*triangle)[3];
    Vec3 *place;
};

// Returns the node with an id, or NULL.
Node *score_find_node(const ScoreTissue *tissue, int id);
void score_corners(const ScoreTissue *tissue, int triangle, Vec3 corner[3]);
double score_area(const Vec3 corner[3]); // [m2]

// Notes the connected parts of the newest mesh, which is the first.
void score_note_parts(ScoreTissue *tissue);

// Return the share of a segment, and to a sixty-fourth of a triangle, that is in any region.
double score_share_of_segment(const ScoreRules *rules, Vec3 a, Vec3 b);
double score_share_of_triangle(const ScoreRules *rules, const Vec3 corner[3]);

#endif
