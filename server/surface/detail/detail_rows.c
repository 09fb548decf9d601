// Rows of nodes that hang, are created or removed: displacements and velocities are transferred so
// that momentum is conserved and a body at rest stays at rest (README.md, "Hanging nodes" and
// README.md, "Momentum and mass across changes"). All in the rows' coordinates.
#include "surface/detail/detail.h"

#include <string.h>

static void *present_rows(const SurfaceModel *model)
{
    return model->rows[model->current];
}

static void read_middle(const SurfaceModel *model, int node, double row[ROW]);

// Reads a node's row, from its masters when it hangs.
static void read_carried(const SurfaceModel *model, int node, double row[ROW])
{
    const Detail *detail = model->detail;
    if (detail->set.status[node] != NODE_HANGING) {
        for (int c = 0; c < ROW; c++)
            row[c] = model_get(model, present_rows(model), (long)model->slot[node] * ROW + c);
        return;
    }
    read_middle(model, node, row);
}

// Reads the mean of its parents' rows, whatever the node's own status.
static void read_middle(const SurfaceModel *model, int node, double row[ROW])
{
    int parent[2];
    double other[ROW];
    levels_parents(&model->detail->set.levels, node, parent);
    read_carried(model, parent[0], row);
    read_carried(model, parent[1], other);
    for (int c = 0; c < ROW; c++)
        row[c] = 0.5 * (row[c] + other[c]);
}

Vec3 detail_velocity(const SurfaceModel *model, int node)
{
    double row[ROW];
    read_carried(model, node, row);
    return (Vec3){row[4], row[5], row[6]};
}

void detail_push(SurfaceModel *model, int node, Vec3 impulse)
{
    const Detail *detail = model->detail;
    if (detail->set.status[node] == NODE_HANGING) {
        int parent[2];
        levels_parents(&detail->set.levels, node, parent);
        detail_push(model, parent[0], vec3_scale(0.5, impulse));
        detail_push(model, parent[1], vec3_scale(0.5, impulse));
        return;
    }
    if (detail->fixed[node])
        return;
    const double share = 1.0 / detail_mass(model, node);
    const double change[3] = {share * impulse.x, share * impulse.y, share * impulse.z};
    for (int c = 0; c < 3; c++) {
        long at = (long)model->slot[node] * ROW + 4 + c;
        model_put(model, present_rows(model), at,
                  model_get(model, present_rows(model), at) + change[c]);
    }
}

// Returns how a step of the rest position changes a row: positions by the rotated step;
// displacements only by what the rotation adds.
static Vec3 shift_of_row(const SurfaceModel *model, int node, Vec3 step)
{
    bool single = model->basis.precision == PRECISION_SINGLE;
    const FramePose *pose = detail_frames_pose(model, node);
    if (pose == NULL)
        return single ? (Vec3){0.0, 0.0, 0.0} : step;
    const double(*r)[3] = (const double(*)[3])pose->rotation;
    Vec3 turned = {r[0][0] * step.x + r[0][1] * step.y + r[0][2] * step.z,
                   r[1][0] * step.x + r[1][1] * step.y + r[1][2] * step.z,
                   r[2][0] * step.x + r[2][1] * step.y + r[2][2] * step.z};
    return single ? vec3_sub(turned, step) : turned;
}

static Vec3 place_of(const SurfaceModel *model, int node)
{
    return model_rest(model, model->slot[node]);
}

static Vec3 middle_of_parents(const SurfaceModel *model, int node)
{
    int parent[2];
    levels_parents(&model->detail->set.levels, node, parent);
    return vec3_scale(0.5, vec3_add(place_of(model, parent[0]), place_of(model, parent[1])));
}

void detail_set_rest(SurfaceModel *model, int node)
{
    const LeafSet *set = &model->detail->set;
    Vec3 place =
        set->status[node] == NODE_HANGING
            ? middle_of_parents(model, node)
            : vec3_sub(set->levels.position[detail_original(set, node)], model->basis.rest_origin);
    double *to = model->basis.rest[model->slot[node]];
    to[0] = place.x, to[1] = place.y, to[2] = place.z;
}

