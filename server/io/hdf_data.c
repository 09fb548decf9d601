// SPDX-License-Identifier: MIT
// Data sets and attributes of HDF5 files. Called by the same threads as hdf.c.
#include "io/hdf.h"

#ifdef PLIANT_WITH_HDF5
#include "base/check.h"

#include <stdlib.h>
#include <string.h>

enum { ROW_LIMIT = 1 << 28, FIXED_TEXT = 256, OBJECT_TEXT = 256, ATTRIBUTE_TEXT = 64 };

// --- questions -----------------------------------------------------------------------------------

// All questions that we ask about a file, so that a child can answer them too.
typedef enum Asked { ASK_EXISTS, ASK_SHAPE, ASK_DATA, ASK_ATTRIBUTE } Asked;
typedef enum Stored { AS_INT, AS_LONG, AS_BYTE, AS_DOUBLE, AS_TEXT } Stored;

typedef struct Question {
    Asked asked;
    Stored type;  // of the numbers to be returned
    size_t bytes; // to be returned: a whole data set or attribute
    char object[OBJECT_TEXT], name[ATTRIBUTE_TEXT];
} Question;

// A data set before its data is read.
typedef struct DataSet {
    H5T_class_t class;
    size_t type_size; // bytes of a number in the file
    int rank;
    hsize_t size[2];
    hsize_t storage; // [bytes]
    bool contiguous; // in one piece, as we write it; for chunked data HDF5 would look up every
                     // chunk that a file claims
} DataSet;

typedef struct Answer {
    enum { FOUND, MISSING, OF_ANOTHER_KIND, UNREADABLE } result;
    DataSet data; // ASK_SHAPE
} Answer;

static hid_t native(Stored type)
{
    const hid_t types[] = {[AS_INT] = H5T_NATIVE_INT,
                           [AS_LONG] = H5T_NATIVE_INT64,
                           [AS_BYTE] = H5T_NATIVE_UINT8,
                           [AS_DOUBLE] = H5T_NATIVE_DOUBLE};
    return types[type];
}

static size_t size_of(Stored type)
{
    const size_t size[] = {[AS_INT] = sizeof(int),
                           [AS_LONG] = sizeof(int64_t),
                           [AS_BYTE] = 1,
                           [AS_DOUBLE] = sizeof(double)};
    return size[type];
}

static void look_at(hid_t set, DataSet *data)
{
    hid_t space = H5Dget_space(set), type = H5Dget_type(set), how = H5Dget_create_plist(set);
    *data = (DataSet){.class = H5Tget_class(type),
                      .type_size = H5Tget_size(type),
                      .rank = H5Sget_simple_extent_ndims(space),
                      .storage = H5Dget_storage_size(set),
                      .contiguous = H5Pget_layout(how) != H5D_CHUNKED};
    // Our data have two dimensions at most.
    if (data->rank >= 0 && data->rank <= 2)
        H5Sget_simple_extent_dims(space, data->size, NULL);
    H5Pclose(how);
    H5Tclose(type);
    H5Sclose(space);
}

// Reads a whole data set if it has the size of the buffer.
static bool read_set(hid_t set, const Question *question, void *to)
{
    hid_t space = H5Dget_space(set);
    hssize_t count = H5Sget_simple_extent_npoints(space);
    H5Sclose(space);
    const size_t wanted = question->bytes / size_of(question->type);
    return count >= 0 && (uint64_t)count == wanted &&
           (wanted == 0 ||
            H5Dread(set, native(question->type), H5S_ALL, H5S_ALL, H5P_DEFAULT, to) >= 0);
}

static void answer_attribute(hid_t file, const Question *question, Answer *answer, void *to)
{
    hid_t attribute =
        H5Aopen_by_name(file, question->object, question->name, H5P_DEFAULT, H5P_DEFAULT);
    if (attribute < 0) {
        answer->result = MISSING;
        return;
    }
    // Only one text or one integer is an attribute of ours.
    const bool text = question->type == AS_TEXT;
    hid_t space = H5Aget_space(attribute), type = H5Aget_type(attribute);
    answer->result = UNREADABLE;
    if (H5Sget_simple_extent_npoints(space) != 1 ||
        H5Tget_class(type) != (text ? H5T_STRING : H5T_INTEGER))
        answer->result = OF_ANOTHER_KIND;
    // Skip strings of variable length: HDF5 reads damaged ones without checks.
    else if (text ? H5Tis_variable_str(type) == 0 && H5Tget_size(type) < question->bytes &&
                        H5Aread(attribute, type, to) >= 0
                  : H5Aread(attribute, native(question->type), to) >= 0)
        answer->result = FOUND;
    H5Tclose(type);
    H5Sclose(space);
    H5Aclose(attribute);
}

