// Elements side by side for the kernel. Load time only.
#include "voxel/plane/plane_model.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

#define ALLOCATE(count, type, label)                                                               \
    (type *)arena_allocate(arena, ARENA_STEP, (size_t)(count), sizeof(type), "%s/%s", name, label)

// A single quarter is a square of half the edge.
static bool is_square(const PlaneForm *form)
{
    return form->shape->count == 4 && (form->shape->extent == 1.0 || form->shape->extent == 0.25);
}

static void square_numbers(const PlaneForm *form, double number[SQUARE_NUMBERS])
{
    const PlaneStiffness *k = &form->stiffness;
    const double edge = form->size * sqrt(form->shape->extent);
    number[SQUARE_PLACE] = 0.5 * edge;
    number[SQUARE_GRADIENT] = 0.5 / edge;
    number[SQUARE_SHEAR] = 0.5 * edge * k->mu;
    number[SQUARE_TRACE] = 0.5 * edge * (k->mu + k->lambda);
    number[SQUARE_RESIDUAL] = k->residual / 16.0;
    number[SQUARE_DAMPING] = k->damping / 4.0;
}

// The batches' order: squares by class, then other shapes, and squares that do not fill a batch of
// their class, by their number of vertices; each in the order of elements, so that neighbours stay
// near.
typedef struct Place {
    int key, element;
} Place;

static int compare(const void *a, const void *b)
{
    const Place *x = a, *y = b;
    if (x->key != y->key)
        return x->key < y->key ? -1 : 1;
    return (x->element > y->element) - (x->element < y->element);
}

static int find_class(double (*class)[SQUARE_NUMBERS], int *count, const PlaneForm *form)
{
    double number[SQUARE_NUMBERS];
    square_numbers(form, number);
    for (int k = 0; k < *count; k++)
        if (memcmp(class[k], number, sizeof number) == 0)
            return k;
    memcpy(class[*count], number, sizeof number);
    return (*count)++;
}

// How many places of a key follow from `at` on, at most a batch.
static int run_length(const Place *place, int count, int at)
{
    int length = 1;
    while (length < PLANE_LANES && at + length < count && place[at + length].key == place[at].key)
        length++;
    return length;
}

static void node_numbers(const PlaneForm *form, int i, double number[NODE_NUMBERS])
{
    const PlaneShape *shape = form->shape;
    const double size = form->size, extent = shape->extent * size * size;
    double m[2][2] = {{0.0}}, spread = 0.0;
    for (int k = 0; k < shape->count; k++)
        for (int d = 0; d < 2; d++) {
            spread += size * size * shape->place[k][d] * shape->place[k][d];
            for (int e = 0; e < 2; e++)
                m[d][e] += shape->share[k] * size * size * shape->place[k][d] * shape->place[k][e];
        }
    const double det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    const double x = size * shape->place[i][0], y = size * shape->place[i][1];
    const double share = shape->share[i];
    const bool paper = form->stiffness.law == VOXEL_MIYAZAKI2004;
    number[NODE_X] = x;
    number[NODE_Y] = y;
    number[NODE_GRADIENT_X] = paper ? 2.0 * x / spread : size * shape->area[i][0] / extent;
    number[NODE_GRADIENT_Y] = paper ? 2.0 * y / spread : size * shape->area[i][1] / extent;
    number[NODE_SHARE] = share;
    number[NODE_RESIDUAL] = share * form->stiffness.residual;
    number[NODE_AREA_X] = size * shape->area[i][0];
    number[NODE_AREA_Y] = size * shape->area[i][1];
    number[NODE_LINEAR_X] = share * (m[1][1] * x - m[0][1] * y) / det;
    number[NODE_LINEAR_Y] = share * (m[0][0] * y - m[0][1] * x) / det;
}

static void put_lane(PlaneModel *model, int batch, int lane, int count, const PlaneForm *form)
{
    PlaneBatches *batches = &model->batches;
    const int numbers = model->law == VOXEL_MIYAZAKI2004 ? NODE_PAPER_NUMBERS : NODE_NUMBERS;
    for (int i = 0; i < count; i++) {
        long row = batches->start[batch] + i;
        batches->vertex[row * PLANE_LANES + lane] =
            form != NULL ? form->vertex[i] : model->vertices.count;
        double number[NODE_NUMBERS] = {0.0};
        if (form != NULL)
            node_numbers(form, i, number);
        for (int k = 0; k < numbers; k++)
            rows_put(&model->vertices.rows, batches->node, (row * numbers + k) * PLANE_LANES + lane,
                     number[k]);
    }
    double whole[WHOLE_NUMBERS] = {[WHOLE_SPREAD] = 1.0};
    if (form != NULL) {
        const PlaneStiffness *k = &form->stiffness;
        whole[WHOLE_SHEAR] = k->mu;
        whole[WHOLE_TRACE] = k->mu + k->lambda;
        whole[WHOLE_DAMPING] = k->damping;
        whole[WHOLE_SPREAD] = 1e-12 * form->size * form->size;
    }
    for (int k = 0; k < WHOLE_NUMBERS; k++)
        rows_put(&model->vertices.rows, batches->whole,
                 ((long)batch * WHOLE_NUMBERS + k) * PLANE_LANES + lane, whole[k]);
}

