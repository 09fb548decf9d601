// SPDX-License-Identifier: MIT
// pliant-tie: makes, changes and releases a tie of a running scene, and prints the reply, which
// names the tie. One thread.
#include "program.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { IDS = 16 }; // of one tie

typedef struct Options {
    PliantOptions client;
    PliantTieKind kind;  // 0: none is made
    int change, release; // numbers; 0: not asked for
    int number, tool;
    double at[3]; // x NaN: not given
    double radius, stiffness, damping_ratio, break_force;
    int32_t node[IDS];
    int node_count;
    const char *body, *to;
    double timeout_s;
    int tries;
} Options;

static bool take_kind(void *target, const char *text, Status *why)
{
    static const char *const KINDS[] = {[PLIANT_PIN] = "pin",
                                        [PLIANT_TIE] = "tie",
                                        [PLIANT_CLIP] = "clip",
                                        [PLIANT_CARRY] = "carry"};
    Options *options = target;
    for (int k = PLIANT_PIN; k <= PLIANT_CARRY; k++)
        if (strcmp(text, KINDS[k]) == 0)
            options->kind = (PliantTieKind)k;
    return options->kind > 0 ||
           status_fail(why, STATUS_INVALID, "is none of pin, tie, clip and carry");
}

static bool take_nodes(void *target, const char *text, Status *why)
{
    Options *options = target;
    // Numbers between commas.
    for (const char *at = text;; at++) {
        char *end;
        const long id = strtol(at, &end, 10);
        if (end == at || (*end != ',' && *end != '\0') || id < 0 || id > INT32_MAX)
            return status_fail(why, STATUS_INVALID, "is no list of node ids ID,ID,...");
        if (options->node_count == IDS)
            return status_fail(why, STATUS_INVALID, "has more than %d node ids", IDS);
        options->node[options->node_count++] = (int)id;
        if (*end == '\0')
            return true;
        at = end;
    }
}

#define AT(member) offsetof(Options, member)
#define PLACES     -1e3, 1e3

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_HEADING, .help = "What to do (one of):"},
    {"make", 'm', ARGUMENT_OTHER, "KIND", .handler = take_kind,
     .help = "pin: hold nodes where they are; tie: to another body; clip: draw two walls together; "
             "carry: to a tool"},
    {"change", 'c', ARGUMENT_INTEGER, "TIE", AT(change), 1, INT32_MAX,
     .help = "give the tie of this number new springs"},
    {"release", 'r', ARGUMENT_INTEGER, "TIE", AT(release), 1, INT32_MAX,
     .help = "release the tie of this number"},
    {.type = ARGUMENT_HEADING, .help = "What to tie to what (--make):"},
    {"body", 'b', ARGUMENT_NAME, "NAME", AT(body), .help = "the body (default: the only one)"},
    {"at", 'a', ARGUMENT_NUMBERS, "X,Y,Z", AT(at), PLACES,
     .help = "centre of a ball whose nodes are tied [m]"},
    {"radius", 'R', ARGUMENT_NUMBER, "M", AT(radius), 1e-6, 1e3, .preset = 0.01,
     .help = "its radius"},
    {"nodes", 'i', ARGUMENT_OTHER, "ID,ID,...", .handler = take_nodes,
     .help = "instead: these nodes, at most 16"},
    {"to", 'o', ARGUMENT_NAME, "NAME", AT(to),
     .help = "the other body, of a tie; of a clip, unless both walls are of one body"},
    {"tool", 't', ARGUMENT_INTEGER, "ID", AT(tool), INT32_MIN, INT32_MAX, .preset = 1,
     .help = "the tool that carries"},
    {"number", 'n', ARGUMENT_INTEGER, "TIE", AT(number), 0, INT32_MAX,
     .preset_text = "the lowest free one",
     .help = "the number by which it is changed and released"},
    {.type = ARGUMENT_HEADING, .help = "Its springs (--make, --change):"},
    {"stiffness", 'k', ARGUMENT_NUMBER, "G", AT(stiffness), 0.0, 4.0, .open = true, .preset = 0.3,
     .help = "as a share of the body's own stiffness"},
    {"damping-ratio", 'z', ARGUMENT_NUMBER, "ZETA", AT(damping_ratio), 0.0, 2.0, .preset = 0.5,
     .help = "with the tied masses; 1 is critical"},
    {"break-force", 'f', ARGUMENT_NUMBER, "N", AT(break_force), 0.0, 1e6,
     .help = "the tie ends when it pulls harder; 0: never"},
    {.type = ARGUMENT_HEADING, .help = "Where:"},
    {"timeout", 'T', ARGUMENT_NUMBER, "S", AT(timeout_s), 0.01, 3600.0, .preset = 0.5,
     .help = "repeat a request when no reply arrives within this time"},
    {"tries", 'N', ARGUMENT_INTEGER, "N", AT(tries), 1, 1000, .preset = 6,
     .help = "send a request at most N times"},
    {.type = ARGUMENT_ROWS, .rows = PROGRAM_WHERE, .offset = AT(client)},
    {0}};

