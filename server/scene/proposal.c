// SPDX-License-Identifier: MIT
#include "scene/proposal_parts.h"

#include "base/check.h"
#include "body/body.h"
#include "scene/build.h"
#include "io/mesh_import.h"
#include "io/volume_import.h"
#include "geometry/mesh.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// Size of a cell in the first try, relative to the body's diagonal. A thin body then takes little
// of a tick, and gets cells down to a third of it, until it takes SPARE [s].
static const double FIRST_CELL = 1.0 / 30.0, SPARE = 2e-4;
// A solid of fewer cells has no shape; one whose volume is a smaller share of its mesh, or more
// than the inverse of that, has lost its thin parts, or enlarged them.
enum { FEWEST_CELLS = 20 };
static const double LEAST_FILL = 0.25;
// A solid of labels begins with no more cells: of 60000 some 10000 lie at the surface of a ball,
// which are as many elements as a tick has time for. As many slices decide by how much a body is
// too thick.
enum { MOST_CELLS = 60000, FEW_LAYERS = 8 };
// Half of the weakest contacts that stiff membranes in the table of the front page had.
static const double LEAST_SHARE = 1e-3;
// How much longer the tick of a cuttable body takes: 1.05 to 1.3 times in config/manual/limits.md,
// 1.01 to 1.2 times for walls and solids as they are proposed.
static const double CUTTABLE = 1.15;

// --- what pliantd makes of it --------------------------------------------------------------------

// Removes the location from a sentence, since the scene file is temporary.
static void strip_place(const char *path, Status *status)
{
    const size_t length = strlen(path);
    const char *text = status->text;
    if (strncmp(text, path, length) == 0) {
        text += length;
        text += strspn(text, ":0123456789");
        text += strspn(text, " ");
        memmove(status->text, text, strlen(text) + 1);
    }
}

// Finds the boxes of the first PROPOSAL_PIECES pieces, and the largest of these.
static void find_pieces(const BodyMesh *mesh, const float *position, Built *built)
{
    int name[PROPOSAL_PIECES], nodes[PROPOSAL_PIECES] = {0}, count = 0, largest = 0;
    for (int i = 0; i < mesh->node_count; i++) {
        int at = 0;
        while (at < count && name[at] != mesh->piece[i])
            at++;
        if (mesh->id[i] < 0 || at == PROPOSAL_PIECES)
            continue;
        const float *f = position + 3 * i;
        const Vec3 x = vec3((double)f[0], (double)f[1], (double)f[2]);
        // A piece that was not met yet gets a box of its own.
        if (at == count) {
            name[count++] = mesh->piece[i];
            built->piece[at] = box_empty();
        }
        box_add(&built->piece[at], x);
        largest = ++nodes[at] > nodes[largest] ? at : largest;
    }
    built->largest = count > 0 ? name[largest] : 0;
    built->largest_nodes = nodes[largest];
}

// Adds the surface at rest of one piece to a draft.
static void take_surface(const BodyMesh *mesh, const float *position, int piece, MeshDraft *surface)
{
    for (int i = 0; i < mesh->node_count; i++) {
        const float *x = position + 3 * i;
        mesh_draft_add_node(surface, vec3((double)x[0], (double)x[1], (double)x[2]));
    }
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *corner = mesh->triangle[t];
        if (corner[0] == corner[1] || mesh->piece[corner[0]] != piece) // 0 0 0: a free slot
            continue;
        for (int c = 0; c < 3; c++)
            mesh_draft_add_corner(surface, corner[c], -1);
        mesh_draft_end_polygon(surface, 0);
    }
}

static bool build_scene(const char *path, Built *built, MeshDraft *surface, Status *status)
{
    Scene scene = {0};
    World world = {0};
    // The proposal is built as a daemon would, since only that says what it costs.
    const BuildOptions options = {.isa = "auto", .may_load = true, .publishes = true};
    bool ok = scene_read(path, &scene, status) && world_build(&world, &scene, &options, status);
    if (ok) {
        const Body *body = sim_body(world.sim, 0);
        const BodyOutline outline = body_outline(body);
        *built = (Built){.substeps = body->substeps,
                         .springs = body->spring_count,
                         .nodes = body->mesh.node_count,
                         .pieces = body_count_pieces(&body->mesh),
                         .tick_s = cost_tick(body, body->substeps),
                         .contact_share = body->contact_share,
                         .cells = world.cells[0],
                         .box = outline.box};
        // Where the nodes are, and to which piece each belongs.
        const BodyMesh *mesh = &body->mesh;
        float *position = calloc((size_t)mesh->node_count + 1, 3 * sizeof *position);
        ASSERT(position != NULL);
        body->ops->snapshot(body->model, position, NULL);
        find_pieces(mesh, position, built);
        if (surface != NULL)
            take_surface(mesh, position, built->largest, surface);
        free(position);
        world_destroy(&world);
    }
    scene_destroy(&scene);
    return ok;
}

