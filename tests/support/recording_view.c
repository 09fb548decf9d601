// SPDX-License-Identifier: MIT
#include "recording_view.h"
#include "scoped.h"

#include <stdlib.h>
#include <string.h>

// --- the HDF5 file -------------------------------------------------------------------------------

hid_t view_open(const char *path, bool while_written)
{
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return H5Fopen(path, H5F_ACC_RDONLY | (while_written ? H5F_ACC_SWMR_READ : 0), H5P_DEFAULT);
}

hid_t view_change(const char *path)
{
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    if (file < 0)
        fail_msg("%s cannot be opened", path);
    return file;
}

void view_put_row(const char *path, const char *name, hid_t type, int row, int columns,
                  const void *numbers)
{
    hid_t file = view_change(path);
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT), space = H5Dget_space(set);
    const hsize_t first[2] = {(hsize_t)row, 0}, one[2] = {1, (hsize_t)columns};
    hid_t memory = H5Screate_simple(columns > 0 ? 2 : 1, one, NULL);
    H5Sselect_hyperslab(space, H5S_SELECT_SET, first, NULL, one, NULL);
    assert_true(H5Dwrite(set, type, memory, space, H5P_DEFAULT, numbers) >= 0);
    H5Sclose(memory);
    H5Sclose(space);
    H5Dclose(set);
    H5Fclose(file);
}

void *view_rows(hid_t file, const char *name, hid_t type, int *rows)
{
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    if (set < 0)
        fail_msg("no data set %s", name);
    hid_t space = H5Dget_space(set);
    hsize_t size[2] = {0, 1};
    int rank = H5Sget_simple_extent_dims(space, size, NULL);
    assert_in_range(rank, 1, 2);
    size_t bytes = (size_t)(size[0] * size[1]) * H5Tget_size(type);
    void *data = malloc(bytes + 1);
    if (size[0] > 0)
        assert_true(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
    H5Sclose(space);
    H5Dclose(set);
    *rows = (int)size[0];
    return data;
}

static void *column(hid_t file, const char *body, const char *name, hid_t type, int *shortest)
{
    char path[128];
    int rows;
    snprintf(path, sizeof path, "/bodies/%s/%s", body, name);
    void *data = view_rows(file, path, type, &rows);
    if (rows < *shortest)
        *shortest = rows;
    return data;
}

static void check_body(const BodyView *view)
{
    for (int i = 0; i < view->topologies; i++) {
        assert_in_range(view->first_triangle[i] + view->triangle_count[i], 1, view->triangles);
        assert_in_range(view->first_node[i] + view->node_count[i], 1, view->nodes);
        for (int t = 0; t < view->triangle_count[i]; t++)
            for (int k = 0; k < 3; k++)
                assert_in_range(view->triangle[view->first_triangle[i] + t][k], 0,
                                view->node_count[i] - 1);
    }
    for (int i = 0; i < view->frames; i++) {
        assert_in_range(view->first[i] + view->count[i], 1, view->rows);
        int at = 0;
        while (at < view->topologies && view->number[at] != view->topology[i])
            at++;
        assert_in_range(at, 0, view->topologies - 1);
        assert_int_equal(view->count[i], view->node_count[at]);
        if (i > 0)
            assert_true(view->step[i] > view->step[i - 1] && view->time[i] > view->time[i - 1]);
    }
}

static bool is_topology_whole(const BodyView *view, int i)
{
    return view->first_triangle[i] + view->triangle_count[i] <= view->triangles &&
           view->first_node[i] + view->node_count[i] <= view->nodes;
}

static bool has_topology(const BodyView *view, int number)
{
    for (int i = 0; i < view->topologies; i++)
        if (view->number[i] == number)
            return true;
    return false;
}

// Columns reach the disk one by one: what a writer was adding when it was killed, or is adding now,
// may have some of its rows and not others, and does not count yet.
static void leave_out_what_is_being_added(BodyView *view)
{
    while (view->topologies > 0 && !is_topology_whole(view, view->topologies - 1))
        view->topologies--;
    for (int last = view->frames - 1;
         last >= 0 && (view->first[last] + view->count[last] > view->rows ||
                       !has_topology(view, view->topology[last]));
         last--)
        view->frames--;
}

void view_body(BodyView *view, hid_t file, const char *body)
{
    const hid_t integer = H5T_NATIVE_INT32, wide = H5T_NATIVE_INT64;
    *view = (BodyView){.frames = INT32_MAX,
                       .rows = INT32_MAX,
                       .topologies = INT32_MAX,
                       .triangles = INT32_MAX,
                       .nodes = INT32_MAX};
    int *frames = &view->frames, *topologies = &view->topologies;
    view->time = column(file, body, "frames/time", H5T_NATIVE_DOUBLE, frames);
    view->step = column(file, body, "frames/step", wide, frames);
    view->topology = column(file, body, "frames/topology", integer, frames);
    view->first = column(file, body, "frames/first", wide, frames);
    view->count = column(file, body, "frames/count", integer, frames);
    view->position = column(file, body, "position", H5T_NATIVE_FLOAT, &view->rows);
    view->number = column(file, body, "topology/number", integer, topologies);
    view->first_triangle = column(file, body, "topology/first", wide, topologies);
    view->triangle_count = column(file, body, "topology/count", integer, topologies);
    view->first_node = column(file, body, "topology/node_first", wide, topologies);
    view->node_count = column(file, body, "topology/node_count", integer, topologies);
    view->triangle = column(file, body, "triangles", integer, &view->triangles);
    view->node_id = column(file, body, "node_id", integer, &view->nodes);
    leave_out_what_is_being_added(view);
    check_body(view);
}

void view_free(BodyView *view)
{
    void *arrays[] = {view->time,           view->step,       view->first,    view->topology,
                      view->count,          view->position,   view->number,   view->triangle_count,
                      view->first_triangle, view->first_node, view->triangle, view->node_count,
                      view->node_id};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        free(arrays[i]);
}

void expect_attribute(hid_t object, const char *name, const char *expected)
{
    const hid_t attribute = H5Aopen(object, name, H5P_DEFAULT);
    assert_true(attribute >= 0);
    const hid_t type = H5Aget_type(attribute);
    assert_int_equal(H5Tget_class(type), H5T_STRING);
    const bool varies = H5Tis_variable_str(type) > 0;
    char *text = varies ? NULL : zeroed(H5Tget_size(type) + 1, 1);
    assert_true(H5Aread(attribute, type, varies ? (void *)&text : text) >= 0);
    assert_string_equal(text, expected);
    if (varies)
        H5free_memory(text);
    else
        free(text);
    H5Tclose(type);
    H5Aclose(attribute);
}

void expect_number(hid_t object, const char *name, int expected)
{
    int number = expected - 1;
    const hid_t attribute = H5Aopen(object, name, H5P_DEFAULT);
    assert_true(H5Aread(attribute, H5T_NATIVE_INT, &number) >= 0);
    assert_int_equal(number, expected);
    H5Aclose(attribute);
}

void view_get(hid_t file, const char *name, hid_t type, void *numbers)
{
    const hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    assert_true(set >= 0);
    assert_true(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers) >= 0);
    H5Dclose(set);
}

