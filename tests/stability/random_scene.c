// SPDX-License-Identifier: MIT
// Keys are taken or left at random; their values lie at the ends of their range, anywhere within
// it, or near the default. What only says how large a scene is stays small, so that a run takes
// milliseconds. Nothing here knows what keys mean to each other: what a scene is refused for is
// struck out by the caller.
#include "random_scene.h"

#include "scene/scene_parts.h"
#include "random.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

// What would make a scene large or a run long, and what is fit for one that is not. 0: never taken.
static const struct {
    const char *key;
    double most;
} SMALL[] = {
    {"nodes", 150},     {"subdivisions", 2}, {"rings", 7},  {"segments", 10},   {"columns", 8},
    {"rows", 8},        {"count", 6},        {"levels", 3}, {"start_level", 2}, {"threads", 2},
    {"settle_s", 0.02}, {"faces", 4000},     {"label", 3},  {"lcm_url", 0},     {"prepared", 0},
};

// Lists of groups: how many at most.
static const struct {
    const char *key;
    int most;
} LISTS[] = {{"bodies", 2}, {"tools", 3},    {"loads", 2},    {"attachments", 2},
             {"fixed", 2},  {"capsules", 2}, {"materials", 2}};

static const char *const MESH_FILES[] = {"triangle.off", "near.off", "twins.off", "graded3.off",
                                         "graded6.off"};

static int below(RandomScene *scene, int count)
{
    return random_below(&scene->random, count);
}

static bool chance(RandomScene *scene, double share)
{
    return random_between(&scene->random, 0.0, 1.0) < share;
}

__attribute__((format(printf, 2, 3))) static int add(RandomScene *scene, const char *format, ...)
{
    if (scene->count == SCENE_LINES)
        return SCENE_LINES - 1; // the rest is lost: the scene will not parse, and is refused
    const int at = scene->count++;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(scene->line[at].text, SCENE_LINE, format, arguments);
    va_end(arguments);
    scene->line[at].last = at;
    scene->line[at].gone = false;
    return at;
}

// ---------------------------------------------------------------------------------------------
// Numbers

static double limit_of(const Option *option, bool *never)
{
    *never = false;
    for (size_t i = 0; i < sizeof SMALL / sizeof *SMALL; i++)
        if (strcmp(SMALL[i].key, option->key) == 0) {
            *never = !(SMALL[i].most > 0.0);
            return fmin(option->high, SMALL[i].most);
        }
    return option->high;
}

// In [low, high], both above 0, every power of ten as likely.
static double power_between(RandomScene *scene, double low, double high)
{
    return exp(random_between(&scene->random, log(low), log(high)));
}

static double draw_real(RandomScene *scene, const Option *option)
{
    bool never;
    const double low = option->low, high = limit_of(option, &never);
    static const double tiny[] = {1e-300, 1e-40, 1e-20, 1e-12, 1e-9};
    const int how = below(scene, 100);
    const double smallest = low > 0.0 ? low : option->open ? tiny[below(scene, 5)] : 0.0;
    if (how < 6)
        return smallest;
    if (how < 12)
        return high;
    const double usual = option->preset > 0.0               ? option->preset
                         : strcmp(option->unit, "m") == 0   ? 0.03
                         : strcmp(option->unit, "s") == 0   ? 0.02
                         : strcmp(option->unit, "kg") == 0  ? 1e-3
                         : strcmp(option->unit, "N/m") == 0 ? 50.0
                                                            : fmin(1.0, 0.5 * (low + high));
    if (how < 75)
        return fmax(smallest, fmin(high, usual * power_between(scene, 0.1, 10.0)));
    const double from = fmax(fmax(low, 1e-12), high * 1e-15);
    return power_between(scene, from, fmax(high, 2.0 * from));
}

static int draw_int(RandomScene *scene, const Option *option)
{
    bool never;
    const double low = option->low, high = fmax(low, limit_of(option, &never));
    const int how = below(scene, 10);
    if (how == 0)
        return (int)low;
    if (how == 1)
        return (int)high;
    return (int)fmin(high, low + below(scene, (int)fmin(high - low, 1000.0) + 1));
}

// Bodies are some centimetres wide, about the origin.
static Vec3 draw_vector(RandomScene *scene, const Option *option)
{
    const int how = below(scene, 20);
    const bool place = strcmp(option->unit, "m") == 0;
    Vec3 direction = random_vec3(&scene->random);
    if (how == 0 && !(option->low > 0.0))
        return (Vec3){0.0, 0.0, 0.0};
    if (how == 1) // on the sphere, but for rounding
        return vec3_scale(option->high * 0.999999, vec3_unit(direction));
    if (how == 2)
        return vec3_scale(power_between(scene, fmax(option->low, 1e-9), option->high),
                          vec3_unit(direction));
    return vec3_scale(place ? 0.06 : fmin(option->high, 10.0), direction);
}

