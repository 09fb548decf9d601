// SPDX-License-Identifier: MIT
// Cells of VTK, and every way in which its XML can hold an array.
#include "test.h"
#include "import_text.h"
#include "mesh_writer.h"

#include "io/mesh_formats.h"

#ifdef PLIANT_WITH_LATTICES
#include <zlib.h>
#endif

AROUND_ALL(scratch_begin, scratch_end)

// --- one cell of each kind -----------------------------------------------------------------------

// Corners in the order of VTK, and what the cell holds.
typedef struct Cell {
    const char *name;
    int type, corners, faces;
    double x[8][3], volume;
} Cell;

static const Cell SOLID[] = {
    {"tetrahedron", 10, 4, 4, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 1.0 / 6.0},
    {"voxel",
     11,
     8,
     6,
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}},
     1.0},
    {"hexahedron",
     12,
     8,
     6,
     {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
     1.0},
    {"wedge", 13, 6, 5, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, 0.5},
    {"pyramid", 14, 5, 5, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}}, 1.0 / 3.0},
};

// Two cells, the second mirrored at z = 0 where the first one stands, so that they share a face;
// with nodes of its own if `apart`. A triangle lies beside them.
static void write_two(const Cell *cell, bool apart, char *text, size_t room)
{
    FILE *out = fmemopen(text, room, "w");
    fprintf(out,
            "# vtk DataFile Version 2.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS %d float\n",
            2 * cell->corners);
    for (int i = 0; i < 2 * cell->corners; i++) {
        const double *x = cell->x[i % cell->corners];
        fprintf(out, "%g %g %g\n", x[0], x[1], i < cell->corners ? x[2] : -x[2]);
    }
    fprintf(out, "CELLS 3 %d\n", 2 * cell->corners + 6);
    for (int k = 0; k < 2; k++) {
        fprintf(out, "%d", cell->corners);
        for (int i = 0; i < cell->corners; i++)
            fprintf(out, " %d", i + (k == 1 && (apart || cell->x[i][2] > 0.0) ? cell->corners : 0));
        fprintf(out, "\n");
    }
    fprintf(out, "3 0 1 2\nCELL_TYPES 3\n%d %d 5\nCELL_DATA 3\n", cell->type, cell->type);
    fclose(out);
}

TEST(solid_cells_give_the_faces_that_belong_to_one_of_them)
{
    for (size_t i = 0; i < sizeof SOLID / sizeof *SOLID; i++)
        for (int apart = 0; apart < 2; apart++) {
            SCOPED(mesh_destroy) TriMesh mesh;
            MeshImport import;
            char text[2048], remark[128];
            write_two(&SOLID[i], apart, text, sizeof text);
            assert_string_equal(import_text(text, &mesh, &import), "");
            // The shared face is gone, also where it is so by position only.
            assert_int_equal(import.face_count, 2 * SOLID[i].faces - 2);
            MeshQuality quality;
            mesh_quality_measure(&mesh, &quality);
            assert_int_equal(quality.component_count, 1);
            assert_int_equal(quality.border_loops, 0);
            // Sums of a dozen volumes of about 1, rounded.
            expect_near(quality.volume, 2.0 * SOLID[i].volume, 1e-14);
            mesh_quality_destroy(&quality);
            snprintf(remark, sizeof remark,
                     "its 2 solid cells are taken by their border, %d faces; 1 faces beside them "
                     "are not read",
                     import.face_count);
            assert_string_equal(import.remarks, remark);
        }
}

TEST(curved_cells_are_taken_with_straight_edges)
{
    // A tetrahedron of ten nodes, of which the last six are on its edges, and a triangle of six.
    static const char text[] =
        "# vtk DataFile Version 5.1\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 10 double\n"
        "0 0 0 1 0 0 0 1 0 0 0 1 .5 0 0 .5 .5 0 0 .5 0 0 0 .5 .5 0 .5 0 .5 .5\n"
        "CELLS 2 10\nOFFSETS vtktypeint64\n0 10\nCONNECTIVITY vtktypeint64\n"
        "0 1 2 3 4 5 6 7 8 9\nCELL_TYPES 1\n24\n";
    SCOPED(mesh_destroy) TriMesh mesh;
    MeshImport import;
    assert_string_equal(import_text(text, &mesh, &import), "");
    assert_int_equal(mesh.triangle_count, 4);
    assert_int_equal(import.repairs.unused_nodes, 6);
    expect_near(mesh_volume(&mesh), 1.0 / 6.0, 1e-15); // exact but for rounding
    expect_in(import.remarks, "1 curved cells are taken with straight edges");
}

