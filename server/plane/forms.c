// SPDX-License-Identifier: MIT
// Elements in the form of the kernels: the shapes that occur, their stiffness, and batches. Memory
// at load; after it pure functions of the elements.
#include "plane/model.h"

#include "base/check.h"

#include <math.h>
#include <string.h>

enum {
    KEYS = 16 * 512, // quarters and present places
    SHAPES = 256,    // upper bound: 13 sets of quarters, at most 2^4 of places each
};

// ---------------------------------------------------------------------------------------------
// Shapes and their parameters

// Returns the index of a shape; creates it if necessary.
static int find_shape(PlaneForms *forms, unsigned quarters, unsigned present)
{
    short *found = &forms->find[quarters * 512 + present];
    if (*found == 0) {
        ASSERT(forms->count < forms->capacity);
        plane_shape_create(&forms->shape[forms->count], forms->law, quarters, present);
        *found = (short)++forms->count;
    }
    return *found - 1;
}

static double element_mass(const PlaneForms *forms, const PlaneShape *shape, double size,
                           int material)
{
    return forms->material[material - 1].density * shape->extent * size * size * forms->size;
}

static void set_stiffness(const PlaneForms *forms, PlaneStiffness *stiffness,
                          const PlaneShape *shape, int material, double beta)
{
    const SolidMaterial *of = &forms->material[material - 1];
    stiffness->law = forms->law;
    plane_stiffness(stiffness, shape, of->youngs_modulus, of->poisson_ratio, forms->size, beta);
}

// Updates the bounds. An element's mass is distributed like its stiffness, so that the largest
// eigenvalue of the body is at most that of its worst element.
static void take_bound(PlaneForms *forms, int index, double size, int material)
{
    const PlaneShape *shape = &forms->shape[index];
    PlaneStiffness stiffness;
    set_stiffness(forms, &stiffness, shape, material, 1.0);
    const double scale = forms->material[material - 1].youngs_modulus * forms->size;
    double *unit = &forms->unit[(material - 1) * forms->capacity + index];
    if (*unit == 0.0)
        *unit = plane_shape_eigenvalue(shape, &stiffness) / scale;
    const double mass = element_mass(forms, shape, size, material);
    forms->lambda = fmax(forms->lambda, *unit * scale / mass);
    forms->damping_lambda = fmax(forms->damping_lambda, stiffness.damping / mass);
}

// Creates all shapes. Places that the outline passes straight may have a vertex or not; those where
// it turns have one. Larger elements of a shape have smaller eigenvalues.
static void take_all(PlaneForms *forms)
{
    for (unsigned quarters = 1; quarters <= PLANE_WHOLE; quarters++) {
        if (quarters == 6 || quarters == 9) // they meet in a corner
            continue;
        // Corners are always present, each middle of an edge may be.
        unsigned corners = 0, middles = 0;
        for (int at = 0; at < PLANE_PLACES; at++) {
            PlanePassing passing = plane_passing(quarters, at);
            corners |= passing == PLANE_CORNER ? 1u << at : 0u;
            middles |= passing == PLANE_STRAIGHT ? 1u << at : 0u;
        }
        // All subsets of the middles.
        for (unsigned part = middles;; part = (part - 1) & middles) {
            int index = find_shape(forms, quarters, corners | part);
            for (int m = 1; m <= forms->material_count; m++) {
                take_bound(forms, index, 2.0 * forms->size, m);
                if (quarters == PLANE_WHOLE && part == 0)
                    take_bound(forms, index, forms->size, m);
            }
            if (part == 0)
                break;
        }
    }
}

static void take_present(PlaneForms *forms, const PlaneLayout *layout, const PlaneMesh *mesh)
{
    for (int e = 0; e < layout->element_count; e++) {
        const PlaneElement *element = &layout->element[e];
        int index = find_shape(forms, element->quarters, plane_mesh_present(mesh, e));
        take_bound(forms, index, forms->size * (double)(1 << element->level), element->material);
    }
}

void plane_forms_create(PlaneForms *forms, const PlaneOptions *options, const PlaneLayout *layout,
                        const PlaneMesh *mesh, bool all, Arena *arena)
{
    const char *name = options->body.name;
    const int materials = options->material_count;
    // The options do not outlive the creation.
    SolidMaterial *material = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)materials,
                                             sizeof *material, "%s/materials", name);
    memcpy(material, options->material, (size_t)materials * sizeof *material);
    *forms = (PlaneForms){
        .material = material,
        .material_count = materials,
        .law = options->law,
        .size = options->lattice->size,
        .find = arena_allocate(arena, ARENA_TOPOLOGY, KEYS, sizeof *forms->find,
                               "%s/keys of shapes", name),
        .shape = arena_allocate(arena, ARENA_TOPOLOGY, SHAPES, sizeof *forms->shape,
                                "%s/shapes of elements", name),
        .unit = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)materials * SHAPES,
                               sizeof *forms->unit, "%s/eigenvalues of shapes", name),
        .capacity = SHAPES,
    };
    // Shapes, and with them the bounds.
    if (all)
        take_all(forms);
    else
        take_present(forms, layout, mesh);
    // Damping is given in units of the critical step dt0 = 2 / omega.
    forms->beta = options->damping * 2.0 / sqrt(forms->lambda);
    forms->damping_lambda *= forms->beta;
}