bool proposal_build(const Proposal *proposal, Built *built, MeshDraft *surface, Status *status)
{
    const char *folder = getenv("TMPDIR") != NULL ? getenv("TMPDIR") : "/tmp";
    char path[512];
    char *file = realpath(proposal->path, NULL);
    snprintf(path, sizeof path, "%s/pliant-prepare-XXXXXX", folder);
    // As a temporary file that nobody else can guess.
    int descriptor = file != NULL ? mkstemp(path) : -1;
    FILE *out = descriptor >= 0 ? fdopen(descriptor, "w") : NULL;
    bool ok = out != NULL;
    if (ok) {
        proposal_write(proposal, file, out);
        ok = fclose(out) == 0;
    } else if (descriptor >= 0) {
        close(descriptor);
    }
    if (ok)
        ok = build_scene(path, built, surface, status);
    else
        status_fail(status, STATUS_FAILED, "cannot write to %s", folder);
    // The user knows nothing of that file.
    strip_place(path, status);
    if (descriptor >= 0)
        unlink(path);
    free(file);
    return ok;
}

static bool build(const Proposal *proposal, Built *built, Status *status)
{
    return proposal_build(proposal, built, NULL, status);
}

// Makes a proposal, built whole, cuttable where a tick has time for that and memory suffices.
static void make_cuttable(Proposal *proposal, Built *built)
{
    Built cuttable;
    Status ignored = {0};
    proposal->whole = CUTTABLE * built->tick_s > COST_BUDGET;
    if (!proposal->whole && build(proposal, &cuttable, &ignored)) {
        *built = cuttable;
        built->tick_s *= CUTTABLE;
    } else {
        proposal->whole = true;
    }
}

// --- verdicts ------------------------------------------------------------------------------------

