// SPDX-License-Identifier: MIT
// The connected pieces of a body that can be cut, and the rigid motions of their shapes. Step
// thread.
#include "surface/detail/detail.h"

#include "base/sets.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// Labels: always from scratch, some ten nanoseconds per face

void detail_pieces_label(LeafSet *set)
{
    DetailCut *cut = set->cut;
    const Level *finest = &set->levels.level[set->levels.finest];
    int *piece = cut->piece;
    // Faces across an unbroken edge are in one piece.
    union_find_reset(piece, finest->face_count);
    for (int f = 0; f < finest->face_count; f++)
        for (int k = 0; k < 3; k++) {
            int across = levels_beyond(finest, finest->face_edge[f][k], f);
            if (across >= f && (cut->broken[f] >> k & 1) == 0)
                union_find_join(piece, f, across);
        }
    // A piece is named by its lowest face; nodes take the piece of their faces.
    cut->piece_count = cut->small_count = 0;
    for (int f = 0; f < finest->face_count; f++) { // lower ones are final
        piece[f] = piece[piece[f]];
        if (detail_cut_is_gone(cut, f))
            continue;
        cut->piece_count += piece[f] == f;
        for (int k = 0; k < 3; k++)
            cut->node_piece[cut->node[f][k]] = piece[f];
    }
    // A piece of one face has no unbroken edge.
    for (int f = 0; f < finest->face_count; f++) {
        bool alone = piece[f] == f && !detail_cut_is_gone(cut, f);
        for (int k = 0; k < 3 && alone; k++)
            alone = (cut->broken[f] >> k & 1) != 0 ||
                    levels_beyond(finest, finest->face_edge[f][k], f) < 0;
        cut->small_count += alone;
    }
}

// ---------------------------------------------------------------------------------------------
// Frames: sorted when pieces or nodes change, fitted and added in every evaluation

void detail_frames_create(SurfaceModel *model, const char *name, Arena *arena, StateList *state)
{
    Detail *detail = model->detail;
    size_t nodes = (size_t)detail->set.node_count, faces = (size_t)detail->set.face_count;
    DetailFrames *frames = detail->frames =
        ALLOCATE(ARENA_STEP, 1 + 1, DetailFrames, "piece frames");
    // The rotations are state: fits start from them.
    frames->rotation = ALLOCATE(ARENA_STEP, PIECE_FRAMES + 1, *frames->rotation, "piece rotations");
    for (int i = 0; i < PIECE_FRAMES; i++)
        frames->rotation[i][0] = 1.0;
    state_add(state, frames->rotation, PIECE_FRAMES * sizeof *frames->rotation,
              "%s/piece_rotations", name);
    // By piece and by node.
    frames->frame_of = ALLOCATE(ARENA_STEP, faces + 1, unsigned char, "frames of pieces");
    frames->size = ALLOCATE(ARENA_STEP, faces + 1, int, "piece sizes");
    frames->slot = ALLOCATE(ARENA_STEP, nodes + 1, int, "slots of pieces");
    frames->slot_frame = ALLOCATE(ARENA_STEP, nodes + 1, unsigned char, "frames of slots");
    frames->rest = ALLOCATE(ARENA_STEP, nodes + 1, *frames->rest, "places of pieces");
    frames->weight = ALLOCATE(ARENA_STEP, nodes + 1, double, "weights of pieces");
    frames->row = ALLOCATE(ARENA_STEP, (nodes * ROW) + 1, double, "rows of pieces");
    frames->saved = ALLOCATE(ARENA_STEP, nodes + 1, *frames->saved, "forces on pieces");
}

bool detail_frames_check(const Detail *detail)
{
    const DetailFrames *frames = detail->frames;
    for (int i = 0; frames != NULL && i < PIECE_FRAMES; i++) {
        const double *q = frames->rotation[i];
        double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
        if (!(fabs(square - 1.0) < 1e-6))
            return false;
    }
    return true;
}

void detail_frames_start(Detail *detail)
{
    static const double none[4] = {1.0, 0.0, 0.0, 0.0};
    for (int i = 0; detail->frames != NULL && i < PIECE_FRAMES; i++)
        memcpy(detail->frames->rotation[i], none, sizeof none);
}