static void print_vector(char text[128], Vec3 v)
{
    snprintf(text, 128, "[%.9e, %.9e, %.9e]", v.x, v.y, v.z);
}

// ---------------------------------------------------------------------------------------------
// Keys

static void draw_group(RandomScene *scene, const OptionTable *table, const char *begin,
                       const char *end);

// The table of a group `key` of `table`; NULL: it has none (box, edge, nodes).
static const OptionTable *table_of(RandomScene *scene, const OptionTable *table, const char *key)
{
    char path[128];
    const OptionTable *found[4];
    int count = 0;
    snprintf(path, sizeof path, "%s%s%s", table->path, table->path[0] != '\0' ? "." : "", key);
    for (int i = 0; i < SCENE_TABLE_COUNT && count < 4; i++)
        if (strcmp(scene_table(i)->path, path) == 0)
            found[count++] = scene_table(i);
    if (count == 0 && strcmp(key, "place") == 0)
        return &PLACEMENT_TABLE;
    return count > 0 ? found[below(scene, count)] : NULL;
}

static void draw_list(RandomScene *scene, const OptionTable *table, const Option *option)
{
    static const Option corner = {.key = "", .unit = "m", .high = 1e6};
    char a[128], b[128];
    if (strcmp(option->key, "nodes") == 0) {
        add(scene, "nodes = [%d, %d];", below(scene, 60), below(scene, 60));
        return;
    }
    if (strcmp(option->key, "box") == 0) {
        const Vec3 low = draw_vector(scene, &corner), size = draw_vector(scene, &corner);
        print_vector(a, low);
        print_vector(b, (Vec3){low.x + fabs(size.x), low.y + fabs(size.y), low.z + fabs(size.z)});
        add(scene, "box = (%s, %s);", a, b);
        return;
    }
    if (strcmp(option->key, "edge") == 0) {
        print_vector(a, draw_vector(scene, &corner));
        print_vector(b, draw_vector(scene, &corner));
        add(scene, "edge = (%s, %s);", a, b);
        return;
    }
    int most = 1;
    for (size_t i = 0; i < sizeof LISTS / sizeof *LISTS; i++)
        if (strcmp(LISTS[i].key, option->key) == 0)
            most = LISTS[i].most;
    const int count = 1 + below(scene, most), at = add(scene, "%s = (", option->key);
    const OptionTable *entry = table_of(scene, table, option->key);
    for (int i = 0; i < count && entry != NULL; i++)
        draw_group(scene, entry, "{", i < count - 1 ? "}," : "}");
    scene->line[at].last = add(scene, ");");
}

static void draw_name(RandomScene *scene, const OptionTable *table, const Option *option)
{
    // Bodies are b1, b2; whatever names one names any.
    if (strcmp(table->path, "bodies") == 0) {
        int bodies = 0;
        for (int i = 0; i < scene->count; i++)
            bodies += strncmp(scene->line[i].text, "name = \"b", 9) == 0;
        add(scene, "name = \"b%d\";", bodies + 1);
    } else {
        add(scene, "%s = \"b%d\";", option->key, 1 + below(scene, 2));
    }
}

static void draw_string(RandomScene *scene, const OptionTable *table, const Option *option)
{
    if (strcmp(table->path, "bodies.voxels") == 0 && strcmp(option->key, "file") == 0)
        add(scene, "file = \"labels.nrrd\";");
    else if (strcmp(table->path, "bodies.voxels") == 0 || strcmp(table->path, "bodies.skin") == 0)
        add(scene, "%s = \"graded3.off\";", option->key);
    else if (strcmp(table->path, "bodies.mesh") == 0)
        add(scene, "%s = \"%s\";", option->key, MESH_FILES[below(scene, 5)]);
    else
        add(scene, "%s = \"nowhere\";", option->key);
}

static void draw_word(RandomScene *scene, const Option *option)
{
    int count = 0, taken;
    for (const OptionWord *word = option->words; word->word != NULL; word++)
        count++;
    taken = below(scene, count);
    for (const OptionWord *word = option->words; word->word != NULL; word++)
        if (taken-- == 0)
            add(scene, "%s = \"%s\";", option->key, word->word);
}

