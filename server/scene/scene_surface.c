// SPDX-License-Identifier: MIT
// Reads what only surface bodies have: mesh (and that of a skin), material, shape, adapt.
#include "scene/scene_parts.h"

#include <string.h>

// --- `mesh`: a file or a generator, and its placement in the world -------------------------------

typedef struct MeshGroup {
    MeshSource mesh;
    const char *file;
    int generator, nodes, subdivisions;
    const config_setting_t *place;
} MeshGroup;

static const OptionWord GENERATOR_WORDS[] = {
    {"sphere", MESH_SPHERE}, {"uv_sphere", MESH_UV_SPHERE}, {"ico_sphere", MESH_ICO_SPHERE},
    {"sheet", MESH_SHEET},   {"stomach", MESH_STOMACH},     {NULL, 0}};

enum { ICO_DEEPEST = 8, ICO_USUAL = 3, ICO_MOST = 655362 };

// Sources that use a key.
#define FROM(kind) (1u << (kind))

#define AT(member) offsetof(MeshGroup, member)
static const Option MESH_OPTIONS[] = {
    {"file", OPTION_STRING, AT(file), "", .low = 1, .high = SCENE_FILE_MAX, .preset_text = "none",
     .about = "OBJ, STL, PLY, OFF, VTK, MSH or TetGen file, relative to the scene's folder. Either "
              "this or "
              "`generator`."},
    {"generator", OPTION_WORD, AT(generator), "", .words = GENERATOR_WORDS, .preset = -1,
     .preset_text = "none", .about = "Shape that is generated."},
    {"nodes", OPTION_INT, AT(nodes), "", 4.0, ICO_MOST,
     .preset_text = "`sphere` 114, `stomach` 188",
     .only = FROM(MESH_SPHERE) | FROM(MESH_ICO_SPHERE) | FROM(MESH_STOMACH),
     .about =
         "Number of nodes: `sphere` 4 to 20000, `stomach` 60 to 20000, `ico_sphere` 10 * 4^s + "
         "2."},
    {"subdivisions", OPTION_INT, AT(subdivisions), "", 0.0, ICO_DEEPEST, .preset = ICO_USUAL,
     .only = FROM(MESH_ICO_SPHERE),
     .about = "`ico_sphere`: how often every triangle of the icosahedron is split in four."},
    {"rings", OPTION_INT, AT(mesh.rings), "", 1.0, 2000.0, .preset = 8.0,
     .only = FROM(MESH_UV_SPHERE), .about = "`uv_sphere`: rings of nodes between the poles."},
    {"segments", OPTION_INT, AT(mesh.segments), "", 3.0, 4000.0, .preset = 14.0,
     .only = FROM(MESH_UV_SPHERE), .about = "`uv_sphere`: nodes per ring."},
    {"columns", OPTION_INT, AT(mesh.columns), "", 2.0, 4000.0, .preset = 21.0,
     .only = FROM(MESH_SHEET), .about = "`sheet`: nodes along x."},
    {"rows", OPTION_INT, AT(mesh.rows), "", 2.0, 4000.0, .preset = 21.0, .only = FROM(MESH_SHEET),
     .about = "`sheet`: nodes along y."},
    {"radius", OPTION_REAL, AT(mesh.radius), "m", 0.0, SIZE_LIMIT, .open = true, .preset = 0.05,
     .only = FROM(MESH_SPHERE) | FROM(MESH_UV_SPHERE) | FROM(MESH_ICO_SPHERE),
     .about = "Radius of the spheres."},
    {"width", OPTION_REAL, AT(mesh.width), "m", 0.0, SIZE_LIMIT, .open = true, .preset = 0.1,
     .only = FROM(MESH_SHEET), .about = "`sheet`: extent along x."},
    {"height", OPTION_REAL, AT(mesh.height), "m", 0.0, SIZE_LIMIT, .open = true, .preset = 0.1,
     .only = FROM(MESH_SHEET), .about = "`sheet`: extent along y."},
    {"length", OPTION_REAL, AT(mesh.length), "m", 0.0, SIZE_LIMIT, .open = true, .preset = 0.25,
     .only = FROM(MESH_STOMACH), .about = "`stomach`: its largest extent."},
    {"scale", OPTION_REAL, AT(mesh.scale), "", 0.0, 1e6, .open = true, .preset = 1.0,
     .about = "Metres per unit of the file or generator; 0.001 for millimetres."},
    {"place", OPTION_GROUP, AT(place), "", .preset_text = "as it is",
     .about = "Position and rotation of the scaled mesh."},
};
#undef AT
const OptionTable MESH_TABLE = OPTION_TABLE(
    "bodies.mesh", "A closed or open triangle mesh, from a file or a generator.", MESH_OPTIONS);