static void set_form(PlaneForms *forms, PlaneForm *form, const PlaneElement *element,
                     const int vertex[PLANE_PLACES])
{
    unsigned present = 0;
    for (int p = 0; p < PLANE_PLACES; p++)
        present |= vertex[p] >= 0 ? 1u << p : 0u;
    form->shape = &forms->shape[find_shape(forms, element->quarters, present)];
    form->size = forms->size * (double)(1 << element->level);
    form->material = element->material;
    set_stiffness(forms, &form->stiffness, form->shape, element->material, forms->beta);
    for (int i = 0; i < form->shape->count; i++)
        form->vertex[i] = vertex[form->shape->at[i]];
}

void plane_forms_fill(PlaneForms *forms, PlaneModel *model, const PlaneLayout *layout,
                      const int (*vertex)[PLANE_PLACES])
{
    model->element_count = 0;
    memset(model->element_at_level, 0, sizeof model->element_at_level);
    for (int e = 0; e < layout->element_count; e++) {
        const PlaneElement *element = &layout->element[e];
        if (element->quarters == 0)
            continue;
        model->element_at_level[element->level]++;
        set_form(forms, &model->form[model->element_count++], element, vertex[e]);
    }
}

double plane_forms_add_masses(const PlaneForms *forms, PlaneModel *model)
{
    double total = 0.0;
    for (int e = 0; e < model->element_count; e++) {
        const PlaneForm *form = &model->form[e];
        const double mass = element_mass(forms, form->shape, form->size, form->material);
        total += mass;
        for (int i = 0; i < form->shape->count; i++)
            model->vertices.mass[form->vertex[i]] += form->shape->share[i] * mass;
    }
    return total;
}

// ---------------------------------------------------------------------------------------------
// Batches: elements side by side, as a pure function of model->form

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

// The order of batches: squares by class, then other shapes together with squares that do not fill
// a batch of their class, by their number of vertices; each in the order of elements, so that
// neighbours stay close.
typedef struct PlaneEntry {
    int key, element;
} Entry;

