// Numbers the nodes of an implicit body for one step in the order of the kernel's lanes, and sorts
// them into islands. Step thread.
#include "surface/implicit.h"

#include "surface/detail/detail.h"

#include <string.h>

static void add_node(SurfaceModel *model, int slot, int lane)
{
    Implicit *system = model->implicit;
    if (model->node[slot] < 0 || !(((const double *)model->nodes.inverse_mass)[lane] > 0.0))
        return;
    system->number[slot] = system->moving;
    system->slot[system->moving++] = slot;
}

static void number_nodes(SurfaceModel *model)
{
    Implicit *system = model->implicit;
    const Detail *detail = model->detail;
    memset(system->number, 0xff, (size_t)model->basis.count * sizeof *system->number);
    system->moving = system->hanging = 0;
    if (detail == NULL) {
        for (int s = 0; s < model->basis.count; s++)
            add_node(model, s, s);
    } else {
        for (int k = 0; k < detail->lists.free_chunk_count; k++)
            for (int lane = detail->lists.free_chunk[k] * LANES, i = 0; i < LANES; i++)
                add_node(model, model->springs.own[lane + i], lane + i);
        system->hanging = detail->lists.hanging_count;
        for (int i = 0; i < system->hanging; i++) {
            int number = system->moving + i;
            system->number[detail->lists.hanging[i]] = number;
            system->slot[number] = detail->lists.hanging[i];
        }
    }
    // All fixed nodes share the last number; unused slots are neighbours of none.
    const int fixed = system->moving + system->hanging;
    for (int s = 0; s < model->basis.count; s++)
        if (system->number[s] < 0)
            system->number[s] = fixed;
    for (int i = 0; i < system->hanging; i++)
        for (int k = 0; k < 2; k++)
            system->master[i][k] = system->number[detail->lists.master[i][k]];
}

// Sets the frames of pieces with motions of their own (detail_frames.h): 0 is the body's frame.
static void number_frames(SurfaceModel *model)
{
    Implicit *system = model->implicit;
    const DetailFrames *frames = model->detail->frames;
    memset(system->frame, 0, (size_t)system->moving);
    for (int i = 0; i < frames->slot_count; i++)
        if (system->number[frames->slot[i]] < system->moving)
            system->frame[system->number[frames->slot[i]]] = frames->slot_frame[i];
}

// Returns the piece with which a node shares its momentum; with virtual nodes on one frame, the
// whole body.
static int piece_of(const SurfaceModel *model, int node)
{
    const Detail *detail = model->detail;
    if (detail != NULL)
        return detail->set.cut != NULL ? detail->set.cut->node_piece[node] : 0;
    return model->shape == SHAPE_FRAME_BODY ? 0 : model->piece[node];
}

static bool is_one_piece(const SurfaceModel *model)
{
    const Detail *detail = model->detail;
    if (detail != NULL)
        return detail->set.cut == NULL || detail->set.cut->piece_count <= 1;
    return model->shape == SHAPE_FRAME_BODY;
}

// Orders islands by their first node; marks those with a fixed node.
static void sort_islands(SurfaceModel *model)
{
    Implicit *system = model->implicit;
    const bool whole = is_one_piece(model);
    int *start = system->island_start;
    system->island_count = 0;
    // Count the members of each island; the stamp maps pieces to islands.
    for (int i = 0; i < system->moving; i++) {
        int *stamp = &system->stamp[whole ? 0 : piece_of(model, model->node[system->slot[i]])];
        if (*stamp == 0) {
            system->held[system->island_count] = false;
            start[system->island_count + 1] = 0;
            *stamp = ++system->island_count;
        }
        system->island[i] = *stamp - 1;
        start[*stamp]++;
    }
    // A fixed node of a piece anchors its island.
    for (int s = 0; s < model->basis.count; s++) {
        int node = model->node[s];
        if (node < 0 || system->number[s] < system->moving + system->hanging)
            continue;
        int island = system->stamp[whole ? 0 : piece_of(model, node)] - 1;
        if (island >= 0)
            system->held[island] = true;
    }
    // Counting sort of the nodes by island.
    start[0] = 0;
    for (int k = 0; k < system->island_count; k++)
        start[k + 1] += start[k];
    for (int i = system->moving - 1; i >= 0; i--)
        system->member[--start[system->island[i] + 1]] = i;
    // Each start has moved down to that of the island before: shift them back.
    memmove(start, start + 1, (size_t)system->island_count * sizeof *start);
    start[system->island_count] = system->moving;
    // Clear the stamps for the next step.
    for (int i = 0; i < system->moving; i++)
        system->stamp[whole ? 0 : piece_of(model, model->node[system->slot[i]])] = 0;
}

void implicit_number(SurfaceModel *model)
{
    number_nodes(model);
    if (model->implicit->frame != NULL)
        number_frames(model);
    sort_islands(model);
}
