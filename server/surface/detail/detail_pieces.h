// SPDX-License-Identifier: MIT
// Virtual nodes of a body in several pieces, with frame = "body": each piece follows a rigid motion
// of its own, so that disconnected pieces move apart. The kernel has one motion, that of the
// largest piece; the differences for other pieces are added as external forces. Bodies in one
// piece, and those without such a frame, do not use this.
#ifndef PLIANT_SURFACE_DETAIL_DETAIL_PIECES_H
#define PLIANT_SURFACE_DETAIL_DETAIL_PIECES_H

#include "base/memory.h"
#include "body/rows.h"

struct SurfaceModel;
struct Detail;
struct SpringPass;

// Pieces besides the largest that have a motion of their own; smaller ones have no shape springs.
enum { PIECE_FRAMES = 16, FRAME_LOOSE = PIECE_FRAMES + 1 };

typedef struct DetailFrames {
    double (*rotation)[4]; // [PIECE_FRAMES] part of the state: where the next fit starts
    int count;             // in use
    RigidFrame frame[PIECE_FRAMES];
    int run[PIECE_FRAMES][1][2]; // range in the arrays below
    unsigned char *frame_of;    // [finest faces] of a piece, by its number: 0 the largest, else 1 +
                                // frame, or FRAME_LOOSE
    int *size;                  // [finest faces] size of a piece; zero between uses
    int slot_count;             // free nodes outside the largest piece
    int *slot;                  // [nodes] their slots by frame; loose ones last
    unsigned char *slot_frame;  // [nodes]
    double (*rest)[3], *weight; // [nodes]
    double *row;                // [nodes][ROW] their rows, in the layout of the frames
    double (*saved)[3];         // [nodes] their external forces before
} DetailFrames;

void detail_frames_create(struct SurfaceModel *model, const char *name, Arena *arena,
                          StateList *state);
// After packing: assigns nodes to frames.
void detail_frames_sort(struct SurfaceModel *model);
// After pieces have changed: the fits start again.
void detail_frames_start(struct Detail *detail);
bool detail_frames_check(const struct Detail *detail);
// Fits all frames to rows.
void detail_frames_fit(struct SurfaceModel *model, const void *rows);
// Adds the forces of the pieces' own motions to this evaluation. True if it did; then call
// detail_frames_take_back after the kernel.
bool detail_frames_add(struct SurfaceModel *model, const struct SpringPass *pass);
void detail_frames_take_back(struct SurfaceModel *model);
// Returns the motion of the node's piece at the last fit; NULL if the body has no frames.
const FramePose *detail_frames_pose(const struct SurfaceModel *model, int node);
// Returns the energy of the shape-preserving springs outside the largest piece [J].
double detail_frames_energy(const struct SurfaceModel *model, const void *rows);

#endif
