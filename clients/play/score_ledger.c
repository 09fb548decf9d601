// SPDX-License-Identifier: MIT
// The ledger on the score sheet: the last one of the session, with the numbers that were recorded.
#include "score_parts.h"

#include <stdlib.h>
#include <string.h>

bool score_read_ledger(Timeline *timeline, Score *score, Status *status)
{
    const int last = timeline_find_lines(timeline, RECORDING_LEDGERS, score->last_s + 1.0);
    if (last == 0)
        return true;
    score->ledger = score_allocate(LEDGER_LINES, sizeof *score->ledger);
    return timeline_lines(timeline, RECORDING_LEDGERS, last, score->ledger, &score->ledger_count,
                          status);
}

// --- measures ------------------------------------------------------------------------------------

// One number of a line, as all files have it.
typedef struct Measure {
    const char *name, *size_unit; // size_unit: the amount's unit by the body is appended
    int value;
} Measure;

static const Measure TISSUE[] = {{"at_load", "", LEDGER_AT_LOAD},
                                 {"attached", "", LEDGER_ATTACHED},
                                 {"cut_off", "", LEDGER_CUT_OFF},
                                 {"removed", "", LEDGER_REMOVED},
                                 {"coagulated", "", LEDGER_COAGULATED}};
enum { AMOUNTS = sizeof TISSUE / sizeof *TISSUE };

// True if the amounts of a body are volumes.
static bool is_solid(const Score *score, const char *body)
{
    for (int i = 0; i < score->ledger_count; i++)
        if (score->ledger[i].line == LEDGER_BODY && strcmp(score->ledger[i].body, body) == 0)
            return (score->ledger[i].flag & LEDGER_SOLID) != 0;
    return true;
}

static double mass_of(const RecordingLedger *line, int value)
{
    return line->value[LEDGER_DENSITY] * line->value[value];
}

// Returns the distance [m], NaN: nothing was cut or removed.
static double distance_of(const RecordingLedger *line)
{
    return line->value[LEDGER_DISTANCE] >= 0.0 ? line->value[LEDGER_DISTANCE] : SCORE_UNKNOWN;
}

// True if nothing came nearer to a region than it may, and it was not touched if it is to be kept.
static bool is_kept(const RecordingLedger *line)
{
    const double distance = distance_of(line), margin = line->value[LEDGER_MARGIN];
    return !(distance < margin) && !((line->flag & LEDGER_KEEP) && (line->flag & LEDGER_TOUCHED));
}

// --- JSON ----------------------------------------------------------------------------------------

static void put_exact(double value, FILE *out)
{
    if (isfinite(value))
        fprintf(out, "%.17g", value);
    else
        fputs("null", out);
}

static void put_value(const char *name, const char *unit, double value, FILE *out)
{
    fprintf(out, ", \"%s%s%s\": ", name, *unit != '\0' ? "_" : "", unit);
    put_exact(value, out);
}

static void put_tissue(const Score *score, const RecordingLedger *line, FILE *out)
{
    const bool solid = is_solid(score, line->body);
    fputs("\"body\": ", out);
    score_put_text(line->body, out);
    fputs(", \"name\": ", out);
    score_put_text(line->name, out);
    for (int m = 0; m < AMOUNTS; m++)
        put_value(TISSUE[m].name, score_size_unit(solid), line->value[TISSUE[m].value], out);
    for (int m = 0; m < AMOUNTS; m++)
        put_value(TISSUE[m].name, "kg", mass_of(line, TISSUE[m].value), out);
}

static void put_section(const Score *score, const RecordingLedger *line, FILE *out)
{
    (void)score;
    fputs("\"body\": ", out);
    score_put_text(line->body, out);
    put_value("cut", "m2", line->value[LEDGER_CUT], out);
    put_value("torn", "m2", line->value[LEDGER_TORN], out);
}