// `to` has question->bytes bytes.
static void answer_here(hid_t file, const Question *question, Answer *answer, void *to)
{
    *answer = (Answer){.result = FOUND};
    // Each kind of question has its own way; none of them trusts the file.
    if (question->asked == ASK_EXISTS) {
        answer->result = H5Lexists(file, question->object, H5P_DEFAULT) > 0 ? FOUND : MISSING;
    } else if (question->asked == ASK_ATTRIBUTE) {
        answer_attribute(file, question, answer, to);
    } else {
        hid_t set = H5Dopen2(file, question->object, H5P_DEFAULT);
        if (set < 0)
            answer->result = MISSING;
        else if (question->asked == ASK_SHAPE)
            look_at(set, &answer->data);
        else if (!read_set(set, question, to))
            answer->result = UNREADABLE;
        if (set >= 0)
            H5Dclose(set);
    }
}

void hdf_serve(const HdfFile *file, int fd)
{
    Question question;
    while (hdf_child_receive(fd, &question, sizeof question)) {
        Answer answer;
        // Room for what is asked for, which the asker has checked.
        void *to = calloc(question.bytes + 1, 1);
        if (to == NULL)
            answer = (Answer){.result = UNREADABLE};
        else
            answer_here(file->id, &question, &answer, to);
        // The data follow only if there are any.
        if (!hdf_child_send(fd, &answer, sizeof answer) ||
            (answer.result == FOUND && !hdf_child_send(fd, to, question.bytes)))
            return;
        free(to);
    }
}

// Returns UNREADABLE with a status if the child is gone.
static Answer ask(const HdfFile *file, Question *question, const char *object, const char *name,
                  void *to)
{
    Answer answer = {.result = UNREADABLE};
    // The question as a block of fixed size.
    int object_length = snprintf(question->object, sizeof question->object, "%s", object);
    int name_length = snprintf(question->name, sizeof question->name, "%s", name);
    ASSERT(object_length < OBJECT_TEXT && name_length < ATTRIBUTE_TEXT);
    if (file->child == NULL) {
        answer_here(file->id, question, &answer, to);
        return answer;
    }
    // Of the child's answer the bytes follow.
    int fd = file->child->fd;
    if (fd >= 0 && hdf_child_send(fd, question, sizeof *question) &&
        hdf_child_receive(fd, &answer, sizeof answer) &&
        (answer.result != FOUND || hdf_child_receive(fd, to, question->bytes)))
        return answer;
    // It has crashed: say so once.
    hdf_child_failed(file->child, file->path, file->status);
    return (Answer){.result = UNREADABLE};
}

// --- reading -------------------------------------------------------------------------------------

bool hdf_exists(const HdfFile *file, const char *name)
{
    Question question = {.asked = ASK_EXISTS};
    return ask(file, &question, name, "", NULL).result == FOUND;
}

bool hdf_alive(const HdfFile *file)
{
    return file->child == NULL || file->child->fd >= 0;
}

static bool open_data(const HdfFile *file, const char *name, DataSet *data)
{
    Question question = {.asked = ASK_SHAPE};
    Answer answer = ask(file, &question, name, "", NULL);
    *data = answer.data;
    return answer.result == FOUND || hdf_fail(file, name, "is missing or no data set");
}

static bool read_data(const HdfFile *file, const char *name, Stored type, size_t count, void *to)
{
    Question question = {.asked = ASK_DATA, .type = type, .bytes = count * size_of(type)};
    return ask(file, &question, name, "", to).result == FOUND ||
           hdf_fail(file, name, "cannot be read: the file is damaged");
}

// True if the data set is [n][3] of reals.
static bool check_vectors(const HdfFile *file, const char *name, const DataSet *data)
{
    if (data->class != H5T_FLOAT)
        return hdf_fail(file, name, "must hold floating-point numbers");
    if (data->rank != 2 || data->size[1] != 3)
        return hdf_fail(file, name, "must have the shape [n][3]");
    if (data->size[0] > ROW_LIMIT)
        return hdf_fail(file, name, "has %llu rows, at most %d", (unsigned long long)data->size[0],
                        ROW_LIMIT);
    return true;
}

int64_t hdf_count_vectors(const HdfFile *file, const char *name)
{
    DataSet data;
    return open_data(file, name, &data) && check_vectors(file, name, &data) ? (int64_t)data.size[0]
                                                                            : -1;
}