void view_put(hid_t file, const char *name, hid_t type, const void *numbers)
{
    const hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    assert_true(set >= 0);
    assert_true(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers) >= 0);
    H5Dclose(set);
}

void view_alter(const char *path, const char *name, long at, unsigned char bits)
{
    const hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    assert_true(file >= 0);
    const hid_t set = H5Dopen2(file, name, H5P_DEFAULT), type = H5Dget_type(set);
    const size_t size = (size_t)H5Dget_storage_size(set);
    FREED unsigned char *data = malloc(size);
    view_get(file, name, type, data);
    data[at < 0 ? size / 2 : (size_t)at] ^= bits;
    view_put(file, name, type, data);
    H5Tclose(type);
    H5Dclose(set);
    H5Fclose(file);
}

void view_close(hid_t *file)
{
    H5Fclose(*file);
}

void view_read(BodyView *view, const char *path, const char *body)
{
    const hid_t file = view_open(path, false);
    if (file < 0)
        fail_msg("%s cannot be opened", path);
    view_body(view, file, body);
    H5Fclose(file);
}

// --- XML -----------------------------------------------------------------------------------------

enum { DEPTH = 16, NAME = 32, TEXT = 256 };

typedef struct Element {
    char name[NAME], attributes[TEXT], text[TEXT];
} Element;

typedef struct Parser {
    const char *at;
    Element open[DEPTH]; // from the root to where we are
    int depth;
    void (*ended)(void *user, const Element *open, int depth); // open[depth - 1] is complete
    void *user;
} Parser;

