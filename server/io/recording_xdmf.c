// SPDX-License-Identifier: MIT
// The sidecar of a recording: an XDMF 2 text that describes to ParaView's "XDMF Reader" which rows
// of the HDF5 file belong to which frame, as one temporal collection of grids per body. It is made
// from the file, so that no data of a long recording stays in memory. A time at which no body has
// moved is left out: ParaView shows the last one before. At any other it shows only bodies that
// list that very time, so all do.
#include "io/recording_parts.h"

#ifdef PLIANT_WITH_HDF5
#include "base/check.h"
#include "base/output.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#define XDMF_HEAD                                                                                  \
    "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!DOCTYPE Xdmf SYSTEM \"Xdmf.dtd\" []>\n"

enum { BLOCK = 1024 }; // frames read back at a time

typedef struct Block {
    double time[BLOCK];
    int64_t first[BLOCK];
    int32_t count[BLOCK], topology[BLOCK];
} Block;

static void write_escaped(FILE *out, const char *text)
{
    for (; *text != '\0'; text++) {
        // Names may hold what means something in XML.
        const char *entity = *text == '&'   ? "&amp;"
                             : *text == '<' ? "&lt;"
                             : *text == '>' ? "&gt;"
                             : *text == '"' ? "&quot;"
                                            : NULL;
        if (entity != NULL)
            fputs(entity, out);
        else
            fputc(*text, out);
    }
}

// Writes a reference to `rows` rows of a data set, from row `first`; columns 0: single numbers.
static void write_rows(const Recording *recording, const RecordedBody *body, const char *set,
                       const HdfTable *table, int64_t first, int rows, FILE *out)
{
    // The HDF5 file is named without its folder, so that both can be moved.
    const char *folder_end = strrchr(recording->path, '/');
    const char *file = folder_end != NULL ? folder_end + 1 : recording->path;
    const size_t bytes = H5Tget_size(table->type);
    const char *number = H5Tget_class(table->type) == H5T_FLOAT ? "Float"
                         : bytes == 1                           ? "UChar"
                                                                : "Int";
    int columns = table->columns;
    char last[16] = "";
    if (columns > 0)
        snprintf(last, sizeof last, " %d", columns);
    // A range of rows,
    fprintf(out, "<DataItem ItemType=\"HyperSlab\" Dimensions=\"%d%s\">", rows, last);
    if (columns > 0)
        fprintf(out,
                "<DataItem Dimensions=\"3 2\" Format=\"XML\">%" PRId64 " 0 1 1 %d %d</DataItem>",
                first, rows, columns);
    else
        fprintf(out, "<DataItem Dimensions=\"3 1\" Format=\"XML\">%" PRId64 " 1 %d</DataItem>",
                first, rows);
    // of a data set in that file.
    fprintf(out,
            "<DataItem Format=\"HDF\" NumberType=\"%s\" Precision=\"%zu\" Dimensions=\"%llu%s\">",
            number, bytes, (unsigned long long)table->count, last);
    write_escaped(out, file);
    fprintf(out, ":/bodies/%s/%s</DataItem></DataItem>", body->name, set);
}

// The newest map of a kind up to a frame, and the one after it.
typedef struct NewestMap {
    RecordingMap map, next; // count 0: none
    hsize_t read;           // heads
} NewestMap;

static bool follow_maps(const Recording *recording, const RecordedBody *body, BodyTable head,
                        double time, NewestMap *newest)
{
    const HdfTable *table = &body->table[head];
    for (;;) {
        if (newest->next.count > 0 && newest->next.time > time)
            return true;
        if (newest->next.count > 0)
            newest->map = newest->next;
        newest->next.count = 0;
        if (newest->read == table->count)
            return true;
        if (!hdf_table_read(&recording->file, table, newest->read++, 1, &newest->next))
            return false;
    }
}

static void write_frame(const Recording *recording, const RecordedBody *body, const Block *block,
                        int i, const TopologyRows *topology, const NewestMap *maps, FILE *out)
{
    fprintf(out, "<Grid Name=\"%s\"><Time Value=\"%.9g\"/>\n", body->name, block->time[i]);
    // Triangles, positions and ids are rows of the HDF5 file.
    fprintf(out, "<Topology TopologyType=\"Triangle\" NumberOfElements=\"%d\">",
            topology->triangle_count);
    write_rows(recording, body, "triangles", &body->table[TRIANGLES], topology->first_triangle,
               topology->triangle_count, out);
    fprintf(out, "</Topology>\n<Geometry GeometryType=\"XYZ\">");
    write_rows(recording, body, "position", &body->table[POSITION], block->first[i],
               block->count[i], out);
    fprintf(out, "</Geometry>\n<Attribute Name=\"node_id\" Center=\"Node\">");
    write_rows(recording, body, "node_id", &body->table[NODE_ID], topology->first_node,
               topology->node_count, out);
    fprintf(out, "</Attribute>");
    const RecordingMap *error = &maps[RECORDING_ERROR_MAP].map;
    if (error->count > 0 && error->topology == topology->number) {
        fprintf(out, "\n<Attribute Name=\"error\" Center=\"Node\">");
        write_rows(recording, body, "error_map/share", &body->table[ERROR_SHARE], error->first,
                   error->count, out);
        fprintf(out, "</Attribute>");
    }
    const RecordingMap *elements = &maps[RECORDING_ELEMENTS].map;
    if (elements->count > 0 && elements->topology == topology->number) {
        fprintf(out, "\n<Attribute Name=\"element_level\" Center=\"Cell\">");
        write_rows(recording, body, "elements/level", &body->table[ELEMENTS_LEVEL], elements->first,
                   elements->count, out);
        fprintf(out, "</Attribute>");
    }
    fprintf(out, "</Grid>\n");
}

