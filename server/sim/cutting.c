// SPDX-License-Identifier: MIT
// Cuts in a tick: strokes of blades, tearing, postponed refinement, and the events of all of them
// (README.md, "Strokes and commands"). Step thread. No allocation except in cutting_create.
#include "sim/cutting.h"

#include "sim/follow.h"
#include "sim/events.h"
#include "sim/guard/guard.h"

#include "base/check.h"
#include "base/sets.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// An end of a blade that moves faster than any hand starts a new stroke.
#define BLADE_FASTEST 100.0 // [m/s]

// A sweep with less than this length, or an area within rounding of millimetres, is empty [m],
// [m2].
static const double NO_LENGTH = 1e-9;
static const double NO_AREA = 1e-12;

// ---------------------------------------------------------------------------------------------
// Creation

int body_count_pieces(const BodyMesh *mesh)
{
    size_t used = 0;
    int *piece = malloc(((size_t)mesh->node_count + 1) * sizeof *piece);
    ASSERT(piece != NULL);
    for (int i = 0; i < mesh->node_count; i++)
        if (mesh->id[i] >= 0)
            piece[used++] = mesh->piece[i];
    qsort(piece, used, sizeof *piece, compare_ints);
    int count = 0;
    for (size_t i = 0; i < used; i++)
        count += i == 0 || piece[i] != piece[i - 1];
    free(piece);
    return count;
}

static bool can_part(const Body *body)
{
    return body->ops->cut != NULL || body->ops->tear != NULL;
}

static void create_body(Sim *sim, int b)
{
    Body *body = &sim->body[b];
    Cutting *cutting = sim->cutting;
    int blades = cutting->blade_count;
    BodyCuts *cuts = arena_allocate(sim->arena, ARENA_STEP, 1, sizeof *cuts, "%s/cuts", body->name);
    *cuts = (BodyCuts){
        .pieces = sim->pieces_at_load[b], .reported_step = STEP_NEVER, .refused_step = STEP_NEVER};
    state_add(sim->state, cuts, sizeof *cuts, "%s/cuts", body->name);
    cutting->cuts[b] = cuts;
    if (body->ops->cut == NULL || blades == 0)
        return;
    cutting->stroke[b] = arena_allocate(sim->arena, ARENA_STEP, (size_t)blades,
                                        sizeof *cutting->stroke[b], "%s/strokes", body->name);
    state_add(sim->state, cutting->stroke[b], (size_t)blades * sizeof *cutting->stroke[b],
              "%s/strokes", body->name);
    if (body->ops->reserve_blades != NULL)
        body->ops->reserve_blades(body->model, blades, sim->arena, sim->state);
}

// Returns the number of a body's strokes, one per blade; 0 if it has none.
static int stroke_count(const Sim *sim, int b)
{
    return sim->cutting->stroke[b] != NULL ? sim->cutting->blade_count : 0;
}

void cutting_create(Sim *sim)
{
    bool any = false;
    sim->pieces_at_load = arena_allocate(sim->arena, ARENA_OUTPUT, (size_t)sim->body_count,
                                         sizeof *sim->pieces_at_load, "sim/pieces");
    for (int b = 0; b < sim->body_count; b++) {
        const Body *body = &sim->body[b];
        sim->pieces_at_load[b] = body->mesh.node_count > 0 ? body_count_pieces(&body->mesh) : 1;
        any |= can_part(body);
    }
    if (!any)
        return;
    Cutting *cutting =
        arena_allocate(sim->arena, ARENA_STEP, 1, sizeof *sim->cutting, "sim/cutting");
    sim->cutting = cutting;
    for (int t = 0; t < sim->tool_count; t++)
        if (sim->tool[t].kind == TOOL_BLADE)
            cutting->blade_tool[cutting->blade_count++] = t;
    for (int b = 0; b < sim->body_count; b++)
        if (can_part(&sim->body[b]))
            create_body(sim, b);
}

// Restarts the time when a scene has settled.
void cutting_settled(Sim *sim)
{
    if (sim->cutting == NULL)
        return;
    for (int b = 0; b < sim->body_count; b++)
        if (sim->cutting->cuts[b] != NULL)
            sim->cutting->cuts[b]->reported_step = sim->cutting->cuts[b]->refused_step = STEP_NEVER;
}

