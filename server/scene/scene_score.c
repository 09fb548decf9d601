// SPDX-License-Identifier: MIT
// Reads `score`, what the ledger and the score sheet of a session (clients/play) judge by, and
// repeats it in the description that recordings carry.
#include "scene/scene_parts.h"

#include "base/check.h"
#include "io/volume_import.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct ScoreGroup {
    SceneScore score; // first: offsets of rows are the same in a SceneScore
    const config_setting_t *regions;
} ScoreGroup;

static const Option SCORE_OPTIONS[] = {
    {"force_limit", OPTION_REAL, offsetof(ScoreGroup, score.force_limit), "N", 0.0, FORCE_LIMIT,
     .open = true, .preset_text = "none",
     .about = "Force on a tool above which the sheet counts time."},
    {"regions", OPTION_LIST, offsetof(ScoreGroup, regions), "",
     .about = "Up to 16 groups: tissue to be cut, and tissue to stay away from. Of the first the "
              "sheet states what was severed inside and outside of them, of all the ledger states "
              "how near anything was cut or removed."},
};
const OptionTable SCORE_TABLE =
    OPTION_TABLE("score",
                 "What the [ledger](manual/ledger.md) and the [score "
                 "sheet](../clients/play/SCORE.md) of a session judge by. The motion does not "
                 "depend on it.",
                 SCORE_OPTIONS);

typedef struct ScoreRegionGroup {
    RegionGroup region; // first: offsets of rows are the same in a RegionGroup
    const char *name;
    const config_setting_t *label;
    double margin;
    bool keep;
} ScoreRegionGroup;

#define AT(member) offsetof(ScoreRegionGroup, member)
static const Option SCORE_REGION_OPTIONS[] = {
    {"name", OPTION_NAME, AT(name), "", .low = 1, .high = SCENE_WORD_MAX, .preset_text = "region",
     .about = "Its name on the sheet; without it that of the label."},
    {"box", OPTION_LIST, AT(region.box), "m",
     .about = "Two opposite corners, `([x, y, z], [x, y, z])`, the lower one first; faces "
              "included."},
    {"sphere", OPTION_VECTOR, AT(region.sphere), "m", 0.0, POSITION_LIMIT, .preset_text = "none",
     .about = "Centre of a ball; requires `radius`."},
    {"radius", OPTION_REAL, AT(region.radius), "m", 0.0, POSITION_LIMIT, .open = true,
     .preset_text = "none", .about = "Radius of the ball."},
    {"label", OPTION_INTS, AT(label), "", 1.0, INT_MAX, .preset_text = "none", .names = true,
     .about = "The tissue of this label, by name or number, of a body that can be cut; nobody is "
              "to cut it."},
    {"margin", OPTION_REAL, AT(margin), "m", 0.0, POSITION_LIMIT,
     .about = "Distance that every cut is to keep from it."},
    {"keep", OPTION_BOOL, AT(keep), "", .about = "It is not to be touched, as a vessel."},
};
#undef AT
const OptionTable SCORE_REGION_TABLE = OPTION_TABLE(
    "score.regions",
    "Each entry is one of `{ box = ... }`, `{ sphere = ...; radius = ...; }` and `{ label = ... "
    "}`, tissue as it is at the start; it moves with the tissue. With none of `label`, `margin` "
    "and `keep` it is tissue to be cut.",
    SCORE_REGION_OPTIONS);

// Takes a label, a number or a name.
static bool take_label(const SceneReader *reader, const config_setting_t *at,
                       char label[SCENE_LABEL_MAX])
{
    int number;
    if (config_setting_type(at) == CONFIG_TYPE_STRING)
        snprintf(label, SCENE_LABEL_MAX, "%s", config_setting_get_string(at));
    else if (option_read_ints(at, &number, 1) == 1)
        snprintf(label, SCENE_LABEL_MAX, "%d", number);
    else
        return option_fail(&reader->source, at, "label must be one number or name");
    return label[0] != '\0' || option_fail(&reader->source, at, "label is empty");
}

static bool read_region(const SceneReader *reader, const config_setting_t *group,
                        SceneRegion *region)
{
    ScoreRegionGroup raw = {.name = NULL};
    const OptionSource *source = &reader->source;
    if (group == NULL || !option_read(&SCORE_REGION_TABLE, group, source, &raw))
        return false;
    region->margin = raw.margin;
    region->keep = raw.keep;
    snprintf(region->name, sizeof region->name, "%s", raw.name);
    if (raw.label == NULL)
        return scene_read_region(reader, group, &raw.region, "regions", &region->region);
    if (raw.region.box != NULL || option_given(group, "sphere") || option_given(group, "radius"))
        return option_fail(
            source, group,
            "regions entry must be one of { label }, { box } and { sphere; radius }");
    if (!take_label(reader, raw.label, region->label))
        return false;
    if (!option_given(group, "name"))
        memcpy(region->name, region->label, sizeof region->name);
    return true;
}

// --- labels --------------------------------------------------------------------------------------

void scene_name_tissues(const SceneBody *body, char name[][SCENE_LABEL_MAX])
{
    const VoxelSource *voxels = &body->voxels;
    const int count = voxels->kind == VOXELS_FILE ? voxels->label_count : 1;
    name[0][0] = '\0';
    if (voxels->kind != VOXELS_FILE)
        return;
    for (int m = 0; m < count; m++)
        snprintf(name[m], SCENE_LABEL_MAX, "label %d", voxels->label[m]);
#ifdef PLIANT_WITH_LATTICES
    // A file that cannot be read is an error of the body that is made from it.
    LabelVolume volume;
    Status ignored = {0};
    if (!volume_import_header(voxels->file, &volume, &ignored))
        return;
    for (int s = 0; s < volume.segment_count; s++) {
        const VolumeSegment *segment = &volume.segment[s];
        for (int m = 0; m < count && segment->name[0] != '\0'; m++)
            if (voxels->label[m] == segment->label &&
                (voxels->layer == 0 || voxels->layer == segment->layer))
                snprintf(name[m], SCENE_LABEL_MAX, "%s", segment->name);
    }
    volume_destroy(&volume);
#endif
}

