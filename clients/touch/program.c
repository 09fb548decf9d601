// SPDX-License-Identifier: MIT
// pliant-touch: certifies how a scene feels; a page on the standard output or in files.
#include "touch/certify.h"

#include "base/arguments.h"
#include "base/log.h"
#include "base/output.h"
#include "run/realtime.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#define DEVICE "noise=20e-6,quantum=20e-6,gap=0.06/0.25,late=0.002,jitter=0.0005,loss=0.01,seed=1"

typedef struct Options {
    CertifyOptions by;
    const char *base;
} Options;

static bool take_device(void *target, const char *text, Status *why)
{
    Options *options = target;
    options->by.device_text = text;
    return device_parse(text, &options->by.device, why);
}

static bool check(void *target, Status *why)
{
    Options *options = target;
    if (options->by.scene_path == NULL)
        return status_fail(why, STATUS_INVALID, "no scene given");
    return options->by.device_text != NULL || take_device(options, DEVICE, why);
}

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_ROWS, .rows = ARGUMENTS_SCENE, .offset = offsetof(Options, by.scene_path)},
    {"out", 'o', ARGUMENT_TEXT, "BASE", offsetof(Options, base),
     .help = "Write BASE.md and BASE.json, instead of printing the page"},
    {"body", 0, ARGUMENT_TEXT, "NAME", offsetof(Options, by.body),
     .help = "Body to press, where pliant-study would press it; by default the first"},
    {"device", 0, ARGUMENT_OTHER, "ITEM,...", .preset_text = DEVICE, .handler = take_device,
     .help = "Device and network between the hand and the server, as of pliant-probe"},
    {.type = ARGUMENT_ROWS, .rows = ARGUMENTS_LOG_LEVEL},
    {0}};

static const ArgumentTable TABLE = {
    .program = "pliant-touch",
    .usage = "SCENE.cfg",
    .about = "Certifies how a scene feels: presses, holds, drags, pulls and releases it offline "
             "with a simulated hand, device and network, and lists forces, oscillations, energies "
             "and the largest stable stiffness, each with its bar. Deterministic.",
    .end = "Exit code 0: done, whether bars are met or not; 1: failed while running; 2: bad usage, "
           "scene, mesh or file.",
    .rows = ROWS,
    .check = check};

static bool write_file(const Certificate *certificate, const char *base, const char *end,
                       const char *mark, void (*write)(const Certificate *, FILE *), Status *status)
{
    char path[4096];
    snprintf(path, sizeof path, "%s%s", base, end);
    if (!output_check(path, mark, status))
        return false;
    FILE *out = fopen(path, "w");
    if (out == NULL)
        return status_fail(status, STATUS_FAILED, "%s: cannot be written", path);
    write(certificate, out);
    return fclose(out) == 0 || status_fail(status, STATUS_FAILED, "%s: the disk is full?", path);
}

static void run(const Options *options, Status *status)
{
    static Scene scene;
    Certificate certificate;
    if (scene_read(options->by.scene_path, &scene, status) &&
        certify(&scene, &options->by, &certificate, status)) {
        if (options->base == NULL)
            sheet_page(&certificate, stdout);
        else if (write_file(&certificate, options->base, ".md", "# Touch: ", sheet_page, status))
            write_file(&certificate, options->base, ".json", "{\"format\": \"pliant-touch\"",
                       sheet_json, status);
    }
    scene_destroy(&scene);
}

int main(int argc, char **argv)
{
    log_set_program("pliant-touch");
    log_set_level(LOG_ERROR); // pliantd reports what is clamped or repaired
    realtime_flush_denormals();
    static Options options;
    Status status = {0};
    if (arguments_parse(&TABLE, argc, argv, &options, &status))
        run(&options, &status);
    return arguments_exit(&status);
}