static bool read_block(const Recording *recording, const RecordedBody *body, hsize_t first,
                       hsize_t rows, Block *block)
{
    const HdfTable *table = body->table;
    const HdfFile *file = &recording->file;
    return hdf_table_read(file, &table[FRAME_TIME], first, rows, block->time) &&
           hdf_table_read(file, &table[FRAME_FIRST], first, rows, block->first) &&
           hdf_table_read(file, &table[FRAME_COUNT], first, rows, block->count) &&
           hdf_table_read(file, &table[FRAME_TOPOLOGY], first, rows, block->topology);
}

// Times at which something has moved.
typedef struct Times {
    double *at; // [count] [s]
    size_t count, capacity;
} Times;

static void add_time(Times *times, double at)
{
    if (times->count == times->capacity) {
        times->capacity = 2 * times->capacity + BLOCK;
        times->at = realloc(times->at, times->capacity * sizeof *times->at);
        ASSERT(times->at != NULL);
    }
    times->at[times->count++] = at;
}

static int compare_times(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Adds those of one body, and its last one, where the recording ends.
static bool add_times(const Recording *recording, const RecordedBody *body, Block *block,
                      Times *times)
{
    int64_t at = -1;
    int32_t topology = 0;
    const hsize_t frames = body->table[FRAME_TIME].count;
    for (hsize_t first = 0; first < frames; first += BLOCK) {
        const int rows = (int)(frames - first < BLOCK ? frames - first : BLOCK);
        if (!read_block(recording, body, first, (hsize_t)rows, block))
            return false;
        for (int i = 0; i < rows; i++) {
            if (block->first[i] != at || block->topology[i] != topology ||
                first + (hsize_t)i + 1 == frames)
                add_time(times, block->time[i]);
            at = block->first[i];
            topology = block->topology[i];
        }
    }
    return true;
}

// Finds the topology with this number; most frames have that of the frame before.
static const TopologyRows *find_topology(const RecordedBody *body, int number, int *at)
{
    for (int i = 0; i < body->topology_count; i++) {
        int index = (*at + i) % body->topology_count;
        if (body->topology[index].number == number) {
            *at = index;
            return &body->topology[index];
        }
    }
    return NULL;
}

static bool write_body(const Recording *recording, const RecordedBody *body, const Times *times,
                       Block *block, FILE *out)
{
    int at = 0;
    NewestMap maps[RECORDING_MAPS] = {0};
    fprintf(out, "<Grid Name=\"%s\" GridType=\"Collection\" CollectionType=\"Temporal\">\n",
            body->name);
    hsize_t frames = body->table[FRAME_TIME].count;
    // A block of frames at a time, whatever the length of the recording.
    for (hsize_t first = 0; first < frames; first += BLOCK) {
        int rows = (int)(frames - first < BLOCK ? frames - first : BLOCK);
        if (!read_block(recording, body, first, (hsize_t)rows, block))
            return false;
        for (int i = 0; i < rows; i++) {
            if (bsearch(&block->time[i], times->at, times->count, sizeof *times->at,
                        compare_times) == NULL)
                continue;
            const TopologyRows *topology = find_topology(body, block->topology[i], &at);
            ASSERT(topology != NULL);
            if (!follow_maps(recording, body, ERROR_MAP, block->time[i],
                             &maps[RECORDING_ERROR_MAP]) ||
                !follow_maps(recording, body, ELEMENTS, block->time[i], &maps[RECORDING_ELEMENTS]))
                return false;
            write_frame(recording, body, block, i, topology, maps, out);
        }
    }
    fprintf(out, "</Grid>\n");
    return true;
}

static bool write_all(const Recording *recording, FILE *out)
{
    Block *block = malloc(sizeof *block);
    ASSERT(block != NULL);
    fputs(XDMF_HEAD "<Xdmf Version=\"2.0\"><Domain>\n", out);
    bool ok = true;
    Times times = {0};
    for (int i = 0; i < recording->body_count && ok; i++)
        ok = add_times(recording, &recording->body[i], block, &times);
    if (times.count > 0)
        qsort(times.at, times.count, sizeof *times.at, compare_times);
    for (int i = 0; i < recording->body_count && ok; i++)
        ok = write_body(recording, &recording->body[i], &times, block, out);
    fprintf(out, "</Domain></Xdmf>\n");
    free(times.at);
    free(block);
    return ok;
}

bool recording_write_xdmf(const Recording *recording, Status *status)
{
    size_t size = strlen(recording->path) + sizeof ".xdmf";
    char *path = malloc(size);
    ASSERT(path != NULL);
    snprintf(path, size, "%s.xdmf", recording->path);
    // There is always one complete sidecar: it is replaced as a whole.
    Output output;
    FILE *out = output_begin_text(&output, path, XDMF_HEAD, status);
    bool whole =
        out != NULL && output_end_text(&output, out, write_all(recording, out), false, status);
    free(path);
    return whole;
}
#endif
