// SPDX-License-Identifier: MIT
// Writes a proposal as a scene. Load time only.
#include "scene/proposal.h"

static double diagonal_of(const Proposal *p)
{
    return vec3_length(box_size(&p->box));
}

// The length that its tools are made by [m]: for a body without extent any.
static double size_of(const Proposal *p)
{
    return diagonal_of(p) > 0.0 ? diagonal_of(p) : 1.0;
}

static void write_text(const char *text, FILE *out)
{
    fputc('"', out);
    for (; *text != '\0'; text++) {
        if (*text == '"' || *text == '\\')
            fputc('\\', out);
        fputc(*text, out);
    }
    fputc('"', out);
}

// Fixes the lowest share of a box, with `margin` [m] below and at the sides.
static void write_box(const Box *box, double share, double margin, FILE *out)
{
    const Vec3 low = box_low(box), high = box_high(box);
    const double top = low.z + share * (high.z - low.z) + 1e-3 * margin;
    fprintf(out, "{ box = ([%.6g, %.6g, %.6g], [%.6g, %.6g, %.6g]); }", low.x - margin,
            low.y - margin, low.z - margin, high.x + margin, high.y + margin, top);
}

// Fixes the lower end of each piece.
static void write_fixed(const Proposal *p, double share, FILE *out)
{
    const double size = diagonal_of(p);
    if (size <= 0.0)
        return;
    fprintf(out, "    fixed = ( ");
    if (p->piece_count == 0)
        write_box(&p->box, share, 0.1 * size, out);
    for (int i = 0; i < p->piece_count; i++) {
        fprintf(out, i > 0 ? ",\n              " : "");
        write_box(&p->piece[i], share, 1e-3 * size, out);
    }
    fprintf(out, " );   # what holds it\n");
}

static void write_wall(const Proposal *p, const char *file, FILE *out)
{
    fprintf(out, "    mesh = { file = ");
    write_text(file, out);
    fprintf(out, ";  scale = %.9g; };\n", p->scale);
    fprintf(out, "    material = { youngs_modulus_2d = 80.0;  areal_density = 4.2;  damping_time = "
                 "2.0e-4; };\n"
                 "    shape = { angular_frequency = 50.0;  damping_ratio = 0.1; };\n");
    if (p->implicit)
        fprintf(out, "    integrator = \"implicit\";\n");
    if (p->fluid)
        fprintf(out, "    cavity = { fluid = true; };   # what is in it keeps its volume\n");
    write_fixed(p, 0.1, out);
}

static void write_parts(const Proposal *p, FILE *out)
{
    for (int i = 0; i < p->part_count; i++)
        fprintf(out, "%s%d", i == 0 ? "  label = [" : ", ", p->part[i].label);
    fprintf(out, "];");
}

// Writes the colours of the labels that have one, after the material that they share.
static void write_materials(const Proposal *p, FILE *out)
{
    bool any = false;
    for (int i = 0; i < p->part_count; i++) {
        const float *c = proposal_label_colour(&p->part[i]);
        if (c == NULL)
            continue;
        fprintf(
            out,
            "%s      { label = %d;  color = [%.3f, %.3f, %.3f];  inside = [%.3f, %.3f, %.3f]; }",
            any ? ",\n" : "    materials = (\n", p->part[i].label, (double)c[0], (double)c[1],
            (double)c[2], (double)c[0], (double)c[1], (double)c[2]);
        any = true;
    }
    if (any)
        fprintf(out, "\n    );\n");
}

static void write_solid(const Proposal *p, const char *file, FILE *out)
{
    fprintf(out, "    voxels = { %s = ", p->volume ? "file" : "mesh");
    // The source, then one material for all of it.
    write_text(file, out);
    fprintf(out, ";");
    if (p->part_count > 0)
        write_parts(p, out);
    else if (p->volume)
        fprintf(out, "  label = %d;", p->label);
    if (p->volume && p->layer > 0)
        fprintf(out, "  layer = %d;", p->layer);
    fprintf(out, "%s  scale = %.9g;", p->filled && !p->volume ? "  inner = \"filled\";" : "",
            p->scale);
    if (p->cell > 0.0)
        fprintf(out, "  size = %.9g;", p->cell);
    fprintf(out,
            " };\n    levels = 2;\n"
            "    material = { youngs_modulus = 1.0e4;  poisson_ratio = 0.3;  density = 1000.0;%s };"
            "\n",
            p->whole ? "" : "  prestress = 800.0;");
    write_materials(p, out);
    write_fixed(p, 0.35, out);
}

