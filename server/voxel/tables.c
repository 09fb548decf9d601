#include "voxel/tables.h"

// One template's table in double precision.
typedef struct Numbers {
    double head[TABLE_HEAD];
    double row[NODE_COUNT][TABLE_ROW];
} Numbers;

static void put(double to[3], Vec3 a)
{
    to[0] = a.x, to[1] = a.y, to[2] = a.z;
}

static void affine_numbers(const Template *template, Numbers *out)
{
    for (int i = 0; i < template->count; i++) {
        const Vec3 place = template->place[i];
        const double w = template->weight[i], *m = template->spread;
        put(out->row[i], template->area[i]);
        out->row[i][3] = w;
        put(out->row[i] + 4, place);
        put(out->row[i] + 7, vec3(w * place.x / m[0], w * place.y / m[1], w * place.z / m[2]));
        out->head[0] += w;
    }
    out->head[1] = 1.0 / out->head[0];
}

static void paper_numbers(const Template *template, Numbers *out)
{
    const int count = template->count;
    Vec3 mean = {0.0, 0.0, 0.0};
    for (int i = 0; i < count; i++)
        mean = vec3_madd(mean, 1.0 / count, template->place[i]);
    double trace = 0.0, rest[6] = {0.0};
    for (int i = 0; i < count; i++) {
        const Vec3 r = vec3_sub(template->place[i], mean);
        out->row[i][3] = 1.0;
        put(out->row[i] + 4, r);
        trace += vec3_dot(r, r);
        const double product[6] = {r.x * r.x, r.y * r.y, r.z * r.z,
                                   r.y * r.z, r.z * r.x, r.x * r.y};
        for (int k = 0; k < 6; k++)
            rest[k] += product[k];
    }
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            out->row[i][k] = 3.0 / trace * out->row[i][4 + k];
    out->head[0] = count;
    out->head[1] = 1.0 / count;
    for (int k = 0; k < 6; k++)
        out->head[2 + k] = 3.0 / trace * rest[k] - (k < 3 ? 1.0 : 0.0);
}

static void put_number(void *to, int at, double value, bool single)
{
    if (single)
        ((float *)to)[at] = (float)value;
    else
        ((double *)to)[at] = value;
}

static Numbers numbers_of(const Template *template, VoxelLaw law)
{
    Numbers numbers = {0};
    if (law == VOXEL_AFFINE)
        affine_numbers(template, &numbers);
    else
        paper_numbers(template, &numbers);
    return numbers;
}

// Writes every `stride`-th number, of `count` vertices.
static void put_numbers(void *to, int stride, int at, int count, const Numbers *numbers,
                        bool single)
{
    for (int i = 0; i < TABLE_HEAD; i++, at += stride)
        put_number(to, at, numbers->head[i], single);
    for (int i = 0; i < count * TABLE_ROW; i++, at += stride)
        put_number(to, at, numbers->row[i / TABLE_ROW][i % TABLE_ROW], single);
}

void voxel_table_put(void *number, const Template *shape, VoxelLaw law, Precision precision)
{
    const Numbers numbers = numbers_of(shape, law);
    put_numbers(number, 1, 0, shape->count, &numbers, precision == PRECISION_SINGLE);
}

// Rounds up so that tables begin on cache lines.
static size_t numbers_in(const RestTable *table, bool mixed)
{
    size_t numbers = (size_t)(TABLE_HEAD + table->count * TABLE_ROW) * (mixed ? LANES : 1);
    return (numbers + 15) / 16 * 16;
}

const RestTable *voxel_tables_create(const Batches *batches, VoxelLaw law, Precision precision,
                                     const char *name, Arena *arena)
{
    const bool single = precision == PRECISION_SINGLE;
    const size_t real = single ? sizeof(float) : sizeof(double);
    const HangingBatches *hanging = &batches->hanging;
    const int pure = hanging->batch_count - hanging->mixed_count;
    const int count = batches->template_count + hanging->mixed_count;
    RestTable *tables =
        arena_allocate(arena, ARENA_STEP, (size_t)count, sizeof *tables, "%s/rest tables", name);
    // Vertices per table: of one template, or of the longest in a mixed batch.
    size_t total = 0;
    for (int k = 0; k < count; k++) {
        const int mixed = k - batches->template_count, batch = pure + mixed;
        tables[k].count = mixed < 0 ? batches->templates[k].count
                                    : hanging->start[batch + 1] - hanging->start[batch];
        total += numbers_in(&tables[k], mixed >= 0);
    }
    char *out = arena_allocate(arena, ARENA_STEP, total, real, "%s/rest shapes", name);
    for (int k = 0; k < count; k++) {
        const int mixed = k - batches->template_count;
        const int stride = mixed < 0 ? 1 : LANES;
        for (int lane = 0; lane < stride; lane++) {
            // A lane without an element gets a shape that never deforms.
            const int t = mixed < 0 ? k : batches->mixture[mixed][lane];
            const Numbers numbers = numbers_of(&batches->templates[t < 0 ? 0 : t], law);
            put_numbers(out, stride, lane, tables[k].count, &numbers, single);
        }
        tables[k].number = out;
        out += numbers_in(&tables[k], mixed >= 0) * real;
    }
    return tables;
}