static void say(Verdict *verdict, bool usable, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static void say(Verdict *verdict, bool usable, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    int used = snprintf(verdict->text, sizeof verdict->text, usable ? "yes, " : "no, ");
    vsnprintf(verdict->text + used, sizeof verdict->text - (size_t)used, format, list);
    va_end(list);
    verdict->usable = usable;
}

// What the verdict adds about a body that cannot be cut.
static const char *why_whole(const Proposal *proposal)
{
    return proposal->whole ? "; cuttable it would need too much time or memory" : "";
}

// True if implicit steps would be cheaper.
static bool has_many_substeps(const Built *built)
{
#ifdef PLIANT_WITH_SURFACE
    return built->substeps > surface_auto_substeps(built->springs, built->nodes, 0);
#else
    (void)built; // of a build without walls none is judged
    return false;
#endif
}

// Says why explicit steps are unsuitable; `built` NULL: there would be too many to count.
static void refuse_wall(const Proposals *all, const Built *built, Verdict *verdict)
{
    char edge[UNITS_LENGTH];
    units_length(all->shortest, edge);
    verdict->remesh = true;
    if (built == NULL)
        say(verdict, false, "edges of %s need more than 100000 substeps a tick", edge);
    else if (has_many_substeps(built))
        say(verdict, false, "edges of %s need %d substeps a tick, about %.2g ms of 1 ms", edge,
            built->substeps, 1e3 * built->tick_s);
    else
        say(verdict, false, "%d nodes and %d substeps take about %.2g ms of a tick of 1 ms",
            built->nodes, built->substeps, 1e3 * built->tick_s);
}

// Judges a wall that explicit steps are too slow for (`explicit`), or cannot compute (NULL: `said`
// is the reason, if the implicit step cannot either).
static void judge_implicit(const Proposals *all, const Built *explicit, const Status *said,
                           Verdict *verdict)
{
    Built built;
    Status ignored = {0};
    // Implicit only where the explicit body is not hopelessly large.
    verdict->proposal.implicit = true;
    const bool can = explicit == NULL || cost_implicit(explicit->springs) <= COST_BUDGET;
    if (can && !build(&verdict->proposal, &built, &ignored)) {
        say(verdict, false, "%s", explicit == NULL ? said->text : ignored.text);
    } else if (can && built.tick_s <= COST_BUDGET && built.contact_share >= LEAST_SHARE) {
        make_cuttable(&verdict->proposal, &built);
        verdict->remesh = true;
        say(verdict, true,
            "with integrator = \"implicit\": about %.2g ms a tick, its contacts with %.2g %% of "
            "their stiffness%s",
            1e3 * built.tick_s, 100.0 * built.contact_share, why_whole(&verdict->proposal));
        return;
    } else {
        refuse_wall(all, explicit, verdict);
    }
    verdict->proposal.implicit = false;
}

static void judge_wall(const Proposals *all, Verdict *verdict)
{
    Built built;
    Status said = {0};
    // Explicit steps if a tick has time for them, else implicit ones.
    if (all->subject.volume) {
        say(verdict, false, "labels say what is inside, not where a wall is");
    } else if (all->triangles > 1 && 2 * all->loose > all->triangles) {
        say(verdict, false,
            "nothing holds it together: %d of its %d triangles share no edge with another",
            all->loose, all->triangles);
    } else if (!build(&verdict->proposal, &built, &said)) {
        judge_implicit(all, NULL, &said, verdict);
    } else if (built.tick_s > COST_BUDGET) {
        judge_implicit(all, &built, &said, verdict);
    } else {
        make_cuttable(&verdict->proposal, &built);
        say(verdict, true, "%d substep%s a tick, about %.2g ms%s", built.substeps,
            built.substeps > 1 ? "s" : "", 1e3 * built.tick_s, why_whole(&verdict->proposal));
    }
}

// Judges a wall that can be one empty, full of a fluid.
static void judge_filled(const Proposals *all, const Verdict *empty, Verdict *verdict)
{
    Built built;
    Status said = {0};
    verdict->proposal = empty->proposal;
    verdict->proposal.fluid = true;
    if (!empty->usable) {
        say(verdict, false, "it cannot be a wall");
    } else if (all->volume <= 0.0) {
        say(verdict, false, "its surface is not closed");
    } else if (empty->proposal.implicit) {
        say(verdict, false, "a fluid needs explicit steps, for which its edges are too short");
    } else if (!build(&verdict->proposal, &built, &said)) {
        say(verdict, false, "%s", said.text);
    } else {
        say(verdict, built.tick_s <= COST_BUDGET, "%d substep%s a tick, about %.2g ms%s",
            built.substeps, built.substeps > 1 ? "s" : "", 1e3 * built.tick_s,
            why_whole(&verdict->proposal));
    }
}

// Rounds up a cell size to two digits.
static double round_up(double cell)
{
    const double unit = pow(10.0, floor(log10(cell)) - 1.0);
    return ceil(cell / unit - 1e-9) * unit;
}

// Enlarges cells so that a whole number of them makes a body of a few slices: others would make it
// thicker, or thinner.
static double divide_slices(const Proposals *all, double cell)
{
    const double layers = floor(all->thinnest / cell + 1e-9);
    return layers >= 1.0 && layers <= FEW_LAYERS ? all->thinnest / layers : cell;
}

// Describes a solid that fits the tick, and checks that it still has the shape.
static void judge_shape(const Proposals *all, const Built *built, Verdict *verdict)
{
    char cell[UNITS_LENGTH], fill[96] = "", pieces[96] = "", parts[256] = "; ";
    if (!lattice_shells_text(built->cells.shells, parts + 2, sizeof parts - 2))
        parts[0] = '\0';

    const double cells = (double)built->cells.solid, size = built->cells.size;
    // Parts that overlap or lie within each other fill less than their sum.
    const LatticeShells *shells = &built->cells.shells;
    const double cube = size * size * size, twice = (double)shells->claimed - cells;
    const double volume = all->volume - (shells->claimed > 0 ? twice * cube : 0.0);
    const double filled = all->volume > 0.0 ? cells * cube / volume : 1.0;
    units_length(size, cell);
    // Too coarse or too thin to be this body.
    if (built->cells.solid < FEWEST_CELLS) {
        say(verdict, false, "only %ld cells of %s fit in", built->cells.solid, cell);
        return;
    }
    if (filled < LEAST_FILL || filled > 1.0 / LEAST_FILL) {
        say(verdict, false,
            "cells of %s, the smallest that a tick has time for, have %.2g times its volume: it is "
            "too thin",
            cell, filled);
        return;
    }
    // Usable, with remarks on volume and pieces.
    if (all->subject.volume)
        snprintf(fill, sizeof fill, ", %.3g times the volume of its label", filled);
    else if (filled > 1.25)
        snprintf(fill, sizeof fill, ", with %.2g times its volume: thin parts are thicker", filled);
    else if (filled < 0.8)
        snprintf(fill, sizeof fill, ", which fill %.0f %% of it: thin parts are lost",
                 100.0 * filled);
    if (built->pieces > 1) {
        snprintf(pieces, sizeof pieces, ", in %d pieces, each of which something has to hold",
                 built->pieces);
        verdict->proposal.piece_count = built->pieces <= PROPOSAL_PIECES ? built->pieces : 0;
        memcpy(verdict->proposal.piece, built->piece, sizeof built->piece);
    }
    say(verdict, true, "%ld cells of %s, %d substep%s a tick, about %.2g ms%s%s%s%s",
        built->cells.solid, cell, built->substeps, built->substeps > 1 ? "s" : "",
        1e3 * built->tick_s, fill, pieces, why_whole(&verdict->proposal), parts);
}

// Enlarges the cells until the body fits the tick.
static void judge_solid(const Proposals *all, Verdict *verdict)
{
    Proposal *p = &verdict->proposal;
    Built built = {0};
    Status said = {0};
    // Cells fill a closed surface only.
    if (!all->subject.volume && all->volume <= 0.0) {
        say(verdict, false, "its surface is not closed (MeshLab: Close Holes)");
        return;
    }
    // A first guess by size, then cells as small as a tick has time for if it can be cut.
    if (!p->volume)
        p->cell = round_up(FIRST_CELL * vec3_length(box_size(&p->box)));
    for (int i = 0; i < 8; i++) {
        if (!build(p, &built, &said)) {
            say(verdict, false, "%s", said.text);
            return;
        }
        const double tick_s = CUTTABLE * built.tick_s;
        // A thin body takes little time: one try with smaller cells.
        if (i == 0 && !p->volume && tick_s < SPARE) {
            p->cell = round_up(p->cell * fmax(pow(tick_s / SPARE, 0.29), 1.0 / 3.0));
            continue;
        }
        if (tick_s <= COST_BUDGET)
            break;
        // Cost goes with the third power by cells and the first by substeps: an exponent in between
        // never overshoots.
        if (i < 7) // what is judged was built
            p->cell = divide_slices(
                all, round_up(1.02 * built.cells.size * pow(tick_s / COST_BUDGET, 0.29)));
    }
    if (built.tick_s > COST_BUDGET) {
        say(verdict, false, "%ld cells still take about %.2g ms of a tick of 1 ms",
            built.cells.solid, 1e3 * built.tick_s);
        return;
    }
    make_cuttable(p, &built);
    verdict->cavity =
        3 * built.cells.shells.hollow >= built.cells.solid && built.cells.shells.hollow > 0;
    judge_shape(all, &built, verdict);
}

// --- what is in the file -------------------------------------------------------------------------

bool proposal_is_volume(const char *path)
{
#ifdef PLIANT_WITH_VOXEL
    return volume_is_one(path);
#else
    (void)path;
    return false;
#endif
}

static bool look_at_mesh(Proposals *all, Status *status)
{
    TriMesh mesh;
    MeshImport import;
    MeshFault fault;
    const char *path = all->subject.path;
    if (!mesh_import(path, &mesh, &import, status))
        return false;
    // As it will stand in the world.
    mesh_place(&mesh, all->subject.scale, vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0));
    bool ok = mesh_check(&mesh, &fault) ||
              status_fail(status, STATUS_INVALID, "%s: %s", path, fault.text);
    if (ok) {
        // What the judgement needs of its shape.
        MeshQuality quality;
        mesh_quality_measure(&mesh, &quality);
        all->components = quality.component_count;
        all->triangles = mesh.triangle_count;
        for (int i = 0; i < quality.component_count; i++)
            all->loose += quality.component[i].triangle_count == 1;
        all->shortest = quality.edge_min;
        // Edges of length L give A / (sqrt(3)/2 L^2) nodes on an area A.
        all->even = sqrt(quality.area / (0.5 * sqrt(3.0) * PROPOSAL_NODES));
        all->volume = quality.border_loops == 0 ? quality.volume : 0.0;
        all->subject.box = quality.box;
        mesh_quality_destroy(&quality);
    }
    mesh_destroy(&mesh);
    return ok;
}

