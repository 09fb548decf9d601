// SPDX-License-Identifier: MIT
// Writes polygons in every mesh format that is read, for tests. Formats without shared nodes (STL)
// get each polygon as a fan of triangles with nodes of their own.
#ifndef PLIANT_TESTS_MESH_WRITER_H
#define PLIANT_TESTS_MESH_WRITER_H

#include "geometry/mesh_repair.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef enum MeshFormat {
    WRITE_OBJ,
    WRITE_STL_ASCII,
    WRITE_STL_BINARY,
    WRITE_PLY_ASCII,
    WRITE_PLY_LITTLE,
    WRITE_PLY_BIG,
    WRITE_OFF,
    WRITE_VTK_ASCII,
    WRITE_VTK_BINARY,
    WRITE_VTP,
    WRITE_VTU,
    WRITE_MSH_2,
    WRITE_MSH_2_BINARY,
    WRITE_MSH_4,
    WRITE_MSH_4_BINARY,
    WRITE_FORMATS
} MeshFormat;

static const char *const MESH_FORMAT_NAMES[WRITE_FORMATS] = {"OBJ",
                                                             "ASCII STL",
                                                             "binary STL",
                                                             "ASCII PLY",
                                                             "binary little-endian PLY",
                                                             "binary big-endian PLY",
                                                             "OFF",
                                                             "ASCII VTK",
                                                             "binary VTK",
                                                             "VTP",
                                                             "VTU",
                                                             "ASCII MSH",
                                                             "binary MSH",
                                                             "ASCII MSH",
                                                             "binary MSH"};

static inline bool mesh_format_is_stl(MeshFormat format)
{
    return format == WRITE_STL_ASCII || format == WRITE_STL_BINARY;
}

typedef struct Bytes {
    char *at;
    size_t size;
} Bytes;

static inline void write_number(FILE *out, const void *number, int size, bool big)
{
    const unsigned char *byte = number; // tests run on little-endian machines
    for (int i = 0; i < size; i++)
        fputc(byte[big ? size - 1 - i : i], out);
}

static inline void write_facets(FILE *out, const MeshDraft *draft, bool ascii)
{
    for (int p = 0; p < draft->polygon_count; p++)
        for (int c = mesh_draft_start(draft, p); c + 2 < draft->end[p]; c++) {
            const int corner[3] = {draft->corner[mesh_draft_start(draft, p)], draft->corner[c + 1],
                                   draft->corner[c + 2]};
            const float nothing[3] = {0, 0, 0};
            if (ascii)
                fprintf(out, "facet normal 0 0 0\nouter loop\n");
            else
                fwrite(nothing, 4, 3, out);
            for (int k = 0; k < 3; k++) {
                Vec3 x = draft->position[corner[k]];
                const float single[3] = {(float)x.x, (float)x.y, (float)x.z};
                if (ascii)
                    fprintf(out, "vertex %.17g %.17g %.17g\n", x.x, x.y, x.z);
                else
                    fwrite(single, 4, 3, out);
            }
            if (ascii)
                fprintf(out, "endloop\nendfacet\n");
            else
                fwrite(nothing, 1, 2, out);
        }
}

static inline void write_stl(FILE *out, const MeshDraft *draft, bool ascii)
{
    uint32_t triangles = 0;
    for (int p = 0; p < draft->polygon_count; p++) {
        int corners = draft->end[p] - mesh_draft_start(draft, p);
        triangles += corners > 2 ? (uint32_t)corners - 2 : 0;
    }
    if (ascii)
        fprintf(out, "solid test\n");
    else {
        fprintf(out, "%-80s", "solid, says the header");
        fwrite(&triangles, 4, 1, out);
    }
    write_facets(out, draft, ascii);
    if (ascii)
        fprintf(out, "endsolid test\n");
}

