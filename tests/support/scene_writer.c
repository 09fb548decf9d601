// SPDX-License-Identifier: MIT
#include "scene_writer.h"

static const char *or_else(const char *text, const char *preset)
{
    return text != NULL ? text : preset;
}

const char *write_body_scene(const char *file, const SceneParts *parts)
{
    char text[8192];
    int length =
        snprintf(text, sizeof text,
                 "name = \"test\";\n%s\nbodies = ( { name = \"%s\";\n%s\nmaterial = { %s };\n%s "
                 "}%s );\n%s\n",
                 or_else(parts->head, ""), or_else(parts->name, "sphere"),
                 or_else(parts->source, SMALL_SPHERE), or_else(parts->material, SOFT_MATERIAL),
                 or_else(parts->body, SMALL_SHAPE LOWER_FIXED), or_else(parts->others, ""),
                 or_else(parts->tail, ""));
    assert_in_range(length, 0, sizeof text - 1);
    const char *path = scratch(file);
    write_text(path, text);
    return path;
}

const char *write_scene(const char *file, const char *head, const char *tail)
{
    return write_body_scene(file, &(SceneParts){.head = head, .tail = tail});
}
