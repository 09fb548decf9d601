// Reads the keys of a body that only the surface model has.
#include "scene/scene_parts.h"

#define AT(member) offsetof(SurfaceAdapt, member)
static const Option ADAPT_OPTIONS[] = {
    {"force", OPTION_REAL, AT(force), "", 0.0, 1e9, .open = true, .preset = 0.005, .physics = true,
     .about = "Load per unit area times the edge length over `youngs_modulus_2d` beyond which a "
              "face is refined."},
    {"speed", OPTION_REAL, AT(speed), "", 0.0, 1e9, .open = true, .preset = 0.3, .physics = true,
     .about = "Speed relative to the body's rigid motion, over the wave speed in the membrane "
              "times 2^level, beyond which a face is refined."},
    {"curvature", OPTION_REAL, AT(curvature), "rad", 0.0, 1e9, .open = true, .preset = 0.4,
     .physics = true,
     .about = "Change of the angle between two faces beyond which they are refined."},
    {"check_hz", OPTION_REAL, AT(check_hz), "Hz", 0.0, 10000.0, .open = true, .preset = 100.0,
     .physics = true,
     .about =
         "How often all faces are checked; at most `rate_hz`, to which the default is lowered."},
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
    // A default rate of checks is lowered to the tick rate; one that the scene gives is refused.
    if (surface->adapt.check_hz <= reader->scene->rate_hz)
        return true;
    char rate[OPTION_NUMBER_TEXT], limit[OPTION_NUMBER_TEXT];
    if (option_given(raw->adapt, "check_hz"))
        return option_fail(source, option_find(raw->adapt, "check_hz"),
                           "check_hz %s exceeds rate_hz %s",
                           option_number_text(rate, surface->adapt.check_hz),
                           option_number_text(limit, reader->scene->rate_hz));
    surface->adapt.check_hz = reader->scene->rate_hz;
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
    surface->automatic = (int)surface->body.integrator == INTEGRATOR_AUTO;
    if (surface->automatic)
        surface->body.integrator = INTEGRATOR_LEAPFROG;
    surface->tick = 1.0 / reader->scene->rate_hz;
    return scene_read_mesh(reader, raw->mesh, &body->mesh) && read_levels(reader, raw, surface) &&
           scene_read_material(reader, raw->material, &surface->material) &&
           scene_read_shape(reader, raw->shape, &surface->shape) &&
           check_direction(reader, raw, surface);
}