typedef struct Placement {
    Vec3 translation, rotation;
} Placement;

static const Option PLACE_OPTIONS[] = {
    {"translation", OPTION_VECTOR, offsetof(Placement, translation), "m", 0.0, POSITION_LIMIT,
     .about = "Applied last."},
    {"rotation", OPTION_VECTOR, offsetof(Placement, rotation), "rad", 0.0, 100.0,
     .about = "Rotation vector: axis times angle, about the mesh's origin; applied after `scale`."},
};
const OptionTable PLACEMENT_TABLE =
    TITLED_TABLE("`bodies.mesh.place`, `bodies.voxels.place`, `bodies.skin.place`",
                 "bodies.mesh.place", "A rigid motion of the mesh or voxels.", PLACE_OPTIONS);

bool scene_read_placement(const SceneReader *reader, const config_setting_t *group,
                          const char *owner, Vec3 *rotation, Vec3 *translation)
{
    Placement raw = {0};
    OptionTable table = PLACEMENT_TABLE;
    table.path = owner;
    if (!option_read(&table, group, &reader->source, &raw))
        return false;
    *rotation = raw.rotation;
    *translation = raw.translation;
    return true;
}

// Refuses a key that the chosen source would ignore.
static bool check_meant(const SceneReader *reader, const config_setting_t *group,
                        MeshSourceKind kind)
{
    const char *name = "a file";
    for (const OptionWord *word = GENERATOR_WORDS; word->word != NULL; word++)
        if (word->value == (int)kind)
            name = word->word;
    char owner[64];
    snprintf(owner, sizeof owner, "a mesh from %s", name);
    return option_refuse_unused(&MESH_TABLE, group, &reader->source, kind, owner);
}

// Chooses the number of nodes, limited by each generator in its own way; 0 for those without one.
static bool choose_nodes(const SceneReader *reader, const config_setting_t *group,
                         const MeshGroup *raw, MeshSource *mesh)
{
    const OptionSource *source = &reader->source;
    // An ico_sphere has only certain numbers of nodes.
    const config_setting_t *at = option_find(group, "nodes");
    if (mesh->kind == MESH_ICO_SPHERE) {
        if (at != NULL && option_given(group, "subdivisions"))
            return option_fail(source, at, "nodes and subdivisions are two ways to say the same");
        int nodes = 12, wanted = raw->nodes, subdivisions = 0;
        while (at != NULL ? nodes < wanted : subdivisions < raw->subdivisions) {
            nodes = 4 * nodes - 6;
            subdivisions++;
        }
        if (at != NULL && nodes != wanted)
            return option_fail(source, at,
                               "nodes %d is no ico_sphere: 10 * 4^s + 2, as 12, 42, 162, 642, 2562",
                               wanted);
        mesh->nodes = nodes;
        return true;
    }
    // Of the others two are made of any number within bounds.
    bool sphere = mesh->kind == MESH_SPHERE;
    if (!sphere && mesh->kind != MESH_STOMACH)
        return true;
    mesh->nodes = at != NULL ? raw->nodes : sphere ? 114 : 188;
    int low = sphere ? 4 : 60;
    if (mesh->nodes < low || mesh->nodes > 20000)
        return option_fail(source, at, "nodes %d outside [%d, 20000]", mesh->nodes, low);
    return true;
}

