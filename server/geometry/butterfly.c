// The four rules of the modified butterfly. Load time only; never on the step thread.
#include "geometry/butterfly.h"

#include <math.h>

static const double PI = 3.14159265358979323846;

typedef struct Stencil {
    const WingedMesh *winged;
    const int (*face)[3];
    const Vec3 *position;
} Stencil;

static bool is_regular(const WingedMesh *winged, int node)
{
    return winged_valence(winged, node) == 6 || winged_is_boundary_node(winged, node);
}

// Returns the node of a face that is neither u nor v.
static int third_node(const int face[3], int u, int v)
{
    for (int k = 0; k < 2; k++)
        if (face[k] != u && face[k] != v)
            return face[k];
    return face[2];
}

// --- boundary edges ---

// Returns the boundary edge's neighbour: the node before `node` when the boundary is walked towards
// `edge`.
static int along_boundary(const WingedMesh *winged, int node, int edge)
{
    // The edges round a border node start and end with its two border edges.
    int first = winged->node_edge[winged->node_edge_start[node]];
    int last = winged->node_edge[winged->node_edge_start[node + 1] - 1];
    return winged_other(winged, first == edge ? last : first, node);
}

// Returns the point beyond a, seen from b: the next one of the boundary, or at a corner the
// reflection.
static Vec3 beyond(const Stencil *s, int a, int b, int edge)
{
    Vec3 at = s->position[a], before = s->position[along_boundary(s->winged, a, edge)];
    Vec3 in = vec3_sub(at, before), out = vec3_sub(s->position[b], at);
    if (vec3_dot(in, out) < BUTTERFLY_CORNER * vec3_length(in) * vec3_length(out))
        return vec3_sub(vec3_scale(2.0, at), s->position[b]);
    return before;
}

static Vec3 boundary_point(const Stencil *s, int edge)
{
    const int *end = s->winged->edge[edge].node;
    Vec3 inner = vec3_add(s->position[end[0]], s->position[end[1]]);
    Vec3 outer = vec3_add(beyond(s, end[0], end[1], edge), beyond(s, end[1], end[0], edge));
    return vec3_madd(vec3_scale(9.0 / 16.0, inner), -1.0 / 16.0, outer);
}

// --- regular edges ---

// Returns the wing of the face across its edge (u, v), whose third node is w.
static Vec3 wing(const Stencil *s, int face, int u, int v, int w)
{
    for (int k = 0; k < 3; k++) {
        int other = s->winged->face_neighbor[face][k];
        if (other >= 0 && s->face[face][(k + 2) % 3] == w)
            return s->position[third_node(s->face[other], u, v)];
    }
    return vec3_sub(vec3_add(s->position[u], s->position[v]), s->position[w]);
}

static Vec3 regular_point(const Stencil *s, int edge)
{
    const WingedEdge *e = &s->winged->edge[edge];
    int a = e->node[0], b = e->node[1];
    Vec3 opposite = {0.0, 0.0, 0.0}, wings = opposite;
    for (int side = 0; side < 2; side++) {
        int face = e->face[side], c = third_node(s->face[face], a, b);
        opposite = vec3_add(opposite, s->position[c]);
        wings = vec3_add(wings, vec3_add(wing(s, face, b, c, a), wing(s, face, c, a, b)));
    }
    Vec3 point = vec3_scale(0.5, vec3_add(s->position[a], s->position[b]));
    return vec3_madd(vec3_madd(point, 1.0 / 8.0, opposite), -1.0 / 16.0, wings);
}

// --- extraordinary nodes ---

// Returns neighbour i of a node relative to it; as the weights sum to 1/4, 3/4 v + sum s_j p_j = v
// + sum s_j (p_j - v).
static Vec3 spoke(const Stencil *s, int node, int i)
{
    const WingedMesh *winged = s->winged;
    int edge = winged->node_edge[winged->node_edge_start[node] + i];
    return vec3_sub(s->position[winged_other(winged, edge, node)], s->position[node]);
}

