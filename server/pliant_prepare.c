// SPDX-License-Identifier: MIT
// pliant-prepare: checks mesh files before a scene uses them, proposes a scene for one, and makes
// the meshes and levels of a scene once, so that daemons start faster.
#include "base/arguments.h"

#include "base/log.h"
#include "scene/proposal.h"
#include "io/mesh_import.h"
#include "io/mesh_formats.h"
#include "scene/prepared.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct PrepareArguments {
    char **file; // [file_count] meshes, or the scene, of the command line, in order
    int file_count;
    const char *output;
    double scale; // 0: not given
    bool units;   // --units gave it
    double weld;  // of a repair [units of the file]; 0: not given
    int way;      // ProposalWay to propose; -1: the best one
    int cuttable; // 0, 1; -1: if a tick has time for it
    LabelChoice choice;
    bool check, propose, repair, even, json;
} PrepareArguments;

#define AT(member) offsetof(PrepareArguments, member)

static bool take_file(void *target, const char *text, Status *why)
{
    (void)why;
    PrepareArguments *arguments = target;
    arguments->file[arguments->file_count++] = (char *)text;
    return true;
}

static bool take_units(void *target, const char *text, Status *why)
{
    PrepareArguments *a = target;
    a->units = units_parse(text, &a->scale);
    return a->units || status_fail(why, STATUS_INVALID, "is none of m, dm, cm, mm and um");
}

static bool take_model(void *target, const char *text, Status *why)
{
    int *way = &((PrepareArguments *)target)->way;
    for (*way = PROPOSAL_WAYS - 1; *way >= 0; (*way)--)
        if (strcmp(text, proposal_way_name((ProposalWay)*way)) == 0)
            return true;
    return status_fail(why, STATUS_INVALID, "is neither surface, filled nor voxel");
}

static bool take_cuttable(void *target, const char *text, Status *why)
{
    const bool yes = strcmp(text, "yes") == 0;
    ((PrepareArguments *)target)->cuttable = yes;
    return yes || strcmp(text, "no") == 0 ||
           status_fail(why, STATUS_INVALID, "is neither yes nor no");
}

static const ArgumentRow ROWS[] = {
    {NULL, 0, ARGUMENT_OPERAND, .handler = take_file},
    {.type = ARGUMENT_HEADING, .help = "Meshes and label volumes:"},
    {"check", 0, ARGUMENT_FLAG, NULL, AT(check),
     .help = "Report on each MESH (OBJ, STL, PLY, OFF, VTK, MSH, TetGen): repairs, components, "
             "quality of the "
             "triangles, the stable time step; and whether each, or a label volume (NRRD, NIfTI), "
             "is usable as a wall (surface body) or as a solid (voxel body), and the time of a "
             "tick"},
    {"propose", 0, ARGUMENT_FLAG, NULL, AT(propose),
     .help = "Write a scene with a MESH or a label volume as its body, cuttable if a tick has time "
             "for it, and tools of suitable size to a new -o FILE. At a "
             "terminal, asks for the units if they are in doubt"},
    {"repair", 0, ARGUMENT_FLAG, NULL, AT(repair),
     .help = "Write a MESH, repaired and in its own units, to a new OFF file -o FILE, for other "
             "programs"},
    {"even", 0, ARGUMENT_FLAG, NULL, AT(even),
     .help =
         "Write the outer surface of a closed MESH or of a label with about 1000 nodes and even "
         "edges, as a wall needs them, in metres, to a new OFF file -o FILE"},
    {"weld", 0, ARGUMENT_NUMBER, "D", AT(weld), 0.0, 1e90, .open = true, // as meshes measure
     .help = "With --repair: join borders that run beside each other, at most D units of the file "
             "apart"},
    {"units", 0, ARGUMENT_OTHER, "U", .handler = take_units,
     .help = "Units of the mesh files: m, dm, cm, mm or um; without it, and without --scale, they "
             "are guessed from the file's first lines or the size"},
    {"scale", 0, ARGUMENT_NUMBER, "S", AT(scale), 0.0, 1e6, .open = true, // as a scene allows
     .help = "Metres per unit of the files, 0.001 for millimetres; of a label volume, times the "
             "units that it states"},
    {"label", 0, ARGUMENT_TEXT, "L", AT(choice.label),
     .help = "Label of a volume, by its number or name, or all of a layer as one body; without it "
             "the largest"},
    {"layer", 0, ARGUMENT_INTEGER, "N", AT(choice.layer), 1, VOLUME_MOST_VOXELS,
     .help = "Layer or frame of a volume file with several, from 1; without it all are looked "
             "through"},
    {"model", 0, ARGUMENT_OTHER, "M", .handler = take_model,
     .help = "Model to propose: surface (a wall), filled (a wall full of a fluid) or voxel (a "
             "solid); without it a wall where the name says a hollow organ, else what costs least"},
    {"cuttable", 0, ARGUMENT_OTHER, "yes|no", .handler = take_cuttable,
     .help = "Whether the proposed body can be cut; without it if a tick has time for it"},
    {"json", 0, ARGUMENT_FLAG, NULL, AT(json),
     .help = "With --check: for programs, the report, labels and verdicts as one JSON object a "
             "line for each MESH"},
    {.type = ARGUMENT_HEADING, .help = "Scenes:"},
    {"output", 'o', ARGUMENT_TEXT, "FILE", AT(output),
     .help = "Build the meshes and levels of all bodies of SCENE.cfg and write them to FILE "
             "(HDF5), for pliantd --prepared FILE SCENE.cfg"},
    {0}};