// Numbers the pieces by their number of faces, then by their lowest face; the largest is 0.
static void rank_pieces(Detail *detail)
{
    DetailFrames *frames = detail->frames;
    const int *piece = detail->set.cut->piece;
    int best[PIECE_FRAMES + 1], count = 0;
    // Sizes of all pieces.
    for (int f = 0; f < detail->set.face_count; f++)
        frames->size[piece[f]]++;
    for (int f = 0; f < detail->set.face_count; f++) {
        if (piece[f] != f || detail_cut_is_gone(detail->set.cut, f))
            continue;
        frames->frame_of[f] = FRAME_LOOSE;
        // Insert it among the largest so far.
        if (count > PIECE_FRAMES && frames->size[f] <= frames->size[best[PIECE_FRAMES]])
            continue;
        int at = count <= PIECE_FRAMES ? count++ : PIECE_FRAMES;
        for (; at > 0 && frames->size[best[at - 1]] < frames->size[f]; at--)
            best[at] = best[at - 1];
        best[at] = f;
    }
    // The largest is frame 0; sizes return to zero for the next call.
    for (int i = 0; i < count; i++)
        frames->frame_of[best[i]] = (unsigned char)i;
    for (int f = 0; f < detail->set.face_count; f++)
        frames->size[piece[f]] = 0;
    frames->count = count - 1;
}

static int frame_of_node(const Detail *detail, int node)
{
    return detail->frames->frame_of[detail->set.cut->node_piece[node]];
}

void detail_frames_sort(SurfaceModel *model)
{
    Detail *detail = model->detail;
    const LeafSet *set = &detail->set;
    DetailFrames *frames = detail->frames;
    frames->count = frames->slot_count = 0;
    // One piece needs no frames.
    if (set->cut->piece_count <= 1)
        return;
    rank_pieces(detail);
    // Only the largest piece takes part in the body's own fit.
    for (int i = 0; i < set->node_count; i++)
        if (set->status[i] == NODE_FREE)
            model->rigid_weight[model->slot[i]] =
                frame_of_node(detail, i) == 0 ? model->mass[i] * detail->pack.shape_rate : 0.0;
    // List the free nodes of the other pieces by frame, the loose ones last.
    int next = 0;
    for (int k = 1; k <= FRAME_LOOSE; k++) {
        int first = next;
        if (k > frames->count && k < FRAME_LOOSE)
            continue;
        for (int i = 0; i < set->node_count; i++) {
            if (set->status[i] != NODE_FREE || frame_of_node(detail, i) != k)
                continue;
            int slot = model->slot[i];
            frames->slot[next] = slot;
            frames->slot_frame[next] = (unsigned char)k;
            memcpy(frames->rest[next], model->basis.rest[slot], sizeof frames->rest[next]);
            frames->weight[next++] = model->mass[i] * detail->pack.shape_rate;
        }
        if (k == FRAME_LOOSE)
            break;
        // The fit of this piece starts from its last rotation.
        frames->run[k - 1][0][0] = first;
        frames->run[k - 1][0][1] = next;
        frames->frame[k - 1] = (RigidFrame){.run = frames->run[k - 1],
                                            .run_count = 1,
                                            .precision = PRECISION_DOUBLE,
                                            .rest = (const double(*)[3])frames->rest,
                                            .weight = frames->weight,
                                            .rotation = frames->rotation[k - 1],
                                            .pose.rotation = {{1.0}, {0.0, 1.0}, {0.0, 0.0, 1.0}}};
        rigid_frame_weigh(&frames->frame[k - 1]);
    }
    frames->slot_count = next;
}

// Reads positions and velocities in the rows' coordinates.
static void gather(const SurfaceModel *model, const void *rows)
{
    DetailFrames *frames = model->detail->frames;
    for (int i = 0; i < frames->slot_count; i++)
        for (int c = 0; c < 3; c++) {
            long at = (long)frames->slot[i] * ROW + c;
            double x = model_get(model, rows, at);
            frames->row[(long)i * ROW + c] = model->basis.displaced ? frames->rest[i][c] + x : x;
            frames->row[(long)i * ROW + 4 + c] = model_get(model, rows, at + 4);
        }
}

