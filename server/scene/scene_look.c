// SPDX-License-Identifier: MIT
// Reads the look of a body: colours, an image of its inside, and one for its outside.
#include "scene/scene_parts.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

typedef struct LookGroup {
    SceneLook look; // first: offsets of rows are the same in a SceneLook
    Vec3 color, inside;
    const char *image, *texture;
} LookGroup;

#define AT(member) offsetof(LookGroup, member)
static const Option LOOK_OPTIONS[] = {
    {"color", OPTION_VECTOR, AT(color), "", 0.0, LOOK_LENGTH, .preset_text = "[0.77, 0.41, 0.36]",
     .about = "Colour of the outside: red, green and blue of sRGB, 0 to 1 each."},
    {"inside", OPTION_VECTOR, AT(inside), "", 0.0, LOOK_LENGTH,
     .preset_text = "`color`, darker and redder",
     .about = "Colour of walls that cuts lay open, and of the other side of a membrane."},
    {"image", OPTION_STRING, AT(image), "", .low = 1, .high = SCENE_FILE_MAX, .preset_text = "none",
     .only = VOXEL_ONLY,
     .about =
         "Voxel, with `voxels.file`: NRRD or NIfTI image of grey values or colours on any grid "
         "that covers the labels, in their frame, relative to the scene's folder. Walls of "
         "cuts show it instead of `inside`."},
    {"black", OPTION_REAL, AT(look.black), "", -1e9, 1e9, .preset_text = "from the image",
     .only = VOXEL_ONLY,
     .about =
         "Value of the image that is shown black. Without `black` and `white`: 0 and 255 of an "
         "image of bytes, else what 1 % and 99 % of its values around the body do not exceed."},
    {"white", OPTION_REAL, AT(look.white), "", -1e9, 1e9, .preset_text = "from the image",
     .only = VOXEL_ONLY, .about = "Value that is shown white; both of them or none."},
    {"texture", OPTION_STRING, AT(texture), "", .low = 1, .high = SCENE_FILE_MAX,
     .preset_text = "none",
     .about = "PNG or JPEG file beside the scene, an image for the outside of a mesh with texture "
              "coordinates, with `publish.rest = true`. The server passes on its name alone: "
              "`pliant-web --scenes` shows it."},
};
#undef AT
const OptionTable LOOK_TABLE = {
    TABLE_MEMBERS(
        NULL, "bodies.look",
        "Colours for viewers, which the motion does not depend on. A body without any gets "
        "one from its name.",
        LOOK_OPTIONS),
    .variant = offsetof(LookGroup, look.model)};

// Turns shares into bytes.
static bool read_colour(const OptionSource *source, const config_setting_t *group, const char *key,
                        Vec3 share, unsigned char colour[3])
{
    const double one[3] = {share.x, share.y, share.z};
    const config_setting_t *at = option_find(group, key);
    for (int c = 0; c < 3; c++) {
        if (!(one[c] >= 0.0 && one[c] <= 1.0))
            return option_fail(source, at,
                               "%s [%g, %g, %g]: red, green and blue are from 0 to 1 each", key,
                               one[0], one[1], one[2]);
        colour[c] = (unsigned char)(255.0 * one[c] + 0.5);
    }
    return true;
}

// What a cut lays open is darker than the outside, and redder.
static void choose_inside(LookColours *colours)
{
    static const double FLESH[3] = {179.0, 38.0, 31.0};
    for (int c = 0; c < 3; c++)
        colours->inside[c] = (unsigned char)(0.55 * colours->outside[c] + 0.45 * FLESH[c] + 0.5);
}

bool scene_read_colours(const SceneReader *reader, const config_setting_t *group, Vec3 color,
                        Vec3 inside, LookColours *colours)
{
    const bool has_color = option_given(group, "color"), has_inside = option_given(group, "inside");
    if (has_color && !read_colour(&reader->source, group, "color", color, colours->outside))
        return false;
    if (has_color && !has_inside)
        choose_inside(colours);
    return !has_inside || read_colour(&reader->source, group, "inside", inside, colours->inside);
}

static bool read_image(const SceneReader *reader, const LookGroup *raw,
                       const config_setting_t *group, SceneBody *body)
{
    const OptionSource *source = &reader->source;
    const config_setting_t *at = option_find(group, "image");
    const bool black = option_given(group, "black"), white = option_given(group, "white");
    const bool from_labels = scene_has_cells(body) && body->voxels.kind == VOXELS_FILE;
    if (at != NULL && !from_labels)
        return option_fail(source, at,
                           "image means nothing for voxels that are not from a file of "
                           "labels, whose frame it shares");
    if (at == NULL && (black || white))
        return option_fail(source, group, "black and white need an image");
    if (black != white)
        return option_fail(source, group, "look has only one of black and white");
    if (black && raw->look.black == raw->look.white)
        return option_fail(source, option_find(group, "white"), "white %g must differ from black",
                           raw->look.white);
    if (at != NULL)
        body->look.image = scene_source_resolve(reader->folder, raw->image);
    return true;
}

bool scene_read_look(const SceneReader *reader, const config_setting_t *group, SceneBody *body)
{
    LookGroup raw = {.look.model = (int)body->model};
    LookColours colours = {.outside = {196, 105, 92}};
    choose_inside(&colours);
    body->look.usual = colours;
    if (group == NULL)
        return true;
    char owner[32];
    snprintf(owner, sizeof owner, "a %s body", scene_model_name(body->model));
    if (!option_read(&LOOK_TABLE, group, &reader->source, &raw) ||
        !option_refuse_unused(&LOOK_TABLE, group, &reader->source, (int)body->model, owner) ||
        !scene_read_colours(reader, group, raw.color, raw.inside, &colours) ||
        !read_image(reader, &raw, group, body))
        return false;
    body->look.given = true;
    body->look.usual = colours;
    body->look.black = raw.look.black;
    body->look.white = raw.look.white;
    if (option_given(group, "texture")) {
        body->look.texture = strdup(raw.texture);
        ASSERT(body->look.texture != NULL);
    }
    return true;
}