bool scene_read_mesh(const SceneReader *reader, const config_setting_t *group, MeshSource *mesh)
{
    MeshGroup raw = {0};
    const OptionSource *source = &reader->source;
    if (!option_read(&MESH_TABLE, group, source, &raw))
        return false;
    // One source, and only keys that it uses.
    bool file = option_given(group, "file");
    if (file == option_given(group, "generator"))
        return option_fail(source, group, "mesh needs %s file or generator",
                           file ? "only one of" : "a");
    *mesh = raw.mesh;
    mesh->kind = file ? MESH_FILE : (MeshSourceKind)raw.generator;
    if (!check_meant(reader, group, mesh->kind) || !choose_nodes(reader, group, &raw, mesh))
        return false;
    if (file)
        mesh->file = scene_source_resolve(reader->folder, raw.file);
    return scene_read_placement(reader, raw.place, PLACEMENT_TABLE.path, &mesh->rotation,
                                &mesh->translation);
}

// --- `material` and `shape`: each in physical units or as the paper's values per spring and node -

// The keys of `material`, and what is read further.
typedef struct MaterialGroup {
    SurfaceMaterial material; // first: offsets of rows are the same in a SurfaceMaterial
    const config_setting_t *relaxation;
    const config_setting_t *stiffening;
} MaterialGroup;

static bool is_damped(const OptionPlace *place)
{
    const SurfaceMaterial *material = &place->body->surface.material;
    return (material->uniform ? material->spring_damping : material->damping_time) > 0.0;
}

static bool is_stiff(const OptionPlace *place)
{
    const SurfaceMaterial *material = &place->body->surface.material;
    return material->thickness > 0.0 || material->bending_stiffness > 0.0;
}

