// SPDX-License-Identifier: MIT
#include "run/modes.h"

#include "base/check.h"
#include "body/body.h"
#include "sim/touch/touch.h"
#include "voxel/thickness.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double THIN_SHARE = 0.01; // of the cells, from which on it is said

// Returns the number of nodes of a body.
static int node_count(const Body *body)
{
    return body_changes(body) ? body->mesh.node_count : body->state_capacity;
}

static void print_nodes(const Body *body, const BodyOutline *outside, FILE *out)
{
    if (body->spring_count > 0) {
        fprintf(out, "  nodes %d (%d fixed), springs %d, faces %d, pieces %d, mass %.6g kg\n",
                node_count(body), outside->fixed, body->spring_count, body->mesh.triangle_count,
                body_count_pieces(&body->mesh), body->mass);
        return;
    }
    fprintf(out, "  nodes %d, elements %d, pieces %d, mass %.6g kg\n", node_count(body),
            body->element_count, body_count_pieces(&body->mesh), body->mass);
    fprintf(out, "  outside: nodes %d (%d fixed), faces %d; published: nodes %d, faces %d\n",
            outside->nodes, outside->fixed, body->surface.face_used, body->mesh.node_count,
            body->mesh.triangle_count);
}

static void print_cells(const WorldCells *cells, FILE *out)
{
    fprintf(out, "  cells %d x %d x %d of %.6g m, %ld solid\n", cells->count[0], cells->count[1],
            cells->count[2], cells->size, cells->solid);
}

// Prints the levels of a surface body.
static void print_levels(const Body *body, const SceneBody *described, FILE *out)
{
    const SurfaceOptions *surface = &described->surface;
    char adjust[SCENE_VALUE_TEXT];
    // Levels, and what may change them.
    scene_key_text(described, "adjust", adjust);
    if (surface->body.levels > 0)
        fprintf(out, "  level %d of %d, %s, adjust %s\n", body->finest_level, surface->body.levels,
                surface->adaptive        ? "adaptive"
                : surface->body.cuttable ? "refined by cuts alone"
                                         : "constant",
                adjust);
    // Memory bounds what a body can grow to.
    if (surface->adaptive || surface->body.cuttable)
        fprintf(out, "  memory for %d nodes, %d faces\n", body->mesh.node_capacity,
                body->mesh.triangle_capacity);
}

static void print_colours(const LookColours *colours, FILE *out)
{
    const unsigned char *o = colours->outside, *i = colours->inside;
    fprintf(out, "#%02x%02x%02x, inside #%02x%02x%02x\n", o[0], o[1], o[2], i[0], i[1], i[2]);
}

// Prints the colours that viewers are told.
static void print_look(const SceneBody *described, FILE *out)
{
    const SceneLook *look = &described->look;
    if (!look->given)
        return;
    fputs("  colour ", out);
    print_colours(&look->usual, out);
    for (int i = 0; look->label != NULL && i < described->voxels.label_count; i++) {
        fprintf(out, "  label %d: colour ", described->voxels.label[i]);
        print_colours(&look->label[i], out);
    }
    if (look->image != NULL && look->black == look->white)
        fprintf(out, "  image of the inside %s\n", look->image);
    else if (look->image != NULL)
        fprintf(out, "  image of the inside %s, from %g to %g\n", look->image, look->black,
                look->white);
    if (look->texture != NULL)
        fprintf(out, "  texture %s\n", look->texture);
}

static void print_stiffening(const Stiffening *stiffening, FILE *out)
{
    const double knee = stiffening->strain * sqrt(stiffening_curve(stiffening->cap).knee);
    fprintf(
        out,
        "  stiffens as exp((strain/%.4g)^2) up to a strain of %.3g, from there on %.4g times as "
        "stiff as at rest, which bounds the step\n",
        stiffening->strain, knee, stiffening->cap);
}

static void print_branches(int count, const MaxwellBranch *branch, FILE *out)
{
    for (int i = 0; i < count; i++)
        fprintf(out, "  relaxes by %.4g of its fast stiffness in %.4g s%s\n", branch[i].share,
                branch[i].time, branch[i].volumetric ? ", volume as well" : "");
}

static const double LOSS_HZ[] = {2.0, 10.0, 50.0};

