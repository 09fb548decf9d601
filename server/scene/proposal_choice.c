// SPDX-License-Identifier: MIT
// Which of the ways to make an organ is proposed, why, and what each is good for; and all of it for
// programs. Load time only.
#include "scene/proposal.h"

#include <ctype.h>
#include <math.h>
#include <string.h>
#include <strings.h>

// --- hollow organs -------------------------------------------------------------------------------

// Parts of the names of organs that are hollow, as TotalSegmentator, 3D Slicer and anatomy use
// them.
static const char *const HOLLOW[] = {
    "airway",  "aorta",  "arter",   "atrium",  "bladder", "bowel",     "bronch",
    "caecum",  "cava",   "cecum",   "colon",   "duoden",  "esophag",   "ileum",
    "intest",  "jejun",  "larynx",  "pharynx", "rectum",  "sigmoid",   "stomach",
    "trachea", "ureter", "urethra", "uterus",  "vein",    "ventricle", "vessel"};

// Finds a word in a text, in either case; NULL: it is not there.
static const char *find_word(const char *text, const char *word)
{
    const size_t length = strlen(word);
    for (; *text != '\0'; text++)
        if (strncasecmp(text, word, length) == 0)
            return text;
    return NULL;
}

// The name of what is in the file: that of its label; of a file with one organ that of the file.
static const char *name_of(const Proposals *all)
{
    const char *path = all->subject.path, *slash = strrchr(path, '/');
    if (all->subject.label_name[0] != '\0')
        return all->subject.label_name;
    return all->labels.count > 1 ? "" : slash != NULL ? slash + 1 : path;
}

void proposal_find_hollow(Proposals *all)
{
    const char *name = name_of(all);
    for (size_t i = 0; i < sizeof HOLLOW / sizeof *HOLLOW; i++) {
        const char *found = find_word(name, HOLLOW[i]);
        if (found == NULL)
            continue;
        // The whole word, as it is written there.
        int length = 0;
        while (isalpha((unsigned char)found[length]))
            length++;
        snprintf(all->hollow, sizeof all->hollow, "its name says %.*s", length, found);
        all->named_hollow = true;
        return;
    }
    if (all->verdict[WAY_SOLID].cavity)
        snprintf(all->hollow, sizeof all->hollow, "one closed sheet lies within another");
}

// --- colours -------------------------------------------------------------------------------------

// Parts of the names of organs, those that are part of others behind these, and colours as atlases
// draw them.
static const struct {
    const char *name;
    float colour[3];
} COLOURS[] = {
    {"gallbladder", {0.42F, 0.55F, 0.28F}}, {"bladder", {0.80F, 0.58F, 0.50F}},
    {"tumor", {0.88F, 0.80F, 0.52F}},       {"tumour", {0.88F, 0.80F, 0.52F}},
    {"lesion", {0.88F, 0.80F, 0.52F}},      {"cyst", {0.72F, 0.74F, 0.60F}},
    {"vein", {0.30F, 0.34F, 0.60F}},        {"cava", {0.30F, 0.34F, 0.60F}},
    {"portal", {0.30F, 0.34F, 0.60F}},      {"arter", {0.76F, 0.16F, 0.14F}},
    {"aorta", {0.76F, 0.16F, 0.14F}},       {"vessel", {0.70F, 0.18F, 0.17F}},
    {"liver", {0.50F, 0.20F, 0.15F}},       {"kidney", {0.55F, 0.23F, 0.18F}},
    {"spleen", {0.42F, 0.16F, 0.20F}},      {"pancrea", {0.84F, 0.66F, 0.44F}},
    {"lung", {0.80F, 0.60F, 0.58F}},        {"heart", {0.62F, 0.18F, 0.16F}},
    {"myocard", {0.62F, 0.18F, 0.16F}},     {"brain", {0.80F, 0.68F, 0.62F}},
    {"stomach", {0.82F, 0.56F, 0.48F}},     {"duoden", {0.82F, 0.58F, 0.50F}},
    {"bowel", {0.82F, 0.58F, 0.50F}},       {"colon", {0.78F, 0.56F, 0.46F}},
    {"muscle", {0.62F, 0.22F, 0.19F}},      {"fat", {0.93F, 0.80F, 0.47F}},
    {"bone", {0.90F, 0.86F, 0.74F}},        {"vertebra", {0.90F, 0.86F, 0.74F}},
    {"rib", {0.90F, 0.86F, 0.74F}},         {"cartilage", {0.78F, 0.82F, 0.82F}},
    {"nerve", {0.92F, 0.84F, 0.52F}},       {"skin", {0.86F, 0.68F, 0.58F}},
    {"prostate", {0.78F, 0.56F, 0.50F}},    {"uter", {0.80F, 0.52F, 0.50F}},
    {"breast", {0.90F, 0.76F, 0.62F}},      {"thyroid", {0.66F, 0.30F, 0.26F}},
};