// Writes the colour; of a label also where the scan goes that it was segmented from.
static void write_look(const Proposal *p, FILE *out)
{
    if (!p->coloured)
        return;
    fprintf(out, "    look = { color = [%.3f, %.3f, %.3f]; };", (double)p->colour[0],
            (double)p->colour[1], (double)p->colour[2]);
    fprintf(out, p->volume ? "   # with image = \"SCAN.nrrd\" in it cuts show the scan\n" : "\n");
}

// Writes a tool of each kind that hands move, in proportion to the body.
static void write_tools(const Proposal *p, FILE *out)
{
    const double size = size_of(p);
    fprintf(out,
            "tools = (\n"
            "  { id = 1;  kind = \"probe\";  max_force = 10.0;\n"
            "    capsules = ( { from = [0.0, 0.0, 0.0];  to = [0.0, 0.0, %.6g];  radius = %.6g; } "
            "); }",
            size / 2.0, size / (p->model == MODEL_SURFACE ? 50.0 : 20.0));
    // The blade is as long as the body, so that a stroke through its middle leaves no bridge.
    fprintf(out,
            ",\n  { id = 2;  kind = \"blade\";  edge = ([0.0, 0.0, 0.0], [0.0, 0.0, %.6g]); },\n"
            "  { id = 3;  kind = \"grasper\";  max_force = 10.0;\n"
            "    capsules = ( { radius = %.6g; } ); }",
            size, size / 20.0);
    // What takes tissue away: a tube that does so in half a minute for a hundredth of the body's
    // box, and a burr. Of walls it would be whole faces.
    if (p->model != MODEL_SURFACE && !p->whole)
        fprintf(
            out,
            ",\n"
            "  { id = 4;  kind = \"remover\";  removes_by = \"suction\";  rate_mm3_s = %.3g;\n"
            "    mouth = { to = [0.0, 0.0, %.6g];  radius = %.6g; };\n"
            "    capsules = ( { from = [0.0, 0.0, %.6g];  to = [0.0, 0.0, %.6g];  radius = %.6g; } "
            "); },\n"
            "  { id = 5;  kind = \"remover\";  removes_by = \"drill\";\n"
            "    mouth = { radius = %.6g; }; }",
            1e9 * size * size * size / 3000.0, size / 30.0, size / 30.0, size / 10.0, 0.8 * size,
            size / 30.0, size / 30.0);
    fprintf(out, "\n);\n");
}

void proposal_write(const Proposal *p, const char *file, FILE *out)
{
    const bool wall = p->model == MODEL_SURFACE;
    const double size = size_of(p);
    // How to try it, in lengths of the body.
    fprintf(out, "# Proposed by pliant-prepare as a %s",
            p->fluid ? "wall full of a fluid"
            : wall   ? "wall"
                     : "solid");
    if (p->label_name[0] != '\0')
        fprintf(out, " (%s)", p->label_name);
    fprintf(out, ". Press it with\n");
    fprintf(out, "# pliant-probe --auto --clearance %.6f --depth %.6f --speed %.6f\n",
            size / (wall ? 25.0 : 12.0), size / (wall ? 20.0 : 16.0), size / 10.0);
    // A tenth of E times the depth times the probe's radius; for a wall of 25 cm a sixth of the
    // measured force.
    fprintf(out, "# which feels %.2g N or more, unless it meets a thin or loose part.\n",
            wall ? 0.2 * size : 3.0 * size * size);
    // The body.
    fprintf(out,
            "name = \"organ\";\n"
            "publish = { rest = true; };   # colours by displacement on the page\n"
            "tool_timeout_s = 1.0;         # a browser on a busy machine falls silent for a while\n"
            "bodies = (\n  { name = \"organ\";  model = \"%s\";\n",
            scene_model_name(p->model));
    if (wall)
        write_wall(p, file, out);
    else
        write_solid(p, file, out);
    write_look(p, out);
    fprintf(out, !p->whole   ? "    cuttable = true;\n"
                 : p->chosen ? "    cuttable = false;\n"
                             : "    # cuttable = true;   # needs too much time or memory\n");
    fprintf(out, "  }\n);\n");
    write_tools(p, out);
    if (!p->whole)
        proposal_write_score(p, out);
}
