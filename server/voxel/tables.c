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

// Numbers of one template, with those that bring the next one to a 64-byte boundary.
static size_t table_size(const Template *shape)
{
    return ((size_t)(TABLE_HEAD + shape->count * TABLE_ROW) + 15) / 16 * 16;
}

const TemplateTable *voxel_tables_create(const Template *templates, int count, VoxelLaw law,
                                         Precision precision, const char *name, Arena *arena)
{
    const bool single = precision == PRECISION_SINGLE;
    TemplateTable *tables = arena_allocate(arena, ARENA_STEP, (size_t)count, sizeof *tables,
                                           "%s/template tables", name);
    size_t total = 0;
    for (int t = 0; t < count; t++)
        total += table_size(&templates[t]);
    const size_t real = single ? sizeof(float) : sizeof(double);
    char *block = arena_allocate(arena, ARENA_STEP, total, real, "%s/template numbers", name);
    for (int t = 0; t < count; t++) {
        Numbers numbers = {0};
        if (law == VOXEL_AFFINE)
            affine_numbers(&templates[t], &numbers);
        else
            paper_numbers(&templates[t], &numbers);
        const int rows = templates[t].count;
        void *out = block;
        block += table_size(&templates[t]) * real;
        for (int i = 0; i < TABLE_HEAD; i++)
            put_number(out, i, numbers.head[i], single);
        for (int i = 0; i < rows * TABLE_ROW; i++)
            put_number(out, TABLE_HEAD + i, numbers.row[i / TABLE_ROW][i % TABLE_ROW], single);
        tables[t] = (TemplateTable){templates[t].count, out};
    }
    return tables;
}
