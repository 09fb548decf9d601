// SPDX-License-Identifier: MIT
// A certificate of touch: the trials of a scene, their figures, and the page and JSON of them.
#ifndef PLIANT_TOUCH_CERTIFY_H
#define PLIANT_TOUCH_CERTIFY_H

#include "touch/figures.h"
#include "touch/trial.h"

#include <stdio.h>

typedef struct Certificate {
    const Scene *scene;
    const char *device;   // as given
    int tool;             // id
    const char *body;     // name
    double radius, depth; // of tip and press [m]
    double rate_hz;
    double value[FIGURE_COUNT]; // in the figure's unit; NAN: the scene has none
} Certificate;

typedef struct CertifyOptions {
    const char *scene_path, *body; // body: NULL: the first
    const char *device_text;
    DeviceOptions device; // what that text says: what lies between the hand and the server
} CertifyOptions;

// Runs all trials. Returns false with `status`: the scene cannot be built, or nothing be pressed.
bool certify(const Scene *scene, const CertifyOptions *options, Certificate *certificate,
             Status *status);

// Returns "met", "missed", or "" for a figure without bar or value.
const char *sheet_verdict(FigureId id, double value);
// Write it: for readers, and for programs.
void sheet_page(const Certificate *certificate, FILE *out);
void sheet_json(const Certificate *certificate, FILE *out);

#endif
