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

enum {
    OPTION_CHECK = ARGUMENT_OWN,
    OPTION_PROPOSE,
    OPTION_REPAIR,
    OPTION_SCALE,
    OPTION_UNITS,
    OPTION_MODEL
};

typedef struct PrepareArguments {
    Arguments common;
    char **file; // [file_count] meshes, or the scene, of the command line, in order
    int file_count;
    const char *output;
    double scale; // 0: not given
    int model;    // SceneModel to propose; -1: the better one
    bool check, propose, repair;
} PrepareArguments;

static const struct argp_option options[] = {
    {"check", OPTION_CHECK, 0, 0,
     "Report on each MESH (OBJ, STL, PLY, OFF): repairs, components, quality of the triangles, the "
     "stable time step; and whether each, or a label volume (NRRD, NIfTI), is usable as a wall "
     "(surface body) or as a solid (voxel body), and the time of a tick",
     1},
    {"propose", OPTION_PROPOSE, 0, 0,
     "Write a scene with a MESH or a label volume as its body and a probe of suitable size to a "
     "new "
     "-o FILE. At a terminal, asks for the units if they are in doubt",
     1},
    {"repair", OPTION_REPAIR, 0, 0,
     "Write a MESH, repaired and in its own units, to a new OFF file -o FILE, for other programs",
     1},
    {"units", OPTION_UNITS, "U", 0,
     "Units of the mesh files: m, dm, cm, mm or um; without it, and without --scale, they are "
     "guessed from the file's first lines or the size",
     1},
    {"scale", OPTION_SCALE, "S", 0, "Metres per unit of the files; 0.001 for millimetres", 1},
    {"model", OPTION_MODEL, "M", 0, "Model to propose: surface (a wall) or voxel (a solid)", 1},
    {"output", 'o', "FILE", 0,
     "Build the meshes and levels of all bodies of SCENE.cfg and write them to FILE (HDF5), for "
     "pliantd --prepared FILE SCENE.cfg",
     2},
    ARGUMENTS_COMMON(3),
    {0}};

static void parse_scale(PrepareArguments *arguments, const char *text)
{
    const double most = 1e6; // as a scene allows
    char *end;
    arguments->scale = strtod(text, &end);
    if (end == text || *end != '\0' || !(arguments->scale > 0.0 && arguments->scale <= most))
        status_fail(&arguments->common.status, STATUS_INVALID,
                    "pliant-prepare: --scale '%s' is not a number in (0, %g]", text, most);
}

static void parse_model(PrepareArguments *arguments, const char *text)
{
    for (arguments->model = MODEL_VOXEL; arguments->model >= 0; arguments->model--)
        if (strcmp(text, scene_model_name((SceneModel)arguments->model)) == 0)
            return;
    status_fail(&arguments->common.status, STATUS_INVALID,
                "pliant-prepare: --model '%s' is neither surface nor voxel", text);
}

static bool parse_own(int key, char *text, void *arguments)
{
    PrepareArguments *a = arguments;
    switch (key) {
    case OPTION_CHECK:
        a->check = true;
        break;
    case OPTION_PROPOSE:
        a->propose = true;
        break;
    case OPTION_REPAIR:
        a->repair = true;
        break;
    case OPTION_UNITS:
        if (!units_parse(text, &a->scale))
            status_fail(&a->common.status, STATUS_INVALID,
                        "pliant-prepare: --units '%s' is none of m, dm, cm, mm and um", text);
        break;
    case OPTION_MODEL:
        parse_model(a, text);
        break;
    case OPTION_SCALE:
        parse_scale(a, text);
        break;
    case 'o':
        a->output = text;
        break;
    case ARGP_KEY_ARG:
        a->file[a->file_count++] = text;
        break;
    default:
        return false;
    }
    return true;
}

static error_t parse_option(int key, char *text, struct argp_state *state)
{
    return arguments_parse_one(key, text, state, parse_own);
}

static void check_together(PrepareArguments *a)
{
    Status *status = &a->common.status;
    const bool judges = a->check || a->propose, mesh = judges || a->repair;
    if (a->file_count == 0)
        status_fail(status, STATUS_INVALID,
                    "pliant-prepare: no %s given (see pliant-prepare --help)",
                    a->output != NULL && !mesh ? "scene" : "mesh");
    if (a->check + a->propose + a->repair > 1 || a->check == (a->output != NULL))
        status_fail(status, STATUS_INVALID,
                    "pliant-prepare: needs either --check MESH... or SCENE.cfg -o FILE, or "
                    "--propose MESH -o SCENE.cfg, or --repair MESH -o FILE.off (see "
                    "pliant-prepare --help)");
    if (!judges && a->scale > 0.0)
        status_fail(status, STATUS_INVALID,
                    "pliant-prepare: --scale goes with --check or --propose, as --units does: a "
                    "scene has its own");
    if (!a->propose && a->model >= 0)
        status_fail(status, STATUS_INVALID, "pliant-prepare: --model goes with --propose");
    if (a->output != NULL && a->file_count > 1)
        status_fail(status, STATUS_INVALID, "pliant-prepare: one %s at a time, got '%s' and '%s'",
                    mesh ? "mesh" : "scene", a->file[0], a->file[1]);
}