static bool edge_finite(const BladeEdge *edge)
{
    return vec3_finite(edge->end[0]) && vec3_finite(edge->end[1]);
}

bool cutting_was(const Sim *sim, int64_t step)
{
    return step == STEP_NEVER || (step >= 0 && step <= sim->clock->step);
}

bool cutting_check(const Sim *sim)
{
    for (int b = 0; b < sim->body_count && sim->cutting != NULL; b++) {
        const BodyCuts *cuts = sim->cutting->cuts[b];
        if (cuts == NULL)
            continue;
        if (cuts->pieces < 0 || cuts->pieces > INT_MAX || cuts->torn < 0 || cuts->torn_nodes < 0 ||
            !cutting_was(sim, cuts->reported_step) || !cutting_was(sim, cuts->refused_step))
            return false;
        for (int k = 0; k < stroke_count(sim, b); k++) {
            const Stroke *stroke = &sim->cutting->stroke[b][k];
            if ((stroke->cut.under_way != 0 && stroke->cut.under_way != 1) || stroke->lifted < 0 ||
                stroke->lifted > STROKE_LIFTED || stroke->cut.tries < 0 ||
                stroke->cut.tries > INT_MAX || !edge_finite(&stroke->cut.edge) ||
                stroke->separated < 0 || stroke->nodes_added < 0)
                return false;
        }
    }
    return true;
}

// ---------------------------------------------------------------------------------------------
// Events

static bool is_due(const Sim *sim, int64_t last, double seconds)
{
    return (double)(sim->clock->step - last) * sim->tick >= seconds;
}

void cutting_note_pieces(Sim *sim, int b, int pieces)
{
    BodyCuts *cuts = sim->cutting->cuts[b];
    if (pieces > cuts->pieces)
        sim_report(sim, b, "piece", "body '%s' is in %d pieces now, %lld more", sim->body[b].name,
                   pieces, (long long)(pieces - cuts->pieces));
    if (pieces > 0)
        cuts->pieces = pieces;
}

// Reports a refusal at most a few times per second: a stroke may be refused a thousand times.
static void report_refusal(Sim *sim, int b, int tool, const CutOutcome *outcome)
{
    BodyCuts *cuts = sim->cutting->cuts[b];
    if (!is_due(sim, cuts->refused_step, 1.0))
        return;
    cuts->refused_step = sim->clock->step;
    char why[SIM_EVENT_TEXT];
    cut_describe(outcome, sim->body[b].name, why, sizeof why);
    if (tool >= 0)
        sim_report(sim, b, "cut_refused", "tool %d: %.140s", sim->tool[tool].id, why);
    else
        sim_report(sim, b, "cut_refused", "tearing: %.140s", why);
}

// ---------------------------------------------------------------------------------------------
// One sweep

// Adds up the results of one sweep's calls; the verdict is the last one's, unless an earlier call
// cut something.
static void add_outcome(CutOutcome *sum, const CutOutcome *one)
{
    CutVerdict verdict =
        sum->verdict == CUT_DONE && sum->separated > 0 && !cut_refuses(one->verdict) ? CUT_DONE
                                                                                     : one->verdict;
    sum->verdict = verdict;
    sum->separated += one->separated;
    sum->nodes_added += one->nodes_added;
    sum->needed = one->needed;
    sum->room = one->room;
    if (one->pieces == 0)
        return; // not counted
    sum->pieces = one->pieces;
    sum->small_pieces = one->small_pieces;
}

typedef struct Sweeping {
    const CutSweep *sweep;
    CutOutcome *sum;
} Sweeping;

static bool sweep_once(Sim *sim, int b, void *context, TopologyChange *change)
{
    const Sweeping *sweeping = context;
    Body *body = &sim->body[b];
    CutOutcome one = {.verdict = CUT_MET_NOTHING};
    bool changed = body->ops->cut(body, sweeping->sweep, &one, change);
    add_outcome(sweeping->sum, &one);
    return changed;
}

// Executes a whole sweep, as often as the body asks for more.
static void sweep_body(Sim *sim, int b, const CutSweep *sweep, CutOutcome *outcome)
{
    *outcome = (CutOutcome){.verdict = CUT_MET_NOTHING};
    Sweeping sweeping = {sweep, outcome};
    change_body(sim, b, sweep_once, &sweeping);
    if (outcome->verdict == CUT_DONE)
        cutting_note_pieces(sim, b, outcome->pieces);
}

