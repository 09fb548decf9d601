// Angles between leaves, now and at rest, for the curvature criterion. Between leaves whose corners
// are where the butterfly has put them the rest angle is known since load.
#include "surface/detail/detail.h"

#include <math.h>

// Two faces (a, b, c) and (b, a, d) at an edge: the squared product of their normals' lengths, and
// the cosine and sine of the angle between them, multiplied by that product.
typedef struct Fold {
    double size2, cosine, sine;
} Fold;

static Fold fold_of(const Vec3 x[4])
{
    Vec3 edge = vec3_sub(x[1], x[0]);
    Vec3 n = vec3_cross(edge, vec3_sub(x[2], x[0])), m = vec3_cross(vec3_sub(x[3], x[0]), edge);
    // n x m is parallel to the edge.
    double along = vec3_dot(edge, vec3_cross(n, m));
    return (Fold){vec3_dot(n, n) * vec3_dot(m, m), vec3_dot(n, m),
                  along / sqrt(vec3_dot(edge, edge))};
}

static double least_height(const Level *level, const Vec3 *x)
{
    double least = (double)INFINITY;
    for (int f = 0; f < level->face_count; f++) {
        const int *corner = level->face[f];
        for (int k = 0; k < 3; k++) {
            Vec3 side = vec3_sub(x[corner[(k + 1) % 3]], x[corner[k]]);
            Vec3 normal = vec3_cross(side, vec3_sub(x[corner[(k + 2) % 3]], x[corner[k]]));
            least = fmin(least, vec3_length(normal) / vec3_length(side));
        }
    }
    return least;
}

// Returns which side of a face an edge is.
static int side_of(const Level *level, int face, int edge)
{
    const int *edges = level->face_edge[face];
    return edges[0] == edge ? 0 : edges[1] == edge ? 1 : 2;
}

void detail_measure_fold(DetailFolds *folds, int level, int edge)
{
    const LeafSet *set = folds->set;
    const Level *at = &set->levels.level[level];
    const Vec3 *rest = set->levels.position;
    const int *face = at->edge_face[edge];
    if (face[0] < 0 || face[1] < 0)
        return;
    int k = side_of(at, face[0], edge), j = side_of(at, face[1], edge);
    const int *corner = detail_uncut(set, level, face[0]);
    const Vec3 x[4] = {rest[corner[k]], rest[corner[(k + 1) % 3]], rest[corner[(k + 2) % 3]],
                       rest[detail_uncut(set, level, face[1])[(j + 2) % 3]]};
    Fold fold = fold_of(x);
    double size = fold.size2 > 0.0 ? 1.0 / sqrt(fold.size2) : 0.0;
    float *known = folds->rest_fold[set->edge_base[level] + edge];
    known[0] = (float)(size * fold.cosine);
    known[1] = (float)(size * fold.sine);
}

void detail_folds_create(DetailFolds *folds, const LeafSet *set, const char *name, Arena *arena)
{
    const size_t edges = (size_t)set->edge_base[set->levels.finest + 1];
    folds->set = set;
    folds->rest_fold = arena_allocate(arena, ARENA_TOPOLOGY, edges, sizeof *folds->rest_fold,
                                      "%s/rest angles", name);
    const Vec3 *rest = set->levels.position;
    for (int l = 0; l <= set->levels.finest; l++) {
        const Level *at = &set->levels.level[l];
        folds->least_height[l] = least_height(at, rest);
        for (int e = 0; e < at->edge_count; e++)
            detail_measure_fold(folds, l, e);
    }
}

// Computes the rest angle of the leaves as they are now: hanging nodes are not where the butterfly
// would put them.
static Fold rest_fold(const SurfaceModel *model, int level, int edge, const int node[4])
{
    const Detail *detail = model->detail;
    bool smooth = true;
    Vec3 rest[4];
    for (int k = 0; k < 4; k++)
        smooth &= detail->set.status[node[k]] == NODE_FREE;
    if (smooth) {
        const float *known = detail->folds.rest_fold[detail->set.edge_base[level] + edge];
        return (Fold){1.0, (double)known[0], (double)known[1]};
    }
    for (int k = 0; k < 4; k++)
        rest[k] = model_rest(model, model->slot[node[k]]);
    return fold_of(rest);
}

double detail_cos_of_turn(const SurfaceModel *model, int level, int edge, const int node[4],
                          const Vec3 x[4])
{
    Fold now = fold_of(x), rest = rest_fold(model, level, edge, node);
    double size2 = now.size2 * rest.size2;
    return size2 > 0.0 ? (now.cosine * rest.cosine + now.sine * rest.sine) / sqrt(size2) : 1.0;
}