#define AT(member) offsetof(SurfaceMaterial, member)
static const Option MATERIAL_OPTIONS[] = {
    {"youngs_modulus_2d", OPTION_REAL, AT(youngs_modulus_2d), "N/m", 0.0, 1e9, .open = true,
     .way = 1, .preset = 80.0, .physics = true,
     .about = "Young's modulus times thickness; springs get k = E (A1 + A2) / L^2 (Van Gelder "
              "1998)."},
    {"areal_density", OPTION_REAL, AT(areal_density), "kg/m2", 0.0, 1e6, .open = true, .way = 1,
     .preset = 4.2, .physics = true,
     .about = "Mass per unit area; a node has a third of the mass of the faces around it."},
    {"damping_time", OPTION_REAL, AT(damping_time), "s", 0.0, 10.0, .way = 1, .preset = 2e-4,
     .physics = true,
     .feature = {.name = "damping of springs",
                 is_damped,
                 "material.damping_time or spring_damping"},
     .about = "Damping of a spring over its stiffness. Reduced, with a warning, where it would "
              "shorten explicit steps; `implicit` uses at most one step of it."},
    {"thickness", OPTION_REAL, AT(thickness), "m", 0.0, 1.0, .way = 1, .physics = true,
     .feature = {.name = "bending of the wall",
                 is_stiff,
                 "material.thickness or bending_stiffness"},
     .about = "Thickness t of the wall, which then resists bending with E2D t^2 / 10.67 (Poisson "
              "ratio 1/3); 0: it does not. Needs `adjust = \"continuum\"`."},
    {"bending_stiffness", OPTION_REAL, AT(bending_stiffness), "N m", 0.0, 1e9, .apart = "thickness",
     .physics = true,
     .about =
         "Instead of `thickness`, and with uniform values too: bending stiffness of the wall."},
    {"spring_stiffness", OPTION_REAL, AT(spring_stiffness), "N/m", 0.0, 1e9, .open = true, .way = 2,
     .needed = true, .preset_text = "none", .physics = true,
     .about = "Uniform: stiffness of every spring."},
    {"spring_damping", OPTION_REAL, AT(spring_damping), "N s/m", 0.0, 1e6, .way = 2,
     .physics = true, .about = "Uniform: damping of every spring."},
    {"node_mass", OPTION_REAL, AT(node_mass), "kg", 0.0, 1e6, .open = true, .way = 2,
     .needed = true, .preset_text = "none", .physics = true,
     .about = "Uniform: mass of every node."},
    {"node_damping", OPTION_REAL, AT(node_damping), "N s/m", 0.0, 1e6, .physics = true,
     .feature = {.name = "drag on nodes"}, .about = "Both: drag on every node's velocity."},
    {"relaxation", OPTION_LIST, offsetof(MaterialGroup, relaxation), "", .preset_text = "none",
     .about = "Both: up to three Maxwell branches beside each spring, by which its stress relaxes: "
              "`youngs_modulus_2d` or `spring_stiffness` is what is left after a long time. Needs "
              "integrator `leapfrog` or `symplectic_euler`."},
    {"loss_factor", OPTION_REAL, AT(loss_factor), "", 0.0, LOSS_MAX, .apart = "relaxation",
     .physics = true, .feature = {.name = "loss factor"},
     .about = "Both: tangent of the phase between strain and stress, nearly the same from 1 to "
              "100 Hz, by three branches of `relaxation`, instead of it. A swing's damping ratio "
              "by stretching is half of it."},
    {"stiffening", OPTION_GROUP, offsetof(MaterialGroup, stiffening), "", .preset_text = "linear",
     .about = "Both: stiffening of springs as they are pulled; pushed ones stay linear, as fibres "
              "buckle. Needs an explicit integrator."},
};
#undef AT
const OptionTable MATERIAL_TABLE = {
    TABLE_MEMBERS(
        "`bodies.material` of a surface body", "bodies.material",
        "Either physical (`youngs_modulus_2d`, `areal_density`, `damping_time`) or uniform "
        "(`spring_stiffness` and `node_mass`, and `spring_damping`); `node_damping` is permitted "
        "with both.",
        MATERIAL_OPTIONS),
    .second = offsetof(SurfaceMaterial, uniform)};

// Springs have no volume.
static bool check_branches(const SceneReader *reader, const config_setting_t *list,
                           SurfaceMaterial *material)
{
    for (int i = 0; list != NULL && i < material->branch_count; i++)
        if (option_given(config_setting_get_elem(list, (unsigned)i), "volumetric"))
            return option_fail(&reader->source, config_setting_get_elem(list, (unsigned)i),
                               "volumetric means nothing for a surface body: springs have no "
                               "volume");
    return true;
}

bool scene_read_material(const SceneReader *reader, const config_setting_t *group,
                         SurfaceMaterial *material)
{
    MaterialGroup raw = {0};
    if (!option_read(&MATERIAL_TABLE, group, &reader->source, &raw))
        return false;
    *material = raw.material;
    return scene_read_branches(reader, group, raw.relaxation, material->loss_factor,
                               &material->branch_count, material->branch) &&
           check_branches(reader, raw.relaxation, material) &&
           scene_read_stiffening(reader, raw.stiffening, &material->stiffening);
}

static const OptionWord FRAME_WORDS[] = {{"world", SHAPE_WORLD}, {"body", SHAPE_BODY}, {NULL, 0}};
static const OptionWord DIRECTION_WORDS[] = {
    {"all", SHAPE_DAMPS_ALL}, {"radial", SHAPE_DAMPS_RADIAL}, {NULL, 0}};

