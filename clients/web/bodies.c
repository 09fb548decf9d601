// The bodies of the scene as they arrive over LCM. The LCM thread only.
#include "bodies.h"
#include "client.h"

#include <stdlib.h>
#include <string.h>

void bodies_init(Bodies *bodies, Board *board)
{
    *bodies = (Bodies){.board = board, .body = calloc(BOARD_BODIES, sizeof(Body))};
    if (!bodies->body)
        abort(); // out of memory
}

static void forget(Bodies *bodies)
{
    for (int i = 0; i < bodies->count; i++) {
        mesh_frame_destroy(&bodies->body[i].mesh);
        nodes_frame_destroy(&bodies->body[i].nodes);
        rest_frame_destroy(&bodies->body[i].rest);
    }
    bodies->count = 0;
    bodies->open = false;
}

void bodies_destroy(Bodies *bodies)
{
    forget(bodies);
    free(bodies->body);
    *bodies = (Bodies){0};
}

static int count_of(const pliant_status_t *status)
{
    return status->num_bodies < BOARD_BODIES ? status->num_bodies : BOARD_BODIES;
}

bool bodies_are(const Bodies *bodies, const pliant_status_t *status)
{
    if (bodies->count != count_of(status))
        return false;
    for (int i = 0; i < bodies->count; i++) {
        if (strncmp(bodies->body[i].name, status->body[i].name, BODY_NAME_MAX - 1) != 0)
            return false;
    }
    return true;
}

void bodies_name(Bodies *bodies, const pliant_status_t *status)
{
    forget(bodies);
    bodies->count = count_of(status);
    for (int i = 0; i < bodies->count; i++) {
        Body *body = &bodies->body[i];
        *body = (Body){.shown = -1};
        snprintf(body->name, sizeof body->name, "%s", status->body[i].name);
    }
}

static Body *find(const Bodies *bodies, const char *name)
{
    for (int i = 0; i < bodies->count; i++) {
        if (strcmp(bodies->body[i].name, name) == 0)
            return &bodies->body[i];
    }
    return NULL;
}

// Returns NULL if the board has the same parcel.
static Parcel *unless_shown(const BoardSlot *slot, Parcel *parcel)
{
    // Only this thread changes the slot.
    if (!parcel_equal(slot->parcel, parcel))
        return parcel;
    parcel_drop(parcel);
    return NULL;
}

// Puts new, consistent data on the board: nodes always with the mesh of their topology, and a mesh
// always with nodes of it.
static void show(Bodies *bodies, Body *body)
{
    const MeshFrame *mesh = &body->mesh;
    const NodesFrame *nodes = &body->nodes;
    const RestFrame *rest = &body->rest;
    // Nodes are shown with the mesh that they belong to.
    bool pair = mesh->whole && nodes->whole && nodes->topology == mesh->topology &&
                nodes->node_count == mesh->node_count;
    if (pair)
        body->unmatched_ns = 0;
    else if (nodes->whole && body->unmatched_ns == 0)
        body->unmatched_ns = client_now_ns();
    if (!pair || !bodies->open)
        return;
    // Build what is new; what the page has already is not sent again.
    int index = (int)(body - bodies->body);
    BoardBody *on_board = &bodies->board->body[index];
    Parcel *new_mesh = NULL, *new_rest = NULL, *new_nodes = NULL;
    if (body->new_mesh)
        new_mesh = unless_shown(&on_board->mesh, parcel_mesh(index, mesh));
    bool fits = rest->whole && rest->topology == mesh->topology;
    if (body->new_rest && fits)
        new_rest = unless_shown(&on_board->rest, parcel_rest(index, rest));
    // Send the nodes again with a mesh, so that the page can draw it at once.
    if (body->new_nodes || new_mesh)
        new_nodes = parcel_nodes(index, nodes);
    body->new_mesh = body->new_nodes = false;
    body->new_rest = body->new_rest && !fits;
    // Hand it over in one piece.
    body->shown = mesh->topology;
    if (new_mesh || new_rest || new_nodes)
        board_set_body(bodies->board, index, new_mesh, new_rest, new_nodes);
}

void bodies_open(Bodies *bodies)
{
    bodies->open = true;
    for (int i = 0; i < bodies->count; i++)
        show(bodies, &bodies->body[i]);
}

void bodies_take_mesh(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    if (!body)
        return;
    body->chunk_ns = client_now_ns();
    if (mesh_frame_add(&body->mesh, data, size) != FRAMES_WHOLE)
        return;
    body->new_mesh = true;
    show(bodies, body);
}

void bodies_take_delta(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    if (!body || mesh_frame_add_delta(&body->mesh, data, size) != FRAMES_WHOLE)
        return;
    body->new_mesh = true;
    show(bodies, body);
}

void bodies_take_nodes(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    if (!body || nodes_frame_add(&body->nodes, data, size) != FRAMES_WHOLE)
        return;
    body->new_nodes = true;
    show(bodies, body);
}

void bodies_take_rest(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    if (!body || rest_frame_add(&body->rest, data, size) != FRAMES_WHOLE)
        return;
    body->new_rest = true;
    show(bodies, body);
}

double bodies_unmatched(const Bodies *bodies, int64_t now_ns)
{
    const int64_t pause_ns = 500000000; // longer than between the chunks of one mesh
    int64_t longest = 0;
    for (int i = 0; i < bodies->count; i++) {
        const Body *body = &bodies->body[i];
        bool under_way = body->mesh.next.started && !body->mesh.next.done;
        if (under_way && now_ns - body->chunk_ns < pause_ns)
            continue;
        if (body->unmatched_ns && now_ns - body->unmatched_ns > longest)
            longest = now_ns - body->unmatched_ns;
    }
    return (double)longest / 1e9;
}