// Sorts by ascending key below `keys`, stably; `to` has the same size.
static void sort_entries(const Entry *from, Entry *to, int count, int keys)
{
    int put = 0;
    for (int key = 0; key < keys; key++)
        for (int k = 0; k < count; k++)
            if (from[k].key == key)
                to[put++] = from[k];
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

// Returns how many entries from `at` on have the same key, at most a batch.
static int run_length(const Entry *entry, int count, int at)
{
    int length = 1;
    while (length < PLANE_LANES && at + length < count && entry[at + length].key == entry[at].key)
        length++;
    return length;
}

static void node_numbers(const PlaneForm *form, int i, double number[NODE_NUMBERS])
{
    const PlaneShape *shape = form->shape;
    const double size = form->size, extent = shape->extent * size * size;
    // Second moments of the vertices, for the best linear map.
    double m[2][2] = {{0.0}}, spread = 0.0;
    for (int k = 0; k < shape->count; k++)
        for (int d = 0; d < 2; d++) {
            spread += size * size * shape->rest[k][d] * shape->rest[k][d];
            for (int e = 0; e < 2; e++)
                m[d][e] += shape->share[k] * size * size * shape->rest[k][d] * shape->rest[k][e];
        }
    // Its own numbers.
    const double det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    const double x = size * shape->rest[i][0], y = size * shape->rest[i][1];
    const double share = shape->share[i];
    const bool paper = form->stiffness.law == PLANE_MIYAZAKI2004;
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
    const int numbers = model->law == PLANE_MIYAZAKI2004 ? NODE_PAPER_NUMBERS : NODE_NUMBERS;
    // By vertex; a lane without an element moves only the spare one.
    for (int i = 0; i < count; i++) {
        long row = batches->start[batch] + i;
        batches->vertex[row * PLANE_LANES + lane] = form != NULL ? form->vertex[i] : model->spare;
        double number[NODE_NUMBERS] = {0.0};
        if (form != NULL)
            node_numbers(form, i, number);
        for (int k = 0; k < numbers; k++)
            rows_put(&model->vertices.rows, batches->node, (row * numbers + k) * PLANE_LANES + lane,
                     number[k]);
    }
    // By element.
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

static void put_squares(PlaneModel *model, const Entry *entry, int count)
{
    PlaneBatches *batches = &model->batches;
    batches->square_count = count / PLANE_LANES;
    for (int at = 0; at < count; at++) {
        int b = at / PLANE_LANES, lane = at % PLANE_LANES;
        batches->square_class[b] = entry[at].key;
        for (int i = 0; i < 4; i++)
            batches->square[(b * 4 + i) * PLANE_LANES + lane] =
                model->form[entry[at].element].vertex[i];
    }
}

static void put_others(PlaneModel *model, const Entry *entry, int count)
{
    PlaneBatches *batches = &model->batches;
    batches->other_count = 0;
    for (int at = 0; at < count;) {
        // One number of vertices per batch.
        int b = batches->other_count++, length = run_length(entry, count, at);
        int vertices = model->form[entry[at].element].shape->count;
        batches->start[b + 1] = batches->start[b] + vertices;
        for (int lane = 0; lane < PLANE_LANES; lane++)
            put_lane(model, b, lane, vertices,
                     lane < length ? &model->form[entry[at + lane].element] : NULL);
        at += length;
    }
}

void plane_reserve_batches(PlaneModel *model, int elements, int classes, const char *name,
                           Arena *arena)
{
    PlaneBatches *batches = &model->batches;
    const size_t real = rows_real_size(&model->vertices.rows);
    const int numbers = model->law == PLANE_MIYAZAKI2004 ? NODE_PAPER_NUMBERS : NODE_NUMBERS;
    // Each number of vertices may leave one batch partly filled.
    const int most = elements / PLANE_LANES + PLANE_PLACES, rows = most * (PLANE_PLACES - 1);
    // Squares share their numbers by class.
    batches->square = ALLOCATE(ARENA_STEP, (size_t)elements * 4, int, "squares");
    batches->square_class = ALLOCATE(ARENA_STEP, elements / PLANE_LANES, int, "square classes");
    batches->class = arena_allocate(arena, ARENA_STEP, (size_t)classes * SQUARE_NUMBERS, real,
                                    "%s/square numbers", name);
    // Other shapes have numbers of their own.
    batches->start = ALLOCATE(ARENA_STEP, most + 1, int, "element start");
    batches->vertex = ALLOCATE(ARENA_STEP, (size_t)rows * PLANE_LANES, int, "elements");
    batches->node = arena_allocate(arena, ARENA_STEP, (size_t)(rows * numbers) * PLANE_LANES, real,
                                   "%s/element vertices", name);
    batches->whole = arena_allocate(arena, ARENA_STEP, (size_t)(most * WHOLE_NUMBERS) * PLANE_LANES,
                                    real, "%s/element stiffness", name);
    // Scratch memory of plane_fill_batches.
    model->sorting = (PlaneSorting){
        .class_capacity = classes,
        .class = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)classes,
                                sizeof *model->sorting.class, "%s/classes of squares", name),
    };
    for (int k = 0; k < 4; k++)
        model->sorting.entry[k] = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)elements,
                                                 sizeof(Entry), "%s/order of elements %d", name, k);
}

void plane_fill_batches(PlaneModel *model)
{
    const PlaneSorting *work = &model->sorting;
    Entry *square = work->entry[0], *other = work->entry[1];
    // Squares by class, other shapes by their number of vertices.
    int squares = 0, others = 0, classes = 0;
    for (int e = 0; e < model->element_count; e++) {
        const PlaneForm *form = &model->form[e];
        if (is_square(form))
            square[squares++] = (Entry){find_class(work->class, &classes, form), e};
        else
            other[others++] = (Entry){form->shape->count, e};
    }
    ASSERT(classes <= work->class_capacity);
    // Full batches of squares stay; the rest joins the other shapes.
    Entry *sorted = work->entry[2];
    sort_entries(square, sorted, squares, classes);
    int kept = 0;
    for (int at = 0, length; at < squares; at += length) {
        length = run_length(sorted, squares, at);
        for (int k = 0; k < length; k++)
            if (length == PLANE_LANES)
                square[kept++] = sorted[at + k];
            else
                other[others++] = (Entry){4, sorted[at + k].element};
    }
    put_squares(model, square, kept);
    // Remaining squares follow the other shapes with four vertices.
    Entry *mixed = work->entry[3];
    sort_entries(other, mixed, others, PLANE_PLACES + 1);
    put_others(model, mixed, others);
    // Numbers of the classes in use.
    for (long k = 0; k < (long)classes * SQUARE_NUMBERS; k++)
        rows_put(&model->vertices.rows, model->batches.class, k,
                 work->class[k / SQUARE_NUMBERS][k % SQUARE_NUMBERS]);
}
