// Hashes the physics of a scene member by member: structures have padding, whose bytes mean
// nothing.
#include "files/physics_hash.h"

#include <string.h>

// FNV-1a, continued.
static uint64_t add_bytes(uint64_t hash, const void *memory, size_t bytes)
{
    const unsigned char *byte = memory;
    for (size_t i = 0; i < bytes; i++)
        hash = (hash ^ byte[i]) * UINT64_C(0x100000001b3);
    return hash;
}

static void add_real(uint64_t *hash, double value)
{
    *hash = add_bytes(*hash, &value, sizeof value);
}

static void add_int(uint64_t *hash, int64_t value)
{
    *hash = add_bytes(*hash, &value, sizeof value);
}

static void add_vector(uint64_t *hash, Vec3 v)
{
    add_real(hash, v.x);
    add_real(hash, v.y);
    add_real(hash, v.z);
}

static void add_surface(uint64_t *hash, const SurfaceOptions *surface)
{
    const SurfaceMaterial *material = &surface->material;
    add_int(hash, material->uniform);
    if (material->uniform) {
        add_real(hash, material->spring_stiffness);
        add_real(hash, material->spring_damping);
        add_real(hash, material->node_mass);
    } else {
        add_real(hash, material->youngs_modulus_2d);
        add_real(hash, material->areal_density);
        add_real(hash, material->damping_time);
    }
    add_real(hash, material->node_damping);

    const SurfaceShape *shape = &surface->shape;
    add_int(hash, shape->wanted);
    if (shape->wanted) {
        add_int(hash, shape->per_node);
        add_real(hash, shape->per_node ? shape->stiffness : shape->angular_frequency);
        add_real(hash, shape->per_node ? shape->damping : shape->damping_ratio);
        add_int(hash, shape->frame);
    }
    if (surface->levels > 0) {
        add_int(hash, surface->levels);
        add_int(hash, surface->start_level);
        add_int(hash, surface->adjust);
    }
    if (surface->adaptive) {
        add_real(hash, surface->adapt.force);
        add_real(hash, surface->adapt.speed);
        add_real(hash, surface->adapt.curvature);
        add_real(hash, surface->adapt.check_hz);
        add_int(hash, surface->node_capacity);
        add_int(hash, surface->face_capacity);
    }
    add_real(hash, surface->prestress);
    add_int(hash, surface->integrator);
    add_real(hash, surface->time_step);
    add_real(hash, surface->contact_ratio);
    add_real(hash, surface->contact_damping);
    add_real(hash, surface->friction);
}

static void add_fixed(uint64_t *hash, const FixedRegion *region)
{
    add_int(hash, region->kind);
    add_vector(hash, region->low);
    add_vector(hash, region->high);
    add_vector(hash, region->center);
    add_real(hash, region->radius);
    add_int(hash, region->node_count);
    for (int i = 0; i < region->node_count; i++)
        add_int(hash, region->node[i]);
}

static void add_body(uint64_t *hash, const SceneBody *body, const TriMesh *mesh)
{
    *hash = add_bytes(*hash, body->name, strlen(body->name) + 1);
    *hash = add_bytes(*hash, body->model, strlen(body->model) + 1);
    add_surface(hash, &body->surface);
    add_int(hash, body->fixed_count);
    for (int i = 0; i < body->fixed_count; i++)
        add_fixed(hash, &body->fixed[i]);
    add_int(hash, mesh->node_count);
    add_int(hash, mesh->triangle_count);
    *hash = add_bytes(*hash, mesh->position, (size_t)mesh->node_count * sizeof *mesh->position);
    *hash = add_bytes(*hash, mesh->triangle, (size_t)mesh->triangle_count * sizeof *mesh->triangle);
}

static void add_tool(uint64_t *hash, const ToolOptions *tool)
{
    add_int(hash, tool->id);
    add_int(hash, tool->kind);
    add_int(hash, tool->capsule_count);
    for (int i = 0; i < tool->capsule_count; i++) {
        add_vector(hash, tool->capsule[i].from);
        add_vector(hash, tool->capsule[i].to);
        add_real(hash, tool->capsule[i].radius);
    }
    add_int(hash, tool->has_plane);
    add_vector(hash, tool->plane.point);
    add_vector(hash, tool->plane.normal);
    add_real(hash, tool->max_force);
}

static void add_load(uint64_t *hash, const LoadOptions *load)
{
    add_int(hash, load->body);
    add_vector(hash, load->center);
    add_real(hash, load->radius);
    add_vector(hash, load->force);
    add_real(hash, load->start);
    add_real(hash, load->duration);
}

uint64_t physics_hash(const Scene *scene, const World *world)
{
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    add_real(&hash, scene->rate_hz);
    add_vector(&hash, scene->gravity);
    add_real(&hash, scene->tool_timeout_s);
    add_int(&hash, scene->body_count);
    for (int i = 0; i < scene->body_count; i++)
        add_body(&hash, &scene->body[i], &world->mesh[i]);
    add_int(&hash, scene->tool_count);
    for (int i = 0; i < scene->tool_count; i++)
        add_tool(&hash, &scene->tool[i]);
    add_int(&hash, scene->load_count);
    for (int i = 0; i < scene->load_count; i++)
        add_load(&hash, &scene->load[i].load);
    return hash;
}