#define AT(member) offsetof(SurfaceShape, member)
static const Option SHAPE_OPTIONS[] = {
    {"angular_frequency", OPTION_REAL, AT(angular_frequency), "rad/s", 0.0, 1e6, .way = 1,
     .preset = 50.0, .physics = true,
     .about = "Angular frequency of a node on its shape spring: k = m w^2."},
    {"damping_ratio", OPTION_REAL, AT(damping_ratio), "", 0.0, 100.0, .way = 1, .preset = 0.1,
     .physics = true, .about = "Share of critical damping of that oscillation."},
    {"stiffness", OPTION_REAL, AT(stiffness), "N/m", 0.0, 1e9, .way = 2, .needed = true,
     .preset_text = "none", .physics = true,
     .about = "Instead: stiffness of every node's shape spring."},
    {"damping", OPTION_REAL, AT(damping), "N s/m", 0.0, 1e6, .way = 2, .physics = true,
     .about = "With `stiffness`: damping of every node's shape spring."},
    {"frame", OPTION_WORD, AT(frame), "", .words = FRAME_WORDS, .preset = SHAPE_WORLD,
     .physics = true, .feature = {.name = "shape springs that follow the body"},
     .about = "Whether the rest shape is fixed in the world or follows the body's rigid motion."},
    {"damping_direction", OPTION_WORD, AT(direction), "", .words = DIRECTION_WORDS,
     .preset = SHAPE_DAMPS_ALL, .physics = true,
     .feature = {.name = "shape springs damped along themselves"},
     .about = "Which part of a node's velocity is damped: all of it, or only the part along the "
              "spring (`radial`: eq 10 as printed, with which a node keeps circling about its rest "
              "position; only with frame `world` and explicit steps)."},
};
#undef AT
const OptionTable SHAPE_TABLE = {
    TABLE_MEMBERS(NULL, "bodies.shape",
                  "Shape-preserving springs (Choi et al. 2005, eq 10). Either `angular_frequency` "
                  "and `damping_ratio`, or `stiffness` and `damping` per node.",
                  SHAPE_OPTIONS),
    .second = offsetof(SurfaceShape, per_node)};

bool scene_read_shape(const SceneReader *reader, const config_setting_t *group, SurfaceShape *shape)
{
    shape->wanted = group != NULL;
    if (group == NULL)
        return true;
    if (!option_read(&SHAPE_TABLE, group, &reader->source, shape))
        return false;
    return shape->direction != SHAPE_DAMPS_RADIAL || shape->frame != SHAPE_BODY ||
           option_fail(&reader->source, option_find(group, "damping_direction"),
                       "damping_direction \"radial\" needs frame \"world\"");
}

#define AT(member) offsetof(SurfaceCavity, member)
static const Option CAVITY_OPTIONS[] = {
    {"pressure", OPTION_REAL, AT(pressure), "Pa", PRESSURE_RANGE, .physics = true,
     .live = "pressure", .feature = {.name = "pressure inside"},
     .about =
         "Pressure above that outside. It stays, until a cut opens the wall. `gas` and `fluid` "
         "are let in at this pressure while the scene settles (`settle_s`), then sealed. 0 without "
         "these: nothing is inside, as without a `cavity`, which SET cannot change."},
    {"gas", OPTION_BOOL, AT(gas), "", .physics = true, .feature = {.name = "gas inside"},
     .about = "A gas at constant temperature: (`ambient` + pressure) times volume stays."},
    {"ambient", OPTION_REAL, AT(ambient), "Pa", 0.0, 1e9, .preset = 101325.0, .physics = true,
     .idle = {&IDLE_HOLDS_NO_GAS}, .about = "Pressure outside. 0: `pressure` times volume stays."},
    {"fluid", OPTION_BOOL, AT(fluid), "", .physics = true, .feature = {.name = "fluid inside"},
     .about = "A fluid that hardly gives way: the volume stays."},
    {"bulk_modulus", OPTION_REAL, AT(bulk_modulus), "Pa", 0.0, 1e12, .open = true,
     .preset_text = "as stiff as makes the bound of the time step 0.7 times as long",
     .physics = true, .idle = {&IDLE_HOLDS_NO_FLUID},
     .about = "Pressure over relative change of volume. More shortens the time step."},
    {"density", OPTION_REAL, AT(density), "kg/m3", 0.0, 1e6, .open = true,
     .preset_text = "1000, of a `gas` 1.2", .physics = true, .idle = {&IDLE_IS_WHOLE},
     .about = "Density of what leaks from a wall that was cut, with the speed sqrt(2 pressure / "
              "density), through 0.62 of the opening's area."},
};
#undef AT
const OptionTable CAVITY_TABLE = OPTION_TABLE(
    "bodies.cavity",
    "What a closed wall encloses: a constant pressure, a gas or a fluid. It needs an integrator "
    "with explicit steps, and `adjust = \"continuum\"`.",
    CAVITY_OPTIONS);