static void put_row(SurfaceModel *model, int node, const double row[ROW])
{
    for (int c = 0; c < ROW; c++)
        model_put(model, present_rows(model), (long)model->slot[node] * ROW + c, row[c]);
    model->node[model->slot[node]] = node;
}

void detail_release(SurfaceModel *model, int node)
{
    Vec3 before = place_of(model, node);
    detail_set_rest(model, node);
    Vec3 step = shift_of_row(model, node, vec3_sub(place_of(model, node), before));
    const double shift[3] = {step.x, step.y, step.z};
    // Recompute it: its masters may have been released after the node was placed between them.
    double row[ROW];
    read_middle(model, node, row);
    put_row(model, node, row);
    for (int c = 0; c < 3; c++) {
        long at = (long)model->slot[node] * ROW + c;
        model_put(model, present_rows(model), at,
                  model_get(model, present_rows(model), at) + shift[c]);
    }
}

// Creates a node with the mean velocity of its parents, which conserves momentum, and the mean of
// their displacements from their rest positions (README.md, "Momentum and mass across changes");
// with choi2005 at the butterfly's point.
void detail_give_birth(SurfaceModel *model, int node)
{
    const Levels *levels = &model->detail->set.levels;
    double row[ROW];
    read_middle(model, node, row);
    Vec3 place = place_of(model, node);
    if (model->detail->set.constrained) {
        Vec3 step = shift_of_row(model, node, vec3_sub(place, middle_of_parents(model, node)));
        row[0] += step.x, row[1] += step.y, row[2] += step.z;
    } else {
        int level = levels_of_node(levels, node) - 1;
        Vec3 at = detail_butterfly(model, level, node - levels->level[level].node_count);
        if (model->basis.precision == PRECISION_DOUBLE)
            at = vec3_add(at, place);
        row[0] = at.x, row[1] = at.y, row[2] = at.z;
    }
    put_row(model, node, row);
}

void detail_copy_row(SurfaceModel *model, int node, int from)
{
    double row[ROW];
    for (int c = 0; c < ROW; c++)
        row[c] = model_get(model, present_rows(model), (long)model->slot[from] * ROW + c);
    put_row(model, node, row);
}

// Unused rows are zero, so that the state is a function of the nodes that are on.
void detail_switch_off(SurfaceModel *model, int node)
{
    int slot = model->slot[node];
    size_t bytes = ROW * model_real_size(model);
    for (int k = 0; k < 2; k++)
        memset((char *)model->rows[k] + (size_t)slot * bytes, 0, bytes);
    memset(model->basis.rest[slot], 0, sizeof model->basis.rest[slot]);
    model->node[slot] = -1;
}

// Four numbers at a time, coarsest level first.
#define HANG(Real)                                                                                 \
    {                                                                                              \
        typedef Real Half __attribute__((vector_size(ROW / 2 * sizeof(Real))));                    \
        Half *row = rows;                                                                          \
        for (int i = lists->hanging_count - 1; i >= 0; i--)                                        \
            for (int k = 0; k < 2; k++)                                                            \
                row[2 * lists->hanging[i] + k] =                                                   \
                    (row[2 * lists->master[i][0] + k] + row[2 * lists->master[i][1] + k]) / 2;     \
    }

void detail_hang(const DetailLists *lists, Precision precision, void *rows)
{
    if (precision == PRECISION_SINGLE)
        HANG(float)
    else
        HANG(double)
}

// Finest level first, so that a master that hangs itself passes on what it received.
#define HAND_OVER(Real)                                                                            \
    {                                                                                              \
        typedef Real Force __attribute__((vector_size(4 * sizeof(Real))));                         \
        Force *force = lists->handed;                                                              \
        for (int i = 0; i < lists->carrier_count; i++)                                             \
            force[2 * lists->carrier[i]] = (Force){0};                                             \
        for (int i = 0; i < lists->hanging_count; i++) {                                           \
            Force half = force[2 * lists->hanging[i]] / 2;                                         \
            force[2 * lists->master[i][0]] += half;                                                \
            force[2 * lists->master[i][1]] += half;                                                \
        }                                                                                          \
    }

void detail_hand_over(const DetailLists *lists, Precision precision)
{
    if (precision == PRECISION_SINGLE)
        HAND_OVER(float)
    else
        HAND_OVER(double)
}
