// SPDX-License-Identifier: MIT
// Derives the faces of a cut body: at load, and after the state was replaced.
#include "voxel/cut/cut_faces.h"

#include "base/bits.h"
#include "base/check.h"
#include "voxel/lattice_faces.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// From scratch

// Clears all squares and faces.
static void clear(CutFaces *faces)
{
    const size_t triangles = 2 * (size_t)faces->square_capacity;
    // No squares, and no vertex has faces.
    cut_faces_drop_all(faces);
    memset(faces->neighbor, -1, triangles * sizeof *faces->neighbor);
    memset(faces->face, 0, triangles * sizeof *faces->face);
    memset(faces->triangle, 0, triangles * sizeof *faces->triangle);
    memset(faces->is_touched, 0, (size_t)faces->lattice->vertex_capacity);
    faces->touched_count = 0;
    faces->vertex_count = cut_lattice_used(faces->lattice);
    for (int v = 0; v < faces->lattice->vertex_capacity; v++) {
        faces->start[v] = faces->end[v] = 0;
        faces->node_area[v] = 0.0;
    }
    faces->list_top = 0;
    memset(faces->free_run, -1, sizeof faces->free_run);
    for (int v = 0; v < faces->vertex_count; v++)
        cut_faces_enter_vertex(faces, v);
}

static void count_broken(CutFaces *faces)
{
    const CutLattice *lattice = faces->lattice;
    faces->wall_count = 0;
    for (int c = 0; c < faces->cell_count; c++) {
        if (faces->counted != NULL)
            faces->counted[c] = lattice->broken[c];
        for (int axis = 0; axis < 3; axis++)
            if (lattice->broken[c] >> axis & 1)
                faces->wall_count +=
                    !cut_lattice_is_gone(lattice, c) +
                    !cut_lattice_is_gone(lattice, cut_lattice_across(lattice, c, 2 * axis + 1));
    }
}

static void count_free(CutFaces *faces)
{
    faces->free_count = 0;
    faces->free_low = faces->outer_squares;
    for (int s = faces->outer_squares; s < *faces->shown; s++)
        faces->free_count += faces->square[s] < 0;
}

// Counts the visible sides.
static int count_sides(const CutFaces *faces)
{
    int count = 0;
    for (int cell = 0; cell < faces->cell_count; cell++)
        for (int d = 0; d < SQUARE_DIRECTIONS; d++)
            count += cut_faces_is_shown(faces->lattice, cell, d);
    return count;
}

// True if the list of squares has each visible side once.
static bool squares_are_valid(CutFaces *faces)
{
    if (*faces->shown < 0 || *faces->shown > faces->square_capacity)
        return false;
    bool sound = true;
    int sides = 0;
    for (int s = 0; s < *faces->shown && sound; s++) {
        // Each side once.
        const int code = faces->square[s];
        if (code == -1 && faces->lattice->removable)
            continue;
        sides++;
        sound = code >= 0 && code / 6 < faces->cell_count &&
                cut_faces_is_shown(faces->lattice, code / 6, code % 6) &&
                cut_faces_square(faces, code / 6, code % 6) < 0;
        if (sound)
            cut_faces_put_square(faces, s);
    }
    // As many squares as sides that are shown.
    return sound && sides == count_sides(faces);
}

static void choose_squares(CutFaces *faces)
{
    cut_faces_drop_all(faces);
    *faces->shown = 0;
    for (int code = 0; code < 6 * faces->cell_count; code++)
        if (*faces->shown < faces->square_capacity &&
            cut_faces_is_shown(faces->lattice, code / 6, code % 6))
            faces->square[(*faces->shown)++] = code;
}

// True if slots refer to vertices, each once.
static bool slots_are_valid(CutFaces *faces)
{
    bool sound = *faces->slot_count >= 0 && *faces->slot_count <= faces->vertex_count;
    for (int s = 0; sound && s < *faces->slot_count; s++) {
        const int vertex = faces->slot_vertex[s];
        sound = vertex >= 0 && vertex < faces->vertex_count && faces->slot_of[vertex] < 0 &&
                (!faces->all || vertex == s);
        if (sound)
            faces->slot_of[vertex] = s;
    }
    return sound && (!faces->all || *faces->slot_count == faces->vertex_count);
}

static void choose_slots(CutFaces *faces)
{
    memset(faces->slot_of, -1, (size_t)faces->lattice->vertex_capacity * sizeof *faces->slot_of);
    *faces->slot_count = 0;
    for (int v = 0; v < faces->vertex_count && faces->all; v++)
        cut_faces_add_slot(faces, v);
}

