// SPDX-License-Identifier: MIT
// Blades in a body that can be cut: where its faces of the finest level are, including those that
// do not exist yet, which links a blade met (surface/cut), what breaks. Step thread.
#include "surface/detail/detail.h"

#include "base/check.h"
#include "geometry/box.h"

#include <string.h>

// --- deformed positions of nodes ---

static Vec3 turn_out(const SurfaceModel *model, int node, Vec3 v)
{
    const FramePose *pose = detail_frames_pose(model, node);
    if (pose != NULL) {
        const double(*r)[3] = (const double(*)[3])pose->rotation;
        v = (Vec3){r[0][0] * v.x + r[0][1] * v.y + r[0][2] * v.z,
                   r[1][0] * v.x + r[1][1] * v.y + r[1][2] * v.z,
                   r[2][0] * v.x + r[2][1] * v.y + r[2][2] * v.z};
    }
    return model->basis.displaced ? quat_rotate(model->basis.frame->turn, v) : v;
}

// Returns the rest position of a node of the uncut mesh when it does not hang.
static Vec3 true_rest(const SurfaceModel *model, int node)
{
    return vec3_sub(model->detail->set.levels.position[node], model->basis.rest_origin);
}

// Returns the world position [m] of a node; of a node that is off, or hangs, where dividing the
// faces around it would put it (as detail_give_birth and detail_release do). So refining changes
// nothing that a blade can detect. Computed once per call.
static Vec3 position_of(SurfaceModel *model, int node)
{
    const LeafSet *set = &model->detail->set;
    DetailCut *cut = set->cut;
    if (cut->seen[node] == cut->looks)
        return cut->position[node];
    Vec3 x;
    if (set->status[node] != NODE_OFF) {
        rows_read(&model->basis, model->rows[model->current], model->slot[node], &x, NULL);
        if (set->status[node] == NODE_HANGING)
            x = vec3_add(x, turn_out(model, node,
                                     vec3_sub(true_rest(model, node),
                                              model_rest(model, model->slot[node]))));
    } else {
        int parent[2];
        levels_parents(&set->levels, node, parent);
        Vec3 a = true_rest(model, parent[0]), b = true_rest(model, parent[1]);
        Vec3 step = vec3_sub(true_rest(model, node), vec3_scale(0.5, vec3_add(a, b)));
        a = position_of(model, parent[0]), b = position_of(model, parent[1]);
        x = vec3_add(vec3_scale(0.5, vec3_add(a, b)), turn_out(model, node, step));
    }
    cut->seen[node] = cut->looks;
    return cut->position[node] = x;
}

// --- faces near the sweep ---

// Converts a box in the world frame to the rows' coordinates, which may be rotated.
static Box box_in_rows(const SurfaceModel *model, const Box *box)
{
    if (!model->basis.displaced)
        return *box;
    const Vec3 origin = model->basis.frame->origin;
    const double shift[3] = {origin.x, origin.y, origin.z};
    Vec3 middle = {0.0, 0.0, 0.0}, half = middle;
    for (int c = 0; c < 3; c++) {
        Vec3 axis = rows_turn_in(&model->basis, (Vec3){c == 0, c == 1, c == 2});
        double size = 0.5 * (box->high[c] - box->low[c]);
        middle = vec3_madd(middle, 0.5 * (box->high[c] + box->low[c]) - shift[c], axis);
        half =
            vec3_add(half, (Vec3){size * fabs(axis.x), size * fabs(axis.y), size * fabs(axis.z)});
    }
    return (Box){{middle.x - half.x, middle.y - half.y, middle.z - half.z},
                 {middle.x + half.x, middle.y + half.y, middle.z + half.z}};
}

// Returns outside which sides of the box a point is, one bit per side.
static unsigned char sides_of(const Box *box, double x, double y, double z)
{
    return (unsigned char)((x < box->low[0]) | (x > box->high[0]) << 1 | (y < box->low[1]) << 2 |
                           (y > box->high[1]) << 3 | (z < box->low[2]) << 4 |
                           (z > box->high[2]) << 5);
}

// Computes the sides of the box for all nodes that are on.
static void look_at_sides(SurfaceModel *model, const Box *world)
{
    const Detail *detail = model->detail;
    const Box box = box_in_rows(model, world);
    const void *rows = model->rows[model->current];
    for (int r = 0; r < model->run_count; r++)
        for (int s = model->run[r][0]; s < model->run[r][1]; s++) {
            const double *place = model->basis.rest[s];
            if (model->node[s] < 0)
                continue;
            if (model->basis.precision == PRECISION_SINGLE) {
                const float *row = (const float *)rows + (long)s * ROW;
                detail->set.cut->sides[model->node[s]] =
                    sides_of(&box, place[0] + (double)row[0], place[1] + (double)row[1],
                             place[2] + (double)row[2]);
            } else {
                const double *row = (const double *)rows + (long)s * ROW;
                detail->set.cut->sides[model->node[s]] = sides_of(&box, row[0], row[1], row[2]);
            }
        }
}

// Marks the finest faces of leaves that are not entirely outside one side of the box.
static void mark_near(const Detail *detail, int level, int face)
{
    const DetailCut *cut = detail->set.cut;
    if (detail_is_refined(&detail->set, level, face)) {
        for (int k = 0; k < 4; k++)
            mark_near(detail, level + 1, 4 * face + k);
        return;
    }
    const int *corner = detail->set.levels.level[level].face[face];
    if ((cut->sides[corner[0]] & cut->sides[corner[1]] & cut->sides[corner[2]]) == 0)
        memset(cut->is_near + detail_face_slot(&detail->set, level, face), 1,
               (size_t)1 << (2 * (detail->set.levels.finest - level)));
}

