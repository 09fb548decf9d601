// Reads `score`, what the score sheet of a session judges by (clients/play): from a scene, and from
// the text that a recording has of one. The server only checks it and passes it on.
#include "scene/scene_parts.h"

#include "base/check.h"

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
     .about = "The tissue to be cut: up to 16 groups. The sheet states what was severed inside and "
              "outside of them."},
};
const OptionTable SCORE_TABLE =
    OPTION_TABLE("score",
                 "What the [score sheet](../clients/play/SCORE.md) of a session judges by. The "
                 "server itself does nothing with it.",
                 SCORE_OPTIONS);

typedef struct ScoreRegionGroup {
    RegionGroup region; // first: offsets of rows are the same in a RegionGroup
    const char *name;
} ScoreRegionGroup;

static const Option SCORE_REGION_OPTIONS[] = {
    {"name", OPTION_NAME, offsetof(ScoreRegionGroup, name), "", .low = 1, .high = SCENE_WORD_MAX,
     .preset_text = "region", .about = "Its name on the sheet."},
    {"box", OPTION_LIST, offsetof(ScoreRegionGroup, region.box), "m",
     .about = "Two opposite corners, `([x, y, z], [x, y, z])`, the lower one first; faces "
              "included."},
    {"sphere", OPTION_VECTOR, offsetof(ScoreRegionGroup, region.sphere), "m", 0.0, POSITION_LIMIT,
     .preset_text = "none", .about = "Centre of a ball; requires `radius`."},
    {"radius", OPTION_REAL, offsetof(ScoreRegionGroup, region.radius), "m", 0.0, POSITION_LIMIT,
     .open = true, .preset_text = "none", .about = "Radius of the ball."},
};
const OptionTable SCORE_REGION_TABLE = OPTION_TABLE(
    "score.regions",
    "Each entry is one of `{ box = ... }` and `{ sphere = ...; radius = ...; }`, around tissue as "
    "it is at the start; it moves with the tissue.",
    SCORE_REGION_OPTIONS);

static bool read_region(const SceneReader *reader, const config_setting_t *group,
                        SceneRegion *region)
{
    ScoreRegionGroup raw = {.name = NULL};
    if (group == NULL || !option_read(&SCORE_REGION_TABLE, group, &reader->source, &raw) ||
        !scene_read_region(reader, group, &raw.region, "regions", &region->region))
        return false;
    snprintf(region->name, sizeof region->name, "%s", raw.name);
    return true;
}

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

// --- from the text of a recording ----------------------------------------------------------------

// A description of a running daemon has the group in one line.
static const char *find_group(const char *text)
{
    while (text != NULL && strncmp(text, SCENE_SCORE_LINE, strlen(SCENE_SCORE_LINE)) != 0) {
        text = strchr(text, '\n');
        text = text != NULL ? text + 1 : NULL;
    }
    return text;
}

static char *copy_text(const char *text)
{
    // A description is no scene: of it only that line is read.
    const bool described = strncmp(text, "scene ", 6) == 0;
    const char *line = described ? find_group(text) : text;
    char *copy = line == NULL ? strdup("")
                 : described  ? strndup(line, strcspn(line, "\n"))
                              : strdup(text);
    ASSERT(copy != NULL);
    return copy;
}

static bool read_fixed(const SceneReader *reader, const config_setting_t *bodies, SceneScore *score)
{
    const int count = option_length(bodies);
    if (count > SCENE_BODIES)
        return option_fail(&reader->source, bodies, "bodies has %d entries, at most %d", count,
                           SCENE_BODIES);
    score->fixed = calloc((size_t)count + 1, sizeof *score->fixed);
    ASSERT(score->fixed != NULL);
    for (int i = 0; i < count; i++) {
        const config_setting_t *group = config_setting_get_elem(bodies, (unsigned)i);
        const config_setting_t *list =
            config_setting_is_group(group) ? config_setting_get_member(group, "fixed") : NULL;
        SceneFixed *fixed = &score->fixed[score->fixed_count++];
        const char *name = NULL;
        if (config_setting_is_group(group))
            config_setting_lookup_string(group, "name", &name);
        snprintf(fixed->body, sizeof fixed->body, "%s", name != NULL ? name : "");
        SceneBody body = {.name = ""};
        const bool is_list = list == NULL || config_setting_is_list(list);
        const bool ok = is_list && scene_read_fixed(reader, list, &body);
        fixed->region = body.options.fixed;
        fixed->count = body.options.fixed_count;
        if (!ok)
            return is_list ? false : option_fail(&reader->source, list, "fixed must be a list");
    }
    return true;
}

static bool read_group(const config_t *config, const SceneReader *reader, SceneScore *score)
{
    const config_setting_t *root = config_root_setting(config);
    const config_setting_t *group = config_setting_get_member(root, "score");
    const config_setting_t *bodies = config_setting_get_member(root, "bodies");
    if (group != NULL && !config_setting_is_group(group))
        return option_fail(&reader->source, group, "score must be a group { ... }");
    if (bodies != NULL && !config_setting_is_list(bodies))
        return option_fail(&reader->source, bodies, "bodies must be a list ( ... )");
    return scene_read_score_group(reader, group, score) &&
           (bodies == NULL || read_fixed(reader, bodies, score));
}

bool scene_read_score(const char *text, const char *name, SceneScore *score, Status *status)
{
    *score = (SceneScore){0};
    char *copy = copy_text(text);
    config_t config;
    config_init(&config);
    const SceneReader reader = {.source = {name, status}, .folder = "."};
    const bool ok =
        scene_source_parse(name, copy, &config, status) && read_group(&config, &reader, score);
    config_destroy(&config);
    free(copy);
    if (!ok)
        scene_score_destroy(score);
    return ok;
}

bool scene_load_score(const char *path, SceneScore *score, Status *status)
{
    *score = (SceneScore){0};
    config_t config;
    config_init(&config);
    char *text = scene_source_read(path, &config, status);
    const SceneReader reader = {.source = {path, status}, .folder = "."};
    const bool ok = text != NULL && read_group(&config, &reader, score);
    config_destroy(&config);
    free(text);
    if (!ok)
        scene_score_destroy(score);
    return ok;
}

void scene_score_destroy(SceneScore *score)
{
    for (int i = 0; i < score->fixed_count; i++) {
        for (int k = 0; k < score->fixed[i].count; k++)
            free((void *)score->fixed[i].region[k].node);
        free((void *)score->fixed[i].region);
    }
    free(score->fixed);
    *score = (SceneScore){0};
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
        const FixedRegion *region = &score->region[i].region;
        fprintf(out, "%s { name = \"%s\"; ", i > 0 ? "," : "", score->region[i].name);
        if (region->kind == FIXED_BOX)
            fprintf(out, "box = ((%.17e, %.17e, %.17e), (%.17e, %.17e, %.17e)); }", region->low.x,
                    region->low.y, region->low.z, region->high.x, region->high.y, region->high.z);
        else
            fprintf(out, "sphere = (%.17e, %.17e, %.17e); radius = %.17e; }", region->center.x,
                    region->center.y, region->center.z, region->radius);
    }
    fprintf(out, " ); };\n");
}