static bool read_cavity(const SceneReader *reader, const BodyGroup *raw, SurfaceOptions *surface)
{
    SurfaceCavity *cavity = &surface->cavity;
    if (raw->cavity == NULL)
        return true;
    if (!option_read(&CAVITY_TABLE, raw->cavity, &reader->source, cavity))
        return false;
    // What is at rest under no pressure needs no cavity.
    cavity->wanted = cavity->gas || cavity->fluid || cavity->pressure != 0.0;
    if (cavity->gas && cavity->fluid)
        return option_fail(&reader->source, option_find(raw->cavity, "fluid"),
                           "fluid cannot be mixed with gas");
    if (cavity->gas && !(cavity->ambient + cavity->pressure > 0.0))
        return option_fail(&reader->source, raw->cavity,
                           "a gas needs ambient + pressure above 0, not %g + %g Pa",
                           cavity->ambient, cavity->pressure);
    return true;
}

void scene_preset_surface(SurfaceOptions *surface)
{
    Status status = {0};
    const OptionSource nowhere = {.path = "", .status = &status};
    // Defaults cannot fail.
    MaterialGroup material = {0};
    option_read(&MATERIAL_TABLE, NULL, &nowhere, &material);
    surface->material = material.material;
    option_read(&SHAPE_TABLE, NULL, &nowhere, &surface->shape);
    option_read(&ADAPT_TABLE, NULL, &nowhere, &surface->adapt);
    surface->shape.wanted = true;
}

// --- other keys of the model ---------------------------------------------------------------------

#define AT(member) offsetof(SurfaceAdapt, member)
static const Option ADAPT_OPTIONS[] = {
    {"force", OPTION_REAL, AT(force), "", ADAPT_RANGE, .open = true, .preset = 0.005,
     .physics = true, .live = "adapt_force",
     .about = "Load per unit area times the edge length over `youngs_modulus_2d` beyond which a "
              "face is refined."},
    {"speed", OPTION_REAL, AT(speed), "", ADAPT_RANGE, .open = true, .preset = 0.3, .physics = true,
     .live = "adapt_speed",
     .about = "Speed relative to the body's rigid motion, over the wave speed in the membrane "
              "times 2^level, beyond which a face is refined."},
    {"curvature", OPTION_REAL, AT(curvature), "rad", ADAPT_RANGE, .open = true, .preset = 1.6,
     .physics = true, .live = "adapt_curvature",
     .about = "Change of the angle between two faces beyond which they are refined."},
    {"check_hz", OPTION_REAL, AT(check_hz), "Hz", 0.0, 10000.0, .open = true, .follows = true,
     .preset = 100.0, .physics = true,
     .about =
         "How often all faces are checked; at most `rate_hz`, to which the default is lowered."},
    {"coarsest", OPTION_INT, AT(coarsest), "", 0.0, LEVELS_MAX, .physics = true,
     .about = "Level below which no faces are merged, where level 0 is too coarse for the whole "
              "body's shape; `start_level` is then at least this."},
    {"error", OPTION_REAL, AT(error), "", 0.0, 1.0, .preset_text = "not steered", .physics = true,
     .live = "adapt_error", .feature = {.name = "detail steered by its error"},
     .about = "Relative error of the displacements, or of the force on a tool if that is larger, "
              "that the body aims at: it multiplies the thresholds above by 0.001 to 14, until "
              "the error that it estimates of itself is between a half of this and this. 0: as "
              "they are."},
};
#undef AT
const OptionTable ADAPT_TABLE =
    OPTION_TABLE("bodies.adapt",
                 "The body refines where it is loaded, moves or bends, up to `levels`, and "
                 "coarsens where it is at rest. A large value disables a criterion.",
                 ADAPT_OPTIONS);