static const float *colour_by_name(const char *name)
{
    for (size_t i = 0; i < sizeof COLOURS / sizeof *COLOURS; i++)
        if (find_word(name, COLOURS[i].name) != NULL)
            return COLOURS[i].colour;
    return NULL;
}

const float *proposal_label_colour(const VolumeLabel *label)
{
    return label->colour[0] >= 0.0F ? label->colour : colour_by_name(label->name);
}

void proposal_find_colour(Proposals *all)
{
    const float *found = NULL;
    // What the file says comes before what its names mean.
    for (int i = 0; i < all->labels.count; i++) {
        const VolumeLabel *label = &all->labels.label[i];
        if (label->label == all->subject.label && label->colour[0] >= 0.0F &&
            (all->subject.layer == 0 || label->layer == all->subject.layer))
            found = label->colour;
    }
    if (all->subject.part_count > 0)
        found = proposal_label_colour(&all->subject.part[0]);
    if (found == NULL)
        found = colour_by_name(name_of(all));
    for (int i = 0; i < PROPOSAL_WAYS && found != NULL; i++) {
        all->verdict[i].proposal.coloured = true;
        memcpy(all->verdict[i].proposal.colour, found, sizeof all->verdict[i].proposal.colour);
    }
}

// --- what is judged ------------------------------------------------------------------------------

// True if a part of the name is one of the words, which end with NULL.
static bool has_word(const char *name, const char *const *word)
{
    for (; *word != NULL; word++)
        if (find_word(name, *word) != NULL)
            return true;
    return false;
}

void proposal_write_score(const Proposal *p, FILE *out)
{
    static const char *const growths[] = {"tumor", "tumour", "lesion", "cancer", "metasta", NULL},
                             *const vessels[] = {"vessel", "vein",   "arter", "aorta",
                                                 "cava",   "portal", NULL};
    enum { MOST = 16 }; // regions of a scene
    int count = 0;
    for (int i = 0; i < p->part_count && count < MOST; i++) {
        const VolumeLabel *part = &p->part[i];
        const bool growth = has_word(part->name, growths);
        if (!growth && !has_word(part->name, vessels))
            continue;
        // What a scene file can hold of its name.
        char name[24];
        int length = 0;
        for (const char *c = part->name; *c != '\0' && length < (int)sizeof name - 1; c++)
            if (isalnum((unsigned char)*c) || *c == '-' || *c == '_')
                name[length++] = *c;
            else if (*c == ' ' && length > 0 && name[length - 1] != '_')
                name[length++] = '_';
        name[length] = '\0';
        fprintf(out, "%s  { name = \"%s\";  label = %d;  %s }",
                count++ == 0 ? "score = { regions = (\n" : ",\n", name, part->label,
                growth ? "margin = 0.005;" : "keep = true;");
    }
    if (count > 0)
        fprintf(out, "\n); };   # what the ledger judges cuts and removals by\n");
}

// --- the choice ----------------------------------------------------------------------------------

int proposal_best(const Proposals *all, const char **why)
{
    const Verdict *wall = &all->verdict[WAY_WALL], *solid = &all->verdict[WAY_SOLID];
    const bool named = all->named_hollow, nested = !named && all->hollow[0] != '\0';
    const char *ignored;
    if (why == NULL)
        why = &ignored;
    if (wall->usable && named) {
        *why = "since by its name it is hollow";
        return WAY_WALL;
    }
    if (solid->usable && nested) {
        *why = "since its two sheets, one within the other, are the two sides of a wall";
        return WAY_SOLID;
    }
    if (wall->usable && !wall->proposal.implicit) {
        *why = "since nothing is said of its inside, and this costs least";
        return WAY_WALL;
    }
    if (solid->usable) {
        *why = all->subject.volume
                   ? "since labels say what is inside"
                   : "since its triangles are too small or too many for a fast wall";
        return WAY_SOLID;
    }
    *why = "since no cells fill it";
    return wall->usable ? WAY_WALL : -1;
}

