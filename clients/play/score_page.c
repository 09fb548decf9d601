// SPDX-License-Identifier: MIT
// The score sheet to print: one page without anything from elsewhere, with its pictures inside.
#include "score_parts.h"

#include <string.h>

enum {
    WIDE = 720, // of a curve, in the units of its picture: one for each point
    HIGH = 150,
    SQUARE = 230, // of a path
    CUTS_SHOWN = 60,
};

static const char STYLE[] =
    "@page{size:A4;margin:14mm}"
    "body{font:10pt/1.35 sans-serif;color:#111;max-width:182mm;margin:0 auto;padding:4mm}"
    "h1{font-size:16pt;margin:0}h2{font-size:12pt;margin:6mm 0 1mm;break-after:avoid}"
    "p{margin:1mm 0}.note{color:#555;font-size:8.5pt}.warn{border-left:1mm solid #b00;padding-left:"
    "2mm}"
    "table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}"
    ".wide{font-size:8.5pt}th,td{border-bottom:.2mm solid #bbb;padding:.6mm 2mm;text-align:right}"
    "th:first-child,td:first-child,td.unit{text-align:left}tr{break-inside:avoid}"
    "svg{width:100%;height:auto;display:block}figure{margin:2mm 0;break-inside:avoid}"
    "figcaption{font-size:9pt}.views{display:flex;gap:4mm}.views svg{width:32%}"
    "text{font:9px sans-serif;fill:#333}.views text{font-size:12px}";

void score_put_html(const char *text, FILE *out)
{
    for (; *text != '\0'; text++) {
        const unsigned char c = (unsigned char)*text;
        if (c == '<' || c == '>' || c == '&' || c == '"' || c == '\'')
            fprintf(out, "&#%d;", c);
        else
            fputc(c < 0x20 || c >= 0x7f ? '?' : c, out);
    }
}

static void put_cell(double value, FILE *out)
{
    if (isfinite(value))
        fprintf(out, "<td>%.4g</td>", value);
    else
        fputs("<td>&ndash;</td>", out);
}

// --- tools ---------------------------------------------------------------------------------------

static bool is_used(const ScoreTool *tool)
{
    return tool->rows > 0;
}

static void put_tools(const Score *score, FILE *out)
{
    fputs("<h2>Tools</h2>\n<table><tr><th></th>", out);
    for (int i = 0; i < score->tool_count; i++)
        if (is_used(&score->tool[i]))
            fprintf(out, "<th>tool %d</th>", score->tool[i].id);
    fputs("<th></th></tr>\n", out);
    for (int m = 0; m < SCORE_MEASURES; m++) {
        fprintf(out, "<tr><td>%s</td>", score_measure[m].title);
        for (int i = 0; i < score->tool_count; i++)
            if (is_used(&score->tool[i]))
                put_cell(score_measure[m].factor * score_value(&score->tool[i], &score_measure[m]),
                         out);
        fprintf(out, "<td class=\"unit\">%s</td></tr>\n", score_measure[m].unit);
    }
    fputs("</table>\n", out);
}

// --- curves --------------------------------------------------------------------------------------

static double x_of(const Score *score, double time)
{
    const double whole = score->last_s - score->first_s;
    const double share = whole > 0.0 ? (time - score->first_s) / whole : 0.0;
    return WIDE * fmin(fmax(share, 0.0), 1.0);
}

// Returns the next of 1, 2, 5, 10, ... that is not below a value.
static double round_up(double value)
{
    const double power = value > 0.0 && isfinite(value) ? pow(10.0, floor(log10(value))) : 1.0;
    for (int i = 0; i < 3; i++) {
        const double step = power * (const double[]){1.0, 2.0, 5.0}[i];
        if (value <= step * (1.0 + 1e-9))
            return step;
    }
    return 10.0 * power;
}