// With an element and properties that mean nothing to us, before and between.
static inline void write_ply(FILE *out, const MeshDraft *draft, MeshFormat format)
{
    bool ascii = format == WRITE_PLY_ASCII, big = format == WRITE_PLY_BIG;
    const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    fprintf(out, "ply\nformat %s 1.0\ncomment C:\\\nobj_info none\n",
            names[format - WRITE_PLY_ASCII]);
    fprintf(out, "element camera 1\nproperty list uchar short angles\nproperty uchar on\n");
    fprintf(out,
            "element vertex %d\nproperty uchar red\nproperty double x\nproperty double y\n"
            "property double z\nproperty float32 quality\n",
            draft->node_count);
    fprintf(out, "element face %d\nproperty list uint8 int32 vertex_indices\nend_header\n",
            draft->polygon_count);
    const int16_t angle = -2;
    const float quality = 0.5f;
    if (ascii)
        fprintf(out, "2 -2 -2 1\n");
    else {
        fputc(2, out);
        write_number(out, &angle, 2, big);
        write_number(out, &angle, 2, big);
        fputc(1, out);
    }
    for (int i = 0; i < draft->node_count; i++) {
        const Vec3 *x = &draft->position[i];
        if (ascii) {
            fprintf(out, "255 %.17g %.17g %.17g 0.5\n", x->x, x->y, x->z);
            continue;
        }
        fputc(255, out);
        write_number(out, &x->x, 8, big);
        write_number(out, &x->y, 8, big);
        write_number(out, &x->z, 8, big);
        write_number(out, &quality, 4, big);
    }
    for (int p = 0; p < draft->polygon_count; p++) {
        int start = mesh_draft_start(draft, p), corners = draft->end[p] - start;
        if (ascii)
            fprintf(out, "%d", corners);
        else
            fputc(corners, out);
        for (int c = start; c < draft->end[p]; c++) {
            if (ascii)
                fprintf(out, " %d", draft->corner[c]);
            else
                write_number(out, &draft->corner[c], 4, big);
        }
        if (ascii)
            fprintf(out, "\n");
    }
}

static inline void write_obj_or_off(FILE *out, const MeshDraft *draft, bool off)
{
    if (off)
        fprintf(out, "OFF # test\n\n%d %d 0\n", draft->node_count, draft->polygon_count);
    for (int i = 0; i < draft->node_count; i++)
        fprintf(out, "%s%.17g %.17g %.17g\n", off ? "" : "v ", draft->position[i].x,
                draft->position[i].y, draft->position[i].z);
    for (int p = 0; p < draft->polygon_count; p++) {
        int start = mesh_draft_start(draft, p);
        if (off)
            fprintf(out, "%d", draft->end[p] - start);
        else
            fprintf(out, "f");
        for (int c = start; c < draft->end[p]; c++)
            fprintf(out, " %d", draft->corner[c] + (off ? 0 : 1));
        fprintf(out, "%s\n", off ? " 255 0 0" : "");
    }
}

static inline int draft_corners(const MeshDraft *draft)
{
    return draft->polygon_count > 0 ? draft->end[draft->polygon_count - 1] : 0;
}

// ASCII with cells as before version 5.1, binary as since.
static inline void write_vtk(FILE *out, const MeshDraft *draft, bool ascii)
{
    fprintf(out, "# vtk DataFile Version %s\nwritten by nobody\n%s\nDATASET POLYDATA\n",
            ascii ? "3.0" : "5.1", ascii ? "ASCII" : "BINARY");
    fprintf(out, "POINTS %d double\n", draft->node_count);
    for (int i = 0; i < draft->node_count; i++) {
        const double x[3] = {draft->position[i].x, draft->position[i].y, draft->position[i].z};
        for (int k = 0; k < 3; k++) {
            if (ascii)
                fprintf(out, "%.17g%s", x[k], k == 2 ? "\n" : " ");
            else
                write_number(out, &x[k], 8, true);
        }
    }
    const int corners = draft_corners(draft);
    if (ascii) {
        fprintf(out, "POLYGONS %d %d\n", draft->polygon_count, draft->polygon_count + corners);
        for (int p = 0; p < draft->polygon_count; p++) {
            fprintf(out, "%d", draft->end[p] - mesh_draft_start(draft, p));
            for (int c = mesh_draft_start(draft, p); c < draft->end[p]; c++)
                fprintf(out, " %d", draft->corner[c]);
            fprintf(out, "\n");
        }
        return;
    }
    fprintf(out, "\nMETADATA\nINFORMATION 0\n\nPOLYGONS %d %d\nOFFSETS vtktypeint64\n",
            draft->polygon_count + 1, corners);
    for (int p = 0; p <= draft->polygon_count; p++) {
        const int64_t at = p == 0 ? 0 : draft->end[p - 1];
        write_number(out, &at, 8, true);
    }
    fprintf(out, "\nCONNECTIVITY vtktypeint64\n");
    for (int c = 0; c < corners; c++) {
        const int64_t node = draft->corner[c];
        write_number(out, &node, 8, true);
    }
    fprintf(out, "\n");
}