// Prints what springs lose as they relax, and what that costs.
static void print_springs(const Body *body, const SurfaceMaterial *material, FILE *out)
{
    const int count = material->branch_count;
    const MaxwellBranch *branch = material->branch;
    const double damping = material->uniform ? 0.0 : material->damping_time;
    if (stiffening_is_on(&material->stiffening))
        print_stiffening(&material->stiffening, out);
    if (count == 0)
        return;
    print_branches(count, branch, out);
    fprintf(out, "  loss of springs");
    for (int i = 0; i < 3; i++)
        fprintf(out, "%s %.3g at %g Hz", i > 0 ? "," : "",
                maxwell_loss(count, branch, damping, LOSS_HZ[i]), LOSS_HZ[i]);
    fprintf(out, "; fast strains meet %.4g times the stiffness, with %d substeps a tick\n",
            maxwell_rigidity(count, branch), body->substeps);
}

// Prints how a solid is damped: its loss factor at some frequencies, and what that costs. Damping
// in critical steps takes a little more from bending and less from compression.
static void print_loss(World *world, const Body *body, const VoxelOptions *voxel, FILE *out)
{
    const double pi = 3.14159265358979323846;
    const bool rough = voxel->damping > 0.0;
    print_branches(voxel->branch_count, voxel->branch, out);
    fprintf(out, "  damping_time %.4g s, drag %.4g 1/s: %sloss", body->damping_time, body->drag,
            rough ? "about " : "");
    for (int i = 0; i < 3; i++)
        fprintf(out, "%s %.3g at %g Hz", i > 0 ? "," : "",
                maxwell_loss(voxel->branch_count, voxel->branch, body->damping_time, LOSS_HZ[i]) +
                    body->drag / (2.0 * pi * LOSS_HZ[i]),
                LOSS_HZ[i]);
    fprintf(out, "; %d substeps a tick, %d without\n", body->substeps,
            sim_undamped_substeps(world->sim, (int)(body - sim_body(world->sim, 0))));
}

// Prints law and materials of a voxel body.
static void print_elements(World *world, const SceneBody *described, const Body *body, FILE *out)
{
    const VoxelOptions *voxel = &described->voxel;
    char law[SCENE_VALUE_TEXT];
    // The law, and how fine elements are put together.
    scene_key_text(described, "law", law);
    fprintf(out, "  law %s, %d dimensions, levels 0 to %d\n", law, described->dimensions,
            voxel->body.levels);
    // An undamped oscillation of angular frequency w is stable for steps up to 2 / w.
    fprintf(out, "  critical step %.6g s, damping %.6g of it\n", 2.0 / sqrt(body->lambda),
            voxel->damping);
    if (stiffening_is_on(&voxel->stiffening))
        print_stiffening(&voxel->stiffening, out);
    print_loss(world, body, voxel, out);
    // What the cells are made of.
    for (int i = 0; i < voxel->material_count; i++) {
        const SolidMaterial *material = &voxel->material[i];
        fprintf(out, "  label %d: E %.6g Pa, nu %.6g, density %.6g kg/m3\n",
                described->voxels.label[i], material->youngs_modulus, material->poisson_ratio,
                material->density);
    }
    if (described->skin.file != NULL)
        fprintf(out, "  skin %s\n", described->skin.file);
}

// Prints how many elements a body that adapts has, untouched and at most, with what a tick of
// either takes by estimate, and where it is too thin for the coarsest.
static void print_adapting(const Body *body, const VoxelOptions *voxel, const WorldCells *cells,
                           FILE *out)
{
    Body fine = *body;
    fine.element_count = body->fine_elements;
    fprintf(
        out,
        "  adapts: surface up to level %d, elements %d untouched (about %.2g ms a tick), %d with "
        "all of it fine (%.2g ms)\n",
        voxel->surface_level, body->element_count, 1e3 * cost_tick(body, body->substeps),
        fine.element_count, 1e3 * cost_tick(&fine, body->substeps));
    fprintf(out,
            "  adapts: memory for %d vertices, inside too, of which tools and cuts may use %d "
            "(capacity.nodes)\n",
            body->state_capacity, body->spare_nodes);
    // A few cells at an edge are not worth a line.
    for (int level = 0; level < voxel->surface_level; level++)
        if (cells->coarsest[level] >= THIN_SHARE * (double)cells->solid)
            fprintf(out,
                    "  thin: %.3g %% of the cells are in elements of level %d at most, since %d "
                    "larger ones do not fit across the solid there\n",
                    100.0 * (double)cells->coarsest[level] / (double)cells->solid, level,
                    THICKNESS_ELEMENTS);
}

