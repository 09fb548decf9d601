// SPDX-License-Identifier: MIT
#include "geometry/repair.h"

#include "base/check.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// --- draft ---

// Grows the capacity for one more element if necessary; false when the limit is reached.
static bool has_room(MeshDraft *draft, int count, int *capacity)
{
    if (count == MESH_COUNT_MAX)
        draft->full = true;
    if (draft->full)
        return false;
    if (count == *capacity)
        *capacity = *capacity == 0 ? 1024 : 2 * *capacity;
    return true;
}

static void *grown(void *array, int capacity, size_t size)
{
    array = realloc(array, (size_t)capacity * size);
    ASSERT(array != NULL);
    return array;
}

void mesh_draft_add_node(MeshDraft *draft, Vec3 position)
{
    int before = draft->node_capacity;
    if (!has_room(draft, draft->node_count, &draft->node_capacity))
        return;
    if (draft->node_capacity != before)
        draft->position = grown(draft->position, draft->node_capacity, sizeof *draft->position);
    draft->position[draft->node_count++] = position;
}

void mesh_draft_add_uv(MeshDraft *draft, double u, double v)
{
    int before = draft->uv_capacity;
    if (!has_room(draft, draft->uv_count, &draft->uv_capacity))
        return;
    if (draft->uv_capacity != before)
        draft->uv = grown(draft->uv, draft->uv_capacity, sizeof *draft->uv);
    draft->uv[draft->uv_count][0] = u;
    draft->uv[draft->uv_count++][1] = v;
}

void mesh_draft_add_corner(MeshDraft *draft, int node, int uv)
{
    int before = draft->corner_capacity;
    if (!has_room(draft, draft->corner_count, &draft->corner_capacity))
        return;
    // Corners and their texture coordinates grow together.
    if (draft->corner_capacity != before) {
        draft->corner = grown(draft->corner, draft->corner_capacity, sizeof *draft->corner);
        if (draft->keeps_uv)
            draft->corner_uv =
                grown(draft->corner_uv, draft->corner_capacity, sizeof *draft->corner_uv);
    }
    if (draft->keeps_uv)
        draft->corner_uv[draft->corner_count] = uv;
    draft->corner[draft->corner_count++] = node;
}

void mesh_draft_end_polygon(MeshDraft *draft, int line)
{
    int before = draft->polygon_capacity;
    if (!has_room(draft, draft->polygon_count, &draft->polygon_capacity))
        return;
    // Ends and lines grow together.
    if (draft->polygon_capacity != before) {
        draft->end = grown(draft->end, draft->polygon_capacity, sizeof *draft->end);
        draft->line = grown(draft->line, draft->polygon_capacity, sizeof *draft->line);
    }
    draft->end[draft->polygon_count] = draft->corner_count;
    draft->line[draft->polygon_count++] = line;
}

void mesh_draft_destroy(MeshDraft *draft)
{
    free(draft->position);
    free(draft->corner);
    free(draft->corner_uv);
    free(draft->end);
    free(draft->line);
    free(draft->uv);
    *draft = (MeshDraft){0};
}

// --- repair ---

// Beyond these limits squares and cubes of lengths would over- or underflow.
static const double SMALLEST_EXTENT = 1e-90, LARGEST_EXTENT = 1e90;

static bool set_fault(MeshFault *fault, int node, int polygon, const char *format,
                      va_list arguments) __attribute__((format(printf, 4, 0)));

static bool set_fault(MeshFault *fault, int node, int polygon, const char *format,
                      va_list arguments)
{
    fault->node = node;
    fault->triangle = polygon;
    vsnprintf(fault->text, sizeof fault->text, format, arguments);
    return false;
}

bool repair_fail(const Repair *repair, int node, int triangle, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    set_fault(repair->fault, node, triangle < 0 ? -1 : repair->polygon[triangle], format,
              arguments);
    va_end(arguments);
    return false;
}

void repair_compact(Repair *repair)
{
    TriMesh *mesh = &repair->mesh;
    int kept = 0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        if (repair->polygon[t] < 0) // to be dropped
            continue;
        memmove(mesh->triangle[kept], mesh->triangle[t], sizeof *mesh->triangle);
        memmove(repair->corner[kept], repair->corner[t], sizeof *repair->corner);
        repair->polygon[kept++] = repair->polygon[t];
    }
    mesh->triangle_count = kept;
}

