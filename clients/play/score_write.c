// SPDX-License-Identifier: MIT
// The score sheet for programs: JSON and CSV, and the files of a sheet.
#include "score_parts.h"

#include "base/check.h"
#include "base/output.h"

#include <stdlib.h>
#include <string.h>

#define JSON_MARK "{\"format\": \"pliant-score\""
#define CSV_MARK  "subject,name,measure,value,unit\n"

#define AT(member) offsetof(ScoreTool, member)
const ScoreMeasure score_measure[SCORE_MEASURES] = {
    {"time_s", "time in use", "s", 1.0, AT(time_s), false},
    {"path_m", "path length", "m", 1.0, AT(path_m), false},
    {"mean_speed_m_s", "mean speed", "mm/s", 1e3, AT(mean_speed_m_s), false},
    {"idle_fraction", "idle (below 5 mm/s)", "%", 100.0, AT(idle_fraction), false},
    {"movements", "movements", "", 1.0, AT(movements), true},
    {"smoothness", "smoothness (spectral arc length)", "", 1.0, AT(smoothness), false},
    {"contact_time_s", "time in contact", "s", 1.0, AT(contact_time_s), false},
    {"peak_force_n", "peak force", "N", 1.0, AT(peak_force_n), false},
    {"peak_time_s", "time of the peak", "s", 1.0, AT(peak_time_s), false},
    {"mean_force_n", "mean force in contact", "N", 1.0, AT(mean_force_n), false},
    {"force_time_n_s", "integral of force over time", "N s", 1.0, AT(force_time_n_s), false},
    {"over_limit_s", "time above the limit", "s", 1.0, AT(over_limit_s), false},
    {"over_limit_fraction", "share of time above the limit", "%", 100.0, AT(over_limit_fraction),
     false},
    {"over_limit_count", "times above the limit", "", 1.0, AT(over_limit_count), true},
    {"rows", "recorded positions", "", 1.0, AT(rows), true},
    {"rate_hz", "their rate", "Hz", 1.0, AT(rate_hz), false},
    {"gaps", "gaps between them", "", 1.0, AT(gaps), true},
};
#undef AT

double score_value(const ScoreTool *tool, const ScoreMeasure *measure)
{
    const char *at = (const char *)tool + measure->offset;
    return measure->whole ? (double)*(const int64_t *)(const void *)at
                          : *(const double *)(const void *)at;
}

const char *score_cut_unit(bool solid)
{
    return solid ? "m2" : "m";
}

const char *score_size_unit(bool solid)
{
    return solid ? "m3" : "m2";
}

// --- JSON ----------------------------------------------------------------------------------------

void score_put_text(const char *text, FILE *out)
{
    fputc('"', out);
    for (; *text != '\0'; text++) {
        const unsigned char c = (unsigned char)*text;
        // Bytes beyond ASCII may be no UTF-8.
        if (c == '"' || c == '\\')
            fprintf(out, "\\%c", c);
        else if (c < 0x20 || c >= 0x7f)
            fprintf(out, "\\u%04x", c < 0x20 ? c : 0xfffd);
        else
            fputc(c, out);
    }
    fputc('"', out);
}

static void put_number(double value, FILE *out)
{
    if (isfinite(value))
        fprintf(out, "%.9g", value);
    else
        fputs("null", out);
}

static void put_member(const char *name, double value, FILE *out)
{
    fprintf(out, ", \"%s\": ", name);
    put_number(value, out);
}

static void put_numbers(const char *name, const double *value, int count, FILE *out)
{
    fprintf(out, "\"%s\": [", name);
    for (int i = 0; i < count; i++) {
        fputs(i > 0 ? ", " : "", out);
        put_number(value[i], out);
    }
    fputc(']', out);
}

static void put_vector(const char *name, Vec3 v, FILE *out)
{
    const double value[3] = {v.x, v.y, v.z};
    put_numbers(name, value, 3, out);
}

static void put_rules(const Score *score, FILE *out)
{
    const ScoreRules *rules = &score->rules;
    fputs("  \"rules\": {\"force_limit_n\": ", out);
    put_number(rules->scene.force_limit > 0.0 ? rules->scene.force_limit : SCORE_UNKNOWN, out);
    fprintf(out, ", \"fixed_known\": %s, \"regions\": [", score->fixed_known ? "true" : "false");
    for (int i = 0; i < rules->scene.region_count; i++) {
        const FixedRegion *region = &rules->scene.region[i].region;
        fputs(i > 0 ? ",\n    {\"name\": " : "\n    {\"name\": ", out);
        score_put_text(rules->scene.region[i].name, out);
        if (region->kind == FIXED_BOX) {
            fputs(", ", out);
            put_vector("low_m", region->low, out);
            fputs(", ", out);
            put_vector("high_m", region->high, out);
        } else {
            fputs(", ", out);
            put_vector("center_m", region->center, out);
            put_member("radius_m", region->radius, out);
        }
        fputc('}', out);
    }
    fputs("]},\n", out);
}