// Prints what cuts may make of a wall, by estimate: faces of the finest level along them, in the
// end as many as there is room for. Half the edge is half the step; a node has three springs.
static void print_finest(const Body *body, int levels, FILE *out)
{
    const int finer = body->integrator == INTEGRATOR_IMPLICIT ? 0 : levels - body->finest_level;
    Body whole = *body;
    whole.spring_count = 3 * body->mesh.node_capacity;
    fprintf(out, ", at level %d: about %d substeps a tick, at most %.2g ms", levels,
            body->substeps << finer, 1e3 * cost_tick(&whole, body->substeps << finer));
}

// Prints what may happen to it at run time: cuts, tears and so on.
static void print_cutting(const Body *body, const SceneBody *described, FILE *out)
{
    const VoxelOptions *voxel = scene_has_cells(described) ? &described->voxel : NULL;
    if (!described->options.cuttable)
        return;
    fprintf(out, "  cuttable");
    // Only what is set.
    if (voxel != NULL)
        fprintf(out, ", split_budget %d", voxel->split_budget);
    if (voxel != NULL && voxel->tear_stress > 0.0)
        fprintf(out, ", tears at %.6g Pa", voxel->tear_stress);
    if (voxel != NULL && voxel->tear_force > 0.0)
        fprintf(out, ", tears at %.6g N", voxel->tear_force);
    if (voxel == NULL && described->surface.tear_stretch > 0.0)
        fprintf(out, ", tears at a stretch of %.6g", described->surface.tear_stretch);
    if (voxel == NULL && body->finest_level < described->options.levels)
        print_finest(body, described->options.levels, out);
    if (body->ops->conduct != NULL)
        fprintf(out, ", diathermy coagulates it: from then on %d substeps a tick",
                body->finest_substeps);
    fprintf(out, "\n");
}

// Prints the contact stiffness of an implicit body: its step limits it (time_step.c) whatever
// contact.stiffness is. The line says how much more a fifth of the step allows.
static void print_contact_share(const Body *body, FILE *out)
{
    const double h = body->h, shorter = 0.2 * h, more = 4.0 * body->theta - 1.0,
                 damping = 2.0 * body->contact_damping;
    if (!(body->contact_share < 1.0))
        return;
    fprintf(out,
            "  contacts and attachments: %.3g of their stiffness, which this time step allows; "
            "contact.stiffness changes nothing, time_step = %.3g allows %.3g times as much\n",
            body->contact_share, shorter,
            fmin(1.0 / body->contact_share,
                 h * (more * h + damping) / (shorter * (more * shorter + damping))));
}

static void print_time_step(const World *world, const Body *body, const SceneBody *described,
                            FILE *out)
{
    const bool implicit = body->integrator == INTEGRATOR_IMPLICIT;
    // The step and its bound.
    fprintf(out, "  time step %.6g s, %d substeps a tick, ", body->h, body->substeps);
    if (isinf(body->time_step_limit))
        fprintf(out, "no stability limit");
    else
        fprintf(out, "stability limit %.6g s%s", body->time_step_limit,
                implicit ? ", of what acts from outside" : "");
    fprintf(out, "%s\n", body->unsafe_time_step ? " (unsafe_time_step)" : "");
    // What contacts do to the step.
    print_contact_share(body, out);
    double bounce = 1.0;
    for (int t = 0; t < sim_tool_count(world->sim); t++)
        bounce = fmax(bounce, contact_bounce_share(body, sim_tool(world->sim, t)));
    if (bounce > 1.0)
        fprintf(out,
                "  contacts with %s damping (contact.damping_time = %g): shorter steps, so that "
                "bounces gain no energy\n",
                body->contact_damping > 0.0 ? "little" : "no", body->contact_damping);
    // Why "auto" chose this integrator.
    if (described->model == MODEL_SURFACE && described->surface.automatic)
        fprintf(out,
                "  integrator = \"auto\": leapfrog would take %s%d substeps for its springs, whose "
                "time is that "
                "of an implicit tick\n",
                implicit ? "more than " : "at most ", body->auto_substeps);
}

static void print_body(World *world, const Scene *scene, int index, FILE *out)
{
    const SceneBody *described = &scene->body[index];
    const Body *body = sim_body(world->sim, index);
    const BodyOutline outside = body_outline(body);
    const Vec3 low = box_low(&outside.box), high = box_high(&outside.box);
    bool voxel = scene_has_cells(described);
    // Model, size and place.
    fprintf(out, "body %s: model %s, %s\n", body->name, body->ops->model,
            integrator_name(body->integrator));
    if (voxel)
        print_cells(&world->cells[index], out);
    print_nodes(body, &outside, out);
    fprintf(out, "  box [%.6g, %.6g, %.6g] to [%.6g, %.6g, %.6g] m\n", low.x, low.y, low.z, high.x,
            high.y, high.z);
    // Its cost, then what only one model has.
    print_time_step(world, body, described, out);
    if (voxel) {
        print_elements(world, described, body, out);
        if (body->fine_elements > 0)
            print_adapting(body, &described->voxel, &world->cells[index], out);
    } else {
        print_levels(body, described, out);
        print_springs(body, &described->surface.material, out);
    }
    print_cutting(body, described, out);
    print_look(described, out);
}

