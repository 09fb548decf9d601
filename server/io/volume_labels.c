// SPDX-License-Identifier: MIT
// Lists the labels of a volume: how much of it each has, where, and in how many pieces. Works on
// runs of equal voxels along the rows, of which label volumes have few. Load time only.
#include "io/volume_data.h"

#include "base/check.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    TABLE = 2 * VOLUME_MOST_LABELS, // slots of the hash table
    // An image with as many values is one of grey values where most voxels differ from the next:
    // 1.03 voxels in a row are alike in computed tomography (noise of 10 HU), 1.4 in an image of 8
    // bits with a noise of 1, 2 or more in the thinnest cortex of an atlas.
    GREY_VALUES = 32,
    MOST_RUNS = 1 << 22, // whose pieces are counted
    LABELS_SHOWN = 12,
};
static const double GREY_RUN = 1.5; // voxels

typedef struct Run {
    int from, end, at; // voxels, `end` not in it; index of its label
    int parent;        // a run of the same piece, in the end the first of them
} Run;

typedef struct Survey {
    const LabelVolume *volume;
    VolumeLabels *list;
    int slot[TABLE];    // index of a label + 1; 0: free
    double runs, solid; // of all labels: runs, voxels
    Run *run;           // of all rows; NULL: there are too many
    int run_count, run_capacity;
    int low[3], high[3]; // voxels that are looked at
    int *below, *here;   // where the runs of each row of two slices begin, with an end
} Survey;

// --- which label ---

static int *find_slot(Survey *survey, int label)
{
    // By the high bits, which depend on all of the label's.
    unsigned at = ((unsigned)label * 2654435761u >> 16) % TABLE;
    while (survey->slot[at] != 0 && survey->list->label[survey->slot[at] - 1].label != label)
        at = (at + 1) % TABLE;
    return &survey->slot[at];
}

// Returns the index of a label, which it adds if it is new; -1: there are too many.
static int index_of(Survey *survey, int label)
{
    VolumeLabels *list = survey->list;
    int *slot = find_slot(survey, label);
    if (*slot != 0)
        return *slot - 1;
    if (list->count == VOLUME_MOST_LABELS)
        return -1;
    // Capacities are powers of two.
    if ((list->count & (list->count - 1)) == 0) {
        const size_t capacity = list->count == 0 ? 1 : 2 * (size_t)list->count;
        list->label = realloc(list->label, capacity * sizeof *list->label);
        ASSERT(list->label != NULL);
    }
    const int *count = survey->volume->count;
    list->label[list->count] = (VolumeLabel){.label = label,
                                             .layer = survey->volume->layer,
                                             .colour = {-1.0F},
                                             .low = {count[0], count[1], count[2]}};
    *slot = ++list->count;
    return list->count - 1;
}

// --- pieces ---

static int root_of(Run *run, int r)
{
    // Each step halves the way.
    while (run[r].parent != r)
        r = run[r].parent = run[run[r].parent].parent;
    return r;
}

static void add_run(Survey *survey, Run run)
{
    if (survey->run_count == MOST_RUNS) {
        free(survey->run);
        survey->run = NULL;
    }
    if (survey->run == NULL)
        return;
    if (survey->run_count == survey->run_capacity) {
        survey->run_capacity *= 2;
        survey->run = realloc(survey->run, (size_t)survey->run_capacity * sizeof *survey->run);
        ASSERT(survey->run != NULL);
    }
    run.parent = survey->run_count;
    survey->run[survey->run_count++] = run;
}

// Joins the runs [a, a_end) of a row to those of a neighbouring row that begin at b.
static void join_rows(Survey *survey, int a, int a_end, int b, int b_end)
{
    Run *run = survey->run;
    while (a < a_end && b < b_end) {
        if (run[a].at == run[b].at && run[a].from < run[b].end && run[b].from < run[a].end) {
            const int one = root_of(run, a), other = root_of(run, b);
            run[one > other ? one : other].parent = one < other ? one : other;
            survey->list->label[run[a].at].pieces -= one != other;
        }
        if (run[a].end < run[b].end)
            a++;
        else
            b++;
    }
}

// --- rows ---