#ifdef PLIANT_WITH_VOXEL
// Finds the label that is meant, of several the largest.
static const VolumeLabel *find_label(const Proposals *all, LabelChoice choice, Status *status)
{
    const VolumeLabels *list = &all->labels;
    char *end = NULL;
    const long number = choice.label != NULL ? strtol(choice.label, &end, 10) : 0;
    const bool named = choice.label != NULL && (*end != '\0' || end == choice.label);
    for (int i = 0; i < list->count && list->label[i].voxels > 0; i++)
        if (choice.label == NULL || (named ? strcmp(list->label[i].name, choice.label) == 0
                                           : list->label[i].label == number))
            return &list->label[i];
    if (choice.label == NULL)
        status_fail(
            status, STATUS_INVALID,
            "%s: every voxel has the label 0, so it holds no organ: choose another file%s%s",
            all->subject.path, all->frame.notes[0] != '\0' ? ": " : "", all->frame.notes);
    else
        status_fail(status, STATUS_INVALID, "%s: no voxel has the label %s (--check lists them)",
                    all->subject.path, choice.label);
    return NULL;
}

// Takes all labels of the layer as one body, with the box of all.
static bool take_all(Proposals *all, VolumeLabel *sum, Status *status)
{
    VolumeLabels *list = &all->labels;
    int count = 0;
    // Those of the layer of the largest come first, in their order.
    for (int i = 0; i < list->count; i++) {
        const VolumeLabel one = list->label[i];
        if (one.voxels == 0 || one.layer != list->label[0].layer)
            continue;
        memmove(list->label + count + 1, list->label + count,
                (size_t)(i - count) * sizeof *list->label);
        list->label[count++] = one;
    }
    if (count < 2 || count > LATTICE_MATERIALS)
        return status_fail(status, STATUS_INVALID,
                           "%s: %d labels of a layer, 2 to %d can be one body", all->subject.path,
                           count, LATTICE_MATERIALS);
    *sum = list->label[0];
    for (int i = 1; i < count; i++) {
        const VolumeLabel *one = &list->label[i];
        sum->voxels += one->voxels;
        for (int a = 0; a < 3; a++) {
            sum->low[a] = one->low[a] < sum->low[a] ? one->low[a] : sum->low[a];
            sum->high[a] = one->high[a] > sum->high[a] ? one->high[a] : sum->high[a];
        }
    }
    sum->label = 0;
    snprintf(sum->name, sizeof sum->name, "%d labels as one body", count);
    all->subject.part = list->label;
    all->subject.part_count = count;
    return true;
}

