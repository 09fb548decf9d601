#include "plane/forms.h"

#include "base/check.h"

#include <math.h>
#include <string.h>

enum {
    KEYS = 16 * 512, // quarters and present places
    SHAPES = 256,    // upper bound: 13 sets of quarters, at most 2^4 of places each
};

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
        unsigned corners = 0, middles = 0;
        for (int at = 0; at < PLANE_PLACES; at++) {
            PlanePassing passing = plane_passing(quarters, at);
            corners |= passing == PLANE_CORNER ? 1u << at : 0u;
            middles |= passing == PLANE_STRAIGHT ? 1u << at : 0u;
        }
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