static bool add_row(Survey *survey, const int *row, int j, int k)
{
    const int first = survey->low[0], nx = survey->high[0] - first;
    for (int i = 0, end; i < nx; i = end) {
        for (end = i + 1; end < nx && row[end] == row[i];)
            end++;
        if (row[i] == 0)
            continue;
        const int at = index_of(survey, row[i]);
        if (at < 0)
            return false;
        VolumeLabel *label = &survey->list->label[at];
        const int low[3] = {first + i, j, k}, high[3] = {first + end, j + 1, k + 1};
        for (int a = 0; a < 3; a++) {
            label->low[a] = low[a] < label->low[a] ? low[a] : label->low[a];
            label->high[a] = high[a] > label->high[a] ? high[a] : label->high[a];
        }
        label->voxels += end - i;
        label->pieces++;
        survey->solid += end - i;
        survey->runs += 1.0;
        add_run(survey, (Run){.from = i, .end = end, .at = at});
    }
    return true;
}

// Adds a slice of the voxels that are looked at; false if there are too many labels.
static bool add_slice(Survey *survey, const int *label, int k)
{
    const int ny = survey->high[1] - survey->low[1];
    int *here = survey->here, *below = survey->below;
    for (int j = 0; j < ny; j++) {
        const int from = here[j] = survey->run_count;
        if (!add_row(survey, label, survey->low[1] + j, k))
            return false;
        label += survey->high[0] - survey->low[0];
        if (survey->run == NULL)
            continue;
        if (j > 0)
            join_rows(survey, from, survey->run_count, here[j - 1], from);
        if (k > survey->low[2])
            join_rows(survey, from, survey->run_count, below[j], below[j + 1]);
    }
    here[ny] = survey->run_count;
    survey->below = here;
    survey->here = below;
    return true;
}

static int by_size(const void *a, const void *b)
{
    const VolumeLabel *one = a, *other = b;
    if (one->voxels != other->voxels)
        return one->voxels > other->voxels ? -1 : 1;
    if (one->layer != other->layer)
        return one->layer < other->layer ? -1 : 1;
    return one->label < other->label ? -1 : one->label > other->label;
}

// Sets names, and lists the segments of this layer that no voxel has.
static void add_names(Survey *survey)
{
    const LabelVolume *volume = survey->volume;
    for (int s = 0; s < volume->segment_count; s++) {
        const VolumeSegment *segment = &volume->segment[s];
        if (segment->layer != volume->layer || segment->label == 0)
            continue;
        const int at = index_of(survey, segment->label);
        if (at < 0)
            continue;
        VolumeLabel *label = &survey->list->label[at];
        memcpy(label->name, segment->name, sizeof label->name);
        memcpy(label->colour, segment->colour, sizeof label->colour);
    }
}

// Appends the labels of a layer to a list.
static void append(VolumeLabels *list, VolumeLabels *more)
{
    const size_t count = (size_t)list->count + (size_t)more->count;
    list->label = realloc(list->label, (count + 1) * sizeof *list->label);
    ASSERT(list->label != NULL);
    for (int i = 0; i < more->count; i++)
        list->label[list->count++] = more->label[i];
    volume_labels_destroy(more);
}

void volume_labels_destroy(VolumeLabels *list)
{
    free(list->label);
    *list = (VolumeLabels){0};
}

// Begins to look at voxels [low, high) of a volume whose header is known.
static Survey *begin(const LabelVolume *volume, const int low[3], const int high[3],
                     VolumeLabels *list)
{
    Survey *survey = calloc(1, sizeof *survey);
    ASSERT(survey != NULL);
    *list = (VolumeLabels){0};
    survey->volume = volume;
    survey->list = list;
    survey->run_capacity = 1024;
    memcpy(survey->low, low, sizeof survey->low);
    memcpy(survey->high, high, sizeof survey->high);
    const size_t rows = (size_t)(high[1] - low[1]) + 1;
    survey->run = malloc((size_t)survey->run_capacity * sizeof *survey->run);
    survey->below = calloc(rows, sizeof *survey->below);
    survey->here = calloc(rows, sizeof *survey->here);
    ASSERT(survey->run != NULL && survey->below != NULL && survey->here != NULL);
    return survey;
}