static void put_curve(const Score *score, const ScoreTool *tool, FILE *out)
{
    const double limit = score->rules.scene.force_limit,
                 top = round_up(fmax(tool->peak_force_n, limit));
    fprintf(out,
            "<figure><svg viewBox=\"-34 -8 %d %d\">"
            "<path d=\"M0 0V%dH%d\" fill=\"none\" stroke=\"#888\"/>"
            "<text x=\"-4\" y=\"6\" text-anchor=\"end\">%.4g N</text>"
            "<text x=\"-4\" y=\"%d\" text-anchor=\"end\">0</text>"
            "<text x=\"0\" y=\"%d\">%.4g s</text>"
            "<text x=\"%d\" y=\"%d\" text-anchor=\"end\">%.4g s</text>\n",
            WIDE + 40, HIGH + 26, HIGH, WIDE, top, HIGH, HIGH + 12, score->first_s, WIDE, HIGH + 12,
            score->last_s);
    // Cuts below, the limit, then the force.
    for (int i = 0; i < score->cut_count; i++) {
        const double x = x_of(score, score->cut[i].time_s);
        fprintf(out, "<path d=\"M%.1f 0V%d\" stroke=\"#d80\" stroke-width=\".7\"/>", x, HIGH);
    }
    if (limit > 0.0)
        fprintf(out, "<path d=\"M0 %.1fH%d\" stroke=\"#b00\" stroke-dasharray=\"4 3\"/>",
                HIGH * (1.0 - limit / top), WIDE);
    fputs("<path fill=\"none\" stroke=\"#05a\" d=\"", out);
    const double point_s = (score->last_s - score->first_s) / SCORE_CURVE;
    double gap_s = HUGE_VAL; // since the last point with a force
    for (int i = 0; i < tool->curve.count; i++) {
        const double force = tool->curve.force[i];
        gap_s += point_s;
        if (!isfinite(force))
            continue;
        // Slow rows leave points without a force; only a longer time is a gap.
        fprintf(out, "%c%.1f %.1f", gap_s < SCORE_GAP / tool->rate_hz + 2.0 * point_s ? 'L' : 'M',
                x_of(score, tool->curve.time[i]), HIGH * (1.0 - force / top));
        gap_s = 0.0;
    }
    fprintf(out, "\"/></svg><figcaption>Force on tool %d%s%s</figcaption></figure>\n", tool->id,
            limit > 0.0 ? "; dashed: the limit" : "", score->cut_count > 0 ? "; orange: cuts" : "");
}

static void put_path(const ScoreTool *tool, int across, int up, FILE *out)
{
    static const char AXIS[] = "xyz";
    const ScoreCurve *curve = &tool->curve;
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < curve->path_count; i++) {
        const double at[3] = {curve->path[i].x, curve->path[i].y, curve->path[i].z};
        for (int k = 0; k < 3 && isfinite(at[0]); k++) {
            low[k] = fmin(low[k], at[k]);
            high[k] = fmax(high[k], at[k]);
        }
    }
    // One scale for all views, that of the largest extent.
    double extent = 1e-9, middle[3];
    for (int k = 0; k < 3; k++) {
        extent = fmax(extent, high[k] - low[k]);
        middle[k] = 0.5 * (low[k] + high[k]);
    }
    const double bar = round_up(0.2 * extent);
    bool pen = false;
    fprintf(out,
            "<svg viewBox=\"-10 -10 %d %d\"><path fill=\"none\" stroke-linecap=\"round\" "
            "stroke=\"#05a\" d=\"",
            SQUARE + 20, SQUARE + 30);
    for (int i = 0; i < curve->path_count; i++) {
        const double at[3] = {curve->path[i].x, curve->path[i].y, curve->path[i].z};
        if (isfinite(at[0]))
            fprintf(out, "%c%.1f %.1f", pen ? 'L' : 'M',
                    SQUARE * (0.5 + (at[across] - middle[across]) / extent),
                    SQUARE * (0.5 - (at[up] - middle[up]) / extent));
        pen = isfinite(at[0]);
    }
    fprintf(out,
            "\"/><path d=\"M0 %dH%.1f\" stroke=\"#333\" stroke-width=\"2\"/>"
            "<text x=\"0\" y=\"%d\">%.3g mm; across %c, up %c</text></svg>",
            SQUARE + 6, SQUARE * bar / extent, SQUARE + 17, 1e3 * bar, AXIS[across], AXIS[up]);
}

