// SPDX-License-Identifier: MIT
#include "voxel_reference.h"
#include "scoped.h"

#include "base/check.h"
#include "voxel/lattice_mesh.h"
#include "voxel/layout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// The paper's weights are all 1, about their own mean, and its k is such that all elements of one
// size have the same sum k |X|^2, which is the energy of an even stretch: with 8 corners 6 mu H^3.
static void set_law(ReferenceElement *element, VoxelLaw law, double mu, double nu, double size)
{
    const int count = element->rest.count;
    const double k = mu * size;
    element->stiffness = (ElementStiffness){
        .law = law,
        .mu = mu,
        .lambda = 2.0 * mu * nu / (1.0 - 2.0 * nu),
        .residual = (1.0 + nu) / 3.0 * k,
        .damping = k,
    };
    if (law == VOXEL_AFFINE)
        return;
    Vec3 mean = {0.0, 0.0, 0.0};
    double spread = 0.0;
    for (int i = 0; i < count; i++) {
        element->weight[i] = 1.0;
        mean = vec3_madd(mean, 1.0 / count, element->corner[i]);
    }
    for (int i = 0; i < count; i++) {
        Vec3 r = vec3_sub(element->corner[i], mean);
        spread += vec3_dot(r, r);
    }
    element->stiffness.residual = element->stiffness.damping = k * 6.0 * size * size / spread;
}

static void set_element(VoxelReference *reference, ReferenceElement *element,
                        const VoxelOptions *options, const Leaf *leaf, const LatticeMesh *mesh,
                        int index)
{
    const SolidMaterial *material = &options->material[leaf->material - 1];
    const double size = options->lattice->size * (1 << leaf->level), nu = material->poisson_ratio;
    const double mass = material->density * size * size * size;
    Template shape;
    template_create(&shape, template_mask_of(mesh->vertex[index]));
    for (int i = 0; i < shape.count; i++) {
        // In the world's axes, as positions are.
        element->corner[i] = quat_rotate(options->lattice->turn, vec3_scale(size, shape.rest[i]));
        element->area[i] =
            quat_rotate(options->lattice->turn, vec3_scale(size * size, shape.area[i]));
        element->weight[i] = shape.weight[i];
        element->vertex[i] = mesh->vertex[index][shape.node[i]];
        reference->mass[element->vertex[i]] +=
            mass *
            (options->law == VOXEL_AFFINE ? shape.weight[i] / 8.0 : 1.0 / (double)shape.count);
    }
    element->rest =
        (Element){shape.count, element->corner, element->weight, element->area, size * size * size};
    element->last = QUAT_NONE;
    set_law(element, options->law, material->youngs_modulus / (2.0 * (1.0 + nu)), nu, size);
    const double step =
        size * sqrt(material->density * (1.0 - 2.0 * nu) / material->youngs_modulus);
    reference->critical_step = fmin(reference->critical_step, step);
}

void voxel_reference_create(VoxelReference *reference, const VoxelOptions *options)
{
    SCOPED(layout_destroy) Layout layout;
    SCOPED(lattice_mesh_destroy) LatticeMesh mesh;
    layout_create(&layout, options->lattice, options->body.levels);
    bool made = lattice_mesh_create(&mesh, &layout, &(Status){0});
    ASSERT(made);
    const int n = mesh.vertex_count, m = mesh.element_count;
    *reference = (VoxelReference){
        .element_count = m,
        .vertex_count = n,
        .surface_count = mesh.surface_count,
        .element = zeroed(m, sizeof *reference->element),
        .rest = zeroed(n, sizeof *reference->rest),
        .position = zeroed(n, sizeof *reference->position),
        .velocity = zeroed(n, sizeof *reference->velocity),
        .force = zeroed(n, sizeof *reference->force),
        .load = zeroed(n, sizeof *reference->load),
        .mass = zeroed(n, sizeof *reference->mass),
        .fixed = zeroed(n, sizeof *reference->fixed),
        .gravity = options->body.gravity,
        .stiffness_scale = 1.0,
        .damping_scale = 1.0,
        .integrator = options->body.integrator,
        .critical_step = (double)(double)INFINITY,
    };
    for (int i = 0; i < n; i++) {
        const int *p = mesh.point[i];
        reference->rest[i] = reference->position[i] =
            lattice_point(options->lattice, p[0], p[1], p[2]);
        for (int r = 0; r < options->body.fixed_count; r++)
            reference->fixed[i] |= fixed_contains(&options->body.fixed[r], reference->rest[i]);
    }
    for (int e = 0; e < m; e++)
        set_element(reference, &reference->element[e], options, &layout.leaf[e], &mesh, e);
    for (int e = 0; e < m; e++)
        reference->element[e].stiffness.damping *= options->damping * reference->critical_step;
}

