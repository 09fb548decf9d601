// SPDX-License-Identifier: MIT
// Reads `levels` of a voxel body: how large its elements are inside, and where nothing needs them
// fine at the surface.
#include "scene/scene_parts.h"

#include "base/check.h"
#include "voxel/layout.h"

#include <stdlib.h>

enum { LEVELS_USUAL = 2, FINE_REGIONS = 64 };

typedef struct LevelsGroup {
    SceneBody body; // first: offsets of rows are the same in a SceneBody
    const config_setting_t *fine;
} LevelsGroup;

#define AT(member) offsetof(LevelsGroup, member)
static const Option LEVELS_OPTIONS[] = {
    {"inside", OPTION_INT, AT(body.voxel.body.levels), "", 0.0, VOXEL_LEVELS_MAX,
     .preset = LEVELS_USUAL, .physics = true,
     .about = "Coarsest level of elements away from the surface, which are up to 2^inside cells "
              "wide: what `levels` as a number says."},
    {"surface", OPTION_INT, AT(body.voxel.surface_level), "", 0.0, VOXEL_LEVELS_MAX,
     .physics = true, .feature = {.name = "elements that adapt to tools"},
     .about = "Coarsest level of elements at the surface, at most `inside`. From 1 on the body "
              "adapts: elements are divided ahead of tools and cuts, and merged again behind "
              "them. Needs law `affine`, and excludes `skin`, `weights`, `initial` and "
              "`publish.nodes = \"all\"`."},
    {"fine", OPTION_LIST, AT(fine), "", .preset_text = "none",
     .about = "With `surface`: balls in which elements stay single cells, tools or no tools."},
};
#undef AT
const OptionTable LEVELS_TABLE = OPTION_TABLE(
    "bodies.levels",
    "How large the elements of a voxel body are, in place of one number: `levels = { inside = 2; "
    "surface = 2; fine = ( { sphere = [0.0, 0.0, 0.05]; radius = 0.01; } ); };`.",
    LEVELS_OPTIONS);

#define AT(member) offsetof(FineRegion, member)
static const Option FINE_OPTIONS[] = {
    {"sphere", OPTION_VECTOR, AT(centre), "m", 0.0, POSITION_LIMIT, .required = true,
     .physics = true, .about = "Centre of a ball, at rest."},
    {"radius", OPTION_REAL, AT(radius), "m", 0.0, POSITION_LIMIT, .open = true, .required = true,
     .physics = true, .about = "Radius of the ball."},
};
#undef AT
const OptionTable FINE_TABLE =
    OPTION_TABLE("bodies.levels.fine",
                 "Where the elements of a body that adapts stay single cells.", FINE_OPTIONS);

#define AT(member) offsetof(SceneBody, member)
static const Option VOXEL_ADAPT_OPTIONS[] = {
    {"error", OPTION_REAL, AT(voxel.body.adapt_error), "", 0.0, 1.0, .preset_text = "not steered",
     .physics = true, .live = "adapt_error", .feature = {.name = "detail steered by its error"},
     .about = "Relative error of the displacements, or of the force on a tool if that is larger, "
              "that the body aims at: it changes how far around tools its elements are fine, "
              "0.68 to 2.6 times the usual distance, until the error that it estimates of itself "
              "is between a half of this and this. 0: a fixed distance."},
};
#undef AT
const OptionTable VOXEL_ADAPT_TABLE =
    TITLED_TABLE("`bodies.adapt` of a voxel body", "bodies.adapt",
                 "How far around tools the elements of a body with `levels.surface` are fine.",
                 VOXEL_ADAPT_OPTIONS);

static bool read_adapt(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    if (raw->adapt == NULL)
        return true;
    if (body->model == MODEL_PLANE)
        return option_fail(&reader->source, raw->adapt, "adapt means nothing for a plane body");
    if (body->voxel.surface_level == 0)
        return option_fail(&reader->source, raw->adapt,
                           "adapt of a voxel body needs levels.surface, 1 or more");
    return option_read(&VOXEL_ADAPT_TABLE, raw->adapt, &reader->source, body);
}

static bool read_fine(const SceneReader *reader, const config_setting_t *list, SceneBody *body)
{
    const int count = option_length(list);
    if (count == 0)
        return true;
    if (body->voxel.surface_level == 0)
        return option_fail(&reader->source, list,
                           "fine means nothing without levels.surface: all elements at the "
                           "surface are single cells");
    if (count > FINE_REGIONS)
        return option_fail(&reader->source, list, "fine has %d entries, at most %d", count,
                           FINE_REGIONS);
    // The body owns what was read, also after a failure.
    body->fine = calloc((size_t)count, sizeof *body->fine);
    ASSERT(body->fine != NULL);
    body->voxel.fine = body->fine;
    body->voxel.fine_count = count;
    for (int i = 0; i < count; i++) {
        const config_setting_t *group = option_group_at(list, i, &reader->source);
        if (group == NULL || !option_read(&FINE_TABLE, group, &reader->source, &body->fine[i]))
            return false;
    }
    return true;
}

// Refuses what relies on all vertices of the surface, which a body that adapts does not have.
static bool check_adapting(const SceneReader *reader, const BodyGroup *raw,
                           const config_setting_t *group, const SceneBody *body)
{
    const VoxelOptions *voxel = &body->voxel;
    const config_setting_t *at = option_find(group, "surface");
    const OptionSource *source = &reader->source;
    if (voxel->surface_level > voxel->body.levels)
        return option_fail(source, at, "levels.surface %d exceeds levels.inside %d",
                           voxel->surface_level, voxel->body.levels);
    if (voxel->law != VOXEL_AFFINE)
        return option_fail(source, at, "levels.surface needs law \"affine\"");
    if (reader->scene->publish.nodes == NODES_ALL)
        return option_fail(source, at,
                           "levels.surface cannot be mixed with publish.nodes = \"all\"");
    // Keys of the same body.
    const char *const apart = raw->skin != NULL         ? "skin"
                              : voxel->weight_count > 0 ? "weights"
                              : body->initial != NULL   ? "initial"
                                                        : NULL;
    return apart == NULL ||
           option_fail(source, at, "levels.surface cannot be mixed with %s", apart);
}

bool scene_read_levels(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    VoxelOptions *voxel = &body->voxel;
    const config_setting_t *at = option_find(raw->at, "levels");
    if (at == NULL || !config_setting_is_group(at)) {
        // One number, whose range is that of both models.
        if (at == NULL)
            voxel->body.levels = LEVELS_USUAL;
        return (voxel->body.levels <= VOXEL_LEVELS_MAX ||
                option_fail(&reader->source, at, "levels %d outside [0, %d] of a voxel body",
                            voxel->body.levels, VOXEL_LEVELS_MAX)) &&
               read_adapt(reader, raw, body);
    }
    if (body->model == MODEL_PLANE)
        return option_fail(&reader->source, at, "levels of a plane body must be a whole number");
    LevelsGroup levels = {.fine = NULL};
    if (!option_read(&LEVELS_TABLE, at, &reader->source, &levels))
        return false;
    voxel->body.levels = levels.body.voxel.body.levels;
    voxel->surface_level = levels.body.voxel.surface_level;
    return (voxel->surface_level == 0 || check_adapting(reader, raw, at, body)) &&
           read_fine(reader, levels.fine, body) && read_adapt(reader, raw, body);
}