static void put_pictures(const Score *score, FILE *out)
{
    fputs("<h2>Force over time</h2>\n", out);
    int curves = 0;
    for (int i = 0; i < score->tool_count; i++)
        if (score->tool[i].peak_force_n > 0.0) {
            put_curve(score, &score->tool[i], out);
            curves++;
        }
    if (curves == 0)
        fputs("<p>No tool felt a force.</p>\n", out);
    fputs("<h2>Paths</h2>\n", out);
    for (int i = 0; i < score->tool_count; i++) {
        if (!is_used(&score->tool[i]))
            continue;
        fputs("<figure><div class=\"views\">", out);
        put_path(&score->tool[i], 0, 1, out);
        put_path(&score->tool[i], 0, 2, out);
        put_path(&score->tool[i], 1, 2, out);
        fprintf(out, "</div><figcaption>Path of tool %d</figcaption></figure>\n",
                score->tool[i].id);
    }
}

// --- tissue --------------------------------------------------------------------------------------

// Shown in millimetres and their powers.
static const char *shown_unit(bool solid, bool size)
{
    return size ? (solid ? "cm&sup3;" : "cm&sup2;") : (solid ? "mm&sup2;" : "mm");
}

static double shown(double value, bool solid, bool size)
{
    return value * (size ? (solid ? 1e6 : 1e4) : (solid ? 1e6 : 1e3));
}

static void put_body(const ScoreBody *body, bool regions, FILE *out)
{
    const bool solid = body->solid;
    fputs("<tr><td>", out);
    score_put_html(body->name, out);
    fputs("</td>", out);
    put_cell(shown(body->inside + body->outside, solid, false), out);
    put_cell(regions ? shown(body->inside, solid, false) : SCORE_UNKNOWN, out);
    put_cell(regions ? shown(body->outside, solid, false) : SCORE_UNKNOWN, out);
    fprintf(out, "<td class=\"unit\">%s</td>", shown_unit(solid, false));
    put_cell((double)(body->cuts_inside + body->cuts_outside + body->cuts_both), out);
    put_cell(regions ? (double)body->cuts_inside : SCORE_UNKNOWN, out);
    put_cell(regions ? (double)body->cuts_outside : SCORE_UNKNOWN, out);
    put_cell(regions ? (double)body->cuts_both : SCORE_UNKNOWN, out);
    put_cell((double)body->refused, out);
    put_cell(body->pieces_last, out);
    put_cell(body->removed, out);
    put_cell(shown(body->removed_size, solid, true), out);
    fprintf(out, "<td class=\"unit\">%s</td></tr>\n", shown_unit(solid, true));
}