// Appends what is between two places, entities replaced.
static void take_text(const char *from, const char *to, char text[TEXT])
{
    static const char *const entities[][2] = {
        {"&amp;", "&"}, {"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}};
    size_t length = strlen(text);
    while (from < to) {
        size_t step = 1;
        char c = *from;
        if (c == '&') {
            size_t i = 0;
            while (i < 4 && strncmp(from, entities[i][0], strlen(entities[i][0])) != 0)
                i++;
            assert_in_range(i, 0, 3);
            c = entities[i][1][0];
            step = strlen(entities[i][0]);
        }
        assert_true(length + 1 < TEXT);
        text[length++] = c;
        text[length] = '\0';
        from += step;
    }
}

static void open_element(Parser *parser, const char *from, const char *to)
{
    assert_true(parser->depth < DEPTH);
    Element *element = &parser->open[parser->depth++];
    memset(element, 0, sizeof *element);
    size_t length = strcspn(from, " />");
    assert_in_range(length, 1, NAME - 1);
    memcpy(element->name, from, length);
    assert_true((size_t)(to - from) - length < TEXT);
    memcpy(element->attributes, from + length, (size_t)(to - from) - length);
}

static void close_element(Parser *parser)
{
    parser->ended(parser->user, parser->open, parser->depth);
    parser->depth--;
}

// One tag; the parser stands on its '<'.
static void take_tag(Parser *parser)
{
    const char *from = parser->at + 1, *to = strchr(from, '>');
    assert_non_null(to);
    parser->at = to + 1;
    if (*from == '?' || *from == '!')
        return;
    if (*from == '/') {
        const char *name = parser->depth > 0 ? parser->open[parser->depth - 1].name : "";
        assert_int_equal(strlen(name), to - from - 1);
        assert_memory_equal(name, from + 1, strlen(name));
        close_element(parser);
    } else if (to[-1] == '/') {
        open_element(parser, from, to - 1);
        close_element(parser);
    } else {
        open_element(parser, from, to);
    }
}

static void parse(const char *text, void (*ended)(void *, const Element *, int), void *user)
{
    Parser parser = {.at = text, .ended = ended, .user = user};
    while (*parser.at != '\0') {
        const char *tag = parser.at + strcspn(parser.at, "<");
        bool blank = parser.at + strspn(parser.at, " \n") >= tag;
        assert_true(blank || parser.depth > 0);
        if (!blank)
            take_text(parser.at, tag, parser.open[parser.depth - 1].text);
        parser.at = tag;
        if (*tag == '<')
            take_tag(&parser);
    }
    assert_int_equal(parser.depth, 0);
}

// The value of an attribute, "" if it is not there.
static const char *attribute(const Element *element, const char *name)
{
    static char value[4][TEXT];
    static int next;
    char key[64];
    snprintf(key, sizeof key, " %s=\"", name);
    char *out = value[next++ % 4];
    out[0] = '\0';
    const char *at = strstr(element->attributes, key);
    if (at != NULL) {
        at += strlen(key);
        const char *end = strchr(at, '"');
        assert_non_null(end);
        take_text(at, end, out);
    }
    return out;
}

// --- the sidecar ---------------------------------------------------------------------------------

typedef struct Sidecar {
    SidecarFrame *frame;
    int count, capacity;
    SidecarFrame next;
    SidecarRows rows;
} Sidecar;

static bool is(const Element *element, const char *name)
{
    return strcmp(element->name, name) == 0;
}

// The selection of a hyperslab, or the data set that it selects from.
static void take_item(Sidecar *sidecar, const Element *item)
{
    SidecarRows *rows = &sidecar->rows;
    long first, other, stride, stride_other, count, columns;
    if (strcmp(attribute(item, "Format"), "HDF") == 0) {
        const char *colon = strchr(item->text, ':');
        assert_non_null(colon);
        snprintf(rows->file, sizeof rows->file, "%.*s", (int)(colon - item->text), item->text);
        snprintf(rows->set, sizeof rows->set, "%s", colon + 1);
        int dimensions = sscanf(attribute(item, "Dimensions"), "%ld %d", &rows->of, &rows->columns);
        assert_in_range(dimensions, 1, 2);
        rows->columns = dimensions == 2 ? rows->columns : 0;
        const bool byte = strcmp(attribute(item, "NumberType"), "UChar") == 0;
        assert_string_equal(attribute(item, "Precision"), byte ? "1" : "4");
        return;
    }
    assert_string_equal(attribute(item, "Format"), "XML");
    if (strcmp(attribute(item, "Dimensions"), "3 2") == 0) {
        assert_int_equal(sscanf(item->text, "%ld %ld %ld %ld %ld %ld", &first, &other, &stride,
                                &stride_other, &count, &columns),
                         6);
        assert_true(other == 0 && stride_other == 1 && columns == 3);
    } else {
        assert_string_equal(attribute(item, "Dimensions"), "3 1");
        assert_int_equal(sscanf(item->text, "%ld %ld %ld", &first, &stride, &count), 3);
    }
    assert_int_equal(stride, 1);
    rows->first = first;
    rows->rows = count;
}

static void push_frame(Sidecar *sidecar)
{
    if (sidecar->count == sidecar->capacity) {
        sidecar->capacity = 2 * sidecar->capacity + 64;
        sidecar->frame =
            realloc(sidecar->frame, (size_t)sidecar->capacity * sizeof *sidecar->frame);
        assert_non_null(sidecar->frame);
    }
    sidecar->frame[sidecar->count++] = sidecar->next;
    sidecar->next = (SidecarFrame){0};
}

static void on_ended(void *user, const Element *open, int depth)
{
    Sidecar *sidecar = user;
    const Element *element = &open[depth - 1], *parent = depth > 1 ? element - 1 : element;
    if (is(element, "Xdmf")) {
        assert_string_equal(attribute(element, "Version"), "2.0");
    } else if (is(element, "DataItem") && is(parent, "DataItem")) {
        take_item(sidecar, element);
    } else if (is(element, "DataItem")) {
        assert_string_equal(attribute(element, "ItemType"), "HyperSlab");
        SidecarRows *to = is(parent, "Topology")   ? &sidecar->next.triangles
                          : is(parent, "Geometry") ? &sidecar->next.position
                          : strcmp(attribute(parent, "Name"), "error") == 0 ? &sidecar->next.error
                          : strcmp(attribute(parent, "Name"), "element_level") == 0
                              ? &sidecar->next.level
                              : &sidecar->next.node_id;
        assert_int_equal(strtol(attribute(element, "Dimensions"), NULL, 10), sidecar->rows.rows);
        *to = sidecar->rows;
    } else if (is(element, "Topology")) {
        assert_string_equal(attribute(element, "TopologyType"), "Triangle");
        assert_int_equal(strtol(attribute(element, "NumberOfElements"), NULL, 10),
                         sidecar->rows.rows);
    } else if (is(element, "Geometry")) {
        assert_string_equal(attribute(element, "GeometryType"), "XYZ");
    } else if (is(element, "Time")) {
        sidecar->next.time = strtod(attribute(element, "Value"), NULL);
    } else if (is(element, "Grid") && is(parent, "Grid")) {
        assert_string_equal(attribute(parent, "CollectionType"), "Temporal");
        snprintf(sidecar->next.collection, sizeof sidecar->next.collection, "%s",
                 attribute(parent, "Name"));
        push_frame(sidecar);
    }
}

SidecarFrame *view_sidecar(const char *path, int *count)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        fail_msg("no sidecar %s", path);
    fseek(file, 0, SEEK_END);
    size_t size = (size_t)ftell(file);
    rewind(file);
    FREED char *text = malloc(size + 1);
    assert_int_equal(fread(text, 1, size, file), size);
    text[size] = '\0';
    fclose(file);
    Sidecar sidecar = {0};
    parse(text, on_ended, &sidecar);
    *count = sidecar.count;
    return sidecar.frame;
}

void expect_sidecar_matches(const SidecarFrame *frame, int count, const BodyView *view,
                            const char *body)
{
    char set[128];
    int index = 0;
    for (int i = 0; i < count; i++) {
        if (strcmp(frame[i].collection, body) != 0)
            continue;
        const SidecarFrame *f = &frame[i];
        assert_in_range(index, 0, view->frames - 1);
        // Frames that are left out are the one before again. Times have nine digits.
        while (view->time[index] < f->time - 1e-8 * (1.0 + f->time)) {
            assert_in_range(index, 1, view->frames - 2);
            assert_int_equal(view->first[index], view->first[index - 1]);
            assert_int_equal(view->topology[index], view->topology[index - 1]);
            index++;
        }
        expect_near(f->time, view->time[index], 1e-8 * (1.0 + view->time[index]));
        assert_int_equal(f->position.first, view->first[index]);
        assert_int_equal(f->position.rows, view->count[index]);
        int at = 0;
        while (view->number[at] != view->topology[index])
            at++;
        assert_int_equal(f->triangles.first, view->first_triangle[at]);
        assert_int_equal(f->triangles.rows, view->triangle_count[at]);
        assert_int_equal(f->node_id.first, view->first_node[at]);
        assert_int_equal(f->node_id.rows, view->node_count[at]);
        assert_in_range(f->position.of, f->position.first + f->position.rows, view->rows);
        snprintf(set, sizeof set, "/bodies/%s/position", body);
        assert_string_equal(f->position.set, set);
        snprintf(set, sizeof set, "/bodies/%s/triangles", body);
        assert_string_equal(f->triangles.set, set);
        snprintf(set, sizeof set, "/bodies/%s/node_id", body);
        assert_string_equal(f->node_id.set, set);
        index++;
    }
}

SidecarFrame *view_sidecar_of(const char *recording, int *count)
{
    char path[1100];
    snprintf(path, sizeof path, "%s.xdmf", recording);
    return view_sidecar(path, count);
}