// Where its voxels make more cells than a tick has time for, the search begins with larger ones.
static double first_cell(const Proposals *all, double spacing)
{
    const double cell = fmax(spacing, round_up(cbrt(all->volume / MOST_CELLS))),
                 divided = divide_slices(all, cell);
    return divided > spacing * (1.0 + 1e-9) ? divided : 0.0;
}

static bool look_at_volume(Proposals *all, LabelChoice choice, Status *status)
{
    LabelVolume *frame = &all->frame;
    if (!volume_survey(all->subject.path, choice.layer, frame, &all->labels, status))
        return false;
    frame->origin = vec3_scale(all->subject.scale, frame->origin);
    for (int a = 0; a < 3; a++)
        frame->axis[a] = vec3_scale(all->subject.scale, frame->axis[a]);
    VolumeLabel sum;
    const bool together = choice.label != NULL && strcmp(choice.label, "all") == 0;
    const VolumeLabel *label =
        together ? take_all(all, &sum, status) ? &sum : NULL : find_label(all, choice, status);
    if (label == NULL)
        return false;
    all->subject.label = label->label;
    memcpy(all->subject.label_name, label->name, sizeof label->name);
    all->subject.layer = frame->layers > 1 ? label->layer : 0;
    // How much there is of it.
    const Vec3 *axis = frame->axis;
    double spacing = HUGE_VAL;
    all->thinnest = HUGE_VAL;
    all->volume = (double)label->voxels * fabs(vec3_dot(axis[0], vec3_cross(axis[1], axis[2])));
    for (int a = 0; a < 3; a++) {
        spacing = fmin(spacing, vec3_length(axis[a]));
        all->thinnest =
            fmin(all->thinnest, (label->high[a] - label->low[a]) * vec3_length(axis[a]));
    }
    all->subject.cell = first_cell(all, spacing);
    // Its box is that of the body before it is fixed.
    Built built = {0};
    Proposal first = all->subject;
    first.model = MODEL_VOXEL;
    if (!build(&first, &built, status))
        return false;
    all->subject.box = built.box;
    return true;
}
#else
static bool look_at_volume(Proposals *all, LabelChoice choice, Status *status)
{
    (void)choice;
    return status_fail(status, STATUS_INVALID, "%s: built without voxel bodies (PLIANT_VOXEL)",
                       all->subject.path);
}
#endif