// Prints the parts of a tool in its own frame (static tools: in the world); viewers parse these
// lines.
static void print_tool_parts(const ToolOptions *tool, FILE *out)
{
    // Shapes in the order in which clients draw them.
    for (int i = 0; i < tool->capsule_count; i++) {
        const Capsule *c = &tool->capsule[i];
        fprintf(out, "  capsule [%.9g, %.9g, %.9g] to [%.9g, %.9g, %.9g], radius %.9g m\n",
                c->from.x, c->from.y, c->from.z, c->to.x, c->to.y, c->to.z, c->radius);
    }
    const Vec3 *edge = tool->edge, *point = &tool->plane.point, *normal = &tool->plane.normal;
    if (tool->kind == TOOL_BLADE)
        fprintf(out, "  edge [%.9g, %.9g, %.9g] to [%.9g, %.9g, %.9g] m\n", edge[0].x, edge[0].y,
                edge[0].z, edge[1].x, edge[1].y, edge[1].z);
    const Capsule *mouth = &tool->mouth;
    if (tool->kind == TOOL_REMOVER)
        fprintf(out, "  mouth [%.9g, %.9g, %.9g] to [%.9g, %.9g, %.9g], radius %.9g m\n",
                mouth->from.x, mouth->from.y, mouth->from.z, mouth->to.x, mouth->to.y, mouth->to.z,
                mouth->radius);
    if (tool->has_plane)
        fprintf(out, "  plane [%.9g, %.9g, %.9g] m, normal [%.9g, %.9g, %.9g]\n", point->x,
                point->y, point->z, normal->x, normal->y, normal->z);
}

static void print_tool(const ToolOptions *tool, FILE *out)
{
    // What it is, with the figures that matter for its kind.
    if (tool->kind == TOOL_STATIC)
        fprintf(out, "tool %d: static, %d capsules%s\n", tool->id, tool->capsule_count,
                tool->has_plane ? ", a plane" : "");
    else if (tool->kind == TOOL_BLADE)
        fprintf(out, "tool %d: blade, edge %.6g m, %d capsules, max_force %.6g N\n", tool->id,
                vec3_length(vec3_sub(tool->edge[1], tool->edge[0])), tool->capsule_count,
                tool->max_force);
    else if (tool->kind == TOOL_REMOVER)
        fprintf(out, "tool %d: remover, by %s, %d capsules, max_force %.6g N\n", tool->id,
                scene_remover_name(tool->removes), tool->capsule_count, tool->max_force);
    else
        fprintf(out, "tool %d: %s, %d capsules, max_force %.6g N\n", tool->id,
                tool->kind == TOOL_GRASPER ? "grasper" : "probe", tool->capsule_count,
                tool->max_force);
    if (tool->kind == TOOL_GRASPER)
        fprintf(out,
                "  grip stiffness %.6g of 100 times the body's (of the body's with rk4 and "
                "implicit), damping ratio %.6g\n",
                tool->grip_stiffness, tool->grip_damping);
    if (tool->removes != REMOVER_NONE && tool->rate_mm3_s > 0.0)
        fprintf(out, "  takes %.6g mm3/s\n", tool->rate_mm3_s);
    if (tool->removes == REMOVER_DIATHERMY)
        fprintf(out, "  heats with %.6g W\n", tool->power);
    print_tool_parts(tool, out);
}

static void print_attachment(World *world, const Scene *scene, int index, FILE *out)
{
    const AttachmentOptions *options = &scene->attachment[index].options;
    fprintf(out, "attachment %d: %d nodes of body %s to ", index,
            sim_attachment_nodes(world->sim, index), scene->body[options->body].name);
    if (options->to == ATTACH_BODY)
        fprintf(out, "body %s", scene->body[options->to_body].name);
    else if (options->to == ATTACH_TOOL)
        fprintf(out, "tool %d", sim_tool(world->sim, options->tool)->id);
    else
        fprintf(out, "the world");
    fprintf(out, ", stiffness %.6g of the body's, damping ratio %.6g\n", options->stiffness,
            options->damping_ratio);
}