// True if each copied vertex is a copy of an earlier one at its point.
static bool copies_are_valid(const CutFaces *faces)
{
    for (int v = 0; v < faces->vertex_count; v++) {
        int here[3], there[3];
        const int from = faces->copied_from[v];
        if (from == -1)
            continue;
        // Copied from an earlier vertex at the same point; rows that were free are used again.
        if (from < 0 || from == v || from >= (faces->lattice->adapts ? faces->vertex_count : v))
            return false;
        cut_lattice_point(faces->lattice, v, here);
        cut_lattice_point(faces->lattice, from, there);
        if (memcmp(here, there, sizeof here) != 0)
            return false;
    }
    return true;
}

bool cut_faces_derive(CutFaces *faces, Body *body)
{
    clear(faces);
    count_broken(faces);
    // Faces that are not open yet need capacity when they open.
    int needed, room;
    bool sound = cut_faces_has_room(faces, 0, &needed, &room);
    if (!copies_are_valid(faces)) {
        memset(faces->copied_from, -1,
               (size_t)faces->lattice->vertex_capacity * sizeof *faces->copied_from);
        sound = false;
    }
    if (!squares_are_valid(faces)) {
        choose_squares(faces);
        sound = false;
    }
    if (!slots_are_valid(faces)) {
        choose_slots(faces);
        sound = false;
    }
    count_free(faces);
    // The lists are valid now: create triangles and node lists from them.
    for (int s = 0; s < *faces->slot_count; s++)
        cut_faces_describe_slot(faces, s);
    const int64_t slots = *faces->slot_count;
    for (int s = 0; s < *faces->shown; s++)
        if (faces->square[s] >= 0)
            cut_faces_enter_square(faces, s);
    // Exactly the vertices on the surface must have slots.
    sound &= *faces->slot_count == slots;
    for (int s = 0; s < *faces->slot_count && !faces->all; s++) {
        const int vertex = faces->slot_vertex[s];
        sound &= faces->start[vertex] < faces->end[vertex] || faces->lattice->anchor[vertex] < 0;
    }
    for (int s = 0; s < *faces->shown; s++)
        if (faces->square[s] >= 0)
            cut_faces_join_square(faces, s);
    // Recompute all vertices, each once, regardless of which ones entering squares has touched.
    for (int v = 0; v < faces->vertex_count; v++)
        cut_faces_touch(faces, v);
    cut_faces_settle_touched(faces);
    cut_faces_report(faces, body);
    return sound;
}

// ---------------------------------------------------------------------------------------------
// Load time

static int compare_points(const void *a, const void *b)
{
    const VertexId *x = a, *y = b;
    if (x->id != y->id)
        return x->id < y->id ? -1 : 1;
    return (x->vertex > y->vertex) - (x->vertex < y->vertex);
}

// Publishes vertices by their points, x fastest, then by their part: in the order of bodies that do
// not adapt, whatever that of the rows.
static void sort_slots(CutFaces *faces, const VoxelMaking *making, int slots)
{
    const int *n = making->layout.lattice_count;
    const int points = (n[0] + 1) * (n[1] + 1) * (n[2] + 1);
    VertexId *order = malloc(((size_t)slots + 1) * sizeof *order);
    ASSERT(order != NULL);
    for (int s = 0; s < slots; s++)
        order[s] = (VertexId){making->mesh.id[s] % points, s};
    qsort(order, (size_t)slots, sizeof *order,
          compare_points); // those of one point stay as they are
    for (int s = 0; s < slots; s++)
        faces->slot_vertex[s] = order[s].vertex;
    free(order);
}

static void list_outer(CutFaces *faces, const VoxelMaking *making)
{
    const Layout *layout = &making->layout;
    for (int e = 0; e < layout->leaf_count && layout->leaf[e].level == 0; e++) {
        // Squares in the order of the uncut body's faces; its leaves may have merged since.
        const int *at = layout->leaf[e].cell;
        const int cell = cut_lattice_cell(faces->lattice, at[0], at[1], at[2]);
        for (int d = 0; d < SQUARE_DIRECTIONS; d++)
            if (cut_faces_is_shown(faces->lattice, cell, d))
                faces->square[(*faces->shown)++] = 6 * cell + d;
    }
    // Its nodes have the first slots.
    const int slots = faces->all ? cut_lattice_used(faces->lattice) : making->mesh.surface_count;
    *faces->slot_count = slots;
    for (int s = 0; s < slots; s++)
        faces->slot_vertex[s] = s;
    if (faces->lattice->adapts && !faces->all)
        sort_slots(faces, making, slots);
    memset(faces->copied_from, -1,
           (size_t)faces->lattice->vertex_capacity * sizeof *faces->copied_from);
}