void proposals_destroy(Proposals *all)
{
    free(all->frame.segment);
    free(all->labels.label);
    *all = (Proposals){0};
}

bool proposal_judge(const char *path, double scale, LabelChoice choice, Proposals *all,
                    Status *status)
{
    // Whole until it fits: a cuttable body needs much more memory.
    *all = (Proposals){.subject = {.path = path, .scale = scale, .whole = true}};
    all->subject.volume = proposal_is_volume(path);
    if (!all->subject.volume && (choice.label != NULL || choice.layer > 0))
        return status_fail(status, STATUS_INVALID,
                           "%s: is no label volume, so it has no label or layer", path);
    if (!(all->subject.volume ? look_at_volume(all, choice, status) : look_at_mesh(all, status))) {
        proposals_destroy(all);
        return false;
    }
    // All ways are tried, each for itself.
    for (int i = 0; i < PROPOSAL_WAYS; i++) {
        all->verdict[i].proposal = all->subject;
        all->verdict[i].proposal.model = i == WAY_SOLID ? MODEL_VOXEL : MODEL_SURFACE;
    }
    judge_wall(all, &all->verdict[WAY_WALL]);
    judge_filled(all, &all->verdict[WAY_WALL], &all->verdict[WAY_FILLED]);
    judge_solid(all, &all->verdict[WAY_SOLID]);
    proposal_find_hollow(all);
    proposal_find_colour(all);
    return true;
}

const char *proposal_way_name(ProposalWay way)
{
    static const char *const names[] = {"surface", "filled", "voxel"};
    return names[way];
}

// Says what to type for a mesh with edges that suit a wall, and why.
static void print_remeshing(const Proposals *all, FILE *out)
{
    const double length = all->even / all->subject.scale;
    fprintf(
        out,
        "    a better wall: its shortest edge decides how often a tick must compute, its number "
        "of nodes how long that\n    takes. Edges of one length, %.3g units of the file, make "
        "%d nodes, which a tick has time for:\n",
        length, PROPOSAL_NODES);
    // Of a closed mesh this program makes them itself.
    if (all->volume > 0.0)
        fprintf(out, "      pliant-prepare --even '%s' -o NEW.off\n", all->subject.path);
    else
        fprintf(out,
                "      ./dev remesh '%s' NEW.ply %.3g (where Pliant was built)\n"
                "    or in MeshLab: Isotropic Explicit Remeshing with this target length; then "
                "--check the new file\n",
                all->subject.path, length);
}

void proposal_print(const Proposals *all, FILE *out)
{
    fprintf(out, "  as a wall: %s\n", all->verdict[WAY_WALL].text);
    if (all->verdict[WAY_WALL].remesh)
        print_remeshing(all, out);
    if (all->verdict[WAY_FILLED].usable || all->hollow[0] != '\0')
        fprintf(out, "  as a wall full of a fluid: %s\n", all->verdict[WAY_FILLED].text);
    fprintf(out, "  as a solid: %s\n", all->verdict[WAY_SOLID].text);
    fprintf(out, "    (default materials at 1000 Hz, pressed by a probe; times are estimates for a "
                 "core of 2 GHz, not measured here)\n");
}
