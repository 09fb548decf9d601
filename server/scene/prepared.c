// SPDX-License-Identifier: MIT
// Called at load time, and by pliant-prepare.
#include "scene/prepared_parts.h"

#include "base/check.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#ifdef PLIANT_WITH_HDF5

#define PREPARED_FORMAT "pliant-prepared"
enum { PREPARED_VERSION = 1 };

// --- source of a body ----------------------------------------------------------------------------

bool prepared_hash_file(uint64_t *hash, const char *path, Status *status)
{
    unsigned char piece[1 << 16];
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    size_t count;
    // A piece at a time: volumes are large.
    while ((count = fread(piece, 1, sizeof piece, file)) > 0)
        *hash = fnv_bytes(*hash, piece, count);
    bool whole = ferror(file) == 0;
    fclose(file);
    return whole || status_fail(status, STATUS_INVALID, "%s: cannot be read", path);
}

const char *prepared_path(char text[PREPARED_NAME], const char *body, const char *rest)
{
    snprintf(text, PREPARED_NAME, "/bodies/%s%s", body, rest);
    return text;
}

bool prepared_write_source(const HdfFile *file, const SceneBody *body, uint64_t source)
{
    char group[PREPARED_NAME], text[FNV_TEXT];
    fnv_text(text, source);
    return hdf_write_text(file, prepared_path(group, body->name, ""), "source", text);
}

bool prepared_check_source(const HdfFile *file, const SceneBody *body, uint64_t source,
                           const char *noun)
{
    char group[PREPARED_NAME], found[64], text[FNV_TEXT];
    prepared_path(group, body->name, "");
    // The body must be in the file, prepared from what the scene now has.
    if (!hdf_exists(file, "/bodies") || !hdf_exists(file, group))
        return hdf_fail(file, group,
                        "is missing: the file was prepared for another scene (pliant-prepare "
                        "SCENE.cfg -o FILE)");
    if (!hdf_read_text(file, group, "source", found, sizeof found))
        return false;
    fnv_text(text, source);
    return strcmp(found, text) == 0 ||
           hdf_fail(file, group, "was prepared from another %s than this scene's: prepare it again",
                    noun);
}

// --- writing -------------------------------------------------------------------------------------

static bool prepare_body(const HdfFile *file, const SceneBody *body, FILE *report, Status *status)
{
    HdfFile of_body = *file;
    of_body.status = status;
    return scene_has_cells(body) ? prepared_write_voxels(&of_body, body, report)
                                 : prepared_write_mesh(&of_body, body, report);
}

bool prepared_write(const char *path, const Scene *scene, FILE *report, Status *status)
{
    HdfFile file;
    // Only a file of this kind may be replaced, which is known before the work begins.
    if (!hdf_open_target(&file, path, PREPARED_FORMAT, status))
        return false;
    hdf_close(&file);
    if (!hdf_create(&file, path, status))
        return false;
    // What all our files begin with, then one group a body.
    bool ok = hdf_write_text(&file, "/", "format", PREPARED_FORMAT) &&
              hdf_write_int(&file, "/", "version", PREPARED_VERSION) &&
              hdf_write_text(&file, "/", "scene", scene->text) &&
              hdf_write_text(&file, "/", "created_by", "pliant-prepare " PLIANT_VERSION);
    for (int i = 0; i < scene->body_count && ok; i++) {
        Status said = {0};
        ok = prepare_body(&file, &scene->body[i], report, &said);
        if (said.code != STATUS_OK)
            status_fail(status, said.code, "%s:%d: %s", scene->path, scene->body[i].line,
                        said.text);
    }
    ok = ok && hdf_save(&file);
    hdf_close(&file);
    return ok;
}

// --- reading -------------------------------------------------------------------------------------

static bool check_head(const HdfFile *file)
{
    char text[64];
    int version = 0;
    // Other files of ours are refused by their own word.
    if (!hdf_read_text(file, "/", "format", text, sizeof text))
        return false;
    if (strcmp(text, PREPARED_FORMAT) != 0)
        return hdf_fail(file, "/", "format \"%.40s\" must be \"%s\"", text, PREPARED_FORMAT);
    return hdf_read_int(file, "/", "version", &version) &&
           (version == PREPARED_VERSION ||
            hdf_fail(file, "/", "version %d must be %d", version, PREPARED_VERSION));
}

bool prepared_open(Prepared **prepared, const char *path, Status *status)
{
    *prepared = calloc(1, sizeof **prepared);
    ASSERT(*prepared != NULL);
    (*prepared)->path = strdup(path);
    ASSERT((*prepared)->path != NULL);
    HdfFile *file = &(*prepared)->file;
    file->id = -1;
    // The seal first, so that nothing of a damaged file is believed.
    if (hdf_open_sealed(file, (*prepared)->path, status) && check_head(file))
        return true;
    prepared_close(*prepared);
    *prepared = NULL;
    return false;
}

void prepared_close(Prepared *prepared)
{
    if (prepared == NULL)
        return;
    hdf_close(&prepared->file);
    free(prepared->path);
    free(prepared);
}

#else

bool prepared_write(const char *path, const Scene *scene, FILE *report, Status *status)
{
    (void)scene, (void)report;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

bool prepared_open(Prepared **prepared, const char *path, Status *status)
{
    *prepared = NULL;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

void prepared_close(Prepared *prepared)
{
    (void)prepared;
}

#endif