bool hdf_read_vectors(const HdfFile *file, const char *name, int64_t count, Vec3 *to)
{
    DataSet data;
    if (!open_data(file, name, &data) || !check_vectors(file, name, &data))
        return false;
    // The caller knows how many there must be.
    if ((int64_t)data.size[0] != count)
        return hdf_fail(file, name, "has %llu rows and must have %lld",
                        (unsigned long long)data.size[0], (long long)count);
    if (!read_data(file, name, AS_DOUBLE, 3 * (size_t)count, to))
        return false;
    // No later code looks for numbers that are none.
    for (int64_t i = 0; i < count; i++)
        if (!vec3_finite(to[i]))
            return hdf_fail(file, name, "row %lld is not finite", (long long)i);
    return true;
}

// True if the data set is [n][columns] of integers stored uncompressed.
static bool check_ints(const HdfFile *file, const char *name, const DataSet *data, int columns)
{
    if (data->class != H5T_INTEGER)
        return hdf_fail(file, name, "must hold integer numbers");
    // One column may have either shape.
    bool flat = columns == 1 && data->rank == 1;
    if (!flat && (data->rank != 2 || data->size[1] != (hsize_t)columns))
        return hdf_fail(file, name,
                        columns == 1 ? "must have the shape [n]" : "must have the shape [n][%d]",
                        columns);
    if (data->size[0] > ROW_LIMIT)
        return hdf_fail(file, name, "has %llu rows, at most %d", (unsigned long long)data->size[0],
                        ROW_LIMIT);
    // Stored as it is, the file is as large as its data: sizes can be believed.
    return (data->contiguous &&
            data->storage == data->size[0] * (hsize_t)columns * data->type_size) ||
           hdf_fail(file, name, "is compressed or incomplete");
}

int64_t hdf_count_ints(const HdfFile *file, const char *name, int columns)
{
    DataSet data;
    return open_data(file, name, &data) && check_ints(file, name, &data, columns)
               ? (int64_t)data.size[0]
               : -1;
}

bool hdf_read_ints(const HdfFile *file, const char *name, int columns, int64_t rows, int *to)
{
    DataSet data;
    if (!open_data(file, name, &data) || !check_ints(file, name, &data, columns))
        return false;
    if ((int64_t)data.size[0] != rows)
        return hdf_fail(file, name, "has %llu rows and must have %lld",
                        (unsigned long long)data.size[0], (long long)rows);
    return read_data(file, name, AS_INT, (size_t)rows * (size_t)columns, to);
}

static bool stored_as(hid_t type, Stored *stored)
{
    for (int s = AS_INT; s < AS_TEXT; s++) {
        *stored = (Stored)s;
        if (H5Tequal(type, native(*stored)) > 0)
            return true;
    }
    return false;
}

bool hdf_read_numbers(const HdfFile *file, const char *name, hid_t type, size_t count, void *to)
{
    DataSet data;
    Stored stored;
    bool known = stored_as(type, &stored);
    ASSERT(known);
    if (!open_data(file, name, &data))
        return false;
    const bool real = stored == AS_DOUBLE;
    // The type and shape that the caller needs, nothing near it.
    if (data.class != (real ? H5T_FLOAT : H5T_INTEGER))
        return hdf_fail(file, name, "must hold %s numbers", real ? "floating-point" : "integer");
    if (count == 0 && data.rank != 0)
        return hdf_fail(file, name, "must be a single number");
    if (count > 0 && (data.rank != 1 || data.size[0] != count))
        return hdf_fail(file, name, "must have the shape [%zu]", count);
    return read_data(file, name, stored, count > 0 ? count : 1, to);
}

bool hdf_read_bytes(const HdfFile *file, const char *name, size_t bytes, void *to)
{
    DataSet data;
    if (!open_data(file, name, &data))
        return false;
    // Bytes, and just as many as the caller has room for.
    if (data.class != H5T_INTEGER || data.type_size != 1 || data.rank != 1)
        return hdf_fail(file, name, "must be bytes in one dimension");
    if (data.size[0] != bytes)
        return hdf_fail(file, name, "has %llu bytes and must have %zu",
                        (unsigned long long)data.size[0], bytes);
    return bytes == 0 || read_data(file, name, AS_BYTE, bytes, to);
}

// `what`: "string" or "integer".
static bool check_attribute(const HdfFile *file, const char *object, const char *name,
                            const Answer *answer, const char *what, const char *unreadable)
{
    switch (answer->result) {
    case FOUND:
        return true;
    case MISSING:
        return hdf_fail(file, object, "has no attribute %s", name);
    case OF_ANOTHER_KIND:
        return hdf_fail(file, object, "attribute %s must be one %s", name, what);
    default:
        return hdf_fail(file, object, "attribute %s %s", name, unreadable);
    }
}