static void create_state(CutFaces *faces, const char *name, Arena *arena, StateList *state)
{
    const size_t squares = (size_t)faces->square_capacity;
    const size_t vertices = (size_t)faces->lattice->vertex_capacity;
    faces->square = ALLOCATE(ARENA_TOPOLOGY, squares, int, "squares");
    faces->shown = ALLOCATE(ARENA_TOPOLOGY, 1, int64_t, "square count");
    faces->slot_vertex = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "published vertices");
    faces->slot_count = ALLOCATE(ARENA_TOPOLOGY, 1, int64_t, "published count");
    faces->copied_from = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "origins of vertices");
    // The order of squares and slots is history: it cannot be derived.
    state_add(state, faces->square, squares * sizeof *faces->square, "%s/squares", name);
    state_add(state, faces->shown, sizeof *faces->shown, "%s/square_count", name);
    state_add(state, faces->slot_vertex, vertices * sizeof *faces->slot_vertex, "%s/published",
              name);
    state_add(state, faces->slot_count, sizeof *faces->slot_count, "%s/published_count", name);
    state_add(state, faces->copied_from, vertices * sizeof *faces->copied_from, "%s/copied_from",
              name);
}

static void create_surface(CutFaces *faces, const char *name, bool without_contacts, Arena *arena)
{
    const int triangles = 2 * faces->square_capacity, cells = faces->cell_count;
    const int vertices = faces->lattice->vertex_capacity;
    // By cell: which squares it shows.
    if (!faces->lattice->adapts)
        faces->counted = ALLOCATE(ARENA_TOPOLOGY, cells, unsigned char, "counted faces");
    if (faces->lattice->leaf_row == NULL) {
        faces->square_of = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)cells,
                                          sizeof *faces->square_of, "%s/squares of cells", name);
    } else { // half full at most
        faces->table_size = 1;
        while (faces->table_size < 2 * faces->square_capacity + 2)
            faces->table_size *= 2;
        faces->table = ALLOCATE(ARENA_TOPOLOGY, faces->table_size, int, "table of squares");
    }
    // Triangles, two per square.
    faces->face = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)triangles, sizeof *faces->face,
                                 "%s/faces", name);
    faces->neighbor = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)triangles,
                                     sizeof *faces->neighbor, "%s/face neighbours", name);
    // By vertex. Lists have room for the three corners of all triangles, and some to move in.
    faces->start = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "node face start");
    faces->end = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "node face end");
    const int nodes = vertices < 2 * triangles ? vertices : 2 * triangles;
    faces->list_units = 3 * (triangles / FACE_UNIT) + nodes + nodes / 16 + FACE_UNITS_MOST;
    faces->list = ALLOCATE(ARENA_TOPOLOGY, (long)FACE_UNIT * faces->list_units, int, "node faces");
    faces->node_area = ALLOCATE(ARENA_TOPOLOGY, vertices, double, "node areas");
    // Scratch of a change.
    const int for_ever = faces->lattice->leaf_row != NULL ? faces->lattice->kept_end : 0;
    faces->born = ALLOCATE(ARENA_TOPOLOGY, vertices - for_ever, NodeBirth, "born nodes");
    faces->touched = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "touched nodes");
    if (faces->lattice->removable) {
        enum { ENDED = 12 * CUT_REMOVE_MOST, GONE = NODE_CORNERS * CUT_REMOVE_MOST };
        faces->ended = ALLOCATE(ARENA_TOPOLOGY, ENDED, FaceChange, "ended faces");
        faces->gone = ALLOCATE(ARENA_TOPOLOGY, GONE, int, "gone nodes");
        faces->none = arena_allocate(arena, ARENA_TOPOLOGY, GONE, sizeof *faces->none, "%s/%s",
                                     name, "parents of gone nodes");
        memset(faces->none, -1, GONE * sizeof *faces->none);
    }
    faces->is_touched = ALLOCATE(ARENA_TOPOLOGY, vertices, unsigned char, "touched");
    if (without_contacts)
        return;
    // A corner of the body is a sixth as stiff as the middle of a face: contacts need the firmness.
    faces->face_firmness = arena_allocate(arena, ARENA_CONTACT, (size_t)triangles, sizeof(double),
                                          "%s/face firmness", name);
    faces->node_firmness = arena_allocate(arena, ARENA_CONTACT, (size_t)vertices, sizeof(double),
                                          "%s/node firmness", name);
    for (int v = 0; v < vertices; v++)
        faces->node_firmness[v] = 1.0;
}