// ---------------------------------------------------------------------------------------------
// Strokes

// Returns the edge of a blade at the start of the tick: the time of the bodies' positions.
static BladeEdge edge_now(const Sim *sim, int tool)
{
    Vec3 position;
    Quat orientation;
    const ToolMotion *motion = &sim->motion[tool];
    tool_motion_at(motion, 0.0, &position, &orientation);
    BladeEdge edge;
    for (int k = 0; k < 2; k++)
        edge.end[k] = vec3_add(position, quat_rotate(orientation, sim->tool[tool].edge[k]));
    return edge;
}

static bool is_jump(const Sim *sim, const BladeEdge *from, const BladeEdge *to)
{
    for (int k = 0; k < 2; k++)
        if (!(vec3_length(vec3_sub(to->end[k], from->end[k])) <= BLADE_FASTEST * sim->tick))
            return true;
    return false;
}

static void sweep_blade(Sim *sim, int b, int blade, CutPhase phase, BladeEdge to)
{
    Stroke *stroke = &sim->cutting->stroke[b][blade];
    if (phase == CUT_BEGINS)
        stroke->cut = (CutStroke){.under_way = 1, .edge = to};
    CutSweep sweep = {.phase = phase,
                      .before = stroke->cut.edge,
                      .after = to,
                      .blade = blade,
                      .stroke = &stroke->cut};
    CutOutcome outcome;
    sweep_body(sim, b, &sweep, &outcome);
    stroke->cut.edge = to;
    stroke->separated += outcome.separated;
    stroke->nodes_added += outcome.nodes_added;
    if (!cut_refuses(outcome.verdict))
        return;
    report_refusal(sim, b, sim->cutting->blade_tool[blade], &outcome);
    stroke->lifted = STROKE_BROKEN;
}

// Summarises a stroke whose blade has left. A stroke that the body broke off continues for the
// client that moves the blade, and is reported when the blade is lifted.
static void end_stroke(Sim *sim, int b, int blade, bool left)
{
    Stroke *stroke = &sim->cutting->stroke[b][blade];
    sweep_blade(sim, b, blade, CUT_ENDS, stroke->cut.edge);
    if (!left) {
        stroke->cut = (CutStroke){0};
        stroke->lifted = 0;
        return;
    }
    if (stroke->separated > 0) {
        CutOutcome sum = {.verdict = CUT_DONE,
                          .separated = stroke->separated,
                          .nodes_added = stroke->nodes_added,
                          .pieces = (int)sim->cutting->cuts[b]->pieces};
        char text[SIM_EVENT_TEXT];
        cut_describe(&sum, sim->body[b].name, text, sizeof text);
        sim_report(sim, b, "cut", "tool %d, stroke ended: %.140s",
                   sim->tool[sim->cutting->blade_tool[blade]].id, text);
    }
    *stroke = (Stroke){0};
}

// Sweeps one blade through one body, from its position at the start of the last tick.
static void stroke_body(Sim *sim, int b, int blade)
{
    const ToolMotion *motion = &sim->motion[sim->cutting->blade_tool[blade]];
    Stroke *stroke = &sim->cutting->stroke[b][blade];
    if (!motion->active) {
        if (stroke->cut.under_way)
            end_stroke(sim, b, blade, true);
        return;
    }
    BladeEdge now = edge_now(sim, sim->cutting->blade_tool[blade]);
    bool left = stroke->lifted == STROKE_LIFTED || is_jump(sim, &stroke->cut.edge, &now);
    if (stroke->cut.under_way && (left || stroke->lifted == STROKE_BROKEN))
        end_stroke(sim, b, blade, left);
    sweep_blade(sim, b, blade, stroke->cut.under_way ? CUT_GOES_ON : CUT_BEGINS, now);
}

static void mark_strokes(Sim *sim, int tool, int body, int64_t as)
{
    for (int b = 0; b < sim->body_count && sim->cutting != NULL; b++)
        for (int k = 0; k < stroke_count(sim, b); k++) {
            Stroke *stroke = &sim->cutting->stroke[b][k];
            if ((tool < 0 || sim->cutting->blade_tool[k] == tool) && (body < 0 || body == b) &&
                stroke->cut.under_way && stroke->lifted != STROKE_LIFTED)
                stroke->lifted = as;
        }
}