// --- TetGen --------------------------------------------------------------------------------------

#define NODES       "# points\n4 3 1 0\n\n 1 0 0 0 7\n 2 1 0 0 7 # seven\n3 0 1 0 7\n4 0 0 1 7"
#define TETRAHEDRON "1 4 0\n1 1 2 3 4\n"

// Writes a pair of files, either of which may be missing, and imports one of them.
static const char *import_pair(const char *nodes, const char *ending, const char *cells,
                               const char *opened, TriMesh *mesh, MeshImport *import)
{
    static char said[512];
    char name[32];
    Status status = {0};
    static const char *const all[] = {"a.node", "a.ele", "a.face"};
    for (int i = 0; i < 3; i++)
        unlink(scratch_at(all[i]));
    snprintf(name, sizeof name, "a%s", ending);
    if (cells != NULL)
        scratch_write(&scratch_space, name, cells, strlen(cells));
    if (nodes != NULL)
        scratch_write(&scratch_space, "a.node", nodes, strlen(nodes));
    snprintf(name, sizeof name, "a%s", opened);
    mesh_import(scratch_at(name), mesh, import, &status);
    snprintf(said, sizeof said, "%s",
             status.code == STATUS_OK ? "" : status.text + strlen(scratch_at("")));
    return said;
}

TEST(either_file_of_tetgens_pairs_leads_to_the_other)
{
    static const struct {
        const char *ending, *cells;
    } pairs[] = {
        {".ele", TETRAHEDRON},
        {".ele", "1 10 1\n1 1 2 3 4 1 2 3 4 1 2 -1"},
        {".face", "4 1\n0 1 3 2 -1\n1 1 2 4 -1\n2 2 3 4 -1\n3 3 1 4 -1\n"},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++)
        for (int of_nodes = 0; of_nodes < 2; of_nodes++) {
            SCOPED(mesh_destroy) TriMesh mesh;
            MeshImport import;
            assert_string_equal(import_pair(NODES, pairs[i].ending, pairs[i].cells,
                                            of_nodes ? ".node" : pairs[i].ending, &mesh, &import),
                                "");
            assert_int_equal(mesh.triangle_count, 4);
            assert_int_equal(import.repairs.turned_faces, 0);
            expect_near(mesh_volume(&mesh), 1.0 / 6.0, 1e-15); // exact but for rounding
            assert_int_equal(import.face_count, 4);
        }
}

