// pliant-prepare: looks at mesh files before a scene uses them, and makes the meshes and levels of
// a scene once, so that daemons start without.
#include "base/log.h"
#include "files/mesh_report.h"
#include "files/prepared.h"

#include <argp.h>
#include <stdlib.h>
#include <string.h>

enum { OPTION_CHECK = 256, OPTION_SCALE, OPTION_USAGE };

typedef struct Arguments {
    char **file; // [file_count] meshes or scene of the command line, in its order
    int file_count;
    const char *output;
    double scale; // 0: not given
    bool check, help, usage, version;
    int parsed; // arguments that were understood, for the message about the one that was not
    Status status;
} Arguments;

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
    {"version", 'V', 0, 0, "Print the version, exit", 3},
    {"help", '?', 0, 0, "Print this list, exit", 3},
    {"usage", OPTION_USAGE, 0, 0, "Print the options in short, exit", 3},
    {0}};

static void parse_scale(Arguments *arguments, const char *text)
{
    const double most = 1e6; // as a scene allows
    char *end;
    arguments->scale = strtod(text, &end);
    if (end == text || *end != '\0' || !(arguments->scale > 0.0 && arguments->scale <= most))
        status_fail(&arguments->status, STATUS_INVALID,
                    "pliant-prepare: --scale '%s' is not a number in (0, %g]", text, most);
}

static error_t parse_option(int key, char *text, struct argp_state *state)
{
    Arguments *a = state->input;
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
    case 'V':
        a->version = true;
        break;
    case '?':
        a->help = true;
        break;
    case OPTION_USAGE:
        a->usage = true;
        break;
    case ARGP_KEY_INIT:
    case ARGP_KEY_SUCCESS:
    case ARGP_KEY_END:
    case ARGP_KEY_FINI:
    case ARGP_KEY_NO_ARGS:
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    a->parsed = state->next;
    return 0;
}

static void check_together(Arguments *a)
{
    Status *status = &a->status;
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

// argp's own errors take two lines and an exit code of their own; told to leave them, it prints no
// help either.
static void parse_arguments(int argc, char **argv, Arguments *arguments)
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
    arguments->parsed = 1;
    if (argp_parse(&argp, argc, argv, ARGP_IN_ORDER | ARGP_NO_ERRS | ARGP_NO_HELP, NULL,
                   arguments) != 0)
        status_fail(&arguments->status, STATUS_INVALID,
                    "pliant-prepare: '%s' is no option or lacks its value (see pliant-prepare "
                    "--help)",
                    arguments->parsed < argc ? argv[arguments->parsed] : "?");
    char name[] = "pliant-prepare";
    if (arguments->help || arguments->usage)
        argp_help(&argp, stdout,
                  arguments->help ? ARGP_HELP_SHORT_USAGE | ARGP_HELP_LONG | ARGP_HELP_DOC
                                  : ARGP_HELP_USAGE,
                  name);
    else if (arguments->version)
        puts("pliant-prepare " PLIANT_VERSION);
    else
        check_together(arguments);
}

// Every mesh is looked at, also behind one that is not usable.
static StatusCode check_meshes(const Arguments *arguments)
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

static StatusCode prepare(const Arguments *arguments)
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
    Arguments arguments = {.file = calloc((size_t)argc + 1, sizeof *arguments.file)};
    if (arguments.file == NULL)
        return STATUS_FAILED;
    parse_arguments(argc, argv, &arguments);
    StatusCode code = arguments.status.code;
    if (code != STATUS_OK)
        fprintf(stderr, "%s\n", arguments.status.text);
    else if (!arguments.help && !arguments.usage && !arguments.version)
        code = arguments.check ? check_meshes(&arguments) : prepare(&arguments);
    free(arguments.file);
    return fflush(stdout) == 0 ? (int)code : STATUS_FAILED;
}
