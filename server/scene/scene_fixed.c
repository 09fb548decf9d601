// Reads the list `fixed` of a body: boxes, spheres and node numbers that do not move.
#include "scene/scene_parts.h"

#include "base/check.h"

#include <stdlib.h>

enum { FIXED_REGIONS = 1024 };

static const Option FIXED_OPTIONS[] = {
    {"box", OPTION_LIST, offsetof(RegionGroup, box), "m",
     .about = "Two opposite corners, `([x, y, z], [x, y, z])`, the lower one first; faces "
              "included."},
    {"sphere", OPTION_VECTOR, offsetof(RegionGroup, sphere), "m", 0.0, POSITION_LIMIT,
     .preset_text = "none", .about = "Centre of a ball; requires `radius`."},
    {"radius", OPTION_REAL, offsetof(RegionGroup, radius), "m", 0.0, POSITION_LIMIT, .open = true,
     .preset_text = "none", .about = "Radius of the ball."},
    {"nodes", OPTION_LIST, offsetof(RegionGroup, nodes), "",
     .about = "Node numbers of the mesh file or generator, from 0; for a voxel body, lattice "
              "points, as `id` in messages."},
};
const OptionTable FIXED_TABLE = OPTION_TABLE(
    "bodies.fixed",
    "Nodes that are inside a region at the start are fixed. Each entry is one "
    "of `{ box = ... }`, `{ sphere = ...; radius = ...; }` and `{ nodes = [ ... ]; }`.",
    FIXED_OPTIONS);

// Corners may be far outside of any mesh: "everything below".
static const Option CORNER = {.key = "box", .type = OPTION_VECTOR, .high = 1e12};
static const Option NODE = {.key = "nodes", .type = OPTION_INT, .high = 1 << 28};

static bool read_box(const SceneReader *reader, const config_setting_t *list, FixedRegion *region)
{
    const OptionSource *source = &reader->source;
    if (option_length(list) != 2)
        return option_fail(source, list, "box must be two corners ([x, y, z], [x, y, z])");
    region->kind = FIXED_BOX;
    if (!option_read_vector(config_setting_get_elem(list, 0), &CORNER, source, &region->low) ||
        !option_read_vector(config_setting_get_elem(list, 1), &CORNER, source, &region->high))
        return false;
    if (region->low.x > region->high.x || region->low.y > region->high.y ||
        region->low.z > region->high.z)
        return option_fail(source, list, "box is empty: its first corner must be the lower one");
    return true;
}

static bool read_nodes(const SceneReader *reader, const config_setting_t *list, FixedRegion *region)
{
    int count = option_length(list);
    if (count == 0)
        return option_fail(&reader->source, list, "nodes is empty");
    int *node = calloc((size_t)count, sizeof *node);
    ASSERT(node != NULL);
    region->kind = FIXED_NODES;
    region->node = node;
    region->node_count = count;
    for (int i = 0; i < count; i++)
        if (!option_read_int(config_setting_get_elem(list, (unsigned)i), &NODE, &reader->source,
                             &node[i]))
            return false;
    return true;
}

bool scene_read_region(const SceneReader *reader, const config_setting_t *group,
                       const RegionGroup *raw, const char *list, FixedRegion *region)
{
    const OptionSource *source = &reader->source;
    bool sphere = option_given(group, "sphere"), radius = option_given(group, "radius");
    if ((raw->box != NULL) + (raw->nodes != NULL) + (sphere || radius) != 1)
        return option_fail(source, group,
                           "%s entry must be one of { box }, { sphere; radius } and { nodes }",
                           list);
    if (raw->box != NULL)
        return read_box(reader, raw->box, region);
    if (raw->nodes != NULL)
        return read_nodes(reader, raw->nodes, region);
    if (!sphere || !radius)
        return option_fail(source, group, "%s %s is missing: a ball has a sphere and a radius",
                           list, sphere ? "radius" : "sphere");
    region->kind = FIXED_SPHERE;
    region->center = raw->sphere;
    region->radius = raw->radius;
    return true;
}

static bool read_region(const SceneReader *reader, const config_setting_t *group,
                        FixedRegion *region)
{
    RegionGroup raw = {0};
    return option_read(&FIXED_TABLE, group, &reader->source, &raw) &&
           scene_read_region(reader, group, &raw, "fixed", region);
}

bool scene_read_fixed(const SceneReader *reader, const config_setting_t *list, SceneBody *body)
{
    int count = option_length(list);
    if (count == 0)
        return true;
    if (count > FIXED_REGIONS)
        return option_fail(&reader->source, list, "fixed has %d entries, at most %d", count,
                           FIXED_REGIONS);
    FixedRegion *fixed = calloc((size_t)count, sizeof *fixed);
    ASSERT(fixed != NULL);
    body->options.fixed = fixed;
    body->options.fixed_count = count;
    for (int i = 0; i < count; i++) {
        const config_setting_t *group = option_group_at(list, i, &reader->source);
        if (group == NULL || !read_region(reader, group, &fixed[i]))
            return false;
    }
    return true;
}