static bool check_together(void *target, Status *why)
{
    const PrepareArguments *a = target;
    // One job, with the files that it needs.
    const bool judges = a->check || a->propose || a->even, mesh = judges || a->repair;
    if (a->file_count == 0)
        return status_fail(why, STATUS_INVALID, "no %s given",
                           a->output != NULL && !mesh ? "scene" : "mesh");
    if (a->check + a->propose + a->repair + a->even > 1 || a->check == (a->output != NULL))
        return status_fail(why, STATUS_INVALID,
                           "needs either --check MESH... or SCENE.cfg -o FILE, or --propose MESH "
                           "-o SCENE.cfg, or --repair or --even MESH -o FILE.off");
    // Options that have a meaning for some of them only.
    if (!judges && a->scale > 0.0)
        return status_fail(why, STATUS_INVALID,
                           "--scale goes with --check or --propose, as --units does: a scene has "
                           "its own");
    if (!a->repair && a->weld > 0.0)
        return status_fail(why, STATUS_INVALID, "--weld goes with --repair");
    if (!judges && (a->choice.label != NULL || a->choice.layer > 0))
        return status_fail(why, STATUS_INVALID, "--label and --layer go with --check or --propose");
    if (!a->propose && (a->way >= 0 || a->cuttable >= 0))
        return status_fail(why, STATUS_INVALID, "%s goes with --propose",
                           a->way >= 0 ? "--model" : "--cuttable");
    if (!a->check && a->json)
        return status_fail(why, STATUS_INVALID, "--json goes with --check");
    if (a->output != NULL && a->file_count > 1)
        return status_fail(why, STATUS_INVALID, "one %s at a time, got '%s' and '%s'",
                           mesh ? "mesh" : "scene", a->file[0], a->file[1]);
    return true;
}

static const ArgumentTable TABLE = {
    .program = "pliant-prepare",
    .usage =
        "--check MESH...\n--propose MESH -o SCENE.cfg\n--repair MESH -o FILE.off\n--even MESH -o "
        "FILE.off\nSCENE.cfg -o FILE",
    .about = "Reports the contents of mesh files and whether a scene can use them, writes such a "
             "scene, or builds the meshes and levels of a scene in advance.",
    .end = "Exit code 0: every mesh is usable as a wall or as a solid, the file is written; 1: it "
           "cannot be written; 2: bad usage, scene or mesh; a mesh that is usable as neither.",
    .rows = ROWS,
    .check = check_together};

