// Local stiffness of a body that can be cut, leaf by leaf (patch.c).
#include "voxel/cut/cut_body.h"
#include "voxel/patch.h"

static bool is_near(const Patch *patch, const int *node, int count)
{
    for (int n = 0; n < count; n++)
        if (node[n] >= 0 && patch->local[node[n]] >= 0)
            return true;
    return false;
}

static void add_leaf(const VoxelModel *model, Patch *patch, int element)
{
    const CutLattice *lattice = &model->cuts->lattice;
    const CutElement *of = &lattice->element[element];
    const int *node = cut_lattice_nodes(lattice, element);
    const bool cell = element < lattice->level_first[1];
    if (!is_near(patch, node, cell ? NODE_CORNERS : NODE_COUNT))
        return;
    const unsigned mask = cell ? 0 : template_mask_of(node);
    const ElementClass *by =
        &model->batches
             ->classes[of->level * model->cuts->windows.material_count + of->material - 1];
    const void *number = template_cache_numbers(model->cuts->windows.templates, mask);
    PatchElement piece = {0};
    double spread = 0.0;
    for (int n = 0; n < NODE_COUNT; n++) {
        if (n >= NODE_CORNERS && !(mask >> (n - NODE_CORNERS) & 1))
            continue;
        double row[TABLE_ROW];
        for (int k = 0; k < TABLE_ROW; k++)
            row[k] = rows_get(&model->vertices.rows, number,
                              TABLE_HEAD + (long)piece.count * TABLE_ROW + k);
        spread += patch_add_row(model->law, by, row, node[n], &piece);
    }
    patch_set_factors(&model->vertices, model->law, patch, by, spread, &piece);
    const int place = model->cuts->windows.place[element];
    patch_add_element(&model->vertices, patch, &piece,
                      model->batches->last[place / LANES][place % LANES]);
}

bool cut_body_gather_elements(const VoxelModel *model, Patch *patch, int budget)
{
    const CutLattice *lattice = &model->cuts->lattice;
    const int count = lattice->element_count;
    for (; patch->pass == 1 && patch->next < count && budget > 0; patch->next++) {
        const int before = patch->block_count, element = (int)patch->next;
        if (cut_lattice_is_leaf(lattice, element))
            add_leaf(model, patch, element);
        budget -= patch->block_count == before ? PATCH_SKIPPED : PATCH_ADDED;
    }
    return patch->full || (patch->pass == 1 && patch->next == count);
}