void detail_cut_look(SurfaceModel *model, const BladeEdge *edge, int edges, double margin,
                     CutTissue *tissue)
{
    Detail *detail = model->detail;
    const LeafSet *set = &detail->set;
    DetailCut *cut = set->cut;
    const Level *finest = &set->levels.level[set->levels.finest];
    Box box = box_empty(); // around the sweep, in the world frame [m]
    for (int i = 0; i < edges; i++)
        for (int end = 0; end < 2; end++)
            box_add(&box, edge[i].end[end]);
    box_grow(&box, margin + cut->bulge); // nodes of finer levels stick out of leaves
    cut->looks++;                        // positions are computed anew
    // Mark the near faces as 1, then their neighbours as 2.
    look_at_sides(model, &box);
    memset(cut->is_near, 0, (size_t)finest->face_count);
    for (int f = 0; f < set->levels.level[0].face_count; f++)
        mark_near(detail, 0, f);
    for (int f = 0; f < finest->face_count; f++)
        for (int k = 0; k < 3 && cut->is_near[f] == 1; k++) {
            int across = levels_beyond(finest, finest->face_edge[f][k], f);
            if (across >= 0 && cut->is_near[across] == 0)
                cut->is_near[across] = 2;
        }
    // List them and compute the positions of their corners.
    int count = 0;
    for (int f = 0; f < finest->face_count; f++) {
        if (cut->is_near[f] == 0 || detail_cut_is_gone(cut, f))
            continue;
        cut->near[count++] = f;
        for (int k = 0; k < 3; k++)
            position_of(model, cut->node[f][k]);
    }
    *tissue = (CutTissue){.face = cut->near,
                          .face_count = count,
                          .corner = (const int(*)[3])cut->node,
                          .position = cut->position,
                          .broken = cut->broken};
}

// --- cuts ---

FrameStart detail_cut_begin(SurfaceModel *model)
{
    FrameStart start = {{0.0}, {{0.0}}};
    if (model->detail->frames != NULL)
        memcpy(start.piece, model->detail->frames->rotation, sizeof start.piece);
    if (model->basis.rigid != NULL)
        memcpy(start.rotation, model->basis.rigid->rotation, sizeof start.rotation);
    detail_begin_change(model);
    return start;
}

void detail_cut_take_back(SurfaceModel *model, const FrameStart *start)
{
    if (model->detail->frames != NULL)
        memcpy(model->detail->frames->rotation, start->piece, sizeof start->piece);
    if (model->basis.rigid != NULL)
        memcpy(model->basis.rigid->rotation, start->rotation, sizeof start->rotation);
}

static void describe(const DetailCut *cut, CutOutcome *outcome)
{
    outcome->pieces = cut->piece_count;
    outcome->small_pieces = cut->small_count;
}

// Breaks the links that the finder has found.
static bool break_found(Body *body, CutOutcome *outcome, TopologyChange *change)
{
    SurfaceModel *model = body->model;
    Detail *detail = model->detail;
    const CutFinder *finder = &detail->set.cut->finder;
    const bool broken = detail_cut_break(model, finder->edge, finder->count, outcome);
    if (broken) {
        detail_end_cut(body);
        *change = detail->report.change;
    }
    describe(detail->set.cut, outcome);
    return broken;
}

bool detail_blade_cut(Body *body, const CutSweep *sweep, CutOutcome *outcome,
                      TopologyChange *change)
{
    SurfaceModel *model = body->model;
    Detail *detail = model->detail;
    DetailCut *cut = detail->set.cut;
    CutFinder *finder = &cut->finder;
    const BladeEdge edge[2] = {sweep->before, sweep->after};
    const bool whole = sweep->phase == CUT_WHOLE;
    CutTissue tissue;
    *outcome = (CutOutcome){.verdict = CUT_MET_NOTHING};
    // Refinement must not be needed to see what the blade meets: positions come from
    // detail_cut_look.
    describe(cut, outcome);
    FrameStart start = detail_cut_begin(model);
    detail_cut_look(model, edge, 2, CUT_FIND_MARGIN * finder->h, &tissue);
    if (whole) {
        outcome->verdict = cut_find_whole(finder, &tissue, edge, 2);
        if (outcome->verdict == CUT_DONE)
            outcome->verdict = cut_smooth(finder, &tissue, edge, 2);
    } else {
        outcome->verdict = cut_find_tick(finder, &tissue, sweep);
    }
    if (outcome->verdict != CUT_DONE) {
        detail_cut_take_back(model, &start);
        return false;
    }
    const Vec3 *rest = detail->set.levels.position;
    if (whole)
        cut_lips_whole(finder, &tissue, edge, 2, rest, cut->crossing);
    else
        cut_lips_tick(finder, &tissue, rest, cut->crossing);
    const bool broken = break_found(body, outcome, change);
    if (!broken) {
        cut_lips_forget(finder, cut->crossing);
        detail_cut_take_back(model, &start);
    }
    return broken;
}

void detail_blade_reserve(void *self, int blades, Arena *arena, StateList *state)
{
    const Detail *detail = ((SurfaceModel *)self)->detail;
    cut_find_reserve_blades(&detail->set.cut->finder, blades, detail->options.body.name, arena,
                            state);
}
