// SPDX-License-Identifier: MIT
#include "touch/certify.h"

#include <math.h>
#include <string.h>

const char *sheet_verdict(FigureId id, double value)
{
    const Figure *figure = &FIGURES[id];
    if (isinf(figure->high) || isnan(value))
        return "";
    return value >= figure->low && value <= figure->high ? "met" : "missed";
}

// Three digits are what these figures are good for. -0 is 0.
static void put_number(double value, const char *none, FILE *out)
{
    if (isfinite(value))
        fprintf(out, "%.3g", value + 0.0);
    else
        fputs(none, out);
}

void sheet_page(const Certificate *certificate, FILE *out)
{
    fprintf(
        out,
        "# Touch: %s\n\nTool %d, tip %.3g mm, pressed %.3g mm into body %s at %g Hz.\n"
        "Device and network: `%s`.\n\n"
        "| figure | value | unit | least | most | | what it is |\n|---|---|---|---|---|---|---|\n",
        certificate->scene->name, certificate->tool, 1e3 * certificate->radius,
        1e3 * certificate->depth, certificate->body, certificate->rate_hz, certificate->device);
    for (int k = 0; k < FIGURE_COUNT; k++) {
        const Figure *figure = &FIGURES[k];
        const double value = certificate->value[k];
        fprintf(out, "| `%s` | ", figure->name);
        put_number(value, "", out);
        fprintf(out, " | %s | ", figure->unit);
        put_number(figure->low, "", out);
        fprintf(out, " | ");
        put_number(figure->high, "", out);
        fprintf(out, " | %s | %s |\n", sheet_verdict((FigureId)k, value), figure->meaning);
    }
}

// The names of scenes and bodies have no characters that JSON would escape; a device's text has
// been parsed.
void sheet_json(const Certificate *certificate, FILE *out)
{
    fprintf(out,
            "{\"format\": \"pliant-touch\", \"scene\": \"%s\", \"tool\": %d, \"body\": \"%s\",\n"
            " \"radius_m\": %.6g, \"depth_m\": %.6g, \"rate_hz\": %g, \"device\": \"%s\",\n"
            " \"figures\": [\n",
            certificate->scene->name, certificate->tool, certificate->body, certificate->radius,
            certificate->depth, certificate->rate_hz, certificate->device);
    for (int k = 0; k < FIGURE_COUNT; k++) {
        const Figure *figure = &FIGURES[k];
        fprintf(out, "  {\"name\": \"%s\", \"value\": ", figure->name);
        put_number(certificate->value[k], "null", out);
        fprintf(out, ", \"unit\": \"%s\", \"least\": ", figure->unit);
        put_number(figure->low, "null", out);
        fputs(", \"most\": ", out);
        put_number(figure->high, "null", out);
        fprintf(out, ", \"verdict\": \"%s\"}%s\n",
                sheet_verdict((FigureId)k, certificate->value[k]), k + 1 < FIGURE_COUNT ? "," : "");
    }
    fputs(" ]}\n", out);
}