// --- faults that cannot be repaired ---

static bool draft_fail(MeshFault *fault, int node, int polygon, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

static bool draft_fail(MeshFault *fault, int node, int polygon, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    set_fault(fault, node, polygon, format, arguments);
    va_end(arguments);
    return false;
}

static bool check_corner(const MeshDraft *draft, int polygon, int node, MeshFault *fault)
{
    if (node < 0 || node >= draft->node_count)
        return draft_fail(fault, -1, polygon, "face %d names node %d, but there are %d nodes",
                          polygon, node, draft->node_count);
    Vec3 x = draft->position[node];
    return vec3_finite(x) || draft_fail(fault, node, polygon,
                                        "face %d uses node %d, whose position (%g, %g, %g) is not "
                                        "finite",
                                        polygon, node, x.x, x.y, x.z);
}

static bool check_extent(const MeshDraft *draft, MeshFault *fault)
{
    // The extent in each axis of the nodes that are used.
    double low = (double)INFINITY, high = -low, extent = 0.0;
    for (int axis = 0; axis < 3; axis++, extent = fmax(extent, high - low)) {
        low = (double)INFINITY;
        high = -low;
        for (int c = 0; c < draft->corner_count; c++) {
            Vec3 x = draft->position[draft->corner[c]];
            double value = axis == 0 ? x.x : axis == 1 ? x.y : x.z;
            low = fmin(low, value);
            high = fmax(high, value);
        }
    }
    return extent == 0.0 || (extent >= SMALLEST_EXTENT && extent <= LARGEST_EXTENT) ||
           draft_fail(fault, -1, -1, "the mesh measures %g, outside [%g, %g]", extent,
                      SMALLEST_EXTENT, LARGEST_EXTENT);
}

static bool check_draft(const MeshDraft *draft, MeshFault *fault)
{
    // Every corner names a node with a place, and some face has an area.
    long triangles = 0;
    for (int p = 0; p < draft->polygon_count; p++) {
        int start = mesh_draft_start(draft, p);
        for (int c = start; c < draft->end[p]; c++)
            if (!check_corner(draft, p, draft->corner[c], fault))
                return false;
        triangles += draft->end[p] - start > 2 ? draft->end[p] - start - 2 : 0;
    }
    if (triangles == 0)
        return draft_fail(fault, -1, -1, "the mesh has no faces");
    return check_extent(draft, fault);
}

// --- the result ---

static void take_texture(const Repair *repair, const int *number, TriMesh *mesh)
{
    const MeshDraft *draft = repair->draft;
    size_t nodes = (size_t)mesh->node_count;
    // Nothing is known of any node yet.
    mesh->uv = calloc(nodes + 1, sizeof *mesh->uv);
    int *from = malloc((nodes + 1) * sizeof *from); // index in the draft's uv
    bool *seam = calloc(nodes + 1, sizeof *seam);
    ASSERT(mesh->uv != NULL && from != NULL && seam != NULL);
    memset(from, 0xff, (nodes + 1) * sizeof *from);
    // The first corner decides; a different value at another corner is a seam.
    for (int h = 0; h < 3 * repair->mesh.triangle_count; h++) {
        int node = number[half_edge_from(&repair->mesh, h)];
        int uv = draft->corner_uv[repair->corner[h / 3][h % 3]];
        if (uv < 0 || uv >= draft->uv_count)
            continue;
        if (from[node] < 0)
            from[node] = uv;
        seam[node] = seam[node] || memcmp(draft->uv[uv], draft->uv[from[node]], sizeof *draft->uv);
    }
    // Copy what was found, and count seams and gaps.
    for (int i = 0; i < mesh->node_count; i++) {
        repair->repairs->seam_nodes += seam[i];
        repair->repairs->nodes_without_uv += from[i] < 0;
        if (from[i] >= 0)
            memcpy(mesh->uv[i], draft->uv[from[i]], sizeof *mesh->uv);
    }
    // An incomplete texture is none.
    if (repair->repairs->nodes_without_uv > 0) {
        free(mesh->uv);
        mesh->uv = NULL;
    }
    free(from);
    free(seam);
}

// Maps each node of the source to the node that replaces it, and counts the repairs of nodes.
static void take_file_nodes(const Repair *repair, const int *number, TriMesh *mesh)
{
    const MeshDraft *draft = repair->draft;
    mesh->file_node_count = draft->node_count;
    mesh->file_node = malloc(((size_t)draft->node_count + 1) * sizeof *mesh->file_node);
    ASSERT(mesh->file_node != NULL);
    // Nodes were welded: each maps to the one that replaces it.
    for (int i = 0; i < draft->node_count; i++)
        mesh->file_node[i] = number[repair_node(repair, i)];
    // A split node of the source maps to the fan that was drawn with it.
    for (int h = 0; repair->repairs->split_nodes > 0 && h < 3 * repair->mesh.triangle_count; h++) {
        int node = number[half_edge_from(&repair->mesh, h)];
        if (mesh->file_index[node] < draft->node_count)
            mesh->file_node[draft->corner[repair->corner[h / 3][h % 3]]] = node;
    }
    // Count what happened to the nodes of the source.
    MeshRepairs *repairs = repair->repairs;
    for (int i = 0; i < draft->node_count; i++) {
        if (mesh->file_node[i] < 0)
            repairs->unused_nodes++;
        else
            repairs->welded_nodes += mesh->file_index[mesh->file_node[i]] != i;
    }
    repairs->welded_nodes -= repairs->merged_nodes; // counted on their own
}

// Creates the result: numbers the nodes in use in the order of the source, copies last.
static void take_mesh(Repair *repair, TriMesh *mesh)
{
    const TriMesh *from = &repair->mesh;
    int *number = malloc(((size_t)from->node_count + 1) * sizeof *number), count = 0;
    ASSERT(number != NULL);
    memset(number, 0xff, ((size_t)from->node_count + 1) * sizeof *number);
    // Number the nodes in use, in the order of the source.
    for (int h = 0; h < 3 * from->triangle_count; h++)
        number[half_edge_from(from, h)] = 0;
    for (int i = 0; i < from->node_count; i++)
        if (number[i] == 0)
            number[i] = count++;
    // Copy positions and triangles under the new numbers.
    mesh_create(mesh, count, from->triangle_count);
    for (int i = 0; i < from->node_count; i++)
        if (number[i] >= 0) {
            mesh->position[number[i]] = from->position[i];
            mesh->file_index[number[i]] = i;
        }
    for (int h = 0; h < 3 * from->triangle_count; h++)
        mesh->triangle[h / 3][h % 3] = number[half_edge_from(from, h)];
    // The list of copies moves to the result.
    mesh->copy_count = from->copy_count;
    mesh->copy_of = repair->mesh.copy_of;
    repair->mesh.copy_of = NULL;
    take_file_nodes(repair, number, mesh);
    if (repair->draft->uv_count > 0 && repair->draft->corner_uv != NULL)
        take_texture(repair, number, mesh);
    free(number);
}

// --- all steps ---

static void repair_create(Repair *repair, const MeshDraft *draft)
{
    long triangles = 0;
    for (int p = 0; p < draft->polygon_count; p++) {
        int size = draft->end[p] - mesh_draft_start(draft, p);
        triangles += size > 2 ? size - 2 : 0;
    }
    // At most as many as corners, which a draft counts up to MESH_COUNT_MAX.
    mesh_create(&repair->mesh, draft->node_count, (int)triangles);
    repair->mesh.triangle_count = 0;
    memcpy(repair->mesh.position, draft->position,
           (size_t)draft->node_count * sizeof *draft->position);
    repair->corner = malloc(((size_t)triangles + 1) * sizeof *repair->corner);
    repair->polygon = malloc(((size_t)triangles + 1) * sizeof *repair->polygon);
    repair->kept = malloc(((size_t)draft->node_count + 1) * sizeof *repair->kept);
    ASSERT(repair->corner != NULL && repair->polygon != NULL && repair->kept != NULL);
}

static void repair_destroy(Repair *repair)
{
    mesh_destroy(&repair->mesh);
    free(repair->corner);
    free(repair->polygon);
    free(repair->kept);
}

// How a run welds: all equal nodes, or only where that closes a gap; and whether it joins borders
// that are one but for rounding.
typedef struct Welding {
    bool ties_borders, joins_seams;
} Welding;

// Runs all steps. `overfull`: the failure was an edge of more than two faces.
static bool run(const MeshDraft *draft, Welding how, TriMesh *mesh, MeshRepairs *repairs,
                MeshFault *fault, bool *overfull)
{
    // Each run counts anew.
    *repairs = (MeshRepairs){0};
    *fault = (MeshFault){.node = -1, .triangle = -1};
    Repair repair = {
        .draft = draft, .repairs = repairs, .fault = fault, .ties_borders = how.ties_borders};
    repair_create(&repair, draft);
    // Polygons and edges before orientation, which walks across edges.
    bool ok = repair_faces(&repair);
    if (ok && how.joins_seams)
        repair_seams(&repair);
    ok = ok && repair_edges(&repair) && repair_orientation(&repair);
    if (ok) {
        repair_fans(&repair);
        ok = repair_flat_faces(&repair);
    }
    if (ok) {
        // A removed border face may have been the only connection between two fans.
        if (repairs->flat_faces > 0)
            repair_fans(&repair);
        take_mesh(&repair, mesh);
        // Prove that the repairs left no fault.
        ok = mesh_check(mesh, fault);
        if (!ok) {
            fault->triangle = -1;
            mesh_destroy(mesh);
        }
    }
    *overfull = repair.edges_overfull;
    repair_destroy(&repair);
    return ok;
}

bool mesh_repair(const MeshDraft *draft, TriMesh *mesh, MeshRepairs *repairs, MeshFault *fault)
{
    *repairs = (MeshRepairs){0};
    *fault = (MeshFault){.node = -1, .triangle = -1};
    if (!check_draft(draft, fault))
        return false;
    bool overfull, again;
    if (run(draft, (Welding){false, true}, mesh, repairs, fault, &overfull))
        return true;
    // A seam may make a surface one-sided that is sound without. And closed surfaces that touch
    // along an edge were joined by welding.
    MeshFault second;
    const bool joined = repairs->joined_edges > 0;
    return (joined && run(draft, (Welding){false, false}, mesh, repairs, &second, &again)) ||
           (overfull && run(draft, (Welding){true, true}, mesh, repairs, &second, &again));
}

// --- summary ---

void mesh_repairs_text(const MeshRepairs *repairs, char *text, size_t size)
{
    char edges[80];
    snprintf(edges, sizeof edges, "border edges at most %.2g units of the file apart",
             repairs->joined_apart);
    const struct {
        int count;
        const char *verb, *one, *many;
    } parts[] = {
        {repairs->welded_nodes, "welded", "node", "nodes"},
        {repairs->joined_edges, "joined", "", edges},
        {repairs->merged_nodes, "merged", "node with the next", "nodes with the next"},
        {repairs->unused_nodes, "dropped", "unused node", "unused nodes"},
        {repairs->split_nodes, "split", "node in which surfaces met",
         "nodes in which surfaces met"},
        {repairs->polygons, "cut", "polygon into triangles", "polygons into triangles"},
        {repairs->degenerate_faces, "dropped", "degenerate face", "degenerate faces"},
        {repairs->flat_faces, "took out", "face without area", "faces without area"},
        {repairs->duplicate_faces, "dropped", "duplicate face", "duplicate faces"},
        {repairs->turned_faces, "turned", "face", "faces"},
        {repairs->seam_nodes, "kept one texture coordinate of", "node", "nodes"},
        {repairs->components > 1 ? repairs->components : 0, "kept", "", "components apart"},
        {repairs->nodes_without_uv, "left out the texture, missing at", "node", "nodes"},
    };
    // List what was repaired; what was not stays unmentioned.
    text[0] = '\0';
    for (size_t i = 0, used = 0; i < sizeof parts / sizeof *parts && used < size; i++)
        if (parts[i].count > 0)
            used += (size_t)snprintf(text + used, size - used, "%s%s %d %s", used > 0 ? ", " : "",
                                     parts[i].verb, parts[i].count,
                                     parts[i].count == 1 ? parts[i].one : parts[i].many);
}