// Sorts the list, and frees the survey.
static void end(Survey *survey)
{
    VolumeLabels *list = survey->list;
    add_names(survey);
    for (int i = 0; i < list->count && survey->run == NULL; i++)
        list->label[i].pieces = 0;
    if (list->count > 0)
        qsort(list->label, (size_t)list->count, sizeof *list->label, by_size);
    free(survey->run);
    free(survey->below);
    free(survey->here);
    free(survey);
}

// Judges whether these are labels; `few`: not too many different ones.
static bool check_labels(const Survey *survey, bool few, Status *status)
{
    const int count = survey->list->count;
    return (few && (count < GREY_VALUES || survey->solid >= GREY_RUN * survey->runs)) ||
           status_fail(status, STATUS_INVALID,
                       "is an image of grey values, not of labels: %s%d different ones, of which "
                       "%.3g in a row are alike; segment it first, for example in 3D Slicer",
                       few ? "" : "more than ", count, survey->solid / survey->runs);
}

// Adds all voxels that were read.
static bool add_all(Survey *survey)
{
    const LabelVolume *volume = survey->volume;
    const int *low = volume->low, *high = volume->high;
    const size_t area = (size_t)(high[0] - low[0]) * (size_t)(high[1] - low[1]);
    for (int k = low[2]; k < high[2]; k++)
        if (!add_slice(survey, volume->label + (size_t)(k - low[2]) * area, k))
            return false;
    return true;
}

bool volume_list(const LabelVolume *volume, VolumeLabels *list)
{
    Survey *survey = begin(volume, volume->low, volume->high, list);
    bool ok = add_all(survey);
    end(survey);
    return ok;
}

bool volume_labels(const LabelVolume *volume, VolumeLabels *list, Status *status)
{
    Survey *survey = begin(volume, volume->low, volume->high, list);
    bool ok = check_labels(survey, add_all(survey), status);
    end(survey);
    if (!ok)
        volume_labels_destroy(list);
    return ok;
}

// --- some of them ---

static bool fail_missing(const VolumeLabels *list, int missing, Status *status)
{
    char text[400] = "";
    int length = 0, shown = 0;
    // List what there is, so that the user sees what was meant.
    for (int last = INT_MIN; shown < LABELS_SHOWN; shown++) {
        const VolumeLabel *next = NULL;
        for (int i = 0; i < list->count; i++)
            if (list->label[i].voxels > 0 && list->label[i].label > last &&
                (next == NULL || list->label[i].label < next->label))
                next = &list->label[i];
        if (next == NULL)
            break;
        length += snprintf(text + length, sizeof text - (size_t)length, "%s%d",
                           shown > 0 ? ", " : "", last = next->label);
    }
    if (shown == 0)
        return status_fail(status, STATUS_INVALID,
                           "no voxel has the label %d; all have the label 0", missing);
    return status_fail(status, STATUS_INVALID,
                       "no voxel has the label %d; the labels there are %s%s", missing, text,
                       list->count > shown ? " and more" : "");
}

bool volume_find_box(const VolumeLabels *list, const int *label, int label_count, int low[3],
                     int high[3], Status *status)
{
    for (int a = 0; a < 3; a++) {
        low[a] = INT_MAX;
        high[a] = 0;
    }
    for (int m = 0; m < label_count; m++) {
        int at = 0;
        while (at < list->count && list->label[at].label != label[m])
            at++;
        // A label that no voxel has is a mistake of the scene.
        if (at == list->count || list->label[at].voxels == 0)
            return fail_missing(list, label[m], status);
        const VolumeLabel *one = &list->label[at];
        for (int a = 0; a < 3; a++) {
            low[a] = one->low[a] < low[a] ? one->low[a] : low[a];
            high[a] = one->high[a] > high[a] ? one->high[a] : high[a];
        }
    }
    return true;
}

// --- names ---

// Writes the names of a file, as many as fit.
static void list_names(const LabelVolume *volume, char *text, size_t size)
{
    size_t used = 0;
    text[0] = 0;
    for (int s = 0; s < volume->segment_count && used < size; s++)
        if (volume->segment[s].name[0] != 0)
            used += (size_t)snprintf(text + used, size - used, "%s%s", used > 0 ? ", " : "",
                                     volume->segment[s].name);
}