static void parse_arguments(int argc, char **argv, PrepareArguments *arguments)
{
    static const struct argp argp = {
        options,
        parse_option,
        "--check MESH...\n--propose MESH -o SCENE.cfg\n--repair MESH -o FILE.off\nSCENE.cfg -o "
        "FILE",
        "Reports the contents of mesh files and whether a scene can use them, writes such a scene, "
        "or "
        "builds the meshes and levels of a scene in advance.\v"
        "Exit code 0: every mesh is usable as a wall or as a solid, the file is written; "
        "1: it cannot be written; 2: bad usage, scene or mesh; a mesh that is usable as neither.",
        NULL,
        NULL,
        NULL};
    if (arguments_parse(&arguments->common, &argp, argc, argv))
        check_together(arguments);
}

// Checks every mesh, also after one that is unusable.
static StatusCode check_meshes(const PrepareArguments *arguments)
{
    StatusCode worst = STATUS_OK;
    for (int i = 0; i < arguments->file_count; i++) {
        Status status = {0};
        if (mesh_report_print(arguments->file[i], arguments->scale, stdout, &status))
            continue;
        fflush(stdout);
        fprintf(stderr, "%s\n", status.text);
        worst = status.code > worst ? status.code : worst;
    }
    return worst;
}

// --- a proposal ---

// Returns the unit of a mesh: asks if it is in doubt and a user can answer, else prints it.
static double find_units(const char *path, double extent)
{
    char line[64];
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

static bool write_proposal(const Proposal *proposal, const char *path, Status *status)
{
    FILE *out = open_new(path, status);
    if (out == NULL)
        return false;
    char *name = name_from(path, proposal->path);
    proposal_write(proposal, name, out);
    free(name);
    return close_new(out, path, status);
}

static StatusCode repair(const PrepareArguments *arguments)
{
    Status status = {0};
    TriMesh mesh;
    MeshImport import;
    if (mesh_import(arguments->file[0], &mesh, &import, &status)) {
        char repairs[512];
        FILE *out = open_new(arguments->output, &status);
        mesh_repairs_text(&import.repairs, repairs, sizeof repairs);
        if (out != NULL)
            off_write(&mesh, out);
        if (out != NULL && close_new(out, arguments->output, &status))
            printf("%s: %d nodes, %d triangles; repairs: %s\n", arguments->output, mesh.node_count,
                   mesh.triangle_count, repairs[0] != '\0' ? repairs : "none");
        mesh_destroy(&mesh);
    }
    fflush(stdout);
    if (status.code != STATUS_OK)
        fprintf(stderr, "%s\n", status.text);
    return status.code;
}

static StatusCode propose(const PrepareArguments *arguments)
{
    Status status = {0};
    Proposals proposals;
    double scale;
    const char *path = arguments->file[0];
    if (find_scale(arguments, &scale, &status) &&
        proposal_judge(path, scale, &proposals, &status)) {
        const Verdict *best =
            arguments->model < 0 ? proposal_best(&proposals) : &proposals.verdict[arguments->model];
        proposal_print(&proposals, stdout);
        if (best == NULL || !best->usable)
            status_fail(&status, STATUS_INVALID, "%s: cannot be used as a %s", path,
                        best == NULL                      ? "wall or a solid"
                        : arguments->model == MODEL_VOXEL ? "solid"
                                                          : "wall");
        else if (write_proposal(&best->proposal, arguments->output, &status))
            printf("%s: a scene with it as a %s\n", arguments->output,
                   best->proposal.model == MODEL_SURFACE ? "wall" : "solid");
    }
    fflush(stdout);
    if (status.code != STATUS_OK)
        fprintf(stderr, "%s\n", status.text);
    return status.code;
}

static StatusCode prepare(const PrepareArguments *arguments)
{
    Status status = {0};
    Scene scene = {0};
    log_set_level(LOG_INFO); // reports repairs
    if (scene_read(arguments->file[0], &scene, &status))
        prepared_write(arguments->output, &scene, stdout, &status);
    scene_destroy(&scene);
    fflush(stdout);
    if (status.code != STATUS_OK)
        fprintf(stderr, "%s\n", status.text);
    return status.code;
}

int main(int argc, char **argv)
{
    log_set_program("pliant-prepare");
    log_set_level(LOG_ERROR); // the report has all that matters
    PrepareArguments arguments = {.common.program = "pliant-prepare",
                                  .model = -1,
                                  .file = calloc((size_t)argc + 1, sizeof *arguments.file)};
    if (arguments.file == NULL)
        return STATUS_FAILED;
    parse_arguments(argc, argv, &arguments);
    StatusCode code = arguments.common.status.code;
    if (code != STATUS_OK)
        fprintf(stderr, "%s\n", arguments.common.status.text);
    else if (!arguments_only_print(&arguments.common))
        code = arguments.check     ? check_meshes(&arguments)
               : arguments.propose ? propose(&arguments)
               : arguments.repair  ? repair(&arguments)
                                   : prepare(&arguments);
    free(arguments.file);
    return fflush(stdout) == 0 ? (int)code : STATUS_FAILED;
}