static void put_region(const Score *score, const RecordingLedger *line, FILE *out)
{
    (void)score;
    fputs("\"name\": ", out);
    score_put_text(line->name, out);
    put_value("margin", "m", line->value[LEDGER_MARGIN], out);
    put_value("distance", "m", distance_of(line), out);
    put_value("time", "s", line->value[LEDGER_TIME], out);
    fputs(", \"body\": ", out);
    score_put_text(line->body, out);
    fputs(", \"by\": ", out);
    score_put_text(line->by, out);
    fprintf(out, ", \"keep\": %s, \"touched\": %s, \"kept\": %s",
            line->flag & LEDGER_KEEP ? "true" : "false",
            line->flag & LEDGER_TOUCHED ? "true" : "false", is_kept(line) ? "true" : "false");
}

static void put_lines(const Score *score, LedgerLine kind,
                      void (*put)(const Score *, const RecordingLedger *, FILE *), FILE *out)
{
    const char *between = "\n    {";
    for (int i = 0; i < score->ledger_count; i++)
        if (score->ledger[i].line == (int32_t)kind) {
            fputs(between, out);
            put(score, &score->ledger[i], out);
            fputc('}', out);
            between = ",\n    {";
        }
}

void score_ledger_json(const Score *score, FILE *out)
{
    if (score->ledger_count == 0)
        return;
    fputs(",\n  \"ledger\": {\"time_s\": ", out);
    put_exact(score->ledger[0].time, out);
    fputs(", \"sections\": [", out);
    put_lines(score, LEDGER_BODY, put_section, out);
    fputs("],\n   \"tissues\": [", out);
    put_lines(score, LEDGER_TISSUE, put_tissue, out);
    fputs("],\n   \"regions\": [", out);
    put_lines(score, LEDGER_REGION, put_region, out);
    fputs("]}", out);
}

// --- CSV -----------------------------------------------------------------------------------------

// Writes a name of a file, quoted if it needs to be.
static void put_name(const char *name, FILE *out)
{
    const bool quoted = strpbrk(name, ",\"\r\n") != NULL;
    fputs(quoted ? "\"" : "", out);
    for (; *name != '\0'; name++)
        fprintf(out, "%s%c", *name == '"' ? "\"" : "", *name);
    fputs(quoted ? "\"" : "", out);
}

static void put_row(const char *subject, const char *name, const char *measure, double value,
                    const char *unit, FILE *out)
{
    fprintf(out, "%s,", subject);
    put_name(name, out);
    fprintf(out, ",%s,", measure);
    if (isfinite(value))
        fprintf(out, "%.17g", value);
    fprintf(out, ",%s\n", unit);
}

void score_ledger_csv(const Score *score, FILE *out)
{
    for (int i = 0; i < score->ledger_count; i++) {
        const RecordingLedger *line = &score->ledger[i];
        if (line->line == LEDGER_BODY) {
            put_row("sections", line->body, "cut", line->value[LEDGER_CUT], "m2", out);
            put_row("sections", line->body, "torn", line->value[LEDGER_TORN], "m2", out);
        } else if (line->line == LEDGER_TISSUE) {
            char name[RECORDING_BODY_TEXT + RECORDING_LEDGER_NAME + 1];
            snprintf(name, sizeof name, "%s/%s", line->body, line->name);
            for (int m = 0; m < AMOUNTS; m++)
                put_row("tissue", name, TISSUE[m].name, line->value[TISSUE[m].value],
                        score_size_unit(is_solid(score, line->body)), out);
        } else {
            put_row("region", line->name, "margin", line->value[LEDGER_MARGIN], "m", out);
            put_row("region", line->name, "distance", distance_of(line), "m", out);
            put_row("region", line->name, "time", line->value[LEDGER_TIME], "s", out);
            put_row("region", line->name, "touched", (line->flag & LEDGER_TOUCHED) != 0, "1", out);
            put_row("region", line->name, "kept", is_kept(line), "1", out);
        }
    }
}

// --- the page ------------------------------------------------------------------------------------

static void put_cell(double value, FILE *out)
{
    if (isfinite(value))
        fprintf(out, "<td>%.4g</td>", value);
    else
        fputs("<td>&ndash;</td>", out);
}