static void create_squares(PlaneModel *model, const Place *place, int count, const char *name,
                           Arena *arena)
{
    PlaneBatches *batches = &model->batches;
    batches->square_count = count / PLANE_LANES;
    batches->square = ALLOCATE((size_t)count * 4, int, "squares");
    batches->square_class = ALLOCATE(batches->square_count, int, "square classes");
    for (int at = 0; at < count; at++) {
        int b = at / PLANE_LANES, lane = at % PLANE_LANES;
        batches->square_class[b] = place[at].key;
        for (int i = 0; i < 4; i++)
            batches->square[(b * 4 + i) * PLANE_LANES + lane] =
                model->form[place[at].element].vertex[i];
    }
}

static void create_others(PlaneModel *model, const Place *place, int count, int batches_most,
                          int rows_most, const char *name, Arena *arena)
{
    PlaneBatches *batches = &model->batches;
    const size_t real = rows_real_size(&model->vertices.rows);
    const int numbers = model->law == VOXEL_MIYAZAKI2004 ? NODE_PAPER_NUMBERS : NODE_NUMBERS;
    batches->start = ALLOCATE(batches_most + 1, int, "element start");
    batches->vertex = ALLOCATE((size_t)rows_most * PLANE_LANES, int, "elements");
    batches->node = arena_allocate(arena, ARENA_STEP, (size_t)(rows_most * numbers) * PLANE_LANES,
                                   real, "%s/element vertices", name);
    batches->whole =
        arena_allocate(arena, ARENA_STEP, (size_t)(batches_most * WHOLE_NUMBERS) * PLANE_LANES,
                       real, "%s/element stiffness", name);
    for (int at = 0; at < count;) {
        int b = batches->other_count++, length = run_length(place, count, at);
        int vertices = model->form[place[at].element].shape->count;
        batches->start[b + 1] = batches->start[b] + vertices;
        for (int lane = 0; lane < PLANE_LANES; lane++)
            put_lane(model, b, lane, vertices,
                     lane < length ? &model->form[place[at + lane].element] : NULL);
        at += length;
    }
}

void plane_create_batches(PlaneModel *model, const char *name, Arena *arena)
{
    size_t elements = (size_t)model->element_count;
    Place *square = malloc((elements + 1) * sizeof *square);
    Place *other = malloc((elements + 1) * sizeof *other);
    double(*class)[SQUARE_NUMBERS] = malloc((elements + 1) * sizeof *class);
    ASSERT(square != NULL && other != NULL && class != NULL);
    int squares = 0, others = 0, classes = 0;
    for (int e = 0; e < model->element_count; e++) {
        const PlaneForm *form = &model->form[e];
        if (is_square(form))
            square[squares++] = (Place){find_class(class, &classes, form), e};
        else
            other[others++] = (Place){form->shape->count, e};
    }
    qsort(square, (size_t)squares, sizeof *square, compare);
    int kept = 0;
    for (int at = 0, length; at < squares; at += length) {
        length = run_length(square, squares, at);
        for (int k = 0; k < length; k++)
            if (length == PLANE_LANES)
                square[kept++] = square[at + k];
            else
                other[others++] = (Place){4, square[at + k].element};
    }
    qsort(other, (size_t)others, sizeof *other, compare);
    create_squares(model, square, kept, name, arena);
    // Each number of vertices may leave one batch partly filled.
    int most = others / PLANE_LANES + PLANE_PLACES;
    create_others(model, other, others, most, most * PLANE_PLACES, name, arena);
    model->batches.class =
        arena_allocate(arena, ARENA_STEP, (size_t)classes * SQUARE_NUMBERS,
                       rows_real_size(&model->vertices.rows), "%s/square numbers", name);
    for (long k = 0; k < (long)classes * SQUARE_NUMBERS; k++)
        rows_put(&model->vertices.rows, model->batches.class, k,
                 class[k / SQUARE_NUMBERS][k % SQUARE_NUMBERS]);
    free(square);
    free(other);
    free(class);
}