void cutting_lift(Sim *sim, int tool)
{
    mark_strokes(sim, tool, -1, STROKE_LIFTED);
}

void cutting_break_off(Sim *sim, int body)
{
    mark_strokes(sim, -1, body, STROKE_BROKEN);
}

// ---------------------------------------------------------------------------------------------
// Tearing

// Reports tears at most a few times per second.
static void report_torn(Sim *sim, int b)
{
    enum { A_SECOND = 4 };
    BodyCuts *cuts = sim->cutting->cuts[b];
    if (cuts->torn == 0 || !is_due(sim, cuts->reported_step, 1.0 / A_SECOND))
        return;
    sim_report(sim, b, "tear", "body '%s': %lld links torn, %lld nodes added, %lld pieces",
               sim->body[b].name, (long long)cuts->torn, (long long)cuts->torn_nodes,
               (long long)cuts->pieces);
    cuts->torn = cuts->torn_nodes = 0;
    cuts->reported_step = sim->clock->step;
}

static bool tear_once(Sim *sim, int b, void *context, TopologyChange *change)
{
    (void)context;
    Body *body = &sim->body[b];
    BodyCuts *cuts = sim->cutting->cuts[b];
    CutOutcome outcome = {.verdict = CUT_MET_NOTHING};
    bool changed = body->ops->tear(body, sim->tick, &outcome, change);
    if (cut_refuses(outcome.verdict))
        report_refusal(sim, b, -1, &outcome);
    cuts->torn += outcome.separated; // also those not visible yet
    cuts->torn_nodes += outcome.nodes_added;
    if (outcome.verdict == CUT_DONE)
        cutting_note_pieces(sim, b, outcome.pieces);
    return changed;
}

// ---------------------------------------------------------------------------------------------
// The stages

void cutting_stage(Sim *sim)
{
    for (int b = 0; b < sim->body_count; b++) {
        for (int k = 0; k < stroke_count(sim, b); k++)
            stroke_body(sim, b, k);
        if (sim->body[b].ops->tear != NULL && !guard_is_frozen(sim, b)) {
            change_body(sim, b, tear_once, NULL);
            report_torn(sim, b);
        }
    }
}

static bool reconstruct_once(Sim *sim, int b, void *context, TopologyChange *change)
{
    (void)context;
    const bool changed = sim->body[b].ops->reconstruct(&sim->body[b], change);
    cutting_note_pieces(sim, b, change->pieces);
    return changed;
}

void reconstruct_stage(Sim *sim)
{
    for (int b = 0; b < sim->body_count; b++)
        if (sim->body[b].ops->reconstruct != NULL)
            change_body(sim, b, reconstruct_once, NULL);
}

// ---------------------------------------------------------------------------------------------
// Commands

int sim_pieces(const Sim *sim, int body)
{
    const BodyCuts *cuts = sim->cutting != NULL ? sim->cutting->cuts[body] : NULL;
    return cuts != NULL ? (int)cuts->pieces : sim->pieces_at_load[body];
}

static double edge_length(const BladeEdge *edge)
{
    return vec3_length(vec3_sub(edge->end[1], edge->end[0]));
}

// Returns the area of the two triangles between the edge before and after.
static double swept_area(const BladeEdge *before, const BladeEdge *after)
{
    Vec3 a = before->end[0], b = before->end[1], a1 = after->end[0], b1 = after->end[1];
    return 0.5 * (vec3_length(vec3_cross(vec3_sub(b, a), vec3_sub(a1, a))) +
                  vec3_length(vec3_cross(vec3_sub(b1, b), vec3_sub(a1, b))));
}

// Returns a sentence about sweeps that can cut no body; else NULL.
static const char *find_fault(const CutOptions *cut)
{
    const BladeEdge *before = &cut->before, *after = &cut->after;
    if (!edge_finite(before) || !edge_finite(after))
        return "the sweep holds a number that is not finite";
    if (edge_length(before) < NO_LENGTH && edge_length(after) < NO_LENGTH)
        return "the blade has no length";
    if (vec3_length(vec3_sub(after->end[0], before->end[0])) < NO_LENGTH &&
        vec3_length(vec3_sub(after->end[1], before->end[1])) < NO_LENGTH)
        return "the sweep does not move";
    if (swept_area(before, after) < NO_AREA)
        return "the sweep has no area: the blade moves along its own edge";
    return NULL;
}

