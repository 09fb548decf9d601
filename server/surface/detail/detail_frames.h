// Virtual nodes of a body in several pieces, with frame = "body": each piece follows a rigid motion
// of its own, so that pieces which come apart move apart. The kernel knows one motion, that of the
// largest piece; what the others' differ from it is added as forces from outside. Bodies in one
// piece, and those without such a frame, have none of this.
#ifndef PLIANT_SURFACE_DETAIL_DETAIL_FRAMES_H
#define PLIANT_SURFACE_DETAIL_DETAIL_FRAMES_H

#include "base/arena.h"
#include "base/state.h"
#include "dynamics/rigid_frame.h"

struct SurfaceModel;
struct Detail;
struct SpringPass;

// Pieces besides the largest that have a motion of their own; smaller ones just keep no shape.
enum { PIECE_FRAMES = 16, FRAME_LOOSE = PIECE_FRAMES + 1 };

typedef struct DetailFrames {
    double (*rotation)[4]; // [PIECE_FRAMES] part of the state: where the next fit starts
    int count;             // in use
    RigidFrame frame[PIECE_FRAMES];
    int run[PIECE_FRAMES][1][2]; // in the arrays below
    unsigned char *frame_of;     // [finest faces] of a piece, by its number: 0 the largest, else
                                 // 1 + frame, or FRAME_LOOSE
    int *size;                   // [finest faces] of a piece; zero between uses
    int slot_count;              // nodes outside the largest piece that are free,
    int *slot;                   // [nodes] by frame; loose ones last
    unsigned char *slot_frame;   // [nodes]
    double (*place)[3], *weight; // [nodes]
    double *row;                 // [nodes][ROW] their rows, as the frames read them
    double (*saved)[3];          // [nodes] outside forces that they had
} DetailFrames;

void detail_frames_create(struct SurfaceModel *model, const char *name, Arena *arena,
                          StateList *state);
// After packing: who belongs to which frame.
void detail_frames_sort(struct SurfaceModel *model);
// Pieces have changed: fits start over.
void detail_frames_start(struct Detail *detail);
bool detail_frames_check(const struct Detail *detail);
// Fits all frames to rows.
void detail_frames_fit(struct SurfaceModel *model, const void *rows);
// Adds what the pieces' own motions make of the forces of this evaluation; true when it did, then
// to be taken back after the kernel.
bool detail_frames_add(struct SurfaceModel *model, const struct SpringPass *pass);
void detail_frames_take_back(struct SurfaceModel *model);
// The motion of the node's piece at the last fit; NULL of a body that has no frame at all.
const FramePose *detail_frames_pose(const struct SurfaceModel *model, int node);
// Energy of the shape-preserving springs outside the largest piece [J].
double detail_frames_energy(struct SurfaceModel *model, const void *rows);

#endif
