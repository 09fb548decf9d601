// SPDX-License-Identifier: MIT
#include "scene/proposal.h"

#include "body/integrator.h"
#include "scene/build_parts.h"
#include "io/mesh_import.h"
#include "geometry/mesh.h"

#include <math.h>

enum { COMPONENTS_SHOWN = 20, LABELS_SHOWN = 1000 };

static double degrees(double angle)
{
    return angle * 180.0 / 3.14159265358979323846;
}

static int name_of(const TriMesh *mesh, int node)
{
    return mesh->file_index[node];
}

static void print_source(const MeshImport *import, FILE *out)
{
    char repairs[512];
    mesh_repairs_text(&import->repairs, repairs, sizeof repairs);
    fprintf(out, "  file: %s, %d nodes, %d faces\n", import->format, import->node_count,
            import->face_count);
    fprintf(out, "  repairs: %s\n", repairs[0] != '\0' ? repairs : "none");
    if (import->remarks[0] != '\0')
        fprintf(out, "  note: %s\n", import->remarks);
}

static void print_components(const MeshQuality *quality, FILE *out)
{
    // All together first, then the largest ones one by one.
    int closed = 0;
    for (int i = 0; i < quality->component_count; i++)
        closed += quality->component[i].border_loops == 0;
    fprintf(out, "  components: %d, of them closed: %d, boundary loops: %d, boundary edges: %d\n",
            quality->component_count, closed, quality->border_loops, quality->border_edges);
    for (int i = 0; i < quality->component_count && i < COMPONENTS_SHOWN; i++) {
        const MeshComponent *component = &quality->component[i];
        fprintf(out, "    %d: nodes %d, triangles %d, ", i + 1, component->node_count,
                component->triangle_count);
        if (component->border_loops == 0)
            fprintf(out, "closed, genus %d, volume %.6g m3\n", component->genus, component->volume);
        else
            fprintf(out, "open, boundary loops %d, genus %d\n", component->border_loops,
                    component->genus);
    }
    if (quality->component_count > COMPONENTS_SHOWN)
        fprintf(out, "    and %d more\n", quality->component_count - COMPONENTS_SHOWN);
}

// Says where the surface passes through itself: as a solid that is united, as a wall it stays.
static void print_crossings(const TriMesh *mesh, FILE *out)
{
    const MeshCrossings found = mesh_find_crossings(mesh);
    if (found.pairs == 0)
        return;
    fprintf(out,
            "  crossings: %s%ld pair%s of triangles pass%s through each other, as at nodes %d "
            "and %d\n",
            found.all ? "" : "at least ", found.pairs, found.pairs == 1 ? "" : "s",
            found.pairs == 1 ? "es" : "", name_of(mesh, mesh->triangle[found.first][0]),
            name_of(mesh, mesh->triangle[found.second][0]));
}

// Prints a box behind `before`.
static void print_box(const char *before, const Box *box, FILE *out)
{
    const Vec3 low = box_low(box), high = box_high(box);
    fprintf(out, "%sbox: [%.6g, %.6g, %.6g] to [%.6g, %.6g, %.6g] m\n", before, low.x, low.y, low.z,
            high.x, high.y, high.z);
}

// Prints the box of voxels [low, high).
static void print_voxels(const LabelVolume *frame, const int low[3], const int high[3], FILE *out)
{
    Box box = box_empty();
    for (int k = 0; k < 8; k++) {
        Vec3 corner = frame->origin;
        for (int a = 0; a < 3; a++)
            corner = vec3_madd(corner, (k >> a & 1 ? high[a] : low[a]) - 0.5, frame->axis[a]);
        box_add(&box, corner);
    }
    print_box(", ", &box, out);
}

