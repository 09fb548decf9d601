// Hashes the physics of a scene member by member.
#include "files/physics_hash.h"

#include "files/fnv.h"

#include <string.h>

// Adds what bodies of all models have.
static void add_shared(uint64_t *hash, IntegratorKind integrator, double time_step,
                       double contact_ratio, double contact_damping, double friction)
{
    fnv_int(hash, integrator);
    fnv_real(hash, time_step);
    fnv_real(hash, contact_ratio);
    fnv_real(hash, contact_damping);
    fnv_real(hash, friction);
}

static void add_surface(uint64_t *hash, const SurfaceOptions *surface)
{
    const SurfaceMaterial *material = &surface->material;
    fnv_int(hash, material->uniform);
    if (material->uniform) {
        fnv_real(hash, material->spring_stiffness);
        fnv_real(hash, material->spring_damping);
        fnv_real(hash, material->node_mass);
    } else {
        fnv_real(hash, material->youngs_modulus_2d);
        fnv_real(hash, material->areal_density);
        fnv_real(hash, material->damping_time);
    }
    fnv_real(hash, material->node_damping);

    // Options of a disabled feature do not count.
    const SurfaceShape *shape = &surface->shape;
    fnv_int(hash, shape->wanted);
    if (shape->wanted) {
        fnv_int(hash, shape->per_node);
        fnv_real(hash, shape->per_node ? shape->stiffness : shape->angular_frequency);
        fnv_real(hash, shape->per_node ? shape->damping : shape->damping_ratio);
        fnv_int(hash, shape->frame);
        if (shape->direction == SHAPE_DAMPS_RADIAL)
            fnv_int(hash, shape->direction);
    }
    if (surface->body.levels > 0) {
        fnv_int(hash, surface->body.levels);
        fnv_int(hash, surface->start_level);
        fnv_int(hash, surface->adjust);
    }
    if (surface->adaptive) {
        fnv_real(hash, surface->adapt.force);
        fnv_real(hash, surface->adapt.speed);
        fnv_real(hash, surface->adapt.curvature);
        fnv_real(hash, surface->adapt.check_hz);
        fnv_int(hash, surface->body.node_capacity);
        fnv_int(hash, surface->body.face_capacity);
    }
    if (surface->body.cuttable) {
        fnv_int(hash, surface->body.cuttable);
        fnv_real(hash, surface->tear_stretch);
        fnv_int(hash, surface->body.node_capacity);
        fnv_int(hash, surface->body.face_capacity);
    }
    fnv_real(hash, surface->prestress);
    add_shared(hash, surface->body.integrator, surface->body.time_step, surface->body.contact_ratio,
               surface->body.contact_damping, surface->body.friction);
    if (surface->automatic || surface->body.integrator == INTEGRATOR_IMPLICIT) {
        fnv_int(hash, surface->automatic);
        fnv_real(hash, surface->implicit.theta);
        fnv_real(hash, surface->implicit.tolerance);
        fnv_int(hash, surface->implicit.iterations);
    }
}

// World.cells has the hash of the cells.
static void add_voxel(uint64_t *hash, const VoxelOptions *voxel)
{
    fnv_int(hash, voxel->dimensions);
    fnv_int(hash, voxel->body.levels);
    fnv_int(hash, voxel->law);
    fnv_int(hash, voxel->material_count);
    for (int i = 0; i < voxel->material_count; i++) {
        fnv_real(hash, voxel->material[i].youngs_modulus);
        fnv_real(hash, voxel->material[i].poisson_ratio);
        fnv_real(hash, voxel->material[i].density);
    }
    fnv_real(hash, voxel->damping);
    if (voxel->body.cuttable) {
        fnv_int(hash, voxel->body.cuttable);
        fnv_int(hash, voxel->split_budget);
        fnv_real(hash, voxel->tear_stress);
        fnv_real(hash, voxel->tear_force);
        fnv_int(hash, voxel->body.node_capacity);
        fnv_int(hash, voxel->body.face_capacity);
    }
    add_shared(hash, voxel->body.integrator, voxel->body.time_step, voxel->body.contact_ratio,
               voxel->body.contact_damping, voxel->body.friction);
}

static void add_fixed(uint64_t *hash, const FixedRegion *region)
{
    fnv_int(hash, region->kind);
    fnv_vector(hash, region->low);
    fnv_vector(hash, region->high);
    fnv_vector(hash, region->center);
    fnv_real(hash, region->radius);
    fnv_int(hash, region->node_count);
    for (int i = 0; i < region->node_count; i++)
        fnv_int(hash, region->node[i]);
}