// ASCII, with words about an array behind its numbers.
static inline void write_vtp(FILE *out, const MeshDraft *draft)
{
    fprintf(out,
            "<?xml version='1.0'?>\n<!-- > -->\n<VTKFile type=\"PolyData\">\n<PolyData>\n"
            "<Piece NumberOfPoints=\"%d\" NumberOfPolys='%d'>\n<Points>\n"
            "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n",
            draft->node_count, draft->polygon_count);
    for (int i = 0; i < draft->node_count; i++)
        fprintf(out, "%.17g %.17g %.17g\n", draft->position[i].x, draft->position[i].y,
                draft->position[i].z);
    fprintf(out, "<InformationKey name=\"a > b\"><Value>7</Value></InformationKey></DataArray>\n"
                 "</Points><Polys><DataArray type=\"Int32\" Name=\"connectivity\">");
    for (int c = 0; c < draft_corners(draft); c++)
        fprintf(out, "%d ", draft->corner[c]);
    fprintf(out, "</DataArray><DataArray type=\"Int32\" Name=\"offsets\">");
    for (int p = 0; p < draft->polygon_count; p++)
        fprintf(out, "%d\n", draft->end[p]);
    fprintf(out, "</DataArray></Polys></Piece></PolyData></VTKFile>\n");
}

static inline void write_length(FILE *out, int numbers, int size)
{
    const uint64_t length = (uint64_t)numbers * (uint64_t)size;
    write_number(out, &length, 8, false);
}

// Raw bytes behind the last tag.
static inline void write_vtu(FILE *out, const MeshDraft *draft)
{
    const int corners = draft_corners(draft), polygons = draft->polygon_count;
    const int at = 8 + 24 * draft->node_count, behind = at + 8 + 8 * corners;
    fprintf(out,
            "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" "
            "header_type=\"UInt64\"><Piece NumberOfPoints=\"%d\" NumberOfCells=\"%d\"><Points>"
            "<DataArray type=\"Float64\" format=\"appended\" offset=\"0\"/></Points><Cells>",
            draft->node_count, polygons);
    fprintf(out,
            "<DataArray Name=\"connectivity\" type=\"Int64\" format=\"appended\" offset=\"%d\"/>"
            "<DataArray Name=\"offsets\" type=\"Int32\" format=\"appended\" offset=\"%d\"/>"
            "<DataArray Name=\"types\" type=\"UInt8\" format=\"appended\" offset=\"%d\"/></Cells>"
            "</Piece><AppendedData encoding=\"raw\">_",
            at, behind, behind + 8 + 4 * polygons);
    write_length(out, 3 * draft->node_count, 8);
    for (int i = 0; i < draft->node_count; i++) {
        const double x[3] = {draft->position[i].x, draft->position[i].y, draft->position[i].z};
        fwrite(x, 8, 3, out);
    }
    write_length(out, corners, 8);
    for (int c = 0; c < corners; c++)
        write_number(out, &(const int64_t){draft->corner[c]}, 8, false);
    write_length(out, polygons, 4);
    fwrite(draft->end, 4, (size_t)polygons, out);
    write_length(out, polygons, 1);
    for (int p = 0; p < polygons; p++)
        fputc(7, out); // a polygon
    fprintf(out, "</AppendedData></VTKFile>");
}

// An int or, of 8 bytes, a count of version 4.
static inline void write_msh_number(FILE *out, int64_t number, int size, MeshFormat format)
{
    if (format == WRITE_MSH_2 || format == WRITE_MSH_4)
        fprintf(out, "%lld ", (long long)number);
    else // version 4 in the other order of bytes
        for (int i = 0; i < size; i++)
            fputc((int)(number >> 8 * (format == WRITE_MSH_4_BINARY ? size - 1 - i : i) & 255),
                  out);
}

static inline void write_msh_position(FILE *out, Vec3 x, MeshFormat format)
{
    const double number[3] = {x.x, x.y, x.z};
    if (format == WRITE_MSH_2 || format == WRITE_MSH_4)
        fprintf(out, "%.17g %.17g %.17g\n", x.x, x.y, x.z);
    for (int k = 0; k < 3 && (format == WRITE_MSH_2_BINARY || format == WRITE_MSH_4_BINARY); k++)
        write_number(out, &number[k], 8, format == WRITE_MSH_4_BINARY);
}

// Tags have gaps, and fall.
static inline int msh_tag(const MeshDraft *draft, int node)
{
    return 7 + 3 * (draft->node_count - node);
}