static int find_tissue(const VoxelSource *voxels, char name[][SCENE_LABEL_MAX], const char *label)
{
    char *end;
    const long number = strtol(label, &end, 10);
    for (int m = 0; m < voxels->label_count; m++)
        if ((*end == '\0' && number == voxels->label[m]) || strcmp(label, name[m]) == 0)
            return m + 1;
    return 0;
}

int scene_find_tissue(const SceneBody *body, const char *label)
{
    static const int most = LATTICE_MATERIALS;
    if (!scene_has_cells(body) || body->voxels.kind != VOXELS_FILE)
        return 0;
    char(*name)[SCENE_LABEL_MAX] = calloc((size_t)most, sizeof *name);
    ASSERT(name != NULL);
    scene_name_tissues(body, name);
    const int found = find_tissue(&body->voxels, name, label);
    free(name);
    return found;
}

// Lists the labels that a region may name.
static void list_tissues(const Scene *scene, char *text, size_t size)
{
    size_t used = 0;
    text[0] = '\0';
    for (int b = 0; b < scene->body_count; b++) {
        const SceneBody *body = &scene->body[b];
        if (!scene_has_cells(body) || body->voxels.kind != VOXELS_FILE)
            continue;
        char(*name)[SCENE_LABEL_MAX] = calloc(LATTICE_MATERIALS, sizeof *name);
        ASSERT(name != NULL);
        scene_name_tissues(body, name);
        for (int m = 0; m < body->voxels.label_count && used < size; m++)
            used +=
                (size_t)snprintf(text + used, size - used, "%s%s", used > 0 ? ", " : "", name[m]);
        free(name);
    }
}

bool scene_check_score(const SceneReader *reader, const config_setting_t *group,
                       const SceneScore *score)
{
    const Scene *scene = reader->scene;
    for (int r = 0; r < score->region_count; r++) {
        const char *label = score->region[r].label;
        const config_setting_t *at = option_find(group, "regions");
        at = option_find(config_setting_get_elem(at, (unsigned)r), "label");
        bool found = label[0] == '\0';
        for (int b = 0; b < scene->body_count && !found; b++) {
            const SceneBody *body = &scene->body[b];
            found = scene_find_tissue(body, label) > 0;
            if (found && (!body->options.cuttable || body->model != MODEL_VOXEL))
                return option_fail(&reader->source, at,
                                   "label \"%s\" is of body \"%s\", which cannot be cut: "
                                   "cuttable = true",
                                   label, body->name);
        }
        char text[256];
        if (found)
            continue;
        list_tissues(scene, text, sizeof text);
        return option_fail(&reader->source, at, "label \"%s\" is of no body%s%s", label,
                           text[0] != '\0' ? ": there are " : "", text);
    }
    return true;
}

// --- the group -----------------------------------------------------------------------------------

bool scene_read_score_group(const SceneReader *reader, const config_setting_t *group,
                            SceneScore *score)
{
    ScoreGroup raw = {.regions = NULL};
    if (!option_read(&SCORE_TABLE, group, &reader->source, &raw))
        return false;
    score->force_limit = raw.score.force_limit;
    const int count = option_length(raw.regions);
    if (count > SCENE_SCORE_REGIONS)
        return option_fail(&reader->source, raw.regions, "regions has %d entries, at most %d",
                           count, SCENE_SCORE_REGIONS);
    for (int i = 0; i < count; i++)
        if (!read_region(reader, option_group_at(raw.regions, i, &reader->source),
                         &score->region[score->region_count++]))
            return false;
    return true;
}

static void print_label(const char *label, FILE *out)
{
    fputs(" label = \"", out);
    for (; *label != '\0'; label++)
        fprintf(out, "%s%c", *label == '"' || *label == '\\' ? "\\" : "", *label);
    fputs("\";", out);
}

void scene_print_score(const SceneScore *score, FILE *out)
{
    if (score->force_limit == 0.0 && score->region_count == 0)
        return;
    fprintf(out, SCENE_SCORE_LINE "{");
    if (score->force_limit > 0.0)
        fprintf(out, " force_limit = %.17e;", score->force_limit);
    fprintf(out, " regions = (");
    for (int i = 0; i < score->region_count; i++) {
        const SceneRegion *from = &score->region[i];
        const FixedRegion *region = &from->region;
        const bool named = strcmp(from->name, from->label) != 0;
        fprintf(out, "%s {", i > 0 ? "," : "");
        if (named)
            fprintf(out, " name = \"%s\";", from->name);
        if (from->label[0] != '\0')
            print_label(from->label, out);
        else if (region->kind == FIXED_BOX)
            fprintf(out, " box = ((%.17e, %.17e, %.17e), (%.17e, %.17e, %.17e));", region->low.x,
                    region->low.y, region->low.z, region->high.x, region->high.y, region->high.z);
        else
            fprintf(out, " sphere = (%.17e, %.17e, %.17e); radius = %.17e;", region->center.x,
                    region->center.y, region->center.z, region->radius);
        if (from->margin > 0.0)
            fprintf(out, " margin = %.17e;", from->margin);
        fprintf(out, "%s }", from->keep ? " keep = true;" : "");
    }
    fprintf(out, " ); };\n");
}