static void put_tissue_table(const Score *score, FILE *out)
{
    fputs("<table class=\"wide\"><tr><th>tissue</th><th>body</th><th>at load</th><th>attached</th>"
          "<th>cut off</th><th>removed</th><th>coagulated</th><th></th><th>cut off, removed "
          "[g]</th></tr>\n",
          out);
    for (int i = 0; i < score->ledger_count; i++) {
        const RecordingLedger *line = &score->ledger[i];
        if (line->line != LEDGER_TISSUE)
            continue;
        const bool solid = is_solid(score, line->body);
        fputs("<tr><td>", out);
        score_put_html(line->name, out);
        fputs("</td><td>", out);
        score_put_html(line->body, out);
        fputs("</td>", out);
        for (int m = 0; m < AMOUNTS; m++)
            put_cell(line->value[TISSUE[m].value] * (solid ? 1e6 : 1e4), out);
        fprintf(out, "<td class=\"unit\">%s</td>", solid ? "cm&sup3;" : "cm&sup2;");
        put_cell(1e3 * (mass_of(line, LEDGER_CUT_OFF) + mass_of(line, LEDGER_REMOVED)), out);
        fputs("</tr>\n", out);
    }
    fputs("</table>\n", out);
}

static void put_region_table(const Score *score, FILE *out)
{
    int regions = 0;
    for (int i = 0; i < score->ledger_count; i++) {
        const RecordingLedger *line = &score->ledger[i];
        if (line->line != LEDGER_REGION)
            continue;
        if (regions++ == 0)
            fputs(
                "<table class=\"wide\"><tr><th>region</th><th>nearest [mm]</th><th>by</th>"
                "<th>margin [mm]</th><th>tools inside [s]</th><th>touched</th><th>kept</th></tr>\n",
                out);
        fputs("<tr><td>", out);
        score_put_html(line->name, out);
        fputs("</td>", out);
        put_cell(1e3 * distance_of(line), out);
        fputs("<td>", out);
        score_put_html(line->by, out);
        fputs("</td>", out);
        put_cell(line->value[LEDGER_MARGIN] > 0.0 ? 1e3 * line->value[LEDGER_MARGIN]
                                                  : SCORE_UNKNOWN,
                 out);
        put_cell(line->value[LEDGER_TIME], out);
        fprintf(out, "<td>%s</td><td>%s</td></tr>\n", line->flag & LEDGER_TOUCHED ? "yes" : "no",
                is_kept(line) ? "yes" : "no");
    }
    fputs(regions > 0 ? "</table>\n" : "", out);
}

void score_ledger_page(const Score *score, FILE *out)
{
    if (score->ledger_count == 0)
        return;
    fputs("<h2>Ledger</h2>\n", out);
    put_tissue_table(score, out);
    fputs("<p class=\"note\">Volumes and areas at rest, at the end of the session. Attached: the "
          "piece with the most of what is fixed, else the largest. Sections: ",
          out);
    for (int i = 0; i < score->ledger_count; i++) {
        const RecordingLedger *line = &score->ledger[i];
        if (line->line != LEDGER_BODY)
            continue;
        score_put_html(line->body, out);
        fprintf(out, " %.4g cm&sup2; cut, %.4g torn. ", 1e4 * line->value[LEDGER_CUT],
                1e4 * line->value[LEDGER_TORN]);
    }
    fputs("</p>\n", out);
    put_region_table(score, out);
}

void score_ledger_print(const Score *score, FILE *out)
{
    for (int i = 0; i < score->ledger_count; i++) {
        const RecordingLedger *line = &score->ledger[i];
        const double *value = line->value;
        if (line->line == LEDGER_TISSUE)
            fprintf(out, "tissue %s of %s: %.4g of %.4g %s attached, %.4g cut off, %.4g removed\n",
                    line->name, line->body, value[LEDGER_ATTACHED], value[LEDGER_AT_LOAD],
                    score_size_unit(is_solid(score, line->body)), value[LEDGER_CUT_OFF],
                    value[LEDGER_REMOVED]);
        else if (line->line == LEDGER_REGION && value[LEDGER_DISTANCE] >= 0.0)
            fprintf(out, "region %s: nearest %s at %.4g m%s\n", line->name, line->by,
                    value[LEDGER_DISTANCE], is_kept(line) ? "" : ", NOT kept");
    }
}