static void create_mesh(CutFaces *faces, const char *name, Arena *arena)
{
    const int triangles = 2 * faces->square_capacity, vertices = faces->lattice->vertex_capacity;
    faces->triangle = faces->face;
    // With slots of their own, published nodes have other triangles.
    if (!faces->all)
        faces->triangle = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)triangles,
                                         sizeof *faces->triangle, "%s/triangles", name);
    faces->cell_of = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "cells of vertices");
    faces->slot_of = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "slots of vertices");
    if (faces->lattice->adapts && !faces->all)
        faces->found = ALLOCATE(ARENA_CONTACT, bits_words(vertices), uint64_t, "slots found");
    faces->id = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "node ids");
    faces->origin = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "node origins");
    faces->piece = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "node pieces");
    faces->parent = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)vertices, sizeof *faces->parent,
                                   "%s/node parents", name);
    faces->level = ALLOCATE(ARENA_TOPOLOGY, vertices, signed char, "node levels");
}

static void describe(CutFaces *faces, double size, Body *body)
{
    const int triangles = 2 * faces->square_capacity, vertices = faces->lattice->vertex_capacity;
    // For tools and loads: nodes are vertices, free ones have no faces.
    body->surface = (BodySurface){
        .node_count = vertices,
        .face_count = triangles,
        .face = (const int(*)[3])faces->face,
        .face_area = &faces->half,
        .finest_area = &faces->half,
        .face_neighbor = (const int(*)[3])faces->neighbor,
        .node_face_start = faces->start,
        .node_face_end = faces->end,
        .node_face = faces->list,
        .node_area = faces->node_area,
        .node_mass = faces->masses->node_mass,
        .longest_edge = sqrt(2.0) * size,
        .solid = true,
        .alike = true,
        .face_firmness = faces->face_firmness,
        .node_firmness = faces->node_firmness,
    };
    // For clients: nodes are slots.
    body->mesh = (BodyMesh){
        .topology = 1,
        .node_capacity = vertices,
        .triangle_capacity = triangles,
        .triangle = (const int(*)[3])faces->triangle,
        .id = faces->id,
        .origin = faces->origin,
        .parent = (const int(*)[2])faces->parent,
        .piece = faces->piece,
        .level = faces->level,
        .first_wall = 2 * faces->outer_squares,
    };
}

// Returns the capacity in squares: ten times the outer ones, enough for cuts four times as large as
// the surface; or all that can exist. Of a body that adapts as many as it has vertices for: the two
// squares of a broken face take four, of cells on both sides and copies.
static int choose_capacity(const CutFaces *faces, int face_capacity)
{
    enum { LEAST = 512 };
    if (face_capacity > 0)
        return face_capacity / 2;
    const CutLattice *lattice = faces->lattice;
    const long most = 6L * faces->cell_count, outer = faces->outer_squares;
    const long room = lattice->vertex_capacity - cut_lattice_used(lattice);
    const long pool = lattice->leaf_row != NULL && room / 2 < 9 * outer ? room / 2 : 9 * outer;
    const long wanted = outer + pool + LEAST;
    return (int)(wanted < most ? wanted : most);
}

bool cut_faces_create(CutFaces *faces, const CutPieces *pieces, const CutMasses *masses,
                      const VoxelMaking *making, Body *body, Arena *arena, StateList *state,
                      Status *status)
{
    const VoxelOptions *options = making->options;
    const LatticeMesh *mesh = &making->mesh;
    const double size = options->lattice->size;
    const char *name = options->body.name;
    const bool without_contacts = options->body.without_contacts;
    *faces = (CutFaces){
        .lattice = pieces->lattice,
        .pieces = pieces,
        .vertices = masses->vertices,
        .masses = masses,
        .half = 0.5 * size * size,
        .cell_count = pieces->lattice->level_first[1],
        .outer_squares = mesh->face_count / 2,
        .all = options->publish_all,
    };
    // The uncut body must fit.
    faces->square_capacity = choose_capacity(faces, options->body.face_capacity);
    if (faces->square_capacity < faces->outer_squares)
        return status_fail(
            status, STATUS_INVALID,
            "body %s has %d faces to start with, capacity.faces is %d: raise it, or leave it out",
            name, mesh->face_count, options->body.face_capacity);
    // Arrays, then the uncut surface, from which all else is derived.
    create_state(faces, name, arena, state);
    create_surface(faces, name, without_contacts, arena);
    create_mesh(faces, name, arena);
    describe(faces, size, body);
    list_outer(faces, making);
    bool sound = cut_faces_derive(faces, body);
    ASSERT(sound);
    if (!without_contacts) { // areas are known now
        cut_faces_find_least(faces);
        sound = cut_faces_derive(faces, body);
        ASSERT(sound);
    }
    return true;
}
