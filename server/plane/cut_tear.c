// Tearing by the threshold of Miyazaki et al. 2004, section 3.2: a larger external force on a
// vertex releases it, so that the elements around no longer share it. An object that pushes further
// in releases the vertices that then come to the outline, and a crack grows. Step thread.
#include "plane/cut.h"

void plane_cut_feel(PlaneModel *model)
{
    const Vertices *vertices = &model->vertices;
    double *felt = model->cut->felt;
    for (long v = 0; v < vertices->count; v++) {
        const double fx = rows_get(&vertices->rows, vertices->force, 4 * v);
        const double fy = rows_get(&vertices->rows, vertices->force, 4 * v + 1);
        const double square = fx * fx + fy * fy;
        felt[v] = square > felt[v] ? square : felt[v];
    }
}

static void list_edge(PlaneCut *cut, int i, int j, int bit)
{
    if (i < 0 || j < 0 || i >= cut->layout.count[0] || j >= cut->layout.count[1])
        return;
    const int cell = j * cut->layout.count[0] + i;
    const int beyond = plane_layout_at(&cut->layout, i + (bit == PLANE_BROKEN_RIGHT),
                                       j + (bit == PLANE_BROKEN_UP));
    const int own = plane_layout_at(&cut->layout, i, j);
    if (own < 0 || beyond < 0 || own == beyond || (cut->broken[cell] | cut->marked[cell]) & bit)
        return;
    cut->marked[cell] |= (unsigned char)bit;
    cut->edge[cut->edge_count][0] = cell;
    cut->edge[cut->edge_count++][1] = bit;
}

bool plane_cut_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change)
{
    (void)tick;
    PlaneModel *model = body->model;
    PlaneCut *cut = model->cut;
    const double most = cut->tear_force * cut->tear_force;
    const int wide = cut->layout.lattice_count[0] + 1;
    cut->edge_count = 0;
    for (int v = 0; v < model->vertices.count; v++) {
        const bool releases = cut->felt[v] > most;
        cut->felt[v] = 0.0;
        if (!releases)
            continue;
        const int point = cut->id[v] % cut->points, i = point % wide, j = point / wide;
        for (int k = 0; k < 2; k++) { // the four edges between cells that meet at the point
            list_edge(cut, i - 1, j - 1 + k, PLANE_BROKEN_RIGHT);
            list_edge(cut, i - 1 + k, j - 1, PLANE_BROKEN_UP);
        }
    }
    for (int k = 0; k < cut->edge_count; k++)
        cut->marked[cut->edge[k][0]] = 0;
    *outcome = (CutOutcome){.verdict = CUT_MET_NOTHING};
    if (cut->edge_count == 0 ||
        !plane_cut_break(body, (const int(*)[2])cut->edge, cut->edge_count, outcome, change))
        return false;
    outcome->verdict = CUT_DONE;
    plane_cut_count_pieces(cut, outcome);
    return true;
}