// Says how long a large volume takes: it is read a dozen times, 24 ns a voxel altogether (512 x 512
// x 512 voxels took 3.2 s).
static void announce(const char *path, LabelChoice choice)
{
#ifdef PLIANT_WITH_VOXEL
    const double each = 2.4e-8, patience = 2.0; // [s]
    LabelVolume volume;
    Status ignored = {0};
    if (!proposal_is_volume(path) || !volume_import_header(path, &volume, &ignored))
        return;
    const double voxels = (double)volume.count[0] * volume.count[1] * volume.count[2] *
                          (choice.layer > 0 ? 1 : volume.layers);
    if (voxels * each > patience && voxels <= VOLUME_MOST_VOXELS)
        fprintf(stderr, "%s: %.0f million voxels, which take about %.0f s\n", path, 1e-6 * voxels,
                voxels * each);
    volume_destroy(&volume);
#else
    (void)path;
    (void)choice;
#endif
}

// A volume says in what units it is, so `--units mm` would make millimetres of it twice.
static bool check_units(const PrepareArguments *arguments, const char *path, Status *status)
{
    return !arguments->units || !proposal_is_volume(path) ||
           status_fail(status, STATUS_INVALID,
                       "%s: --units is for meshes: a label volume states its units (mm, where it "
                       "states none); if they are wrong, --scale S multiplies them",
                       path);
}

// Reports on one mesh, as text or JSON.
static bool check_mesh(const PrepareArguments *arguments, const char *path, Status *status)
{
    Proposals found;
    char *text = NULL;
    size_t size = 0;
    FILE *out = arguments->json ? open_memstream(&text, &size) : stdout;
    if (out == NULL)
        abort();
    const bool ok = mesh_report_print(path, arguments->scale, arguments->choice, !arguments->json,
                                      &found, out, status);
    if (arguments->json) {
        fclose(out);
        if (found.subject.path != NULL)
            proposal_json(&found, text, stdout);
        free(text);
    }
    proposals_destroy(&found);
    return ok;
}

// Checks every mesh, also after one that is unusable.
static int check_meshes(const PrepareArguments *arguments)
{
    StatusCode worst = STATUS_OK;
    for (int i = 0; i < arguments->file_count; i++) {
        Status status = {0};
        announce(arguments->file[i], arguments->choice);
        if (check_units(arguments, arguments->file[i], &status) &&
            check_mesh(arguments, arguments->file[i], &status))
            continue;
        fflush(stdout);
        fprintf(stderr, "%s\n", status.text);
        worst = status.code > worst ? status.code : worst;
    }
    return (int)worst;
}

// --- a proposal ---

// Returns the unit of a mesh: asks if it is in doubt and a user can answer, else prints it.
static double find_units(const char *path, double extent)
{
    char line[64];
    // A guess in doubt is asked about, where somebody can answer.
    Units units = units_guess(path, extent);
    for (int tries = 0; units.doubt && isatty(STDIN_FILENO) && isatty(STDERR_FILENO) && tries < 3;
         tries++) {
        fprintf(stderr, "%s: %s.\nIts unit (m, dm, cm, mm, um) [%s]: ", path, units.reason,
                units.name);
        if (fgets(line, sizeof line, stdin) == NULL)
            break;
        line[strcspn(line, " \r\n")] = '\0';
        if (line[0] == '\0' || units_parse(line, &units.scale))
            return units.scale;
    }
    // Else it is said which unit was taken.
    printf("%s: %s%s\n", path, units.reason,
           units.doubt ? "; if that is wrong, --units m, dm, cm, mm or um" : "");
    return units.scale;
}

static bool find_scale(const PrepareArguments *arguments, double *scale, Status *status)
{
    const char *path = arguments->file[0];
    *scale = arguments->scale > 0.0 ? arguments->scale : 1.0;
    if (arguments->scale > 0.0 || proposal_is_volume(path))
        return true;
    TriMesh mesh;
    MeshImport import;
    if (!mesh_import(path, &mesh, &import, status))
        return false;
    *scale = find_units(path, mesh_extent(&mesh));
    mesh_destroy(&mesh);
    return true;
}

// Returns the name of a file in a scene: without the folder if both are in the same one.
static char *name_from(const char *scene, const char *path)
{
    // A file beside the scene is named without its folder, so that both can be moved.
    char *file = realpath(path, NULL), *folder = strdup(scene), *place;
    if (file == NULL || folder == NULL)
        abort();
    char *slash = strrchr(folder, '/');
    if (slash != NULL)
        slash[slash == folder] = '\0';
    place = realpath(slash != NULL ? folder : ".", NULL);
    const size_t length = place != NULL ? strlen(place) : 0;
    if (length > 1 && strncmp(file, place, length) == 0 && file[length] == '/' &&
        strchr(file + length + 1, '/') == NULL)
        memmove(file, file + length + 1, strlen(file + length + 1) + 1);
    free(folder);
    free(place);
    return file;
}

