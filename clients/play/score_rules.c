// SPDX-License-Identifier: MIT
// What a session is judged by: the group `score` and the fixed nodes of a scene, from its file or
// from the text that a recording has of it.
#include "score.h"

#include "base/check.h"
#include "scene/scene_parts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

static bool read_fixed(const SceneReader *reader, const config_setting_t *bodies, ScoreRules *rules)
{
    const int count = option_length(bodies);
    if (count > SCENE_BODIES)
        return option_fail(&reader->source, bodies, "bodies has %d entries, at most %d", count,
                           SCENE_BODIES);
    rules->fixed = calloc((size_t)count + 1, sizeof *rules->fixed);
    ASSERT(rules->fixed != NULL);
    for (int i = 0; i < count; i++) {
        const config_setting_t *group = config_setting_get_elem(bodies, (unsigned)i);
        const config_setting_t *list =
            config_setting_is_group(group) ? config_setting_get_member(group, "fixed") : NULL;
        ScoreFixed *fixed = &rules->fixed[rules->fixed_count++];
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

// The ledger has the others.
static void keep_goals(SceneScore *score)
{
    int kept = 0;
    for (int i = 0; i < score->region_count; i++)
        if (scene_region_is_goal(&score->region[i]))
            score->region[kept++] = score->region[i];
    score->region_count = kept;
}

static bool read_group(const config_t *config, const SceneReader *reader, ScoreRules *rules)
{
    const config_setting_t *root = config_root_setting(config);
    const config_setting_t *group = config_setting_get_member(root, "score");
    const config_setting_t *bodies = config_setting_get_member(root, "bodies");
    if (group != NULL && !config_setting_is_group(group))
        return option_fail(&reader->source, group, "score must be a group { ... }");
    if (bodies != NULL && !config_setting_is_list(bodies))
        return option_fail(&reader->source, bodies, "bodies must be a list ( ... )");
    if (!scene_read_score_group(reader, group, &rules->scene))
        return false;
    keep_goals(&rules->scene);
    return (bodies == NULL || read_fixed(reader, bodies, rules));
}

bool score_rules_read(const char *text, const char *name, ScoreRules *rules, Status *status)
{
    *rules = (ScoreRules){0};
    char *copy = copy_text(text);
    config_t config;
    config_init(&config);
    const SceneReader reader = {.source = {.path = name, .status = status}, .folder = "."};
    const bool ok =
        scene_source_parse(name, copy, &config, status) && read_group(&config, &reader, rules);
    config_destroy(&config);
    free(copy);
    if (!ok)
        score_rules_destroy(rules);
    return ok;
}

bool score_rules_load(const char *path, ScoreRules *rules, Status *status)
{
    *rules = (ScoreRules){0};
    config_t config;
    config_init(&config);
    char *text = scene_source_read(path, &config, status);
    const SceneReader reader = {.source = {.path = path, .status = status}, .folder = "."};
    const bool ok = text != NULL && read_group(&config, &reader, rules);
    config_destroy(&config);
    free(text);
    if (!ok)
        score_rules_destroy(rules);
    return ok;
}

void score_rules_destroy(ScoreRules *rules)
{
    for (int i = 0; i < rules->fixed_count; i++) {
        for (int k = 0; k < rules->fixed[i].count; k++)
            free((void *)rules->fixed[i].region[k].node);
        free((void *)rules->fixed[i].region);
    }
    free(rules->fixed);
    *rules = (ScoreRules){0};
}
