// Prints the reference of all keys of a scene file from the tables that read it.
#include "files/scene_parts.h"

#include "base/check.h"

const OptionTable *scene_table(int index)
{
    static const OptionTable *const TABLES[SCENE_TABLE_COUNT] = {
        &SCENE_TABLE, &PUBLISH_TABLE, &CAPACITY_TABLE,       &BODY_TABLE,
        &MESH_TABLE,  &PLACE_TABLE,   &MATERIAL_TABLE,       &SHAPE_TABLE,
        &ADAPT_TABLE, &VOXELS_TABLE,  &VOXEL_MATERIAL_TABLE, &LABEL_MATERIAL_TABLE,
        &SKIN_TABLE,  &TEAR_TABLE,    &CONTACT_TABLE,        &FIXED_TABLE,
        &TOOL_TABLE,  &CAPSULE_TABLE, &PLANE_TABLE,          &ATTACHMENT_TABLE,
        &LOAD_TABLE,
    };
    ASSERT(index >= 0 && index < SCENE_TABLE_COUNT);
    return TABLES[index];
}

static const char INTRODUCTION[] =
    "# Scene files\n"
    "\n"
    "This page is generated from the tables that read scene files; a test keeps it up to\n"
    "date. The annotated scenes in this folder show every group in use: start from\n"
    "`minimal.cfg`.\n"
    "\n"
    "A scene is a [libconfig](https://hyperrealm.github.io/libconfig/) file:\n"
    "`key = value;`, groups `{ }`, lists `( )`, arrays `[ ]`, comments `#`, `//` and\n"
    "`/* */`, and `@include \"file\"` on a line of its own. Units are SI: metres, seconds,\n"
    "kilograms, newtons, radians.\n"
    "\n"
    "- A real may be written as an integer; an integer may not be written with a point.\n"
    "- A vector is three numbers in `[ ]` or `( )`, without a comma after the last. In\n"
    "  included files an array `[ ]` has numbers of one kind: write\n"
    "  `[0.0, 0.0, -9.81]` or `(0, 0, -9.81)` there.\n"
    "- A name consists of letters, digits, `_` and `-`.\n"
    "- File names are relative to the folder of the scene file; so are includes.\n"
    "- In ranges, `(` excludes its bound and `[` includes it. The range of a vector is\n"
    "  that of its length.\n"
    "- Integers are one number or a list of them.\n"
    "- Unknown keys, wrong types and values out of range are errors that name file and\n"
    "  line. A key that has no effect because of another one (`theta` with `leapfrog`) is "
    "accepted,\n"
    "  with a warning that says why.\n";

void scene_print_reference(FILE *out)
{
    fputs(INTRODUCTION, out);
    for (int i = 0; i < SCENE_TABLE_COUNT; i++)
        option_print_reference(scene_table(i), out);
}