int volume_find_name(const LabelVolume *volume, const char *name, int *layer, Status *status)
{
    const VolumeSegment *found = NULL;
    char names[256];
    for (int s = 0; s < volume->segment_count; s++) {
        const VolumeSegment *segment = &volume->segment[s];
        if (strcmp(segment->name, name) != 0 || (*layer != 0 && segment->layer != *layer))
            continue;
        if (found != NULL && (found->label != segment->label || found->layer != segment->layer)) {
            status_fail(status, STATUS_INVALID,
                        "'%s' is the name of label %d of layer %d and of label %d of layer %d",
                        name, found->label, found->layer, segment->label, segment->layer);
            return 0;
        }
        found = segment;
    }
    list_names(volume, names, sizeof names);
    if (found == NULL || found->label < 1) {
        status_fail(status, STATUS_INVALID, "no label%s has the name '%s'; the names are %s",
                    *layer != 0 ? " of that layer" : "", name, names[0] != 0 ? names : "none");
        return 0;
    }
    *layer = found->layer;
    return found->label;
}

// --- layers ---

// A layer that is looked at while it is read.
typedef struct Look {
    const char *path;
    LabelVolume *volume;
    VolumeLabels list;
    Survey *survey;
} Look;

static bool look_at_slice(void *user, int k, const int *label, Status *status)
{
    Look *look = user;
    if (k == 0)
        look->survey = begin(look->volume, (const int[3]){0}, look->volume->count, &look->list);
    const bool few = add_slice(look->survey, label, k);
    Status said = {0};
    return (few && k + 1 < look->volume->count[2]) || check_labels(look->survey, few, &said) ||
           status_fail(status, said.code, "%s: %s", look->path, said.text);
}

// Lists the labels of one layer.
static bool survey_layer(const char *path, int layer, LabelVolume *volume, VolumeLabels *list,
                         Status *status)
{
    Look look = {.path = path, .volume = volume};
    bool ok = volume_read(path, layer, volume, look_at_slice, &look, status);
    if (look.survey != NULL)
        end(look.survey);
    if (ok)
        append(list, &look.list);
    volume_labels_destroy(&look.list);
    return ok;
}

bool volume_survey(const char *path, int layer, LabelVolume *volume, VolumeLabels *list,
                   Status *status)
{
    *list = (VolumeLabels){0};
    if (!volume_import_header(path, volume, status))
        return false;
    const int layers = volume->layers;
    // Each layer is found by reading all of them.
    const double work =
        (double)volume->count[0] * volume->count[1] * volume->count[2] * layers * layers;
    bool ok = layer > 0 || (layers <= VOLUME_MOST_LAYERS && work <= 64.0 * VOLUME_MOST_VOXELS) ||
              status_fail(status, STATUS_INVALID,
                          "%s: has %d layers, more than are looked through, %d of a volume that is "
                          "not large: choose one (layer)",
                          path, layers, VOLUME_MOST_LAYERS);
    for (int l = layer > 0 ? layer : 1; ok && l <= (layer > 0 ? layer : layers); l++) {
        volume_destroy(volume);
        ok = survey_layer(path, l, volume, list, status);
    }
    if (list->count > 0)
        qsort(list->label, (size_t)list->count, sizeof *list->label, by_size);
    if (!ok) {
        volume_destroy(volume);
        volume_labels_destroy(list);
    }
    return ok;
}

bool volume_find_layer(const char *path, const int *label, int label_count, int *layer,
                       Status *status)
{
    LabelVolume volume;
    VolumeLabels list;
    long voxels[VOLUME_MOST_LAYERS + 1] = {0};
    *layer = 1;
    if (!volume_survey(path, 0, &volume, &list, status))
        return false;
    for (int i = 0; i < list.count; i++)
        for (int m = 0; m < label_count; m++)
            if (list.label[i].label == label[m])
                voxels[list.label[i].layer] += list.label[i].voxels;
    for (int l = 2; l <= volume.layers; l++)
        if (voxels[l] > voxels[*layer])
            *layer = l;
    volume_labels_destroy(&list);
    volume_destroy(&volume);
    return true;
}
