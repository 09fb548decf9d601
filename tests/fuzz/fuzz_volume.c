// SPDX-License-Identifier: MIT
// A label volume of any format, as the group `voxels` of a scene names it. An input may be two
// files: what follows the mark is the file of voxels, which headers name "data", or of a NIfTI
// pair.
#include "fuzz.h"

#include "base/log.h"
#include "scene/build_parts.h"
#include "io/volume_import.h"
#include "io/volume_picture.h"

#include <unistd.h>

#define MARK "\n=data=\n"

enum { CELLS_MOST = 1 << 20 };

// The names tell a pair of NIfTI files; NRRD does not look at them.
static const char *write_files(const uint8_t *data, size_t size)
{
    const uint8_t *mark = memmem(data, size, MARK, strlen(MARK));
    size_t head = mark != NULL ? (size_t)(mark - data) : size;
    if (mark != NULL) {
        const uint8_t *rest = mark + strlen(MARK);
        fuzz_write("data", rest, size - head - strlen(MARK));
        fuzz_write("volume.img", rest, size - head - strlen(MARK));
    } else {
        unlink(fuzz_path("data"));
        unlink(fuzz_path("volume.img"));
    }
    return fuzz_write("volume.hdr", data, head);
}

// The labels that a file lists are those that its names lead to.
static void check_lists(const char *path)
{
    LabelVolume volume;
    VolumeLabels list;
    Status status = {0};
    if (!volume_survey(path, 0, &volume, &list, &status)) {
        fuzz_print(status.text);
        MUST(status.code == STATUS_INVALID && strchr(status.text, '\n') == NULL);
        return;
    }
    for (int i = 0; i < list.count; i++) {
        const VolumeLabel *label = &list.label[i];
        MUST(label->layer >= 1 && label->layer <= volume.layers && label->voxels >= 0);
        for (int a = 0; a < 3; a++)
            MUST(label->voxels == 0 || (label->low[a] >= 0 && label->low[a] < label->high[a] &&
                                        label->high[a] <= volume.count[a]));
    }
    for (int s = 0; s < volume.segment_count; s++) {
        int layer = volume.segment[s].layer;
        Status why = {0};
        const int found = volume_find_name(&volume, volume.segment[s].name, &layer, &why);
        MUST(found == 0 ? why.text[0] != '\0' : found > 0 && layer == volume.segment[s].layer);
    }
    volume_labels_destroy(&list);
    volume_destroy(&volume);
}

// The same file as an image around a body where it may be.
static void check_picture(const char *path)
{
    Lattice lattice;
    VolumePicture picture;
    Status status = {0};
    MUST(lattice_create(&lattice, (const int[3]){2, 2, 2}, 1e-3, &status));
    memset(lattice.label, 1, 8);
    const bool ok = volume_import_picture(path, &lattice, &(PicturePlace){.scale = 1.0}, 0.0, 0.0,
                                          &picture, &status);
    MUST(ok == (status.code == STATUS_OK) && ok == (picture.colour != NULL));
    MUST(ok || strchr(status.text, '\n') == NULL);
    for (int a = 0; a < 3 && ok; a++)
        MUST(picture.count[a] >= 1);
    volume_picture_destroy(&picture);
    lattice_destroy(&lattice);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    log_set_level(LOG_ERROR);
    if (size > 1 << 16)
        return 0;
    const char *path = write_files(data, size);
    check_picture(path);
    LabelVolume volume;
    Status status = {0};
    bool ok = volume_import(path, 1, &volume, &status);
    fuzz_print(ok ? "taken" : status.text);
    MUST(ok == (status.code == STATUS_OK));
    MUST(ok || (status.code == STATUS_INVALID && strchr(status.text, '\n') == NULL));
    double cells = 1.0;
    for (int a = 0; a < 3; a++)
        cells *= volume.count[a];
    if (ok) {
        int sum = 0; // every label is there
        for (size_t i = 0; i < (size_t)cells; i++)
            sum ^= volume.label[i];
        static volatile int seen;
        seen = sum;
        (void)seen;
    }
    volume_destroy(&volume);
    if (!ok || cells > CELLS_MOST)
        return 0;

    check_lists(path);
    VoxelSource source = {.kind = VOXELS_FILE, .file = (char *)path, .scale = 1.0};
    source.label_count = 2;
    source.label[0] = 1;
    source.label[1] = 2;
    Lattice lattice;
    if (body_voxels_make(&source, &lattice, &status)) {
        MUST(lattice_solid(&lattice) > 0);
        lattice_destroy(&lattice);
    } else {
        fuzz_print(status.text);
        MUST(status.code == STATUS_INVALID && status.text[0] != '\0');
    }
    return 0;
}