const char *proposal_use(const Proposals *all, ProposalWay way)
{
    if (way == WAY_WALL)
        return "for an empty hollow organ, as a bowel or a stomach: it gives way and folds";
    if (way == WAY_FILLED)
        return "for a full hollow organ, as a bladder: it is tense, and what is in it runs out of "
               "a cut";
    if (all->verdict[WAY_SOLID].cavity)
        return "for a thick wall: tissue between its sheets, hollow within";
    return "for an organ that is full of tissue, as a liver or a kidney: a cut shows its inside";
}

// --- for programs --------------------------------------------------------------------------------

// As many as fit into what pliant-web keeps of a program's output.
enum { LABELS_LISTED = 150 };

// Writes a text as a JSON string. Bytes beyond ASCII pass, as the file has them.
static void write_string(const char *text, FILE *out)
{
    fputc('"', out);
    for (const char *c = text; *c != '\0'; c++) {
        if ((unsigned char)*c < ' ' || *c == 127)
            fprintf(out, "\\u%04x", (unsigned)*c);
        else
            fprintf(out, *c == '"' || *c == '\\' ? "\\%c" : "%c", *c);
    }
    fputc('"', out);
}

static void write_member(const char *name, const char *text, FILE *out)
{
    fprintf(out, ", \"%s\": ", name);
    write_string(text, out);
}

static void write_size(Vec3 metres, FILE *out)
{
    fprintf(out, ", \"size_mm\": [%.4g, %.4g, %.4g]", 1e3 * metres.x, 1e3 * metres.y,
            1e3 * metres.z);
}

// Writes a label, with its size along the axes of the volume.
static void write_label(const Proposals *all, const VolumeLabel *label, FILE *out)
{
    const Vec3 *axis = all->frame.axis;
    const double voxel = fabs(vec3_dot(axis[0], vec3_cross(axis[1], axis[2])));
    double side[3];
    for (int a = 0; a < 3; a++)
        side[a] = (label->high[a] - label->low[a]) * vec3_length(axis[a]);
    fprintf(out, "{\"label\": %d, \"layer\": %d, \"volume_cm3\": %.4g, \"pieces\": %d",
            label->label, label->layer, 1e6 * voxel * (double)label->voxels, label->pieces);
    write_size(label->voxels > 0 ? vec3(side[0], side[1], side[2]) : vec3(0.0, 0.0, 0.0), out);
    const float *colour = label->colour;
    if (colour[0] >= 0.0F)
        fprintf(out, ", \"colour\": [%.3g, %.3g, %.3g]", (double)colour[0], (double)colour[1],
                (double)colour[2]);
    write_member("name", label->name, out);
    fputc('}', out);
}

static void write_labels(const Proposals *all, FILE *out)
{
    const int count = all->labels.count, listed = count < LABELS_LISTED ? count : LABELS_LISTED;
    fprintf(out, ", \"label\": %d, \"layer\": %d, \"layers\": %d, \"unlisted\": %d, \"labels\": [",
            all->subject.label, all->subject.layer, all->frame.layers, count - listed);
    for (int i = 0; i < listed; i++) {
        fputs(i > 0 ? ", " : "", out);
        write_label(all, &all->labels.label[i], out);
    }
    fputc(']', out);
}

void proposal_json(const Proposals *all, const char *report, FILE *out)
{
    const char *why;
    const int best = proposal_best(all, &why);
    fputs("{\"file\": ", out);
    write_string(all->subject.path, out);
    write_member("model", best < 0 ? "" : proposal_way_name((ProposalWay)best), out);
    write_member("why", why, out);
    write_member("hollow", all->hollow, out);
    fprintf(out, ", \"closed\": %s", all->subject.volume || all->volume > 0.0 ? "true" : "false");
    write_size(box_size(&all->subject.box), out);
    if (all->subject.volume)
        write_labels(all, out);
    // Each way, with its verdict.
    fputs(", \"models\": [", out);
    for (int i = 0; i < PROPOSAL_WAYS; i++) {
        const Verdict *verdict = &all->verdict[i];
        fprintf(out, "%s{\"usable\": %s, \"cuttable\": %s", i > 0 ? ", " : "",
                verdict->usable ? "true" : "false", verdict->proposal.whole ? "false" : "true");
        write_member("model", proposal_way_name((ProposalWay)i), out);
        write_member("verdict", verdict->text, out);
        write_member("use", proposal_use(all, (ProposalWay)i), out);
        fputc('}', out);
    }
    fputc(']', out);
    write_member("report", report, out);
    fputs("}\n", out);
}
