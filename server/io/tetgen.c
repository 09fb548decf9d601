// SPDX-License-Identifier: MIT
// TetGen's pairs of files: points in NAME.node, tetrahedra in NAME.ele or else triangles in
// NAME.face. Known by the ends of their names, since they hold nothing but numbers; either one
// leads to the other. Allocates nothing that a file only announces.
#include "io/mesh_formats.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// Returns the length of a path without its ending if that is one of TetGen's, else 0.
static size_t stem_of(const char *path)
{
    static const char *const endings[] = {".node", ".ele", ".face", ".smesh", ".poly"};
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot != NULL && i < sizeof endings / sizeof *endings; i++)
        if (strcmp(dot, endings[i]) == 0)
            return (size_t)(dot - path);
    return 0;
}

bool tetgen_is(const FileBytes *file)
{
    // What begins with a word has but the name.
    double number;
    Text text = text_start(file);
    return stem_of(file->path) > 0 && word_number(text_word_anywhere(&text), &number);
}

// Reads the next number of a line.
static bool read_number(Text *text, double *number, Status *status)
{
    const Word word = text_word(text);
    return word_number(word, number) ||
           status_fail(status, STATUS_INVALID, "%s:%d: '%s' where a number stands", text->path,
                       word.line, word_show(word).text);
}

// Reads the first numbers of the next line that has any.
static bool read_line(Text *text, double *number, int count, Status *status)
{
    Text ahead = *text;
    while (text_word(&ahead).size == 0) {
        if (text->at == text->end)
            return status_fail(status, STATUS_INVALID,
                               "%s:%d: the file ends before all that it announces", text->path,
                               text->line);
        text_next_line(text);
        ahead = *text;
    }
    for (int i = 0; i < count; i++)
        if (!read_number(text, &number[i], status))
            return false;
    return true;
}

static bool read_nodes(const FileBytes *file, MeshCells *cells, Status *status)
{
    Text text = text_start(file);
    double head[2], row[4];
    if (!read_line(&text, head, 2, status))
        return false;
    if (head[1] != 3.0)
        return status_fail(status, STATUS_INVALID,
                           "%s:%d: points of %.9g dimensions, not 3, as Triangle's files have",
                           text.path, text.line, head[1]);
    text_next_line(&text);
    for (double i = 0.0; i < head[0] && !cells->draft->full; i++, text_next_line(&text)) {
        if (!read_line(&text, row, 4, status))
            return false;
        if (!(fabs(row[0]) <= 1e15))
            return status_fail(status, STATUS_INVALID, "%s:%d: a point of number %.9g", text.path,
                               text.line, row[0]);
        cells_tag_node(cells, row[0]);
        mesh_draft_add_node(cells->draft, vec3(row[1], row[2], row[3]));
    }
    return true;
}

// Reads tetrahedra, or triangles; lines count for errors if the file is the one that a user named.
static bool read_cells(const FileBytes *file, bool solid, bool lines, MeshCells *cells,
                       Status *status)
{
    Text text = text_start(file);
    double head[2], row[5];
    const int corners = solid ? 4 : 3;
    if (!read_line(&text, head, 2, status))
        return false;
    // Of tetrahedra the second number is that of their nodes.
    const CellKind kind = {solid ? CELL_TETRAHEDRON : CELL_TRIANGLE, solid && head[1] > 4.0};
    if (solid && head[1] < 4.0)
        return status_fail(status, STATUS_INVALID, "%s:%d: elements of %.9g nodes, not 4 or 10",
                           text.path, text.line, head[1]);
    text_next_line(&text);
    for (double i = 0.0; i < head[0] && !cells->draft->full; i++, text_next_line(&text)) {
        if (!read_line(&text, row, 1 + corners, status))
            return false;
        for (int k = 1; k <= corners; k++) {
            const int node = fabs(row[k]) <= 1e15 ? cells_find_node(cells, row[k]) : -1;
            if (node < 0)
                return status_fail(status, STATUS_INVALID, "%s:%d: no point has the number %.9g",
                                   text.path, text.line, row[k]);
            cells_corner(cells, node);
        }
        cells_end_cell(cells, kind, lines ? text.line : 0);
    }
    return true;
}

bool tetgen_read(const FileBytes *file, MeshCells *cells, const char **format, Status *status)
{
    const size_t stem = stem_of(file->path);
    if (file->path[stem + 1] == 's' || file->path[stem + 1] == 'p')
        return status_fail(
            status, STATUS_INVALID,
            "%s: is what TetGen makes meshes of: tetgen -p FILE writes a .node and an "
            ".ele, which are read",
            file->path);
    const bool nodes = strcmp(file->path + stem, ".node") == 0;
    const size_t room = stem + sizeof ".node";
    bool solid = strcmp(file->path + stem, ".ele") == 0;
    char *path = malloc(room);
    if (path == NULL)
        return status_fail(status, STATUS_FAILED, "%s: no memory", file->path);
    snprintf(path, room, "%.*s%s", (int)stem, file->path, nodes ? ".ele" : ".node");
    if (nodes)
        solid = access(path, F_OK) == 0;
    if (nodes && !solid)
        snprintf(path, room, "%.*s.face", (int)stem, file->path);
    *format = solid ? "TetGen's tetrahedra" : "TetGen's faces";
    FileBytes other;
    Status said = {0};
    bool ok = mesh_file_read(path, &other, &said);
    if (!ok)
        status_fail(status, STATUS_INVALID, "%s: its %s are in another file: %s", file->path,
                    nodes ? "cells" : "points", said.text);
    else {
        ok = read_nodes(nodes ? file : &other, cells, status) &&
             read_cells(nodes ? &other : file, solid, !nodes, cells, status);
        free(other.bytes);
    }
    free(path);
    return ok;
}