static void draw_key(RandomScene *scene, const OptionTable *table, const Option *option)
{
    char text[128];
    switch (option->type) {
    case OPTION_REAL:
        add(scene, "%s = %.17e;", option->key, draw_real(scene, option));
        break;
    case OPTION_INT:
        // Numbers of tools and labels: some that meet.
        if (strcmp(option->key, "id") == 0 || strcmp(option->key, "tool") == 0)
            add(scene, "%s = %d;", option->key, 1 + below(scene, 4));
        else
            add(scene, "%s = %d;", option->key, draw_int(scene, option));
        break;
    case OPTION_INTS:
        add(scene, "%s = %d;", option->key, draw_int(scene, option));
        break;
    case OPTION_BOOL:
        add(scene, "%s = %s;", option->key, chance(scene, 0.5) ? "true" : "false");
        break;
    case OPTION_WORD:
        draw_word(scene, option);
        break;
    case OPTION_NAME:
        draw_name(scene, table, option);
        break;
    case OPTION_STRING:
        draw_string(scene, table, option);
        break;
    case OPTION_VECTOR:
        print_vector(text, draw_vector(scene, option));
        add(scene, "%s = %s;", option->key, text);
        break;
    case OPTION_GROUP: {
        const OptionTable *group = table_of(scene, table, option->key);
        snprintf(text, sizeof text, "%s = {", option->key);
        if (group != NULL)
            draw_group(scene, group, text, "};");
        break;
    }
    case OPTION_LIST:
        draw_list(scene, table, option);
        break;
    }
}

// ---------------------------------------------------------------------------------------------
// Groups

// Keys of which a group needs one, or takes at most one: which of them this one gets is drawn
// beforehand, or hardly any scene would be accepted. NULL: none.
static const struct {
    const char *path, *keys[4];
} ONE_OF[] = {
    {"bodies", {"mesh", "voxels"}},
    {"bodies.mesh", {"generator", "generator", "file"}},
    {"bodies.voxels", {"generator", "generator", "file", "mesh"}},
    {"bodies.fixed", {"box", "sphere", "nodes"}},
    {"attachments", {"box", "sphere", "nodes"}},
    {"tools", {"capsules", "capsules", "plane"}},
    {"bodies.tear", {"stress", "force", "stretch"}},
};

static bool is_one_of(RandomScene *scene, const OptionTable *table, const char *key, int drawn,
                      bool *taken)
{
    (void)scene;
    for (size_t i = 0; i < sizeof ONE_OF / sizeof *ONE_OF; i++) {
        if (strcmp(ONE_OF[i].path, table->path) != 0)
            continue;
        int count = 0;
        bool known = false;
        for (int k = 0; k < 4 && ONE_OF[i].keys[k] != NULL; k++, count++)
            known |= strcmp(ONE_OF[i].keys[k], key) == 0;
        *taken = known && strcmp(ONE_OF[i].keys[drawn % count], key) == 0;
        return known;
    }
    return false;
}

// How often a key is taken that nothing asks for.
static double share_of(const Option *option)
{
    static const struct {
        const char *key;
        double share;
    } shares[] = {{"tools", 0.6},  {"loads", 0.5},    {"material", 0.6},   {"shape", 0.5},
                  {"fixed", 0.5},  {"cuttable", 0.5}, {"capacity", 0.1},   {"settle_s", 0.1},
                  {"place", 0.15}, {"initial", 0.01}, {"time_step", 0.15}, {"rate_hz", 0.3},
                  {"radius", 0.7}, {"levels", 0.6},   {"precision", 0.5},  {"integrator", 0.6}};
    for (size_t i = 0; i < sizeof shares / sizeof *shares; i++)
        if (strcmp(shares[i].key, option->key) == 0)
            return shares[i].share;
    return 0.3;
}

// Sizes of generated voxels: so many cells of so many metres that there are few.
static void draw_cells(RandomScene *scene)
{
    static const char *const generators[] = {"box", "ball", "disc"};
    const int which = below(scene, 3);
    const double size = power_between(scene, 1e-3, chance(scene, 0.1) ? 1e3 : 0.02);
    add(scene, "generator = \"%s\";", generators[which]);
    add(scene, "size = %.9e;", size);
    if (which == 0)
        add(scene, "count = %d;", 1 + below(scene, 6));
    else
        add(scene, "radius = %.9e;", fmin(1e3, size * random_between(&scene->random, 0.4, 4.0)));
}

