// SPDX-License-Identifier: MIT
// The columns of a published mesh, in one list: what bodies publish, what is copied, compared,
// sent, assembled, recorded, played and given to clients follows from it.
#ifndef PLIANT_BASE_MESH_COLUMNS_H
#define PLIANT_BASE_MESH_COLUMNS_H

#include <stdint.h>

// X(name, type, width, of, empty, sent, recorded): `width` numbers of a type in each row, one row
// per slot of a TRIANGLE or NODE; `empty`: what a free slot has. `sent`: in the messages MESH and
// MESH_DELTA, whose types never change, or in a message of its OWN. `recorded`: ALWAYS or NEVER; or
// as IDS or other NUMBERS in rows of node_<name> beside node_id, which older recordings lack.
//   triangle  node slots, counter-clockwise seen from outside
//   id        stays with a node for its life; -1: a free slot
//   origin    id that a duplicate was split from, else its own
//   parent    ids between which a midpoint lies, else its own
//   piece     number of the connected piece
//   level     of detail, at which the node was created
#define MESH_COLUMNS(X)                                                                            \
    X(triangle, int32_t, 3, TRIANGLE, 0, MESH, ALWAYS)                                             \
    X(id, int32_t, 1, NODE, -1, MESH, ALWAYS)                                                      \
    X(origin, int32_t, 1, NODE, -1, MESH, IDS)                                                     \
    X(parent, int32_t, 2, NODE, -1, MESH, IDS)                                                     \
    X(piece, int32_t, 1, NODE, 0, MESH, NEVER)                                                     \
    X(level, int8_t, 1, NODE, 0, MESH, NUMBERS)

// Members of a struct: rows that are read, `const int32_t (*triangle)[3]`; rows that are written;
// and rows as numbers one behind the other, `int32_t *triangle`.
#define MESH_ROWS_1(type, name)                 type *name
#define MESH_ROWS_2(type, name)                 type(*name)[2]
#define MESH_ROWS_3(type, name)                 type(*name)[3]
#define MESH_READ_ROWS(name, type, width, ...)  MESH_ROWS_##width(const type, name);
#define MESH_WRITE_ROWS(name, type, width, ...) MESH_ROWS_##width(type, name);
#define MESH_NUMBERS(name, type, ...)           type *name;

typedef struct MeshColumns {
    MESH_COLUMNS(MESH_WRITE_ROWS)
} MeshColumns;

// The rows of a mesh with so many slots.
#define MESH_SLOTS_NODE(nodes, triangles)     (nodes)
#define MESH_SLOTS_TRIANGLE(nodes, triangles) (triangles)

// Expands the rest only for columns of triangles or nodes, those in MESH and MESH_DELTA, those that
// are recorded, and those of these that older recordings lack.
#define MESH_IF_TRIANGLE(of, ...)      MESH_IF_TRIANGLE_##of(__VA_ARGS__)
#define MESH_IF_TRIANGLE_TRIANGLE(...) __VA_ARGS__
#define MESH_IF_TRIANGLE_NODE(...)
#define MESH_IF_NODE(of, ...)  MESH_IF_NODE_##of(__VA_ARGS__)
#define MESH_IF_NODE_NODE(...) __VA_ARGS__
#define MESH_IF_NODE_TRIANGLE(...)
#define MESH_IF_SENT(sent, ...) MESH_IF_SENT_##sent(__VA_ARGS__)
#define MESH_IF_SENT_MESH(...)  __VA_ARGS__
#define MESH_IF_SENT_OWN(...)
#define MESH_IF_RECORDED(recorded, ...) MESH_IF_RECORDED_##recorded(__VA_ARGS__)
#define MESH_IF_RECORDED_ALWAYS(...)    __VA_ARGS__
#define MESH_IF_RECORDED_IDS(...)       __VA_ARGS__
#define MESH_IF_RECORDED_NUMBERS(...)   __VA_ARGS__
#define MESH_IF_RECORDED_NEVER(...)
#define MESH_IF_LATER(recorded, ...) MESH_IF_LATER_##recorded(__VA_ARGS__)
#define MESH_IF_LATER_IDS(...)       __VA_ARGS__
#define MESH_IF_LATER_NUMBERS(...)   __VA_ARGS__
#define MESH_IF_LATER_ALWAYS(...)
#define MESH_IF_LATER_NEVER(...)

#endif