static bool check(void *target, Status *why)
{
    const Options *options = target;
    if ((options->kind > 0) + (options->change > 0) + (options->release > 0) != 1)
        return status_fail(why, STATUS_INVALID, "give one of --make, --change and --release");
    if (options->kind == 0)
        return true;
    if (isnan(options->at[0]) == (options->node_count == 0))
        return status_fail(why, STATUS_INVALID, "--make needs one of --at and --nodes");
    return options->kind != PLIANT_TIE || options->to != NULL ||
           status_fail(why, STATUS_INVALID, "--make tie needs --to NAME");
}

static const ArgumentTable TABLE = {
    .program = "pliant-tie",
    .about = "Ties tissue of a running pliantd, whose scene has max_ties, and prints the tie.",
    .end = "Exit status: 0 done, 1 refused or no reply arrived, 2 bad usage.",
    .rows = ROWS,
    .check = check};

static bool send_tie(PliantClient *client, const Options *options, PliantError *error)
{
    PliantTie tie = {.kind = options->kind,
                     .body = options->body,
                     .to_body = options->to,
                     .tool = options->tool,
                     .radius = options->radius,
                     .node = options->node,
                     .node_count = options->node_count,
                     .stiffness = options->stiffness,
                     .damping_ratio = options->damping_ratio,
                     .break_force = options->break_force};
    for (int k = 0; k < 3 && !isnan(options->at[0]); k++)
        tie.center[k] = options->at[k];
    const bool ok = options->kind > 0     ? pliant_tie_as(client, options->number, &tie) > 0
                    : options->change > 0 ? pliant_tie_change(client, options->change, &tie)
                                          : pliant_tie_release(client, options->release);
    if (!ok)
        return program_fail(error, "%s", pliant_error(client));
    program_print_text(stdout, pliant_reply(client)->text, false);
    putchar('\n');
    return true;
}

int main(int argc, char **argv)
{
    Options options = {.at = {(double)NAN}};
    Status status = {0};
    if (!arguments_parse(&TABLE, argc, argv, &options, &status))
        return arguments_exit(&status);
    program_catch_signals();
    PliantError error;
    PliantClient *client = program_open(&options.client, &error);
    const double patience = options.timeout_s * options.tries;
    if (client)
        pliant_patience(client, options.timeout_s, options.tries);
    // One that was given is for the request itself.
    const bool ok = client &&
                    (patience != PROGRAM_PATIENCE_S ||
                     program_await_server(client, pliant_bind, patience, &error)) &&
                    send_tie(client, &options, &error);
    if (!ok)
        program_print_error("pliant-tie", &error);
    program_close(client);
    return ok ? 0 : 1;
}