static void put_tool(const ScoreTool *tool, FILE *out)
{
    fprintf(out, "    {\"id\": %d", tool->id);
    for (int m = 0; m < SCORE_MEASURES; m++)
        put_member(score_measure[m].name, score_value(tool, &score_measure[m]), out);
    fputs(",\n     \"force_curve\": {", out);
    put_numbers("time_s", tool->curve.time, tool->curve.count, out);
    fputs(",\n      ", out);
    put_numbers("force_n", tool->curve.force, tool->curve.count, out);
    fputs("}}", out);
}

// "severed_m2": the name of a figure with its unit.
static void put_measured(const char *name, const char *unit, double value, FILE *out)
{
    fprintf(out, ", \"%s_%s\": ", name, unit);
    put_number(value, out);
}

static void put_body(const ScoreBody *body, bool regions, FILE *out)
{
    const char *cut = score_cut_unit(body->solid), *size = score_size_unit(body->solid);
    fputs("    {\"name\": ", out);
    score_put_text(body->name, out);
    fprintf(out, ", \"solid\": %s", body->solid ? "true" : "false");
    put_measured("severed", cut, body->inside + body->outside, out);
    put_measured("severed_inside", cut, regions ? body->inside : SCORE_UNKNOWN, out);
    put_measured("severed_outside", cut, regions ? body->outside : SCORE_UNKNOWN, out);
    put_member("cuts", (double)(body->cuts_inside + body->cuts_outside + body->cuts_both), out);
    put_member("cuts_inside", regions ? (double)body->cuts_inside : SCORE_UNKNOWN, out);
    put_member("cuts_outside", regions ? (double)body->cuts_outside : SCORE_UNKNOWN, out);
    put_member("cuts_both", regions ? (double)body->cuts_both : SCORE_UNKNOWN, out);
    put_member("cuts_refused", (double)body->refused, out);
    put_member("pieces_first", body->pieces_first, out);
    put_member("pieces_last", body->pieces_last, out);
    put_measured("whole", size, body->whole_size, out);
    put_member("removed", body->removed, out);
    put_measured("removed", size, body->removed_size, out);
    fprintf(out, ", \"removed_pieces_%s\": [", size);
    for (int i = 0; i < body->removed && i < SCORE_PIECES; i++) {
        fputs(i > 0 ? ", " : "", out);
        put_number(body->piece[i].size, out);
    }
    fputs("]}", out);
}

static void put_cut(const ScoreCut *cut, bool regions, FILE *out)
{
    const char *unit = score_cut_unit(cut->solid);
    fprintf(out, "    {\"time_s\": %.9g, \"body\": ", cut->time_s);
    score_put_text(cut->body, out);
    fputs(", \"kind\": ", out);
    score_put_text(cut->kind, out);
    put_measured("severed", unit, cut->inside + cut->outside, out);
    put_measured("inside", unit, regions ? cut->inside : SCORE_UNKNOWN, out);
    put_measured("outside", unit, regions ? cut->outside : SCORE_UNKNOWN, out);
    fputc('}', out);
}

void score_write_json(const Score *score, FILE *out)
{
    const bool regions = score->rules.scene.region_count > 0;
    fputs(JSON_MARK ", \"version\": 1,\n  \"scene\": ", out);
    score_put_text(score->scene, out);
    fputs(", \"created_by\": ", out);
    score_put_text(score->created_by, out);
    fprintf(out, ",\n  \"session\": {\"parts\": %d", score->part_count);
    put_member("first_s", score->first_s, out);
    put_member("last_s", score->last_s, out);
    put_member("duration_s", score->last_s - score->first_s, out);
    fprintf(out, ", \"ended\": %s", score->ended ? "true" : "false");
    put_member("frames_missing", (double)score->missing, out);
    put_member("events", (double)score->events, out);
    fputs("},\n", out);
    put_rules(score, out);
    fputs("  \"tools\": [\n", out);
    for (int i = 0; i < score->tool_count; i++) {
        put_tool(&score->tool[i], out);
        fputs(i + 1 < score->tool_count ? ",\n" : "\n", out);
    }
    fputs("  ],\n  \"bodies\": [\n", out);
    for (int i = 0; i < score->body_count; i++) {
        put_body(&score->body[i], regions, out);
        fputs(i + 1 < score->body_count ? ",\n" : "\n", out);
    }
    fputs("  ],\n  \"cuts\": [\n", out);
    for (int i = 0; i < score->cut_count; i++) {
        put_cut(&score->cut[i], regions, out);
        fputs(i + 1 < score->cut_count ? ",\n" : "\n", out);
    }
    fputs("  ]", out);
    score_ledger_json(score, out);
    fputs("\n}\n", out);
}

// --- CSV -----------------------------------------------------------------------------------------

// One row; what is not known has an empty value.
static void put_row(const char *subject, const char *name, const char *measure, double value,
                    const char *unit, FILE *out)
{
    // Names are letters, digits, _ and -: nothing to quote.
    fprintf(out, "%s,%s,%s,", subject, name, measure);
    if (isfinite(value))
        fprintf(out, "%.9g", value);
    fprintf(out, ",%s\n", unit);
}

