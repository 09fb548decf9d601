// SPDX-License-Identifier: MIT
// Readers of mesh formats. Load time only; private to io, but for off_write.
#ifndef PLIANT_IO_MESH_FORMATS_H
#define PLIANT_IO_MESH_FORMATS_H

#include "base/check.h"
#include "geometry/mesh_repair.h"

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

// --- text files, word by word, with the line of each word for error texts ------------------------

// A whole file in memory, at most INT_MAX bytes, so that lines and elements count in an int.
typedef struct FileBytes {
    const char *path;
    char *bytes; // [size + 1], followed by a 0
    size_t size;
} FileBytes;

typedef struct Text {
    const char *path;
    const char *at;  // next character
    const char *end; // *end is 0
    int line;        // of `at`, from 1
} Text;

// A word: characters without blanks. size 0: no word.
typedef struct Word {
    const char *at;
    int size;
    int line;
} Word;

// Reads a file of a readable size; on success the caller frees file->bytes.
bool mesh_file_read(const char *path, FileBytes *file, Status *status);
// Returns a cursor at the start of a file, which must outlive it.
Text text_start(const FileBytes *file);
// Returns the next word of the current line; size 0 at the line's end, which a '#' marks too. A
// backslash before the end of a line joins it to the next.
Word text_word(Text *text);
// Skips the rest of the current line.
void text_next_line(Text *text);
// Returns the next word on this line or a later one; size 0 at the end of the file.
Word text_word_anywhere(Text *text);

// True if a word is `name`, in either case.
bool word_is(Word word, const char *name);
// Reads a whole word as a number, nan and inf included; returns false for anything else.
bool word_number(Word word, double *value);

// A word for an error text: printable, at most 30 characters.
typedef struct Shown {
    char text[40];
} Shown;
Shown word_show(Word word);

// --- binary numbers ------------------------------------------------------------------------------

typedef struct NumberType {
    const char *name;
    int size; // [bytes]
    bool real, sign;
} NumberType;

double number_decode(const char *at, NumberType type, bool big_endian);

// --- cells ---------------------------------------------------------------------------------------

// UNKNOWN: cells that cannot be left out, so that cells_finish refuses them. SKIPPED: points and
// lines.
typedef enum CellShape {
    CELL_UNKNOWN,
    CELL_SKIPPED,
    CELL_POLYGON,
    CELL_STRIP,
    CELL_TRIANGLE,
    CELL_QUAD,
    CELL_PIXEL,
    CELL_TETRAHEDRON,
    CELL_VOXEL,
    CELL_HEXAHEDRON,
    CELL_WEDGE,
    CELL_PYRAMID,
    CELL_SHAPES
} CellShape;

typedef struct CellKind {
    CellShape shape;
    bool curved; // more nodes than corners, behind them
} CellKind;

// Cells of a file, as a reader adds them. Initialize with the draft, which cells_finish completes.
typedef struct MeshCells {
    MeshDraft *draft; // nodes, and faces that the file gives
    MeshDraft faces;  // of solid cells
    int *corner;      // [count] nodes of the cell that is being read
    int count, capacity;
    int solid, curved, unknown; // cells
    int beside;                 // faces beside solid cells, which are not taken
    bool ras, lps;              // the frame that the file's data state
    struct NodeTag *tag;        // [tag_count] of nodes, by which cells name them
    int tag_count, tag_capacity;
    bool tags_sorted;
} MeshCells;

// Gives the next node that has none a tag, an integer below 1e15, by which cells_find_node finds
// it; -1 if there is none.
void cells_tag_node(MeshCells *cells, double tag);
int cells_find_node(MeshCells *cells, double tag);
void cells_corner(MeshCells *cells, int node);
// Ends a cell of the corners since the last one; false if they are too few.
bool cells_end_cell(MeshCells *cells, CellKind kind, int line);
// Leaves in the draft the border of the solid cells, the faces that belong to one of them, if there
// is any; else the faces. Fails without either.
bool cells_finish(MeshCells *cells, const char *path, Status *status);
void cells_destroy(MeshCells *cells);

#define MESH_FORMATS                                                                               \
    "expected a mesh (OBJ, STL, PLY, OFF, VTK, MSH) or labels (NRRD, NIfTI); assimp export FILE "  \
    "NEW.stl converts many others"
// Where a file has points but no faces.
#define MESH_OF_POINTS                                                                             \
    "has points but no faces, so it is no surface; MeshLab makes one of a cloud of points "        \
    "(Screened Poisson)"

// --- formats -------------------------------------------------------------------------------------

// Wavefront OBJ: adds the v, vt and f lines to a draft, or fails with file and line. Refuses faces
// with missing vertices; ignores references to missing texture coordinates.
bool obj_read(const FileBytes *file, MeshDraft *draft, Status *status);

// Object File Format (Geomview's OFF), ASCII.
// True if the text begins with OFF, COFF, NOFF, CNOFF or STOFF, or with a variant that off_read
// refuses by name.
bool off_is(const FileBytes *file);
// Adds vertices and faces to a draft, or fails naming file and line.
bool off_read(const FileBytes *file, MeshDraft *draft, Status *status);

// Writes a mesh as OFF text; every number reads back as the same value. `remark`: a line of
// comment,
// "# units: m\n", or "".
void off_write(const TriMesh *mesh, const char *remark, FILE *out);

// Stanford PLY: ASCII, binary little and big endian.
// True if the file begins as a PLY file does.
bool ply_is(const FileBytes *file);
// Adds the elements vertex and face to a draft, or fails with file and line or element. Sets
// `format` to "ASCII PLY" and the like.
bool ply_read(const FileBytes *file, MeshDraft *draft, const char **format, Status *status);

// Readers of cells, of which each knows its files by their beginning, adds their points and cells,
// and sets `format` to "ASCII VTK" and the like.
// Legacy VTK with DATASET POLYDATA or UNSTRUCTURED_GRID: ASCII and binary.
bool vtk_is(const FileBytes *file);
bool vtk_read(const FileBytes *file, MeshCells *cells, const char **format, Status *status);
// The kind of a cell by the number that VTK has for it.
CellKind vtk_kind(double type);
// VTK's XML: VTP and VTU.
bool vtk_xml_is(const FileBytes *file);
bool vtk_xml_read(const FileBytes *file, MeshCells *cells, const char **format, Status *status);
// Gmsh's MSH: ASCII and binary.
bool msh_is(const FileBytes *file);
bool msh_read(const FileBytes *file, MeshCells *cells, const char **format, Status *status);
// TetGen's .node with .ele or .face: known by name; reads the other file of the pair, too.
bool tetgen_is(const FileBytes *file);
bool tetgen_read(const FileBytes *file, MeshCells *cells, const char **format, Status *status);

// STL, ASCII and binary.
// Each adds triangles to a draft, three nodes per triangle, or fails with file and line.
bool stl_read_ascii(const FileBytes *file, MeshDraft *draft, Status *status);
// Reads the first `count` triangles of a file of at least stl_binary_size(count) bytes.
bool stl_read_binary(const FileBytes *file, size_t count, MeshDraft *draft, Status *status);

// Return the number of triangles that a binary STL announces (0 if the file is shorter than a
// header), the number of whole ones that follow the header, and the file size [bytes] of so many.
size_t stl_binary_count(const FileBytes *file);
size_t stl_binary_held(const FileBytes *file);
size_t stl_binary_size(size_t triangles);
// True if most of the first records from `first` on, below stl_binary_held, are triangles with the
// normals that writers give them: what tells an STL of another size than its count from other
// files.
bool stl_binary_likely(const FileBytes *file, size_t first);

#endif