TEST(faults_of_tetgens_pairs_name_their_file_and_line)
{
    static const struct {
        const char *nodes, *cells, *opened, *says;
    } cases[] = {
        {NULL, TETRAHEDRON, ".ele", "a.ele: its points are in another file: "},
        {NODES, NULL, ".node", "a.node: its cells are in another file: "},
        {"3 2 0 0\n1 0 0\n", TETRAHEDRON, ".ele",
         "a.node:1: points of 2 dimensions, not 3, as Triangle's files have"},
        {"4 3 0 0\n1 0 0 0\n", TETRAHEDRON, ".ele",
         "a.node:3: the file ends before all that it announces"},
        {"4 3 0 0\n1 0 x 0\n", TETRAHEDRON, ".node", "a.node:2: 'x' where a number stands"},
        {NODES, "1 4 0\n1 1 2 3 5\n", ".ele", "a.ele:2: no point has the number 5"},
        {NODES, "1 3 0\n1 1 2 3\n", ".ele", "a.ele:1: elements of 3 nodes, not 4 or 10"},
        {NODES, "9999999999 4\n1 1 2 3 4\n", ".ele",
         "a.ele:3: the file ends before all that it announces"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        TriMesh mesh;
        MeshImport import;
        expect_in(
            import_pair(cases[i].nodes, ".ele", cases[i].cells, cases[i].opened, &mesh, &import),
            cases[i].says);
    }
    scratch_write(&scratch_space, "a.smesh", "8 3 0 0", 7);
    TriMesh mesh;
    MeshImport import;
    Status status = {0};
    assert_false(mesh_import(scratch_at("a.smesh"), &mesh, &import, &status));
    expect_in(status.text, "tetgen -p FILE writes a .node and an .ele, which are read");
}

// --- Gmsh ----------------------------------------------------------------------------------------

#define MSH(version, rest) "$MeshFormat\n" version " 0 8\n$EndMeshFormat\n" rest

TEST(gmshs_solid_cells_give_their_border)
{
    // A tetrahedron of versions 1 and 2 with two faces as elements of their own, and one of
    // version 4.1 whose nodes are named by large numbers in falling order.
    static const char *const texts[] = {
        "$NOD\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$ENDNOD\n$ELM\n4\n1 15 1 1 1 1\n"
        "2 2 1 1 3 1 2 3\n3 2 1 1 3 1 2 4\n4 4 1 1 4 1 2 3 4\n$ENDELM\n",
        MSH("2.2", "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n4\n"
                   "1 15 2 1 1 1\n2 2 2 1 1 1 2 3\n3 2 0 1 2 4\n4 4 2 1 1 1 2 3 4\n"
                   "$EndElements\n$NodeData\n1\n$EndNodeData\n"),
        MSH("4.1", "$Nodes\n1 4 6 900000000000\n3 1 0 4\n900000000000\n80\n7\n6\n"
                   "0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n$Elements\n2 3 1 3\n2 1 2 2\n1 "
                   "900000000000 80 7\n2 900000000000 80 6\n3 1 4 1\n3 900000000000 80 7 6\n"
                   "$EndElements\n"),
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        MeshImport import;
        assert_string_equal(import_text(texts[i], &mesh, &import), "");
        assert_int_equal(mesh.triangle_count, 4);
        expect_near(mesh_volume(&mesh), 1.0 / 6.0, 1e-15); // exact but for rounding
        assert_string_equal(import.remarks,
                            "its 1 solid cells are taken by their border, 4 faces; 2 "
                            "faces beside them are not read");
    }
}

TEST(faults_of_gmshs_files_name_their_line)
{
    static const struct {
        const char *text, *says;
    } cases[] = {
        {MSH("4", "$Nodes\n"),
         ": of Gmsh's MSH versions 1, 2 and 4.1 are read, not 4; gmsh FILE -save "
         "-o NEW.msh -format msh41 converts it"},
        {MSH("2.2", "$Nodes\n2\n1 0 0 0\n"), ":7: the file ends where a number stands"},
        {MSH("2.2", "$Nodes\n1\n1 0 0 0\n2 0 0 0\n"), ":7: $EndNodes or $ENDNOD expected"},
        {"$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n1\n1 2 1 1 4 1 1 1 1\n",
         ":7: an element with another number of nodes than its kind has"},
        {MSH("2.2", "$Nodes\n-1\n"), ":5: a count or tag that is no integer from 0"},
        {MSH("2.2", "$Elements\n1\n1 2 0 1 2 3\n"),
         ":6: an element names a node that is not there"},
        {MSH("2.2", "$Elements\n1\n1 99 0 1 2 3\n"), ":6: an element of a kind that is not read"},
        {MSH("2.2", "$Elements\n1\n1 2 x\n"), ":6: a word where a number stands"},
        {MSH("2.2", "$Periodic\n1\n"), ":5: a part without its end"},
        {MSH("2.2", "Nodes\n1\n"), ":4: a part, $Nodes or another, expected"},
        {MSH("2.2", "$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n$Elements\n1\n1 2 0 1 2 3\n"
                    "$EndElements\n$Nodes\n1\n"),
         ":15: $Nodes behind $Elements"},
        {MSH("2.2", "$Nodes\n0\n$EndNodes\n"),
         ": no faces and no solid cells, of which a mesh is made"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        TriMesh mesh;
        MeshImport import;
        assert_string_equal(import_text(cases[i].text, &mesh, &import), cases[i].says);
    }
}

// --- every encoding of VTK's XML -----------------------------------------------------------------

typedef enum Place { IN_ASCII, IN_BASE64, BEHIND_RAW, BEHIND_BASE64, PLACES } Place;

typedef struct Coding {
    Place place;
    bool packed, big, wide, wide_header;
    bool apart; // base64 ends where the header ends
} Coding;

typedef struct Array {
    const char *name; // NULL: the points
    const double *number;
    int count, size;
    bool real;
} Array;

static void base64_write(FILE *out, const unsigned char *from, size_t size)
{
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        const unsigned bits = (unsigned)from[i] << 16 |
                              (i + 1 < size ? (unsigned)from[i + 1] << 8 : 0) |
                              (i + 2 < size ? (unsigned)from[i + 2] : 0);
        fputc(digit[bits >> 18], out);
        fputc(digit[bits >> 12 & 63], out);
        fputc(i + 1 < size ? digit[bits >> 6 & 63] : '=', out);
        fputc(i + 2 < size ? digit[bits & 63] : '=', out);
    }
}

static void write_integer(FILE *out, uint64_t value, int size, bool big)
{
    for (int i = 0; i < size; i++)
        fputc((int)(value >> 8 * (big ? size - 1 - i : i) & 255), out);
}

static void write_numbers(FILE *out, const Array *array, bool big)
{
    for (int i = 0; i < array->count; i++) {
        const double number = array->number[i];
        const float single = (float)number;
        uint64_t bits = (uint64_t)number;
        uint32_t low;
        memcpy(&low, &single, sizeof low);
        if (array->real && array->size == 4)
            bits = low;
        else if (array->real)
            memcpy(&bits, &number, sizeof bits);
        write_integer(out, bits, array->size, big);
    }
}

// Blocks of 40 bytes behind their number, their size, the size of the last, and those packed.
static Bytes pack(const Bytes *plain, const Coding *coding, size_t *header)
{
    Bytes packed = {0};
    FILE *out = open_memstream(&packed.at, &packed.size);
#ifdef PLIANT_WITH_LATTICES
    enum { BLOCK = 40, BLOCKS_MOST = 100 };
    const size_t blocks = (plain->size + BLOCK - 1) / BLOCK;
    const int word = coding->wide_header ? 8 : 4;
    static unsigned char block[BLOCKS_MOST][2 * BLOCK];
    uLongf size[BLOCKS_MOST];
    write_integer(out, blocks, word, coding->big);
    write_integer(out, BLOCK, word, coding->big);
    write_integer(out, plain->size % BLOCK, word, coding->big);
    for (size_t i = 0; i < blocks; i++) {
        const size_t left = plain->size - i * BLOCK;
        size[i] = sizeof block[i];
        assert_int_equal(compress(block[i], &size[i], (const Bytef *)plain->at + i * BLOCK,
                                  left < BLOCK ? left : BLOCK),
                         Z_OK);
        write_integer(out, size[i], word, coding->big);
    }
    *header = (3 + blocks) * (size_t)word;
    for (size_t i = 0; i < blocks; i++)
        fwrite(block[i], 1, size[i], out);
#else
    (void)plain, (void)coding, (void)header;
#endif
    fclose(out);
    return packed;
}

// The bytes of an array as they stand in the file.
static Bytes encode(const Array *array, const Coding *coding)
{
    Bytes plain = {0}, whole = {0}, text = {0};
    size_t header = coding->wide_header ? 8 : 4;
    FILE *out = open_memstream(&plain.at, &plain.size);
    write_numbers(out, array, coding->big);
    fclose(out);
    out = open_memstream(&whole.at, &whole.size);
    if (!coding->packed) {
        write_integer(out, plain.size, (int)header, coding->big);
        fwrite(plain.at, 1, plain.size, out);
    } else {
        Bytes packed = pack(&plain, coding, &header);
        fwrite(packed.at, 1, packed.size, out);
        free(packed.at);
    }
    fclose(out);
    free(plain.at);
    if (coding->place == BEHIND_RAW)
        return whole;
    out = open_memstream(&text.at, &text.size);
    const size_t first = coding->apart ? header : 0;
    base64_write(out, (const unsigned char *)whole.at, first);
    base64_write(out, (const unsigned char *)whole.at + first, whole.size - first);
    fclose(out);
    free(whole.at);
    return text;
}

static void write_array(FILE *out, FILE *behind, const Array *array, const Coding *coding)
{
    static const char *const formats[PLACES] = {"ascii", "binary", "appended", "appended"};
    fprintf(out, "<DataArray type=\"%s%d\" Name=\"%s\" format=\"%s\" offset=\"%ld\">\n",
            array->real ? "Float" : "Int", 8 * array->size, array->name ? array->name : "Points",
            formats[coding->place], ftell(behind));
    if (coding->place == IN_ASCII)
        for (int i = 0; i < array->count; i++)
            fprintf(out, "%.17g%s", array->number[i], i % 5 == 4 ? "\n" : " ");
    else {
        Bytes bytes = encode(array, coding);
        fwrite(bytes.at, 1, bytes.size, coding->place == IN_BASE64 ? out : behind);
        free(bytes.at);
    }
    fprintf(out, "\n</DataArray>\n");
}

// Two tetrahedra of a piece each, or their surfaces; the frame is RAS.
static Bytes write_xml(const Coding *coding, bool grid)
{
    static const double x[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, types[] = {10};
    static const double corners[] = {0, 1, 2, 3}, ends[] = {4}, ras[] = {'R', 'A', 'S', 0};
    static const double strip[] = {0, 2, 1, 3}, strip_end[] = {4};
    static const double faces[] = {0, 1, 3, 2, 0, 3}, face_ends[] = {3, 6};
    const int real = coding->wide ? 8 : 4;
    Bytes bytes = {0}, behind = {0};
    FILE *out = open_memstream(&bytes.at, &bytes.size);
    FILE *more = open_memstream(&behind.at, &behind.size);
    fprintf(
        out,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"%s\" byte_order=\"%s\" header_type=\"%s\"%s>\n",
        grid ? "UnstructuredGrid" : "PolyData", coding->big ? "BigEndian" : "LittleEndian",
        coding->wide_header ? "UInt64" : "UInt32",
        coding->packed ? " compressor=\"vtkZLibDataCompressor\"" : "");
    fprintf(out, "<FieldData>\n");
    // VTK's texts are arrays of another tag.
    const Array space = {"SPACE", ras, 4, 1, false};
    Bytes frame = encode(&space, coding);
    fprintf(out, "<Array type=\"String\" Name=\"SPACE\" format=\"%s\" offset=\"0\">",
            coding->place == IN_ASCII    ? "ascii"
            : coding->place == IN_BASE64 ? "binary"
                                         : "appended");
    if (coding->place == IN_ASCII)
        fprintf(out, "82 65 83 0");
    else
        fwrite(frame.at, 1, frame.size, coding->place == IN_BASE64 ? out : more);
    free(frame.at);
    fprintf(out, "</Array></FieldData>\n");
    for (int piece = 0; piece < 2; piece++) {
        double moved[12];
        for (int i = 0; i < 12; i++)
            moved[i] = x[i] + 2.0 * piece;
        fprintf(out, "<Piece NumberOfPoints=\"4\" NumberOf%s>\n<PointData></PointData><Points>",
                grid ? "Cells=\"1\"" : "Strips=\"1\" NumberOfPolys=\"2\" NumberOfLines=\"0\"");
        write_array(out, more, &(Array){NULL, moved, 12, real, true}, coding);
        fprintf(out, "</Points>\n<%s>", grid ? "Cells" : "Strips");
        write_array(out, more, &(Array){"connectivity", grid ? corners : strip, 4, real, false},
                    coding);
        write_array(out, more, &(Array){"offsets", grid ? ends : strip_end, 1, real, false},
                    coding);
        if (grid)
            write_array(out, more, &(Array){"types", types, 1, 1, false}, coding);
        fprintf(out, "</%s>\n", grid ? "Cells" : "Strips");
        if (!grid) {
            fprintf(out, "<Polys>");
            write_array(out, more, &(Array){"offsets", face_ends, 2, real, false}, coding);
            write_array(out, more, &(Array){"connectivity", faces, 6, real, false}, coding);
            fprintf(out, "</Polys>");
        }
        fprintf(out, "</Piece>\n");
    }
    fclose(more);
    if (coding->place >= BEHIND_RAW) {
        fprintf(out, "<AppendedData encoding=\"%s\">\n_",
                coding->place == BEHIND_RAW ? "raw" : "base64");
        fwrite(behind.at, 1, behind.size, out);
        fprintf(out, "\n</AppendedData>\n");
    }
    fprintf(out, "</VTKFile>\n");
    fclose(out);
    free(behind.at);
    return bytes;
}

// The codings that a number stands for; false if this build or the format has no such one.
static bool coding_of(int number, Coding *coding)
{
    *coding = (Coding){.place = (Place)(number % PLACES)};
    number /= PLACES;
    coding->packed = number & 1;
    coding->big = number & 2;
    coding->wide = number & 4;
    coding->wide_header = number & 8;
    coding->apart = number & 16;
#ifndef PLIANT_WITH_LATTICES
    if (coding->packed)
        return false;
#endif
    return coding->place != IN_ASCII || !coding->packed;
}
enum { CODINGS = PLACES * 32 };

TEST(every_encoding_of_vtks_xml_gives_the_same_mesh)
{
    int tried = 0;
    for (int i = 0; i < 2 * CODINGS; i++) {
        Coding coding;
        if (!coding_of(i / 2, &coding))
            continue;
        Bytes bytes = write_xml(&coding, i & 1);
        SCOPED(mesh_destroy) TriMesh mesh;
        MeshImport import;
        const char *said = import_bytes(bytes.at, bytes.size, &mesh, &import);
        if (said[0] != '\0')
            fail_msg("coding %d: %s", i, said);
        assert_int_equal(mesh.node_count, 8);
        assert_int_equal(mesh.triangle_count, 8);
        expect_near(mesh_volume(&mesh), 1.0 / 3.0, 1e-15); // exact but for rounding
        // Turned from RAS: all coordinates are integers.
        expect_near(mesh.position[5].x, -3.0, 0.0);
        expect_near(mesh.position[5].z, 2.0, 0.0);
        assert_int_equal(import.repairs.turned_faces, 0);
        expect_in(import.remarks, "its field data state SPACE=RAS");
        assert_string_equal(mesh_frame(scratch_at("organ")), "states RAS and was turned to LPS");
        free(bytes.at);
        tried++;
    }
    assert_true(tried >= CODINGS);
}

// --- faults --------------------------------------------------------------------------------------

#define XML(more) "<VTKFile type=\"PolyData\"" more
#define PIECE(points, polys)                                                                       \
    XML(">\n<Piece NumberOfPoints=\"" points "\" NumberOfPolys=\"" polys "\">\n")
#define POINTS                                                                                     \
    "<Points><DataArray type=\"Float32\" format=\"ascii\">0 0 0 1 0 0 0 1 "                        \
    "0</DataArray></Points>\n"
#define POLYS(corners, ends)                                                                       \
    "<Polys><DataArray type=\"Int32\" Name=\"connectivity\">" corners "</DataArray>\n"             \
    "<DataArray type=\"Int32\" Name=\"offsets\">" ends "</DataArray></Polys></Piece>"

TEST(faults_of_vtks_xml_name_their_line)
{
    static const struct {
        const char *text, *says;
    } cases[] = {
        {"<VTKFile type=\"ImageData\">",
         ":1: of VTK's XML the types PolyData and UnstructuredGrid are read as a mesh; ParaView's "
         "Extract Surface makes the first of 'ImageData'"},
        {XML(" compressor=\"vtkLZ4DataCompressor\">"),
         ":1: of VTK's compressors ZLib is read; ParaView can save without this one: "
         "'vtkLZ4DataCompressor'"},
        {XML(">\n<Piece"), ":2: the file ends inside a tag"},
        {PIECE("3", "1") POINTS POLYS("0 1 2", "3"), ":5: the file ends before </VTKFile>"},
        {PIECE("-1", "1"), ":2: no count: '-1'"},
        {PIECE("3", "1") POINTS POLYS("0 1 3", "3"), ": Polys: a cell names point 3 of 3"},
        {PIECE("3", "1") POINTS POLYS("0 1 x", "3"), ":4: connectivity: 'x' where a number stands"},
        {PIECE("3", "1") POINTS POLYS("0 1", "3"), ":4: connectivity: '' where a number stands"},
        {PIECE("3", "2") POINTS POLYS("0 1 2", "3 2"), ": Polys: offset 2 after 3"},
        {PIECE("3", "1") POINTS "</Piece>", ": a Piece has no offsets"},
        {PIECE("3", "0") POINTS "</Piece>",
         ": no faces and no solid cells, of which a mesh is made"},
        {PIECE("3", "1") "<Points>\n<DataArray type=\"Float32\" format=\"binary\">JAAAAAAA"
                         "</DataArray></Points></Piece>",
         ":4: Points: the file ends inside it"},
        {PIECE("3", "1") "<Points><DataArray type=\"Float32\" format=\"binary\">IAAAAAAA"
                         "</DataArray></Points></Piece>",
         ":3: Points: it has another length than its numbers"},
        {PIECE("3", "1") "<Points><DataArray type=\"Float32\" format=\"appended\" offset=\"24\"/>"
                         "</Points></Piece><AppendedData>_</AppendedData>",
         ":3: Points: the file ends in front of it"},
        {PIECE("3",
               "1") "<Points><DataArray type=\"Float32\" format=\"appended\"/></Points></Piece>",
         ":3: Points: its offset is outside of AppendedData"},
        {"<VTKFile type=\"UnstructuredGrid\"><Piece NumberOfPoints=\"3\" "
         "NumberOfCells=\"1\">" POINTS
         "<Cells><DataArray type=\"Int8\" Name=\"connectivity\">0 1 2</DataArray><DataArray "
         "type=\"Int8\" Name=\"offsets\">3</DataArray><DataArray type=\"Int8\" Name=\"types\">42"
         "</DataArray></Cells></Piece>",
         ": 1 cells are of a kind that is not read, as polyhedra are; in ParaView Extract Surface "
         "makes faces of them"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        TriMesh mesh;
        MeshImport import;
        char text[1024];
        snprintf(text, sizeof text, "%s%s", cases[i].text,
                 strstr(cases[i].says, " a tag") || strstr(cases[i].says, "</VTKFile>")
                     ? ""
                     : "</VTKFile>");
        assert_string_equal(import_text(text, &mesh, &import), cases[i].says);
    }
}

#ifdef PLIANT_WITH_LATTICES
TEST(announced_lengths_take_no_memory)
{
    // 2^24 blocks of 2^16 bytes, and one of 1.2e9 bytes in 100; the file ends behind their lengths.
    static const struct {
        const char *points, *lengths, *says;
    } cases[] = {
        {"91625968981", "AAAAAQAAAQAAAAAA", ":2: Points: its blocks are more than the file holds"},
        {"100000000",
         "AQAAAACMhkcAAAAAZAAAAA==", ":2: Points: it is longer than its blocks can be"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        TriMesh mesh;
        MeshImport import;
        char text[512];
        snprintf(
            text, sizeof text,
            XML(" compressor=\"vtkZLibDataCompressor\">") "<Piece NumberOfPoints=\"%s\"><Points>"
                                                          "\n<DataArray type=\"Float32\" "
                                                          "format=\"binary\">%s</DataArray></"
                                                          "Points></Piece>"
                                                          "</VTKFile>",
            cases[i].points, cases[i].lengths);
        assert_string_equal(import_text(text, &mesh, &import), cases[i].says);
    }
}
#endif