// The unit as the measure's name has it, in SI.
static const char *unit_of(const ScoreMeasure *measure)
{
    static const char *const unit[][2] = {{"mm/s", "m/s"}, {"%", "1"}, {"", "1"}};
    for (int i = 0; i < 3; i++)
        if (strcmp(measure->unit, unit[i][0]) == 0)
            return unit[i][1];
    return measure->unit;
}

static void put_body_rows(const ScoreBody *body, bool regions, FILE *out)
{
    const char *cut = score_cut_unit(body->solid), *size = score_size_unit(body->solid);
    const struct {
        const char *measure;
        double value;
        const char *unit;
        bool by_region;
    } row[] = {
        {"severed", body->inside + body->outside, cut, false},
        {"severed_inside", body->inside, cut, true},
        {"severed_outside", body->outside, cut, true},
        {"cuts", (double)(body->cuts_inside + body->cuts_outside + body->cuts_both), "1", false},
        {"cuts_inside", (double)body->cuts_inside, "1", true},
        {"cuts_outside", (double)body->cuts_outside, "1", true},
        {"cuts_both", (double)body->cuts_both, "1", true},
        {"cuts_refused", (double)body->refused, "1", false},
        {"pieces_first", body->pieces_first, "1", false},
        {"pieces_last", body->pieces_last, "1", false},
        {"whole", body->whole_size, size, false},
        {"removed", body->removed, "1", false},
        {"removed_size", body->removed_size, size, false},
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++)
        put_row("body", body->name, row[i].measure,
                row[i].by_region && !regions ? SCORE_UNKNOWN : row[i].value, row[i].unit, out);
}

void score_write_csv(const Score *score, FILE *out)
{
    char name[16];
    fputs(CSV_MARK, out);
    put_row("session", score->scene, "duration_s", score->last_s - score->first_s, "s", out);
    put_row("session", score->scene, "parts", score->part_count, "1", out);
    put_row("session", score->scene, "ended", score->ended, "1", out);
    put_row("session", score->scene, "frames_missing", (double)score->missing, "1", out);
    put_row("session", score->scene, "force_limit_n",
            score->rules.scene.force_limit > 0.0 ? score->rules.scene.force_limit : SCORE_UNKNOWN,
            "N", out);
    for (int i = 0; i < score->tool_count; i++)
        for (int m = 0; m < SCORE_MEASURES; m++) {
            snprintf(name, sizeof name, "%d", score->tool[i].id);
            put_row("tool", name, score_measure[m].name,
                    score_value(&score->tool[i], &score_measure[m]), unit_of(&score_measure[m]),
                    out);
        }
    for (int i = 0; i < score->body_count; i++)
        put_body_rows(&score->body[i], score->rules.scene.region_count > 0, out);
    score_ledger_csv(score, out);
}

// --- for people at a terminal --------------------------------------------------------------------

void score_print(const Score *score, FILE *out)
{
    fprintf(out, "%.4g s of %s in %d recording%s%s\n", score->last_s - score->first_s,
            score->scene[0] != '\0' ? score->scene : "a session", score->part_count,
            score->part_count == 1 ? "" : "s", score->ended ? "" : ", not ended");
    for (int i = 0; i < score->tool_count; i++) {
        const ScoreTool *tool = &score->tool[i];
        if (tool->rows == 0)
            continue;
        fprintf(out, "tool %d: %.4g s, path %.4g m, smoothness %.3g, peak %.4g N", tool->id,
                tool->time_s, tool->path_m, tool->smoothness, tool->peak_force_n);
        if (isfinite(tool->over_limit_s))
            fprintf(out, ", %.4g s above %.4g N", tool->over_limit_s,
                    score->rules.scene.force_limit);
        fputc('\n', out);
    }
    for (int i = 0; i < score->body_count; i++) {
        const ScoreBody *body = &score->body[i];
        fprintf(out, "body %s: severed %.4g %s", body->name, body->inside + body->outside,
                score_cut_unit(body->solid));
        if (score->rules.scene.region_count > 0)
            fprintf(out, ", %.4g of it inside", body->inside);
        fprintf(out, "; %d pieces, %d removed with %.4g %s\n", body->pieces_last, body->removed,
                body->removed_size, score_size_unit(body->solid));
    }
    score_ledger_print(score, out);
}

// --- files ---------------------------------------------------------------------------------------

bool score_write(const Score *score, const char *base, Status *status)
{
    static const struct {
        const char *ending, *mark;
        void (*write)(const Score *score, FILE *out);
    } file[] = {{".json", JSON_MARK, score_write_json},
                {".csv", CSV_MARK, score_write_csv},
                {".html", SCORE_PAGE_MARK, score_write_page}};
    const size_t size = strlen(base) + 8;
    char *path = malloc(size);
    ASSERT(path != NULL);
    bool ok = true;
    for (int i = 0; i < 3 && ok; i++) {
        Output output;
        snprintf(path, size, "%s%s", base, file[i].ending);
        FILE *out = output_begin_text(&output, path, file[i].mark, status);
        ok = out != NULL;
        if (!ok)
            break;
        file[i].write(score, out);
        ok = output_end_text(&output, out, ferror(out) == 0, false, status);
    }
    free(path);
    return ok;
}