double butterfly_weight(int valence, int j)
{
    static const double small[3][4] = {
        {0.5, 0.0}, {5.0 / 12.0, -1.0 / 12.0, -1.0 / 12.0}, {3.0 / 8.0, 0.0, -1.0 / 8.0, 0.0}};
    if (valence <= 4)
        return small[valence - 2][j];
    double angle = 2.0 * PI * j / valence;
    return (0.25 + cos(angle) + 0.5 * cos(2.0 * angle)) / valence;
}

// Adds `share` of the offset of spoke i's new point to middle[] of that spoke, for K <= 4.
static Vec3 small_offset(const Stencil *s, int node, int valence, int i)
{
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int j = 0; j < valence; j++)
        sum = vec3_madd(sum, butterfly_weight(valence, j), spoke(s, node, (i + j) % valence));
    return sum;
}

// Sums over the spokes that all stencils of a node share. With cos(2 pi (j - i)/K) = cos_i cos_j +
// sin_i sin_j a node takes O(K), not O(K^2).
typedef struct Moments {
    Vec3 sum, cos1, sin1, cos2, sin2;
} Moments;

// Cosine and sine of 2 pi i / K.
static void turn(int i, int valence, double *c, double *s)
{
    double angle = 2.0 * PI * i / valence;
    *c = cos(angle), *s = sin(angle);
}

static Moments spoke_moments(const Stencil *s, int node, int valence)
{
    Moments moments = {0};
    for (int j = 0; j < valence; j++) {
        double c1, s1;
        turn(j, valence, &c1, &s1);
        Vec3 d = spoke(s, node, j);
        moments.sum = vec3_add(moments.sum, d);
        moments.cos1 = vec3_madd(moments.cos1, c1, d);
        moments.sin1 = vec3_madd(moments.sin1, s1, d);
        moments.cos2 = vec3_madd(moments.cos2, c1 * c1 - s1 * s1, d);
        moments.sin2 = vec3_madd(moments.sin2, 2.0 * s1 * c1, d);
    }
    return moments;
}

static Vec3 large_offset(const Moments *moments, int valence, int i)
{
    double c1, s1;
    turn(i, valence, &c1, &s1);
    Vec3 sum = vec3_scale(0.25, moments->sum);
    sum = vec3_madd(vec3_madd(sum, c1, moments->cos1), s1, moments->sin1);
    sum = vec3_madd(sum, 0.5 * (c1 * c1 - s1 * s1), moments->cos2);
    sum = vec3_madd(sum, s1 * c1, moments->sin2);
    return vec3_scale(1.0 / valence, sum);
}

// Adds the share of an extraordinary node to the new points of its edges.
static void add_extraordinary(const Stencil *s, int node, Vec3 *middle)
{
    const WingedMesh *winged = s->winged;
    int valence = winged_valence(winged, node);
    Moments moments = {0};
    if (valence >= 5)
        moments = spoke_moments(s, node, valence);
    for (int i = 0; i < valence; i++) {
        int edge = winged->node_edge[winged->node_edge_start[node] + i];
        double share = is_regular(winged, winged_other(winged, edge, node)) ? 1.0 : 0.5;
        Vec3 offset =
            valence >= 5 ? large_offset(&moments, valence, i) : small_offset(s, node, valence, i);
        Vec3 point = vec3_add(s->position[node], offset);
        middle[edge] = vec3_madd(middle[edge], share, point);
    }
}

void butterfly_midpoints(const WingedMesh *winged, const int (*face)[3], const Vec3 *position,
                         Vec3 *middle)
{
    Stencil s = {winged, face, position};
    for (int e = 0; e < winged->edge_count; e++) {
        const int *end = winged->edge[e].node;
        if (winged_is_boundary_edge(winged, e))
            middle[e] = boundary_point(&s, e);
        else if (is_regular(winged, end[0]) && is_regular(winged, end[1]))
            middle[e] = regular_point(&s, e);
        else
            middle[e] = (Vec3){0.0, 0.0, 0.0};
    }
    for (int i = 0; i < winged->node_count; i++)
        if (!is_regular(winged, i))
            add_extraordinary(&s, i, middle);
}