static inline void write_msh_2(FILE *out, const MeshDraft *draft, MeshFormat format)
{
    fprintf(out, "$Nodes\n%d\n", draft->node_count);
    for (int i = 0; i < draft->node_count; i++) {
        write_msh_number(out, msh_tag(draft, i), 4, format);
        write_msh_position(out, draft->position[i], format);
    }
    fprintf(out, "\n$EndNodes\n$Elements\n%d\n", draft->polygon_count);
    for (int p = 0; p < draft->polygon_count; p++) {
        // Tag, kind and number of tags; in binary files the kind, one element, its tags and tag.
        const int start = mesh_draft_start(draft, p), kind = draft->end[p] - start - 1;
        const int text[] = {p + 1, kind, 2}, binary[] = {kind, 1, 2, p + 1};
        for (int k = 0; k < (format == WRITE_MSH_2 ? 3 : 4); k++)
            write_msh_number(out, format == WRITE_MSH_2 ? text[k] : binary[k], 4, format);
        write_msh_number(out, 1, 4, format);
        write_msh_number(out, 1, 4, format);
        for (int c = start; c < draft->end[p]; c++)
            write_msh_number(out, msh_tag(draft, draft->corner[c]), 4, format);
        fprintf(out, format == WRITE_MSH_2 ? "\n" : "");
    }
    fprintf(out, "\n$EndElements\n");
}

// A block of all nodes, which stand on a surface, and one for each face.
static inline void write_msh_4(FILE *out, const MeshDraft *draft, MeshFormat format)
{
    const int nodes = draft->node_count, faces = draft->polygon_count;
    const int head[4] = {1, nodes, 1, 99};
    fprintf(out, "$Entities\n0 $Nodes 0\n$EndEntities\n$Nodes\n");
    for (int k = 0; k < 4; k++)
        write_msh_number(out, head[k], 8, format);
    for (int k = 0; k < 3; k++) // of a surface, with its coordinates on it
        write_msh_number(out, k == 0 ? 2 : 1, 4, format);
    write_msh_number(out, nodes, 8, format);
    for (int i = 0; i < nodes; i++)
        write_msh_number(out, msh_tag(draft, i), 8, format);
    for (int i = 0; i < nodes; i++) {
        write_msh_position(out, draft->position[i], format);
        write_msh_number(out, 0, 8, format); // 0 is the same as a double
        write_msh_number(out, 0, 8, format);
    }
    fprintf(out, "\n$EndNodes\n$Elements\n");
    for (int k = 0; k < 4; k++)
        write_msh_number(out, k == 0 ? faces : head[k], 8, format);
    for (int p = 0; p < faces; p++) {
        const int start = mesh_draft_start(draft, p);
        write_msh_number(out, 2, 4, format);
        write_msh_number(out, 1, 4, format);
        write_msh_number(out, draft->end[p] - start - 1, 4, format); // its kind
        write_msh_number(out, 1, 8, format);
        write_msh_number(out, p + 1, 8, format);
        for (int c = start; c < draft->end[p]; c++)
            write_msh_number(out, msh_tag(draft, draft->corner[c]), 8, format);
    }
    fprintf(out, "\n$EndElements\n");
}

static inline void write_msh(FILE *out, const MeshDraft *draft, MeshFormat format)
{
    const bool fourth = format == WRITE_MSH_4 || format == WRITE_MSH_4_BINARY;
    const bool binary = format == WRITE_MSH_2_BINARY || format == WRITE_MSH_4_BINARY;
    fprintf(out, "$MeshFormat\n%s %d 8\n", fourth ? "4.1" : "2.2", binary);
    if (binary)
        write_msh_number(out, 1, 4, format);
    fprintf(out, "\n$EndMeshFormat\n");
    if (fourth)
        write_msh_4(out, draft, format);
    else
        write_msh_2(out, draft, format);
}

// The file as it would stand on disk; the caller frees bytes.at.
static inline Bytes mesh_write(const MeshDraft *draft, MeshFormat format)
{
    Bytes bytes = {0};
    FILE *out = open_memstream(&bytes.at, &bytes.size);
    if (out == NULL)
        abort();
    if (mesh_format_is_stl(format))
        write_stl(out, draft, format == WRITE_STL_ASCII);
    else if (format == WRITE_VTK_ASCII || format == WRITE_VTK_BINARY)
        write_vtk(out, draft, format == WRITE_VTK_ASCII);
    else if (format >= WRITE_MSH_2)
        write_msh(out, draft, format);
    else if (format == WRITE_VTP)
        write_vtp(out, draft);
    else if (format == WRITE_VTU)
        write_vtu(out, draft);
    else if (format == WRITE_OBJ || format == WRITE_OFF)
        write_obj_or_off(out, draft, format == WRITE_OFF);
    else
        write_ply(out, draft, format);
    fclose(out);
    return bytes;
}

#endif
