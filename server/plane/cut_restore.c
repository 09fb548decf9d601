// Checks that bits and ids of a cut plane body from a checkpoint are possible.
#include "plane/cut.h"

// True if each solid cell, and no other, is in the quarter of exactly one element.
static bool covers_each_cell_once(const PlaneCut *cut)
{
    for (int j = 0; j < cut->layout.count[1]; j++)
        for (int i = 0; i < cut->layout.count[0]; i++) {
            int over = 0;
            for (int level = 0; level <= cut->layout.levels; level++) {
                int e =
                    cut->layout
                        .lut[level][(j >> level) * (cut->layout.count[0] >> level) + (i >> level)];
                int q = level == 0 ? 0 : (i >> (level - 1) & 1) + 2 * (j >> (level - 1) & 1);
                over += cut->quarters[e] >> q & 1;
            }
            if (over != cut->is_solid[j * cut->layout.count[0] + i])
                return false;
        }
    return true;
}

static bool quarters_can_be(const PlaneCut *cut)
{
    for (int e = 0; e < cut->layout.element_count; e++) {
        const unsigned quarters = cut->quarters[e], level = cut->layout.element[e].level;
        if (quarters > PLANE_WHOLE || quarters == 6 || quarters == 9 ||
            (level == 0 && quarters != 0 && quarters != PLANE_WHOLE))
            return false;
    }
    return true;
}

static bool levels_can_be(const PlaneCut *cut)
{
    for (int j = 0; j < cut->layout.count[1]; j++)
        for (int i = 0; i < cut->layout.count[0]; i++) {
            const int own = plane_layout_at(&cut->layout, i, j);
            const int beside[2] = {plane_layout_at(&cut->layout, i + 1, j),
                                   plane_layout_at(&cut->layout, i, j + 1)};
            for (int k = 0; k < 2 && own >= 0; k++) {
                if (beside[k] < 0)
                    continue;
                int a = cut->layout.element[own].level, b = cut->layout.element[beside[k]].level;
                if (a - b > 1 || b - a > 1)
                    return false;
            }
        }
    return true;
}

static bool ids_can_be(const PlaneModel *model)
{
    const PlaneCut *cut = model->cut;
    int count = 0;
    for (int k = 0; k < 4 * cut->points; k++)
        cut->row_of_id[k] = -1;
    for (int v = 0; v < cut->vertex_capacity; v++) {
        int id = cut->id[v];
        if (id < -1 || id >= 4 * cut->points || (id >= 0 && v != count))
            return false;
        if (id < 0)
            continue;
        if (cut->row_of_id[id] >= 0 || cut->origin_id[v] < 0 ||
            cut->origin_id[v] >= 4 * cut->points)
            return false;
        cut->row_of_id[id] = count++;
    }
    return true;
}

// True if the vertices that follow from the bits are exactly those of the ids.
static bool vertices_are_there(const PlaneCut *cut)
{
    int count = 0;
    for (int v = 0; v < cut->vertex_capacity; v++)
        count += cut->id[v] >= 0;
    for (int v = 0; v < cut->mesh.vertex_count; v++)
        if (cut->row_of_id[cut->mesh.id[v]] < 0)
            return false;
    return count == cut->mesh.vertex_count;
}

bool plane_cut_restore(Body *body)
{
    PlaneModel *model = body->model;
    PlaneCut *cut = model->cut;
    if (!quarters_can_be(cut) || !covers_each_cell_once(cut) || !ids_can_be(model))
        return false;
    for (int e = 0; e < cut->layout.element_count; e++)
        cut->layout.element[e].quarters = cut->quarters[e];
    if (!levels_can_be(cut))
        return false;
    if (!plane_cut_fill_mesh(cut) || !vertices_are_there(cut))
        return false;
    int count = 0;
    while (count < cut->vertex_capacity && cut->id[count] >= 0)
        count++;
    vertices_set_count(&model->vertices, count);
    for (int v = 0; v < cut->mesh.vertex_count; v++)
        plane_cut_place_row(model, v, cut->row_of_id[cut->mesh.id[v]]);
    plane_cut_make(model, body);
    return true;
}