// Prints which label was taken, what was assumed, and the list from the largest to the smallest.
static void print_labels(const Proposals *all, LabelChoice choice, bool list, FILE *out)
{
    const LabelVolume *frame = &all->frame;
    const Vec3 *axis = frame->axis;
    const double voxel = fabs(vec3_dot(axis[0], vec3_cross(axis[1], axis[2])));
    const int count = all->labels.count;
    fprintf(out, "  label: %d%s of %d%s\n", all->subject.label,
            choice.label == NULL ? ", the largest" : "", count,
            count > 1 ? " (else --label NUMBER or NAME)" : "");
    if (frame->layers > 1)
        fprintf(out, "  layers: %d, the label is of layer %d\n", frame->layers, all->subject.layer);
    if (frame->notes[0] != '\0')
        fprintf(out, "  assumed: %s\n", frame->notes);
    for (int i = 0; list && i < count && i < LABELS_SHOWN; i++) {
        const VolumeLabel *label = &all->labels.label[i];
        fprintf(out, "    label %d: \"%s\", layer %d, voxels %ld, volume %.6g m3, pieces %d",
                label->label, label->name, label->layer, label->voxels,
                (double)label->voxels * voxel, label->pieces);
        if (label->colour[0] >= 0.0F)
            fprintf(out, ", colour %.3g %.3g %.3g", (double)label->colour[0],
                    (double)label->colour[1], (double)label->colour[2]);
        if (label->voxels > 0)
            print_voxels(frame, label->low, label->high, out);
        else
            fprintf(out, "\n");
    }
    if (list && count > LABELS_SHOWN)
        fprintf(out, "    and %d more\n", count - LABELS_SHOWN);
}

static void print_shape(const TriMesh *mesh, const MeshQuality *quality, FILE *out)
{
    // Its size,
    print_box("  ", &quality->box, out);
    fprintf(out, "  area: %.6g m2, enclosed volume: %.6g m3\n", quality->area, quality->volume);
    // its edges, with the nodes of the extreme ones,
    fprintf(out, "  edge lengths: min %.6g, mean %.6g, max %.6g m\n", quality->edge_min,
            quality->edge_mean, quality->edge_max);
    fprintf(out, "    shortest: nodes %d and %d; longest: nodes %d and %d\n",
            name_of(mesh, quality->shortest[0]), name_of(mesh, quality->shortest[1]),
            name_of(mesh, quality->longest[0]), name_of(mesh, quality->longest[1]));
    // and its angles.
    const int *corner = mesh->triangle[quality->sharpest];
    fprintf(out,
            "  angles: min %.4g, mean of the smallest %.4g, max %.4g degrees; "
            "triangles with one below 20 degrees: %d\n",
            degrees(quality->angle_min), degrees(quality->angle_mean), degrees(quality->angle_max),
            quality->sharp_triangles);
    fprintf(out, "    sharpest triangle: nodes %d, %d, %d\n", name_of(mesh, corner[0]),
            name_of(mesh, corner[1]), name_of(mesh, corner[2]));
}

#ifdef PLIANT_WITH_SURFACE
// Prints the time step bounds of a body of this mesh whose scene says only `shape = {}`.
static bool print_time_step(const TriMesh *mesh, FILE *out, Status *status)
{
    // A body of the default material tells what the mesh alone decides.
    SurfaceOptions options = {
        .body.name = "mesh", .body.without_contacts = true, .body.without_loads = true};
    scene_preset_surface(&options);
    Arena arena = {0};
    StateList state = {0};
    Body body = {0};
    bool ok = surface_create(&body, mesh, &options, &arena, &state, status);
    if (ok) {
        // Of the two explicit integrators.
        fprintf(out, "  stable time step (default material, shape springs, no contact):");
        const IntegratorKind kinds[] = {INTEGRATOR_RK4, INTEGRATOR_LEAPFROG};
        for (int i = 0; i < 2; i++) {
            double step = stability_time_step(kinds[i], body.lambda, body.damping);
            fprintf(out, "%s %s %.4g s (%d substeps at 1000 Hz)", i > 0 ? "," : "",
                    integrator_name(kinds[i]), step, stability_substeps(1e-3, step));
        }
        fprintf(out, "\n");
    }
    state_destroy(&state);
    arena_destroy(&arena);
    return ok;
}
#else
static bool print_time_step(const TriMesh *mesh, FILE *out, Status *status)
{
    (void)mesh;
    (void)status;
    fprintf(out, "  stable time step: not known, built without surface bodies\n");
    return true;
}
#endif