// Opens a new file; never replaces a user's file. NULL with a status.
static FILE *open_new(const char *path, Status *status)
{
    int descriptor = open(path, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    FILE *out = descriptor >= 0 ? fdopen(descriptor, "w") : NULL;
    if (out == NULL)
        status_fail(status, errno == EEXIST ? STATUS_INVALID : STATUS_FAILED, "%s: %s%s", path,
                    strerror(errno), errno == EEXIST ? ": give it a name of its own" : "");
    return out;
}

static bool close_new(FILE *out, const char *path, Status *status)
{
    const bool failed = ferror(out) != 0;
    return (fclose(out) == 0 && !failed) ||
           status_fail(status, STATUS_FAILED, "%s: not all could be written", path);
}

static bool write_proposal(Proposal *proposal, const PrepareArguments *arguments, Status *status)
{
    const char *path = arguments->output;
    FILE *out = open_new(path, status);
    if (arguments->cuttable >= 0) {
        proposal->whole = arguments->cuttable == 0;
        proposal->chosen = true;
    }
    if (out == NULL)
        return false;
    char *name = name_from(path, proposal->path);
    proposal_write(proposal, name, out);
    free(name);
    return close_new(out, path, status);
}

static bool write_mesh(const TriMesh *mesh, const char *remark, const char *path, Status *status)
{
    FILE *out = open_new(path, status);
    if (out == NULL)
        return false;
    off_write(mesh, remark, out);
    return close_new(out, path, status);
}

static int repair(const PrepareArguments *arguments)
{
    Status status = {0};
    TriMesh mesh;
    MeshImport import;
    const MeshMending mending = {.weld = arguments->weld, .miscounted = true};
    // Import repairs it; the result goes to a new file.
    if (mesh_import_mending(arguments->file[0], &mending, &mesh, &import, &status)) {
        char repairs[512];
        mesh_repairs_text(&import.repairs, repairs, sizeof repairs);
        if (write_mesh(&mesh, "", arguments->output, &status))
            printf("%s: %d nodes, %d triangles; repairs: %s\n", arguments->output, mesh.node_count,
                   mesh.triangle_count, repairs[0] != '\0' ? repairs : "none");
        if (import.remarks[0] != '\0')
            printf("%s: note: %s\n", arguments->file[0], import.remarks);
        mesh_destroy(&mesh);
    }
    return arguments_exit(&status);
}

static int even(const PrepareArguments *arguments)
{
    Status status = {0};
    TriMesh mesh;
    double scale;
    const char *path = arguments->file[0];
    if (find_scale(arguments, &scale, &status) &&
        proposal_even(path, scale, arguments->choice, &mesh, &status)) {
        if (write_mesh(&mesh, "# units: m\n", arguments->output, &status))
            printf("%s: %d nodes, %d triangles, in metres; encloses %.4g cm3\n", arguments->output,
                   mesh.node_count, mesh.triangle_count, 1e6 * mesh_volume(&mesh));
        mesh_destroy(&mesh);
    }
    return arguments_exit(&status);
}

// Asks for one of several labels, where a user can answer; without an answer the largest is taken.
static void ask_label(PrepareArguments *arguments)
{
#ifdef PLIANT_WITH_VOXEL
    enum { SHOWN = 20 };
    static char line[VOLUME_NAME + 2];
    const char *path = arguments->file[0];
    LabelVolume volume;
    VolumeLabels list;
    Status ignored = {0};
    if (arguments->choice.label != NULL || !isatty(STDIN_FILENO) || !isatty(STDERR_FILENO) ||
        !proposal_is_volume(path) ||
        !volume_survey(path, arguments->choice.layer, &volume, &list, &ignored))
        return;
    for (int i = 0; i < list.count && i < SHOWN && list.count > 1; i++)
        fprintf(stderr, "  %d %s: %ld voxels\n", list.label[i].label, list.label[i].name,
                list.label[i].voxels);
    if (list.count > 1) {
        fprintf(stderr, "%s: %d labels. Number or name [%d]: ", path, list.count,
                list.label[0].label);
        if (fgets(line, sizeof line, stdin) != NULL)
            line[strcspn(line, "\r\n")] = '\0';
        arguments->choice.label = line[0] != '\0' ? line : NULL;
    }
    volume_labels_destroy(&list);
    volume_destroy(&volume);
#else
    (void)arguments;
#endif
}

// Says which of several labels was taken.
static void print_taken(const Proposals *all, LabelChoice choice)
{
    if (all->subject.volume)
        printf("  label: %d%s of %d (--check lists them, --label chooses)\n", all->subject.label,
               choice.label == NULL ? ", the largest" : "", all->labels.count);
    if (all->frame.notes[0] != '\0')
        printf("  assumed: %s\n", all->frame.notes);
}

static const char *const WAYS[] = {"wall", "wall full of a fluid", "solid"};

// Says what else it could be, since no file says whether an organ is hollow.
static void print_others(const Proposals *all, int chosen, const char *path)
{
    for (int i = 0; i < PROPOSAL_WAYS; i++)
        if (i != chosen && all->verdict[i].usable)
            printf("  or --model %s: a %s, %s\n", proposal_way_name((ProposalWay)i), WAYS[i],
                   proposal_use(all, (ProposalWay)i));
    if (all->hollow[0] != '\0' && !all->verdict[WAY_WALL].usable)
        printf("  %s: if it is hollow, pliant-prepare --even %s makes a skin for a wall\n",
               all->hollow, path);
}

static int propose(PrepareArguments *arguments)
{
    Status status = {0};
    Proposals proposals = {0};
    double scale;
    const char *path = arguments->file[0], *why = "as chosen";
    ask_label(arguments);
    announce(path, arguments->choice);
    // Try all ways; the best one, or the one that was asked for, becomes the scene.
    if (check_units(arguments, path, &status) && find_scale(arguments, &scale, &status) &&
        proposal_judge(path, scale, arguments->choice, &proposals, &status)) {
        print_taken(&proposals, arguments->choice);
        const int way = arguments->way < 0 ? proposal_best(&proposals, &why) : arguments->way;
        Verdict *best = way < 0 ? NULL : &proposals.verdict[way];
        proposal_print(&proposals, stdout);
        if (best == NULL || !best->usable)
            status_fail(&status, STATUS_INVALID, "%s: cannot be used as a %s", path,
                        best == NULL ? "wall or a solid" : WAYS[way]);
        else if (write_proposal(&best->proposal, arguments, &status)) {
            printf("%s: a scene with it as a %s\n  %s; that is %s\n", arguments->output, WAYS[way],
                   why, proposal_use(&proposals, (ProposalWay)way));
            print_others(&proposals, way, path);
        }
    }
    proposals_destroy(&proposals);
    return arguments_exit(&status);
}

static int prepare(const PrepareArguments *arguments)
{
    Status status = {0};
    Scene scene = {0};
    log_set_level(LOG_INFO); // reports repairs
    if (scene_read(arguments->file[0], &scene, &status))
        prepared_write(arguments->output, &scene, stdout, &status);
    scene_destroy(&scene);
    return arguments_exit(&status);
}

int main(int argc, char **argv)
{
    log_set_program("pliant-prepare");
    log_set_level(LOG_ERROR); // the report has all that matters
    PrepareArguments arguments = {
        .way = -1, .cuttable = -1, .file = calloc((size_t)argc + 1, sizeof *arguments.file)};
    if (arguments.file == NULL)
        return STATUS_FAILED;
    Status status = {0};
    int code;
    // The one job that was asked for.
    if (!arguments_parse(&TABLE, argc, argv, &arguments, &status))
        code = arguments_exit(&status);
    else
        code = arguments.check     ? check_meshes(&arguments)
               : arguments.propose ? propose(&arguments)
               : arguments.repair  ? repair(&arguments)
               : arguments.even    ? even(&arguments)
                                   : prepare(&arguments);
    free(arguments.file);
    return fflush(stdout) == 0 ? code : STATUS_FAILED;
}