static void draw_group(RandomScene *scene, const OptionTable *table, const char *begin,
                       const char *end)
{
    const int at = add(scene, "%s", begin), drawn = below(scene, 60);
    const bool voxels = strcmp(table->path, "bodies.voxels") == 0;
    bool model_given = false;
    for (int i = 0; i < table->count; i++) {
        const Option *option = &table->option[i];
        bool never, taken = option->required;
        if (limit_of(option, &never), never)
            continue;
        if (voxels && (strcmp(option->key, "generator") == 0)) {
            is_one_of(scene, table, option->key, drawn, &taken);
            if (taken)
                draw_cells(scene);
            continue;
        }
        if (voxels && (strcmp(option->key, "size") == 0 || strcmp(option->key, "count") == 0 ||
                       strcmp(option->key, "radius") == 0 || strcmp(option->key, "scale") == 0)) {
            if (strcmp(option->key, "size") == 0 &&
                strncmp(scene->line[scene->count - 1].text, "mesh", 4) == 0)
                add(scene, "size = 0.02;");
            continue;
        }
        if (strcmp(table->path, "bodies") == 0 && strcmp(option->key, "model") == 0) {
            add(scene, "model = \"%s\";", drawn % 2 == 0 ? "surface" : "voxel");
            model_given = true;
            continue;
        }
        if (strcmp(option->key, "radius") == 0 && i > 0 &&
            strncmp(scene->line[scene->count - 1].text, "sphere", 6) == 0)
            taken = true; // the ball that goes with its centre
        else if (!taken && !is_one_of(scene, table, option->key, drawn, &taken))
            taken = chance(scene, share_of(option));
        // What is said to be of the other model.
        if (model_given &&
            strncmp(option->about, drawn % 2 == 0 ? "Voxel" : "Surface", drawn % 2 == 0 ? 5 : 7) ==
                0 &&
            strcmp(option->key, "model") != 0 && !chance(scene, 0.02))
            continue;
        if (taken)
            draw_key(scene, table, option);
    }
    scene->line[at].last = add(scene, "%s", end);
}

void random_scene_draw(RandomScene *scene, uint64_t seed)
{
    scene->random = (seed + 1) * UINT64_C(0x9e3779b97f4a7c15);
    scene->count = 0;
    for (int i = 0; i < 4; i++)
        random_bits(&scene->random);
    draw_group(scene, &SCENE_TABLE, "# drawn", "# end");
}

// No comma behind the last entry of a list that is left.
static const char *comma_less(const RandomScene *scene, int line)
{
    const char *text = scene->line[line].text;
    int next = line + 1;
    while (next < scene->count && scene->line[next].gone)
        next++;
    const bool last = next < scene->count && strcmp(scene->line[next].text, ");") == 0;
    return last && strcmp(text, "},") == 0 ? "}" : text;
}

// Finds the last line of each group: a line that ends with an open bracket begins one, a line that
// begins with a closed one ends the latest.
static void find_groups(RandomScene *scene)
{
    static int open[SCENE_LINES];
    int depth = 0;
    for (int i = 0; i < scene->count; i++) {
        const char *text = scene->line[i].text;
        const size_t length = strlen(text);
        if (text[0] == '#')
            continue;
        if (depth > 0 && (text[0] == '}' || text[0] == ')'))
            scene->line[open[--depth]].last = i;
        if (length > 0 && (text[length - 1] == '{' || text[length - 1] == '('))
            open[depth++] = i;
    }
}

bool random_scene_read(RandomScene *scene, const char *path)
{
    FILE *file = fopen(path, "r");
    scene->count = 0;
    if (file == NULL)
        return false;
    bool fits = true;
    char text[SCENE_LINE];
    while (fits && fgets(text, sizeof text, file) != NULL) {
        text[strcspn(text, "\n")] = '\0';
        fits = scene->count < SCENE_LINES;
        if (!fits)
            break;
        memcpy(scene->line[scene->count].text, text, sizeof text);
        scene->line[scene->count].last = scene->count;
        scene->line[scene->count].gone = false;
        scene->count++;
    }
    fclose(file);
    find_groups(scene);
    return fits;
}

void random_scene_print(const RandomScene *scene, FILE *out)
{
    for (int i = 0; i < scene->count; i++)
        if (!scene->line[i].gone)
            fprintf(out, "%s\n", comma_less(scene, i));
}

bool random_scene_strike(RandomScene *scene, int number)
{
    int at = -1;
    for (int i = 0; i < scene->count && number > 0; i++)
        if (!scene->line[i].gone && --number == 0)
            at = i;
    if (at < 0)
        return false;
    // The end of a group means the group.
    for (int i = at; i >= 0; i--)
        if (scene->line[i].last == at && !scene->line[i].gone)
            at = i;
    if (at == 0)
        return false;
    for (int i = at; i <= scene->line[at].last; i++)
        scene->line[i].gone = true;
    return true;
}