static void print_unit(const TriMesh *mesh, double scale, const Units *guess, FILE *out)
{
    if (guess == NULL)
        fprintf(out, "  scale: %g m a unit of the file, extent %.6g m\n", scale, mesh_extent(mesh));
    else
        fprintf(out, "  scale: not given, %s%s (else --units m, dm, cm, mm or um)\n",
                guess->doubt ? "in doubt " : "", guess->reason);
}

static void print_usable(const char *path, const Proposals *all, FILE *out)
{
    fprintf(out, "%s: %s\n", path, proposal_best(all, NULL) >= 0 ? "usable" : "not usable");
}

// Prints the verdict of all ways, for the report and its exit status.
static bool print_verdict(const char *path, const Proposals *proposals, FILE *out, Status *status)
{
    proposal_print(proposals, out);
    return proposal_best(proposals, NULL) >= 0 ||
           status_fail(status, STATUS_INVALID, "%s: usable neither as a wall nor as a solid%s",
                       path,
                       proposals->subject.volume
                           ? ""
                           : "; a wall needs fewer, even edges (./dev remesh), a solid a closed "
                             "surface");
}

static bool print_mesh(const char *path, double scale, LabelChoice choice, const Units *guess,
                       const MeshImport *import, const TriMesh *mesh, Proposals *found, FILE *out,
                       Status *status)
{
    MeshFault fault;
    // What cannot be simulated has no report.
    if (!body_mesh_check_extent(path, scale, mesh, status))
        return false;
    if (!mesh_check(mesh, &fault))
        return status_fail(status, STATUS_INVALID, "%s: %s", path, fault.text);
    if (!proposal_judge(path, scale, choice, found, status))
        return false;
    // What the mesh is like, then what can be made of it.
    MeshQuality quality;
    mesh_quality_measure(mesh, &quality);
    print_usable(path, found, out);
    print_source(import, out);
    print_unit(mesh, scale, guess, out);
    fprintf(out, "  nodes: %d, edges: %d, triangles: %d%s\n", mesh->node_count, quality.edge_count,
            mesh->triangle_count, mesh->uv != NULL ? ", with texture coordinates" : "");
    print_components(&quality, out);
    print_crossings(mesh, out);
    print_shape(mesh, &quality, out);
    fprintf(out, "  remeshed evenly: edges of %.3g units of the file would make %d nodes of it\n",
            found->even / scale, PROPOSAL_NODES);
    mesh_quality_destroy(&quality);
    return print_time_step(mesh, out, status) && print_verdict(path, found, out, status);
}

static bool print_volume(const char *path, double scale, LabelChoice choice, bool list,
                         Proposals *found, FILE *out, Status *status)
{
    // A volume is judged like a mesh; of its shape its labels say something.
    if (!proposal_judge(path, scale > 0.0 ? scale : 1.0, choice, found, status))
        return false;
    const Proposal *of = &found->subject;
    print_usable(path, found, out);
    fprintf(out,
            "  file: label volume, label %d, in the units that it states (mm, where it states "
            "none)\n",
            of->label);
    print_box("  ", &of->box, out);
    print_labels(found, choice, list, out);
    return print_verdict(path, found, out, status);
}

bool mesh_report_print(const char *path, double scale, LabelChoice choice, bool list,
                       Proposals *found, FILE *out, Status *status)
{
    *found = (Proposals){0};
    TriMesh mesh;
    MeshImport import;
    Units guess;
    // A label volume says its own unit.
    if (proposal_is_volume(path))
        return print_volume(path, scale, choice, list, found, out, status);
    if (!mesh_import(path, &mesh, &import, status))
        return false;
    // The unit that was given, or the likeliest.
    const bool given = scale > 0.0;
    if (!given) {
        guess = units_guess(path, mesh_extent(&mesh));
        scale = guess.scale;
    }
    mesh_place(&mesh, scale, vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0));
    bool ok =
        print_mesh(path, scale, choice, given ? NULL : &guess, &import, &mesh, found, out, status);
    mesh_destroy(&mesh);
    return ok;
}
