// SPDX-License-Identifier: MIT
// What a frame of positions costs the bus thread before the system sends it: cut into chunks of
// floats (nodes_t) and packed into packets (points_t), both encoded as LCM does.
#include "bench.h"

#include "base/clock.h"
#include "geometry/generator.h"
#include "run/bus_points.h"

#include "pliant_nodes_t.h"
#include "pliant_points_t.h"
#include "sending.h"

#include <stdlib.h>
#include <string.h>

// Of a channel with a name of 20 characters, as PLIANT_POINTS_stomach.
enum { HEADERS = 8 + 21, DATAGRAM = 65536 };

typedef struct Positions {
    int count;
    float *value;
    int *id;
} Positions;

static int encode_floats(const Positions *positions, uint8_t *data)
{
    int bytes = 0, chunks = chunks_of(positions->count, NODES_IN_CHUNK);
    for (int k = 0; k < chunks; k++) {
        int first = chunk_begin(positions->count, k, chunks);
        pliant_nodes_t message = {.node_count = positions->count,
                                  .chunk = k,
                                  .chunk_count = chunks,
                                  .first = first,
                                  .num_values =
                                      3 * (chunk_begin(positions->count, k + 1, chunks) - first),
                                  .position = positions->value + 3L * first};
        bytes += HEADERS + pliant_nodes_t_encode(data, 0, DATAGRAM, &message);
    }
    return bytes;
}

static int encode_packets(const Positions *positions, uint8_t *data)
{
    uint8_t bits[PACKET_BYTES];
    pliant_points_t message = {.node_count = positions->count,
                               .grid =
                                   points_grid(positions->value, positions->id, positions->count),
                               .data = bits};
    const int room = PACKET_BYTES - HEADERS - pliant_points_t_encoded_size(&message);
    int bytes = 0;
    for (int first = 0; first < positions->count; first += message.count) {
        message.first = first;
        message.num_bytes = 0;
        message.count = (int16_t)points_pack(positions->value + 3L * first, positions->id + first,
                                             positions->count - first, message.grid, room,
                                             message.origin, bits, &message.num_bytes);
        bytes += HEADERS + pliant_points_t_encode(data, 0, DATAGRAM, &message);
    }
    return bytes;
}

static void run(Bench *bench, const char *name, const Positions *positions,
                int (*encode)(const Positions *positions, uint8_t *data))
{
    static uint8_t data[DATAGRAM];
    double least = 0.0;
    int bytes = 0;
    for (int r = 0; r < (bench->quick ? 3 : 500); r++) {
        int64_t begin = clock_thread_ns();
        bytes = encode(positions, data);
        double us = (double)(clock_thread_ns() - begin) * 1e-3;
        least = r == 0 || us < least ? us : least;
    }
    bench_row(bench, name, positions->count, "us_per_frame", least, "us");
    bench_row(bench, name, positions->count, "bytes_per_node", (double)bytes / positions->count,
              "B");
}

void bench_publish(Bench *bench)
{
    static const char floats[] = "publish.floats", packets[] = "publish.packets";
    if (!bench_wants(bench, floats) && !bench_wants(bench, packets))
        return;
    TriMesh mesh;
    Status status = {0};
    if (!generate_ico_sphere(&mesh, bench->quick ? 2 : 5, 0.1, &status)) {
        bench_fail(bench, packets, status.text);
        return;
    }
    Positions positions = {.count = mesh.node_count,
                           .value = calloc(3 * (size_t)mesh.node_count, sizeof(float)),
                           .id = calloc((size_t)mesh.node_count, sizeof(int))};
    for (int i = 0; i < mesh.node_count && positions.value != NULL; i++) {
        positions.value[3 * i] = (float)mesh.position[i].x;
        positions.value[3 * i + 1] = (float)mesh.position[i].y;
        positions.value[3 * i + 2] = (float)mesh.position[i].z;
    }
    if (positions.value == NULL || positions.id == NULL) {
        bench_fail(bench, packets, "out of memory");
    } else {
        if (bench_wants(bench, floats))
            run(bench, floats, &positions, encode_floats);
        if (bench_wants(bench, packets))
            run(bench, packets, &positions, encode_packets);
    }
    free(positions.value);
    free(positions.id);
    mesh_destroy(&mesh);
}