// Checks levels as far as possible before the mesh is known.
static bool read_levels(const SceneReader *reader, const BodyGroup *raw, SurfaceOptions *surface)
{
    const OptionSource *source = &reader->source;
    surface->adaptive = raw->adapt != NULL;
    // Levels must be there before they can be used.
    if (surface->start_level > surface->body.levels)
        return option_fail(source, option_find(raw->at, "start_level"),
                           "start_level %d exceeds levels %d", surface->start_level,
                           surface->body.levels);
    if (raw->adapt == NULL)
        return true;
    if (surface->body.levels == 0)
        return option_fail(source, raw->adapt,
                           "adapt needs levels, the finest level of detail: set it to 1 or more");
    if (!option_read(&ADAPT_TABLE, raw->adapt, source, &surface->adapt))
        return false;
    surface->body.adapt_error = surface->adapt.error;
    if (surface->adapt.coarsest > surface->body.levels)
        return option_fail(source, option_find(raw->adapt, "coarsest"),
                           "coarsest %d exceeds levels %d", surface->adapt.coarsest,
                           surface->body.levels);
    if (surface->start_level < surface->adapt.coarsest) {
        if (option_given(raw->at, "start_level"))
            return option_fail(source, option_find(raw->at, "start_level"),
                               "start_level %d is below adapt.coarsest %d", surface->start_level,
                               surface->adapt.coarsest);
        surface->start_level = surface->adapt.coarsest;
    }
    return true;
}

// A body that chooses takes leapfrog.
static bool check_integrator(const SceneReader *reader, const BodyGroup *raw,
                             const SurfaceOptions *surface)
{
#ifdef PLIANT_WITH_SURFACE
    const char *key, *needs;
    if (!surface_law_fits(surface, &key, &needs))
        return option_fail(&reader->source, option_find(raw->material, key),
                           "%s needs %s, not \"%s\"", key, needs,
                           integrator_name(surface->body.integrator));
#else
    (void)reader, (void)raw, (void)surface;
#endif
    return true;
}

// Eq. 10 as printed cannot be part of the implicit system.
static bool check_direction(const SceneReader *reader, const BodyGroup *raw,
                            const SurfaceOptions *surface)
{
    if (raw->shape == NULL || surface->shape.direction != SHAPE_DAMPS_RADIAL ||
        (!surface->automatic && surface->body.integrator != INTEGRATOR_IMPLICIT))
        return true;
    return option_fail(&reader->source, option_find(raw->shape, "damping_direction"),
                       "damping_direction \"radial\" needs an explicit integrator, not \"%s\"",
                       surface->automatic ? "auto" : "implicit");
}

bool scene_read_surface(const SceneReader *reader, const BodyGroup *raw, SceneBody *body)
{
    SurfaceOptions *surface = &body->surface;
    if (!option_require(&BODY_TABLE, raw->at, "mesh", &reader->source))
        return false;
    // A body that chooses tries the explicit integrator first.
    surface->automatic = (int)surface->body.integrator == INTEGRATOR_AUTO;
    if (surface->automatic)
        surface->body.integrator = INTEGRATOR_LEAPFROG;
    surface->tick = 1.0 / reader->scene->sim.rate_hz;
    return scene_read_mesh(reader, raw->mesh, &body->mesh) && read_levels(reader, raw, surface) &&
           scene_read_material(reader, raw->material, &surface->material) &&
           check_integrator(reader, raw, surface) &&
           scene_read_shape(reader, raw->shape, &surface->shape) &&
           read_cavity(reader, raw, surface) && check_direction(reader, raw, surface);
}