void voxel_reference_destroy(VoxelReference *reference)
{
    free(reference->element);
    free(reference->rest);
    free(reference->position);
    free(reference->velocity);
    free(reference->force);
    free(reference->load);
    free(reference->mass);
    free(reference->fixed);
}

double voxel_reference_forces(VoxelReference *reference)
{
    double energy = 0.0;
    memcpy(reference->force, reference->load,
           (size_t)reference->vertex_count * sizeof *reference->force);
    for (int e = 0; e < reference->element_count; e++) {
        ReferenceElement *element = &reference->element[e];
        ElementStiffness stiffness = element->stiffness;
        stiffness.damping *= reference->damping_scale;
        Vec3 x[NODE_COUNT], v[NODE_COUNT], force[NODE_COUNT] = {{0.0, 0.0, 0.0}};
        const int count = element->rest.count;
        for (int i = 0; i < count; i++) {
            x[i] = reference->position[element->vertex[i]];
            v[i] = reference->velocity[element->vertex[i]];
        }
        energy += element_forces(&element->rest, &stiffness, x, v, &element->last, force);
        for (int i = 0; i < count; i++) {
            Vec3 *to = &reference->force[element->vertex[i]];
            *to = vec3_madd(*to, reference->stiffness_scale, force[i]);
        }
    }
    return reference->stiffness_scale * energy;
}

static void kick(VoxelReference *reference, double h)
{
    voxel_reference_forces(reference);
    for (int i = 0; i < reference->vertex_count; i++) {
        Vec3 a = vec3_madd(reference->gravity, 1.0 / reference->mass[i], reference->force[i]);
        if (!reference->fixed[i])
            reference->velocity[i] = vec3_madd(reference->velocity[i], h, a);
    }
}

static void drift(VoxelReference *reference, double h)
{
    for (int i = 0; i < reference->vertex_count; i++)
        reference->position[i] = vec3_madd(reference->position[i], h, reference->velocity[i]);
}

void voxel_reference_tick(VoxelReference *reference, int substeps, double h)
{
    const bool leapfrog = reference->integrator == INTEGRATOR_LEAPFROG;
    for (int i = 0; i < substeps; i++) {
        if (leapfrog)
            drift(reference, 0.5 * h);
        kick(reference, h);
        drift(reference, leapfrog ? 0.5 * h : h);
    }
}

int voxel_reference_inverted(const VoxelReference *reference)
{
    int count = 0;
    for (int e = 0; e < reference->element_count; e++) {
        const ReferenceElement *element = &reference->element[e];
        Vec3 column[3] = {{0.0, 0.0, 0.0}};
        for (int i = 0; i < element->rest.count; i++) {
            Vec3 x = vec3_sub(reference->position[element->vertex[i]],
                              reference->position[element->vertex[0]]);
            column[0] = vec3_madd(column[0], element->area[i].x, x);
            column[1] = vec3_madd(column[1], element->area[i].y, x);
            column[2] = vec3_madd(column[2], element->area[i].z, x);
        }
        count += !(vec3_dot(column[0], vec3_cross(column[1], column[2])) > 0.0);
    }
    return count;
}
