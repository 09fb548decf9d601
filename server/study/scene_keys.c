// Cases as keys of a scene.
#include "study/scene_keys.h"

#include "study/field.h"

#include <math.h>
#include <string.h>

// Thresholds of a scene that has none: those that its reference (config/README.md) gives.
static const SurfaceAdapt USUAL = {.force = 0.005, .speed = 0.3, .curvature = 0.4, .check_hz = 100.0};

static SceneKey *add(SceneKey *keys, int *count, const char *name)
{
    SceneKey *key = &keys[(*count)++];
    snprintf(key->name, sizeof key->name, "%s", name);
    key->value[0] = '\0';
    return key;
}

static void set_text(SceneKey *key, const char *text)
{
    snprintf(key->value, sizeof key->value, "\"%s\"", text);
}

// So that it is read as a real, and as the same.
static const char *real_text(double value, char *text)
{
    field_print_real(value, text);
    if (strpbrk(text, ".e") == NULL)
        strcat(text, ".0");
    return text;
}

static void set_real(SceneKey *key, double value)
{
    char text[FIELD_TEXT_MAX];
    snprintf(key->value, sizeof key->value, "%.60s", real_text(value, text));
}

static void set_int(SceneKey *key, int value)
{
    snprintf(key->value, sizeof key->value, "%d", value);
}

static void set_adapt(SceneKey *key, const SurfaceAdapt *base, double threshold, double rate_hz)
{
    char force[FIELD_TEXT_MAX], speed[FIELD_TEXT_MAX], curvature[FIELD_TEXT_MAX];
    char check[FIELD_TEXT_MAX];
    snprintf(key->value, sizeof key->value,
             "{ force = %.30s;  speed = %.30s;  curvature = %.30s;  check_hz = %.30s; }",
             real_text(base->force * threshold, force), real_text(base->speed * threshold, speed),
             real_text(base->curvature * threshold, curvature),
             real_text(fmin(base->check_hz, rate_hz), check));
}

static void add_detail(const SceneBody *body, const StudyCase *what, double rate_hz,
                       SceneKeys *keys)
{
    bool surface = body->model == MODEL_SURFACE;
    if (what->detail == DETAIL_SCENE)
        return;
    set_int(add(keys->body, &keys->body_count, "levels"), what->level);
    if (!surface)
        return;
    bool adaptive = what->detail == DETAIL_ADAPTIVE;
    set_int(add(keys->body, &keys->body_count, "start_level"), adaptive ? 0 : what->level);
    SceneKey *adapt = add(keys->body, &keys->body_count, "adapt");
    if (adaptive)
        set_adapt(adapt, body->surface.adaptive ? &body->surface.adapt : &USUAL, what->threshold,
                  rate_hz);
}

void scene_keys_of_case(const Scene *scene, const StudyCase *what, double rate_hz, SceneKeys *keys)
{
    const SceneBody *body = &scene->body[0];
    *keys = (SceneKeys){0};
    set_real(add(keys->top, &keys->top_count, "rate_hz"), rate_hz);
    set_text(add(keys->top, &keys->top_count, "precision"), study_precision_name(what->precision));
    set_text(add(keys->body, &keys->body_count, "integrator"), integrator_name(what->integrator));
    SceneKey *step = add(keys->body, &keys->body_count, "time_step");
    if (what->time_step > 0.0)
        set_real(step, what->time_step);
    if (body->model == MODEL_SURFACE)
        set_text(add(keys->body, &keys->body_count, "adjust"),
                 what->paper_rule ? "choi2005" : "continuum");
    else
        set_text(add(keys->body, &keys->body_count, "law"),
                 what->paper_rule ? "miyazaki2004" : "affine");
    add_detail(body, what, rate_hz, keys);
}

static void print_keys(const SceneKey *keys, int count, const char *indent, FILE *out)
{
    for (int i = 0; i < count; i++)
        if (keys[i].value[0] != '\0')
            fprintf(out, "%s%s = %s;\n", indent, keys[i].name, keys[i].value);
        else
            fprintf(out, "%s# no %s\n", indent, keys[i].name);
}

void scene_keys_print(const SceneKeys *keys, FILE *out)
{
    print_keys(keys->top, keys->top_count, "", out);
    fputs("# and in the body:\n", out);
    print_keys(keys->body, keys->body_count, "    ", out);
}