static bool read_integer(const HdfFile *file, const char *object, const char *name, Stored type,
                         void *value)
{
    Question question = {.asked = ASK_ATTRIBUTE, .type = type, .bytes = size_of(type)};
    const Answer answer = ask(file, &question, object, name, value);
    return check_attribute(file, object, name, &answer, "integer", "cannot be read");
}

bool hdf_read_int(const HdfFile *file, const char *object, const char *name, int *value)
{
    return read_integer(file, object, name, AS_INT, value);
}

bool hdf_read_long(const HdfFile *file, const char *object, const char *name, int64_t *value)
{
    return read_integer(file, object, name, AS_LONG, value);
}

bool hdf_read_text(const HdfFile *file, const char *object, const char *name, char *text,
                   size_t size)
{
    Question question = {.asked = ASK_ATTRIBUTE, .type = AS_TEXT, .bytes = size};
    memset(text, 0, size);
    const Answer answer = ask(file, &question, object, name, text);
    text[size - 1] = '\0';
    return check_attribute(file, object, name, &answer, "string", "cannot be read or is too long");
}

// --- writing -----------------------------------------------------------------------------------

// Adds a string attribute to an open object.
static bool attach_text(hid_t object, const char *name, const char *text)
{
    // A string of fixed length in an attribute is limited to 64 kB, and a scene's text may be
    // longer.
    size_t size = strlen(text) + 1;
    bool fixed = size <= FIXED_TEXT;
    const void *data = fixed ? (const void *)text : &text;
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, fixed ? size : H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
    hid_t attribute = H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    bool ok = attribute >= 0 && H5Awrite(attribute, type, data) >= 0;
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
    return ok;
}

bool hdf_write(const HdfFile *file, const char *name, hid_t type, int rank, const hsize_t *size,
               const void *data, const char *unit)
{
    // Groups above it are made on the way.
    hid_t groups = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(groups, 1);
    hid_t space = rank == 0 ? H5Screate(H5S_SCALAR) : H5Screate_simple(rank, size, NULL);
    hid_t set = H5Dcreate2(file->id, name, type, space, groups, H5P_DEFAULT, H5P_DEFAULT);
    bool empty = H5Sget_simple_extent_npoints(space) == 0;
    // An empty data set has nothing to write.
    bool ok = set >= 0 &&
              (empty || H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0) &&
              attach_text(set, "unit", unit);
    H5Dclose(set);
    H5Sclose(space);
    H5Pclose(groups);
    return ok ||
           status_fail(file->status, STATUS_FAILED, "%s: %s cannot be written", file->path, name);
}

bool hdf_write_text(const HdfFile *file, const char *object, const char *name, const char *text)
{
    hid_t id = H5Oopen(file->id, object, H5P_DEFAULT);
    bool ok = id >= 0 && attach_text(id, name, text);
    H5Oclose(id);
    return ok || status_fail(file->status, STATUS_FAILED, "%s: %s attribute %s cannot be written",
                             file->path, object, name);
}

static bool write_integer(const HdfFile *file, const char *object, const char *name, hid_t stored,
                          hid_t type, const void *value)
{
    hid_t id = H5Oopen(file->id, object, H5P_DEFAULT), space = H5Screate(H5S_SCALAR);
    hid_t attribute = H5Acreate2(id, name, stored, space, H5P_DEFAULT, H5P_DEFAULT);
    bool ok = attribute >= 0 && H5Awrite(attribute, type, value) >= 0;
    H5Aclose(attribute);
    H5Sclose(space);
    H5Oclose(id);
    return ok || status_fail(file->status, STATUS_FAILED, "%s: %s attribute %s cannot be written",
                             file->path, object, name);
}

bool hdf_write_int(const HdfFile *file, const char *object, const char *name, int value)
{
    return write_integer(file, object, name, H5T_STD_I32LE, H5T_NATIVE_INT, &value);
}

bool hdf_write_long(const HdfFile *file, const char *object, const char *name, int64_t value)
{
    return write_integer(file, object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, &value);
}

bool hdf_set_long(const HdfFile *file, const char *object, const char *name, int64_t value)
{
    // HDF5 1.10 does not write to an object opened by H5Aopen_by_name.
    hid_t id = H5Oopen(file->id, object, H5P_DEFAULT);
    hid_t attribute = H5Aopen(id, name, H5P_DEFAULT);
    bool ok = attribute >= 0 && H5Awrite(attribute, H5T_NATIVE_INT64, &value) >= 0;
    H5Aclose(attribute);
    H5Oclose(id);
    return ok || status_fail(file->status, STATUS_FAILED, "%s: %s attribute %s cannot be written",
                             file->path, object, name);
}
#endif
