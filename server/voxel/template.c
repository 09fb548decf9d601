// Area vectors and weights of cubes with hanging vertices. Load time only.
#include "voxel/template.h"

const signed char NODE_OFFSET[NODE_COUNT][3] = {
    // corners
    {0, 0, 0},
    {2, 0, 0},
    {0, 2, 0},
    {2, 2, 0},
    {0, 0, 2},
    {2, 0, 2},
    {0, 2, 2},
    {2, 2, 2},
    // middles of edges along x, y, z
    {1, 0, 0},
    {1, 2, 0},
    {1, 0, 2},
    {1, 2, 2},
    {0, 1, 0},
    {2, 1, 0},
    {0, 1, 2},
    {2, 1, 2},
    {0, 0, 1},
    {2, 0, 1},
    {0, 2, 1},
    {2, 2, 1},
    // middles of the faces -x, +x, -y, +y, -z, +z
    {0, 1, 1},
    {2, 1, 1},
    {1, 0, 1},
    {1, 2, 1},
    {1, 1, 0},
    {1, 1, 2},
};

int node_at_offset(int x, int y, int z)
{
    // x fastest
    static const signed char node[27] = {0,  8,  1,  12, 24, 13, 2, 9,  3,  16, 22, 17, 20, -1,
                                         21, 18, 23, 19, 4,  10, 5, 14, 25, 15, 6,  11, 7};
    const bool inside = x >= 0 && x <= 2 && y >= 0 && y <= 2 && z >= 0 && z <= 2;
    return inside ? node[x + 3 * y + 9 * z] : -1;
}

static Vec3 place_of(int node)
{
    const signed char *o = NODE_OFFSET[node];
    return vec3(0.5 * (o[0] - 1), 0.5 * (o[1] - 1), 0.5 * (o[2] - 1));
}

// Returns a node's area vector with all 26 present: the surface is 24 squares of edge 1/2, and each
// of a square's four corners gets a quarter of its area vector, exact for fields bilinear on it. On
// a face a corner of the cube meets one square, a mid-edge two, a mid-face four.
static Vec3 full_area(int node)
{
    const signed char *o = NODE_OFFSET[node];
    double area[3];
    for (int d = 0; d < 3; d++) {
        int middles = (o[(d + 1) % 3] == 1) + (o[(d + 2) % 3] == 1);
        area[d] = (o[d] - 1) * (1 << middles) / 16.0;
    }
    return vec3(area[0], area[1], area[2]);
}

// Distributes the area vector of an absent node: it moves as the mean of the nodes around it, one
// step coarser, and gives them equal parts.
static void hand_on(Vec3 area[NODE_COUNT], int node)
{
    const signed char *o = NODE_OFFSET[node];
    int heir[4], count = 0;
    for (int d = 0; d < 3; d++)
        for (int end = 0; end <= 2 && o[d] == 1; end += 2) {
            int at[3] = {o[0], o[1], o[2]};
            at[d] = end;
            heir[count++] = node_at_offset(at[0], at[1], at[2]);
        }
    for (int i = 0; i < count; i++)
        area[heir[i]] = vec3_madd(area[heir[i]], 1.0 / count, area[node]);
    area[node] = vec3(0.0, 0.0, 0.0);
}

void template_create(Template *out, unsigned mask)
{
    *out = (Template){.mask = mask};
    Vec3 area[NODE_COUNT];
    for (int node = 0; node < NODE_COUNT; node++)
        area[node] = full_area(node);
    // Faces first: they may distribute to mid-edges that are absent too.
    for (int node = NODE_COUNT - 1; node >= NODE_CORNERS; node--)
        if (!(mask >> (node - NODE_CORNERS) & 1))
            hand_on(area, node);

    double spread[3] = {0.0, 0.0, 0.0};
    for (int node = 0; node < NODE_COUNT; node++) {
        if (node >= NODE_CORNERS && !(mask >> (node - NODE_CORNERS) & 1))
            continue;
        int i = out->count++;
        Vec3 place = place_of(node);
        out->node[i] = node;
        out->place[i] = place;
        out->area[i] = area[node];
        // Eight times the volume of the cone from the middle over the node's part of the surface:
        // sums of powers of two except for the last division.
        double weight = 8.0 * vec3_dot(area[node], place) / 3.0;
        out->weight[i] = weight;
        spread[0] += weight * place.x * place.x;
        spread[1] += weight * place.y * place.y;
        spread[2] += weight * place.z * place.z;
    }
    for (int d = 0; d < 3; d++)
        out->spread[d] = spread[d];
}

double template_spread(const Template *shape)
{
    Vec3 mean = {0.0, 0.0, 0.0};
    for (int i = 0; i < shape->count; i++)
        mean = vec3_madd(mean, 1.0 / shape->count, shape->place[i]);
    double spread = 0.0;
    for (int i = 0; i < shape->count; i++) {
        Vec3 r = vec3_sub(shape->place[i], mean);
        spread += vec3_dot(r, r);
    }
    return spread;
}