// Orders the verdicts of several bodies: first cut, then refused, then cut before.
static int weight_of(CutVerdict verdict)
{
    return verdict == CUT_DONE ? 3 : cut_refuses(verdict) ? 2 : verdict == CUT_WAS_CUT ? 1 : 0;
}

// Describes several bodies in one sentence: those cut, and the number refused.
static void describe_sum(const CutOutcome *sum, int cut_bodies, int refused, char *why, size_t size)
{
    char more[80] = "";
    if (refused > 0)
        snprintf(more, sizeof more, "; %d other bod%s refused", refused,
                 refused == 1 ? "y" : "ies");
    snprintf(why, size, "%d bodies: %d links severed, %d nodes added, %d pieces%s", cut_bodies,
             sum->separated, sum->nodes_added, sum->pieces, more);
}

// Returns what a tick of all bodies is expected to cost, by counts [s].
static double cost_of(const Sim *sim)
{
    double cost = 0.0;
    for (int b = 0; b < sim->body_count; b++)
        cost += cost_tick(&sim->body[b], sim->body[b].substeps);
    return cost;
}

// Adds what a cut costs in every tick from now on, if that is much: faces of the finest level along
// it need short steps.
static void describe_cost(double longer, char *why, size_t why_size)
{
    static const double MUCH = 1.25; // less is lost in what counts estimate
    const size_t used = strlen(why);
    if (longer > MUCH)
        snprintf(why + used, why_size - used, "; ticks take about %.2g times as long now", longer);
}

bool sim_apply_cut(Sim *sim, const CutOptions *cut, CutOutcome *sum, char *why, size_t why_size)
{
    *sum = (CutOutcome){.verdict = CUT_MET_NOTHING};
    const char *fault = find_fault(cut);
    if (fault != NULL) {
        snprintf(why, why_size, "%s", fault);
        return false;
    }
    const CutSweep sweep = {
        .phase = CUT_WHOLE, .before = cut->before, .after = cut->after, .blade = -1};
    const double cost = cost_of(sim);
    int asked = 0, done = 0, refused = 0, told = -1; // told: the body that the sentence is about
    CutOutcome most = *sum;
    // Sweep through every cuttable body; the most important verdict is reported.
    for (int b = 0; b < sim->body_count; b++) {
        if ((cut->body >= 0 && cut->body != b) || sim->body[b].ops->cut == NULL)
            continue;
        CutOutcome outcome;
        sweep_body(sim, b, &sweep, &outcome);
        asked++;
        done += outcome.verdict == CUT_DONE;
        refused += cut_refuses(outcome.verdict);
        sum->separated += outcome.separated;
        sum->nodes_added += outcome.nodes_added;
        sum->small_pieces += outcome.small_pieces;
        if (told < 0 || weight_of(outcome.verdict) > weight_of(most.verdict)) {
            most = outcome;
            told = b;
        }
    }
    for (int b = 0; b < sim->body_count; b++)
        if (cut->body < 0 || cut->body == b)
            sum->pieces += sim_pieces(sim, b);
    sum->verdict = most.verdict;
    sum->needed = most.needed;
    sum->room = most.room;
    // The sentence: nothing to cut, several bodies, or the one.
    if (asked == 0 && cut->body < 0 && sim->body_count > 1)
        snprintf(why, why_size, "no body is cuttable (cuttable = true)");
    else if (asked == 0)
        snprintf(why, why_size, "body '%s' is not cuttable (cuttable = true)",
                 sim->body[cut->body < 0 ? 0 : cut->body].name);
    else if (done > 1)
        describe_sum(sum, done, refused, why, why_size);
    else if (asked > 1 && done + refused == 0 && most.verdict == CUT_MET_NOTHING)
        snprintf(why, why_size, "the blade met no tissue");
    else
        cut_describe(&most, sim->body[told].name, why, why_size);
    describe_cost(cost_of(sim) / cost, why, why_size);
    return done > 0;
}