void detail_frames_fit(SurfaceModel *model, const void *rows)
{
    DetailFrames *frames = model->detail->frames;
    if (frames->slot_count == 0)
        return;
    gather(model, rows);
    for (int k = 0; k < frames->count; k++)
        rigid_frame_fit(&frames->frame[k], frames->row);
}

// Computes the position of a frame's virtual node, and its velocity at the node's `row`.
static void follow(const FramePose *pose, const double rest[3], const double *row, double at[3],
                   double velocity[3])
{
    const double *w = pose->angular;
    double p[3];
    for (int c = 0; c < 3; c++) {
        const double *r = pose->rotation[c];
        at[c] = pose->center[c] + r[0] * (rest[0] - pose->rest_center[0]) +
                r[1] * (rest[1] - pose->rest_center[1]) + r[2] * (rest[2] - pose->rest_center[2]);
        p[c] = row[c] - pose->center[c];
    }
    velocity[0] = pose->velocity[0] + w[1] * p[2] - w[2] * p[1];
    velocity[1] = pose->velocity[1] + w[2] * p[0] - w[0] * p[2];
    velocity[2] = pose->velocity[2] + w[0] * p[1] - w[1] * p[0];
}

bool detail_frames_add(SurfaceModel *model, const SpringPass *pass)
{
    Detail *detail = model->detail;
    DetailFrames *frames = detail->frames;
    if (frames->slot_count == 0)
        return false;
    // The kernel pulls each node to the largest piece's frame: add the difference to its own.
    detail_frames_fit(model, pass->present);
    for (int i = 0; i < frames->slot_count; i++) {
        const double *row = frames->row + (long)i * ROW;
        double here[3], moves[3], there[3], moves_there[3];
        int k = frames->slot_frame[i], slot = frames->slot[i];
        if (k < FRAME_LOOSE)
            follow(&frames->frame[k - 1].pose, frames->rest[i], row, here, moves);
        follow(pass->frame, frames->rest[i], row, there, moves_there);
        // By how much its own frame's pull differs from the kernel's; a loose piece has no pull.
        double mass = model->mass[model->node[slot]];
        for (int c = 0; c < 3; c++) {
            double from = k < FRAME_LOOSE ? here[c] : row[c];
            double speed = k < FRAME_LOOSE ? moves[c] : row[4 + c];
            double force = mass * (detail->pack.shape_rate * (from - there[c]) +
                                   detail->pack.shape_drag * (speed - moves_there[c]));
            long at = model_lane(model->lane[slot]) + (long)c * LANES;
            frames->saved[i][c] = model_get(model, model->external, at);
            model_put(model, model->external, at, frames->saved[i][c] + force);
        }
    }
    return true;
}

void detail_frames_take_back(SurfaceModel *model)
{
    const DetailFrames *frames = model->detail->frames;
    for (int i = 0; i < frames->slot_count; i++)
        for (int c = 0; c < 3; c++)
            model_put(model, model->external,
                      model_lane(model->lane[frames->slot[i]]) + (long)c * LANES,
                      frames->saved[i][c]);
}

const FramePose *detail_frames_pose(const SurfaceModel *model, int node)
{
    const Detail *detail = model->detail;
    if (detail->frames != NULL && detail->frames->slot_count > 0) {
        int k = frame_of_node(detail, node);
        if (k > 0 && k < FRAME_LOOSE)
            return &detail->frames->frame[k - 1].pose;
    }
    return model->basis.rigid != NULL ? &model->basis.rigid->pose : NULL;
}

double detail_frames_energy(const SurfaceModel *model, const void *rows)
{
    DetailFrames *frames = model->detail->frames;
    double energy = 0.0;
    if (frames->slot_count > 0)
        gather(model, rows);
    for (int k = 0; k < frames->count; k++)
        energy += rigid_frame_energy(&frames->frame[k], frames->row);
    return energy;
}