static void print_touch(const World *world, const Scene *scene, int index, FILE *out)
{
    const TouchOptions *options = &scene->touch[index].options;
    fprintf(out,
            "touch %d: body %s with %s, stiffness %.6g of the softer body's, friction %.6g, "
            "thickness %.6g m\n",
            index, scene->body[options->body[0]].name,
            touch_bodies(options) == 1 ? "itself" : scene->body[options->body[1]].name,
            options->stiffness, options->friction,
            touch_thickness(options, sim_body(world->sim, options->body[0])));
}

void explain_summary(World *world, const Scene *scene, FILE *out)
{
    Sim *sim = world->sim;
    // The scene itself, then each part of it.
    fprintf(out, "scene %s: %.10g Hz, gravity [%g, %g, %g] m/s2, %d bodies, %d tools, %d loads\n",
            scene->name, scene->sim.rate_hz, scene->sim.gravity.x, scene->sim.gravity.y,
            scene->sim.gravity.z, sim_body_count(sim), sim_tool_count(sim), scene->load_count);
    if (world->team != NULL)
        fprintf(out, "threads: %d\n", team_threads(world->team));
    for (int i = 0; i < sim_body_count(sim); i++)
        print_body(world, scene, i, out);
    for (int i = 0; i < sim_tool_count(sim); i++)
        print_tool(sim_tool(sim, i), out);
    for (int i = 0; i < scene->attachment_count; i++)
        print_attachment(world, scene, i, out);
    if (sim_tie_capacity(sim) > 0)
        fprintf(out, "ties by message: at most %d at a time, of up to %d nodes\n",
                sim_tie_capacity(sim), TIE_NODES);
    for (int i = 0; i < scene->touch_count; i++)
        print_touch(world, scene, i, out);
    // What is sent, and to whom it listens.
    const ScenePublish *publish = &scene->publish;
    fprintf(out, "publish on %s_...: nodes %g Hz, mesh %g Hz, contact %g Hz, status %g Hz",
            scene->prefix, publish->nodes_hz, publish->mesh_hz, publish->contact_hz,
            publish->status_hz);
    if (publish->error_hz > 0.0)
        fprintf(out, ", error%s %g Hz", publish->error_map ? " with maps" : "", publish->error_hz);
    if (publish->elements_hz > 0.0)
        fprintf(out, ", elements %g Hz", publish->elements_hz);
    fprintf(out, "%s%s\n", publish->velocity ? ", velocities" : "",
            publish->rest ? ", rest positions" : "");
    fprintf(out, "listen on %s_...: %s, tool timeout %g s%s\n", scene->input_prefix,
            scene->remote ? "all hosts" : "this host only", scene->sim.tool_timeout_s,
            scene->stop_command ? "" : ", STOP is refused");
    scene_print_score(&scene->score, out);
}

int explain_nodes(World *world)
{
    int nodes = 0;
    for (int i = 0; i < sim_body_count(world->sim); i++)
        nodes += node_count(sim_body(world->sim, i));
    return nodes;
}

// A description must fit one message of one packet. Removes lines from the middle, where bodies and
// tools are listed, until it fits.
static void shorten(char *text)
{
    enum { MOST = 50000, HALF = MOST / 2 - 100 };
    size_t size = strlen(text);
    if (size <= MOST)
        return;
    // Cut whole lines from the middle, and say how many.
    char *from = text + HALF, *to = strchr(text + size - HALF, '\n') + 1;
    while (from[-1] != '\n')
        from--;
    int lines = 0;
    for (const char *c = from; c < to; c++)
        lines += *c == '\n';
    from += sprintf(from, "... %d lines more than one message holds ...\n", lines);
    memmove(from, to, strlen(to) + 1);
}

char *explain_describe(World *world, const Scene *scene)
{
    enum { SETTINGS = 256 };
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    ASSERT(out != NULL);
    // The summary as people see it, with what programs need besides.
    explain_summary(world, scene, out);
    for (int i = 0; i < sim_body_count(world->sim); i++) {
        char keys[SETTINGS];
        sim_list_settings(world->sim, i, keys, sizeof keys);
        fprintf(out, "settings of %s: %s\n", sim_body(world->sim, i)->name, keys);
    }
    fprintf(out, "capacity: %d nodes, %d loads at a time, %d requests waiting\n",
            explain_nodes(world), SIM_LOADS, EXCHANGE_REQUESTS);
    fprintf(out, "units: m, kg, s, N, rad; world frame of the scene\n");
    fclose(out);
    ASSERT(text != NULL);
    shorten(text);
    return text;
}