static void add_body(uint64_t *hash, const SceneBody *body, const TriMesh *mesh, uint64_t cells)
{
    const char *model = scene_model_name(body->model);
    *hash = fnv_bytes(*hash, body->name, strlen(body->name) + 1);
    *hash = fnv_bytes(*hash, model, strlen(model) + 1);
    if (body->model == MODEL_VOXEL)
        add_voxel(hash, &body->voxel);
    else
        add_surface(hash, &body->surface);
    fnv_int(hash, body->options.fixed_count);
    for (int i = 0; i < body->options.fixed_count; i++)
        add_fixed(hash, &body->options.fixed[i]);
    if (body->model == MODEL_VOXEL) {
        *hash = fnv_bytes(*hash, &cells, sizeof cells);
        return;
    }
    fnv_int(hash, mesh->node_count);
    fnv_int(hash, mesh->triangle_count);
    *hash = fnv_bytes(*hash, mesh->position, (size_t)mesh->node_count * sizeof *mesh->position);
    *hash = fnv_bytes(*hash, mesh->triangle, (size_t)mesh->triangle_count * sizeof *mesh->triangle);
}

static void add_tool(uint64_t *hash, const ToolOptions *tool)
{
    fnv_int(hash, tool->id);
    fnv_int(hash, tool->kind);
    fnv_int(hash, tool->capsule_count);
    for (int i = 0; i < tool->capsule_count; i++) {
        fnv_vector(hash, tool->capsule[i].from);
        fnv_vector(hash, tool->capsule[i].to);
        fnv_real(hash, tool->capsule[i].radius);
    }
    fnv_int(hash, tool->has_plane);
    fnv_vector(hash, tool->plane.point);
    fnv_vector(hash, tool->plane.normal);
    fnv_real(hash, tool->max_force);
    for (int i = 0; i < 2 && tool->kind == TOOL_BLADE; i++)
        fnv_vector(hash, tool->edge[i]);
    if (tool->has_friction)
        fnv_real(hash, tool->friction);
    if (tool->kind == TOOL_GRASPER) {
        fnv_real(hash, tool->grip_stiffness);
        fnv_real(hash, tool->grip_damping);
    }
}

static void add_attachment(uint64_t *hash, const AttachmentOptions *attachment)
{
    const FixedRegion *region = &attachment->region;
    fnv_int(hash, attachment->body);
    fnv_int(hash, attachment->to);
    fnv_int(hash, attachment->tool);
    fnv_int(hash, attachment->to_body);
    fnv_real(hash, attachment->stiffness);
    fnv_real(hash, attachment->damping_ratio);
    fnv_int(hash, region->kind);
    fnv_vector(hash, region->low);
    fnv_vector(hash, region->high);
    fnv_vector(hash, region->center);
    fnv_real(hash, region->radius);
    fnv_int(hash, region->node_count);
    for (int i = 0; i < region->node_count; i++)
        fnv_int(hash, region->node[i]);
}

static void add_load(uint64_t *hash, const LoadOptions *load)
{
    fnv_int(hash, load->body);
    fnv_vector(hash, load->center);
    fnv_real(hash, load->radius);
    fnv_vector(hash, load->force);
    fnv_real(hash, load->start);
    fnv_real(hash, load->duration);
}

uint64_t physics_hash(const Scene *scene, const World *world)
{
    uint64_t hash = FNV_START;
    fnv_real(&hash, scene->rate_hz);
    fnv_vector(&hash, scene->gravity);
    fnv_real(&hash, scene->tool_timeout_s);
    fnv_int(&hash, scene->body_count);
    for (int i = 0; i < scene->body_count; i++)
        add_body(&hash, &scene->body[i], &world->mesh[i], world->cells[i].hash);
    fnv_int(&hash, scene->tool_count);
    for (int i = 0; i < scene->tool_count; i++)
        add_tool(&hash, &scene->tool[i]);
    for (int i = 0; i < scene->attachment_count; i++)
        add_attachment(&hash, &scene->attachment[i].options);
    fnv_int(&hash, scene->load_count);
    for (int i = 0; i < scene->load_count; i++)
        add_load(&hash, &scene->load[i].load);
    return hash;
}
