// SPDX-License-Identifier: MIT
#include "colours.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

static void *allocate(int count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    ASSERT(memory != NULL);
    return memory;
}

void colours_destroy(Colours *colours)
{
    free(colours->topology);
    free(colours->id);
    free(colours->colour);
    free(colours->order);
    *colours = (Colours){0};
}

typedef struct Row {
    int id, row;
} Row;

static int compare(const void *a, const void *b)
{
    const Row *x = a, *y = b;
    return x->id != y->id ? (x->id > y->id) - (x->id < y->id) : x->row - y->row;
}

static void sort(Colours *colours)
{
    Row *row = allocate(colours->rows, sizeof *row);
    for (int i = 0; i < colours->rows; i++)
        row[i] = (Row){colours->id[i], i};
    qsort(row, (size_t)colours->rows, sizeof *row, compare);
    for (int i = 0; i < colours->rows; i++)
        colours->order[i] = row[i].row;
    free(row);
}

bool colours_read(Colours *colours, Timeline *timeline, const TimelineFrame *at, int body,
                  Status *status)
{
    if (colours->part == at->part + 1)
        return true;
    colours_destroy(colours);
    const int rows = (int)timeline_look_rows(timeline, at, body);
    colours->topology = allocate(rows, sizeof *colours->topology);
    colours->id = allocate(rows, sizeof *colours->id);
    colours->colour = allocate(rows, sizeof *colours->colour);
    colours->order = allocate(rows, sizeof *colours->order);
    for (int first = 0; first < rows; first += RECORDING_ROWS_MOST) {
        const int count = rows - first < RECORDING_ROWS_MOST ? rows - first : RECORDING_ROWS_MOST;
        if (!timeline_look(timeline, at, body, first, count, colours->topology + first,
                           colours->id + first, colours->colour + first, status))
            return false;
    }
    colours->rows = rows;
    colours->part = at->part + 1;
    sort(colours);
    if (rows > 0 && colours->id[colours->order[0]] == RECORDING_OF_BODY)
        memcpy(colours->own, colours->colour[colours->order[0]], sizeof colours->own);
    return true;
}

bool colours_vary(const Colours *colours)
{
    return colours->rows > 0 && colours->id[colours->order[colours->rows - 1]] >= 0;
}

const unsigned char *colours_of(const Colours *colours, int id, int topology)
{
    // The first row of the id,
    int below = -1, above = colours->rows;
    while (above - below > 1) {
        const int middle = below + (above - below) / 2;
        if (colours->id[colours->order[middle]] < id)
            below = middle;
        else
            above = middle;
    }
    // and those after it.
    const unsigned char *found = NULL;
    for (int i = above; i < colours->rows && colours->id[colours->order[i]] == id; i++) {
        const int row = colours->order[i];
        if (found != NULL && colours->topology[row] > topology)
            break;
        found = colours->colour[row];
    }
    return found != NULL ? found : colours->own;
}
