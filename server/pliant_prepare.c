// pliant-prepare: looks at mesh files before a scene uses them, and makes the meshes and levels of
// a scene once, so that daemons start without.
#include "arguments.h"

#include "base/log.h"
#include "files/mesh_report.h"
#include "files/prepared.h"

#include <stdlib.h>
#include <string.h>

enum { OPTION_CHECK = ARGUMENT_OWN, OPTION_SCALE };

typedef struct PrepareArguments {
    Arguments common;
    char **file; // [file_count] meshes or scene of the command line, in its order
    int file_count;
    const char *output;
    double scale; // 0: not given
    bool check;
} PrepareArguments;

static const struct argp_option options[] = {
    {"check", OPTION_CHECK, 0, 0,
     "Report on each MESH (OBJ, STL, PLY, OFF): what was repaired, components, quality of the "
     "triangles, the stable time step it allows",
     1},
    {"scale", OPTION_SCALE, "S", 0, "Metres a unit of the files; 0.001 for millimetres", 1},
    {"output", 'o', "FILE", 0,
     "Make the meshes and levels of all bodies of SCENE.cfg and write them to FILE (HDF5), for "
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

static bool parse_own(int key, char *text, void *arguments)
{
    PrepareArguments *a = arguments;
    switch (key) {
    case OPTION_CHECK:
        a->check = true;
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
    if (a->file_count == 0)
        status_fail(status, STATUS_INVALID,
                    "pliant-prepare: no %s given (see pliant-prepare --help)",
                    a->output != NULL ? "scene" : "mesh");
    if (a->check == (a->output != NULL))
        status_fail(status, STATUS_INVALID,
                    "pliant-prepare: needs either --check MESH... or SCENE.cfg -o FILE (see "
                    "pliant-prepare --help)");
    if (a->output != NULL && a->scale > 0.0)
        status_fail(status, STATUS_INVALID,
                    "pliant-prepare: --scale goes with --check: a scene "
                    "has its own");
    if (a->output != NULL && a->file_count > 1)
        status_fail(status, STATUS_INVALID,
                    "pliant-prepare: one scene at a time, got '%s' and '%s'", a->file[0],
                    a->file[1]);
}

static void parse_arguments(int argc, char **argv, PrepareArguments *arguments)
{
    static const struct argp argp = {
        options,
        parse_option,
        "--check MESH...\nSCENE.cfg -o FILE",
        "Says what a mesh file holds and whether a scene can use it, or does for a scene what "
        "needs "
        "to be done once.\v"
        "Exit code 0: every mesh is usable, the file is written; 1: it cannot be written; 2: bad "
        "usage, scene or mesh.",
        NULL,
        NULL,
        NULL};
    if (arguments_parse(&arguments->common, &argp, argc, argv))
        check_together(arguments);
}

// Every mesh is looked at, also behind one that is not usable.
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

static StatusCode prepare(const PrepareArguments *arguments)
{
    Status status = {0};
    Scene scene = {0};
    log_set_level(LOG_INFO); // of repairs
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
    log_set_level(LOG_ERROR); // the report says what matters
    PrepareArguments arguments = {.common.program = "pliant-prepare",
                                  .file = calloc((size_t)argc + 1, sizeof *arguments.file)};
    if (arguments.file == NULL)
        return STATUS_FAILED;
    parse_arguments(argc, argv, &arguments);
    StatusCode code = arguments.common.status.code;
    if (code != STATUS_OK)
        fprintf(stderr, "%s\n", arguments.common.status.text);
    else if (!arguments_only_print(&arguments.common))
        code = arguments.check ? check_meshes(&arguments) : prepare(&arguments);
    free(arguments.file);
    return fflush(stdout) == 0 ? (int)code : STATUS_FAILED;
}
