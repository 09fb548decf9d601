// SPDX-License-Identifier: MIT
// Reads `score`, what the score sheet of a session judges by (clients/play). The server only checks
// it, so that --check reports errors, and repeats it in the description that recordings carry.
#include "scene/scene_parts.h"

#include <stdio.h>

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