static void put_tissue(const Score *score, FILE *out)
{
    const bool regions = score->rules.scene.region_count > 0;
    fputs("<h2>Tissue</h2>\n<table class=\"wide\"><tr><th></th><th>severed</th><th>inside</th>"
          "<th>outside</th><th></th><th>cuts</th><th>inside</th><th>outside</th><th>both</th>"
          "<th>refused</th><th>pieces</th><th>removed</th><th>size</th><th></th></tr>\n",
          out);
    for (int i = 0; i < score->body_count; i++)
        put_body(&score->body[i], regions, out);
    fputs("</table>\n<p class=\"note\">Of walls the length of the cut edge, of solids the area of "
          "the "
          "section, in the shape of the first frame. Removed: pieces at the end that are neither "
          "the largest",
          out);
    fputs(score->fixed_known ? " nor fixed by the scene.</p>\n"
                             : "; which nodes are fixed was not recorded.</p>\n",
          out);
    if (score->cut_count == 0)
        return;
    fputs("<table class=\"wide\"><tr><th>cut</th><th>time [s]</th><th>event</th><th>body</th>"
          "<th>severed</th><th>inside</th><th>outside</th><th></th></tr>\n",
          out);
    for (int i = 0; i < score->cut_count && i < CUTS_SHOWN; i++) {
        const ScoreCut *cut = &score->cut[i];
        fprintf(out, "<tr><td>%d</td>", i + 1);
        put_cell(cut->time_s, out);
        fputs("<td>", out);
        score_put_html(cut->kind[0] != '\0' ? cut->kind : "none", out);
        fputs("</td><td>", out);
        score_put_html(cut->body, out);
        fputs("</td>", out);
        put_cell(shown(cut->inside + cut->outside, cut->solid, false), out);
        put_cell(regions ? shown(cut->inside, cut->solid, false) : SCORE_UNKNOWN, out);
        put_cell(regions ? shown(cut->outside, cut->solid, false) : SCORE_UNKNOWN, out);
        fprintf(out, "<td class=\"unit\">%s</td></tr>\n", shown_unit(cut->solid, false));
    }
    fputs("</table>\n", out);
    if (score->cut_count > CUTS_SHOWN)
        fprintf(out, "<p class=\"note\">%d more are in the JSON file.</p>\n",
                score->cut_count - CUTS_SHOWN);
}

// --- the page ------------------------------------------------------------------------------------

static void put_regions(const ScoreRules *rules, FILE *out)
{
    for (int i = 0; i < rules->scene.region_count; i++) {
        const FixedRegion *region = &rules->scene.region[i].region;
        const Vec3 a = region->low, b = region->high, c = region->center;
        fputs(i > 0 ? "; " : " Regions: ", out);
        score_put_html(rules->scene.region[i].name, out);
        if (region->kind == FIXED_BOX)
            fprintf(out, " (box from %.4g, %.4g, %.4g to %.4g, %.4g, %.4g m)", a.x, a.y, a.z, b.x,
                    b.y, b.z);
        else
            fprintf(out, " (ball of %.4g m around %.4g, %.4g, %.4g m)", region->radius, c.x, c.y,
                    c.z);
    }
    fputs(rules->scene.region_count > 0 ? "." : " The scene names no regions.", out);
}

static void put_head(const Score *score, FILE *out)
{
    fputs("<h1>Score sheet: ", out);
    score_put_html(score->scene[0] != '\0' ? score->scene : "a session", out);
    fprintf(out, "</h1>\n<p>%.4g s of simulated time, from %.6g to %.6g s; %d %s, written by ",
            score->last_s - score->first_s, score->first_s, score->last_s, score->part_count,
            score->part_count == 1 ? "recording" : "recordings");
    score_put_html(score->created_by, out);
    fputs(".</p>\n", out);
    if (!score->ended)
        fputs("<p class=\"warn\">The recording was not ended: the session may have gone on.</p>\n",
              out);
    if (score->missing > 0)
        fprintf(out, "<p class=\"warn\">%lld frames are missing in the recording.</p>\n",
                (long long)score->missing);
    if (score->rules.scene.force_limit > 0.0)
        fprintf(out, "<p>Force limit: %.4g N.", score->rules.scene.force_limit);
    else
        fputs("<p>The scene names no force limit.", out);
    put_regions(&score->rules, out);
    fputs("</p>\n", out);
}

void score_write_page(const Score *score, FILE *out)
{
    fprintf(out,
            SCORE_PAGE_MARK "\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Score "
                            "sheet</title><style>%s</style></head><body>\n",
            STYLE);
    put_head(score, out);
    put_tools(score, out);
    put_pictures(score, out);
    put_tissue(score, out);
    score_ledger_page(score, out);
    fputs("<p class=\"note\">Every measure is defined in clients/play/SCORE.md of Pliant.</p>\n"
          "</body></html>\n",
          out);
}
