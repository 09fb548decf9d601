// SPDX-License-Identifier: MIT
// The workbench: programs that are run for pages.
#include "workbench.h"
#include "texts.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

const int64_t WORKBENCH_MESH_BYTES = 256 << 20, WORKBENCH_UPLOADS_BYTES = (int64_t)4 << 30;

static const int64_t LOOK_NS = 1000000000, LIST_NS = 10000000000; // between two looks and lists
// A status that was sent before the daemon ended may be read after its end.
static const int64_t LAST_STATUS_NS = 300000000;
static const double PREPARE_S = 120.0;
// To end, for programs that first write what they have: a checkpoint, a recording.
static const double WRITE_S = 60.0;
// Of bodies that stand still the last bits of coordinates change: nobody sees a micrometre.
static const char RECORD_STILL_M[] = "1e-6";
// Sanitizers reserve all of the address space.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
static const int64_t PREPARE_BYTES = 0;
#else
static const int64_t PREPARE_BYTES = (int64_t)4 << 30;
#endif

enum { ARGUMENTS_MAX = 24 };

// --- begin and end ---

// Finds a program beside this one; "" if it is not there.
static void find_beside(const char *name, char path[FOLDER_PATH_MAX])
{
    char folder[FOLDER_PATH_MAX];
    if (!folder_of_program(folder) ||
        snprintf(path, FOLDER_PATH_MAX, "%s/%s", folder, name) >= FOLDER_PATH_MAX ||
        access(path, X_OK) != 0)
        path[0] = '\0';
}

// Opens a folder that files are put into. A failure is reported where it is needed.
static void open_own(Folder *folder, const char *given, const Folder *scenes, const char *name)
{
    char path[FOLDER_PATH_MAX + 16];
    PliantError why;
    snprintf(path, sizeof path, "%s/%s", scenes->path, name);
    if (!folder_open(folder, given ? given : path, true, &why))
        fprintf(stderr, "pliant-web: no %s: %s\n", name, why.text);
}

bool workbench_open(Workbench *workbench, const WorkbenchOptions *options, Board *board,
                    PliantError *error)
{
    *workbench = (Workbench){.board = board};
    pthread_mutex_init(&workbench->lock, NULL);
    for (int k = 0; k < 3; k++)
        workbench->folder[k].fd = -1;
    // The programs.
    find_beside("pliantd", workbench->program[PLIANTD]);
    find_beside("pliant-play", workbench->program[PLIANT_PLAY]);
    find_beside("pliant-prepare", workbench->program[PLIANT_PREPARE]);
    find_beside("pliant-record", workbench->program[PLIANT_RECORD]);
    if (options->pliantd && !realpath(options->pliantd, workbench->program[PLIANTD]))
        return client_fail(error, "--pliantd %s: %s", options->pliantd, strerror(errno));
    if (!workbench->program[PLIANTD][0])
        return client_fail(error, "--scenes: there is no pliantd beside pliant-web (--pliantd)");
    // The network of this program, also where a scene names another: the page would not see it.
    Network network;
    char why[RECEIVER_WHY_MAX];
    if (!network_read(&network, options->url, why))
        return client_fail(error, "%s", why);
    snprintf(workbench->url, sizeof workbench->url, "%s", network.url);
    snprintf(workbench->prefix, sizeof workbench->prefix, "%s", options->prefix);
    snprintf(workbench->input_prefix, sizeof workbench->input_prefix, "%s",
             options->input_prefix ? options->input_prefix : options->prefix);
    // The folders.
    PliantError text;
    if (!folder_open(&workbench->folder[ASK_SCENES], options->scenes, false, &text))
        return client_fail(error, "--scenes %s", text.text);
    const Folder *scenes = &workbench->folder[ASK_SCENES];
    open_own(&workbench->folder[ASK_UPLOADS], options->uploads, scenes, "uploads");
    open_own(&workbench->folder[ASK_RECORDINGS], options->recordings, scenes, "recordings");
    upload_sweep(&workbench->folder[ASK_UPLOADS]);
    signal(SIGCHLD, SIG_DFL); // else, where a parent ignores it, ends are not reported
    return true;
}

void workbench_close(Workbench *workbench)
{
    WorkbenchJob *jobs[] = {&workbench->recorder, &workbench->prepare, &workbench->daemon};
    // The recorder first: it writes what it has while the daemon ends.
    for (int k = 0; k < 3; k++)
        child_stop(&jobs[k]->child, client_now_ns());
    for (int k = 0; k < 3; k++)
        child_end(&jobs[k]->child);
    for (int k = 0; k < 3; k++)
        folder_close(&workbench->folder[k]);
    pthread_mutex_destroy(&workbench->lock);
}

// --- running programs ---

typedef struct Arguments {
    const char *word[ARGUMENTS_MAX];
    int count;
} Arguments;

static void add(Arguments *arguments, const char *word)
{
    arguments->word[arguments->count++] = word;
}

// Adds "--name", "value"; nothing without a value.
static void add_option(Arguments *arguments, const char *name, const char *value)
{
    if (!value)
        return;
    add(arguments, name);
    add(arguments, value);
}

static bool run(const Workbench *workbench, WorkbenchJob *job, Program program,
                const Arguments *arguments, const ChildOptions *options, PliantError *error)
{
    static const char *const names[] = {"pliantd", "pliant-play", "pliant-prepare",
                                        "pliant-record"};
    if (!workbench->program[program][0])
        return client_fail(error, "%s is not installed here", names[program]);
    return child_start(&job->child, arguments->word, options, error);
}

// --- scenes ---

static const char *const *endings_of(AskFolder folder)
{
    return folder == ASK_RECORDINGS ? FOLDER_RECORDINGS : FOLDER_SCENES;
}

static bool start_scene(Workbench *workbench, const Ask *ask, PliantError *error)
{
    WorkbenchJob *job = &workbench->daemon;
    const Folder *folder = &workbench->folder[ask->folder];
    if (!folder_has(folder, ask->text, endings_of(ask->folder), NULL))
        return client_fail(error, "'%s' is no %s of the list", ask->text,
                           ask->folder == ASK_RECORDINGS ? "recording" : "scene");
    Program program = ask->folder == ASK_RECORDINGS ? PLIANT_PLAY : PLIANTD;
    Arguments arguments = {{workbench->program[program]}, 1};
    add_option(&arguments, "--lcm-url", workbench->url);
    add_option(&arguments, "--prefix", workbench->prefix);
    add(&arguments, ask->text);
    if (!run(workbench, job, program, &arguments,
             &(ChildOptions){.folder = folder->path, .patience_s = WRITE_S}, error))
        return false;
    job->folder = ask->folder;
    folder_copy_name(job->file, ask->text);
    return true;
}

// True if a daemon runs that was not started here. If it is missed, because it is silent, pliantd
// itself finds out.
static bool is_foreign(const Workbench *workbench, const WorkbenchHeard *heard)
{
    const Child *child = &workbench->daemon.child;
    return child->pid == 0 && heard->linked && heard->status_ns > child->ended_ns + LAST_STATUS_NS;
}

static bool refuse_foreign(const Workbench *workbench, const WorkbenchHeard *heard,
                           PliantError *error)
{
    return client_fail(error,
                       "a pliantd that was not started here runs on %s (scene '%s'): end it where "
                       "it was started",
                       workbench->prefix, heard->scene);
}

static bool take_start(Workbench *workbench, const WorkbenchAsk *from, const WorkbenchHeard *heard,
                       PliantError *error)
{
    Child *child = &workbench->daemon.child;
    if (is_foreign(workbench, heard))
        return refuse_foreign(workbench, heard, error);
    if (child->pid == 0)
        return start_scene(workbench, &from->ask, error);
    // Another one runs: it ends first.
    if (!folder_has(&workbench->folder[from->ask.folder], from->ask.text,
                    endings_of(from->ask.folder), NULL))
        return client_fail(error, "'%s' is not in the list", from->ask.text);
    child_stop(child, client_now_ns());
    workbench->next = *from;
    return true;
}

static bool take_end(Workbench *workbench, const WorkbenchHeard *heard, PliantError *error)
{
    Child *child = &workbench->daemon.child;
    workbench->next = (WorkbenchAsk){0};
    if (is_foreign(workbench, heard))
        return refuse_foreign(workbench, heard, error);
    if (child->pid == 0)
        return client_fail(error, "nothing runs that was started here");
    child_stop(child, client_now_ns());
    return true;
}

// --- recording ---

static bool begin_recording(Workbench *workbench, const WorkbenchHeard *heard, PliantError *error)
{
    WorkbenchJob *job = &workbench->recorder;
    const Folder *folder = &workbench->folder[ASK_RECORDINGS];
    if (job->child.pid != 0)
        return client_fail(error, "%s is being recorded already", job->file);
    if (folder->fd < 0)
        return client_fail(error, "there is no folder for recordings (see --recordings)");
    if (!heard->linked)
        return client_fail(error, "no daemon runs: there is nothing to record");
    // "stomach-20260131-101500.h5"
    char wanted[FOLDER_NAME_MAX], when[32];
    time_t now = time(NULL);
    struct tm local;
    if (!localtime_r(&now, &local) || strftime(when, sizeof when, "%Y%m%d-%H%M%S", &local) == 0)
        return client_fail(error, "the clock gives no date");
    char scene[41];
    snprintf(scene, sizeof scene, "%.40s", heard->scene[0] ? heard->scene : "session");
    for (char *c = scene; *c; c++)
        *c = (char)(is_name_character(*c) && *c != '-' ? *c : '_');
    snprintf(wanted, sizeof wanted, "%s-%s.h5", scene, when);
    if (!folder_free_name(folder, wanted, FOLDER_RECORDINGS, job->file, error))
        return false;
    Arguments arguments = {{workbench->program[PLIANT_RECORD]}, 1};
    add_option(&arguments, "--lcm-url", workbench->url);
    add_option(&arguments, "--prefix", workbench->prefix);
    add_option(&arguments, "--input-prefix", workbench->input_prefix);
    add_option(&arguments, "--output", job->file);
    add_option(&arguments, "--still", RECORD_STILL_M);
    return run(workbench, job, PLIANT_RECORD, &arguments,
               &(ChildOptions){.folder = folder->path, .patience_s = WRITE_S}, error);
}

static bool take_record(Workbench *workbench, const Ask *ask, const WorkbenchHeard *heard,
                        PliantError *error)
{
    Child *child = &workbench->recorder.child;
    if (ask->record)
        return begin_recording(workbench, heard, error);
    if (child->pid == 0)
        return client_fail(error, "nothing is being recorded");
    child_stop(child, client_now_ns());
    return true;
}

// --- a scene for a mesh ---

// Adds "--name", "7", written to `text`; nothing for 0.
static void add_count(Arguments *arguments, const char *name, int32_t count, char text[16])
{
    snprintf(text, 16, "%d", (int)count);
    add_option(arguments, name, count > 0 ? text : NULL);
}

static bool run_prepare(Workbench *workbench, Arguments *arguments, PliantError *error)
{
    char label[16], layer[16];
    const ChildOptions options = {.folder = workbench->folder[ASK_UPLOADS].path,
                                  .seconds = PREPARE_S,
                                  .memory_bytes = PREPARE_BYTES,
                                  .gentle = true};
    add_option(arguments, "--units", workbench->asked.propose.units);
    if (workbench->asked.propose.together)
        add_option(arguments, "--label", "all");
    else
        add_count(arguments, "--label", workbench->asked.propose.label, label);
    add_count(arguments, "--layer", workbench->asked.propose.layer, layer);
    return run(workbench, &workbench->prepare, PLIANT_PREPARE, arguments, &options, error);
}

static bool check(Workbench *workbench, PliantError *error)
{
    Arguments arguments = {{workbench->program[PLIANT_PREPARE]}, 1};
    workbench->step = CHECK;
    add(&arguments, "--check");
    add(&arguments, "--json");
    add(&arguments, workbench->prepare.file);
    return run_prepare(workbench, &arguments, error);
}

// Names what is made of a mesh: its name with another ending.
static bool name_making(Workbench *workbench, const char *ending, const char *const *endings,
                        PliantError *error)
{
    char wanted[FOLDER_NAME_MAX];
    const char *file = workbench->prepare.file;
    const int stem = folder_stem(file, FOLDER_MESHES), room = FOLDER_NAME_MAX - 16;
    snprintf(wanted, sizeof wanted, "%.*s%s", stem < room ? stem : room, file, ending);
    return folder_free_name(&workbench->folder[ASK_UPLOADS], wanted, endings, workbench->making,
                            error);
}

static bool make_even(Workbench *workbench, PliantError *error)
{
    int meshes = 0;
    folder_bytes(&workbench->folder[ASK_UPLOADS], FOLDER_MESHES, &meshes);
    if (meshes >= FOLDER_FILES_MAX)
        return client_fail(error, "there are %d meshes: remove some", meshes);
    if (!name_making(workbench, "-even.off", FOLDER_MESHES, error))
        return false;
    Arguments arguments = {{workbench->program[PLIANT_PREPARE]}, 1};
    workbench->step = EVEN;
    add(&arguments, "--even");
    add(&arguments, workbench->prepare.file);
    add_option(&arguments, "--output", workbench->making);
    return run_prepare(workbench, &arguments, error);
}

static bool take_propose(Workbench *workbench, const Ask *ask, PliantError *error)
{
    WorkbenchJob *job = &workbench->prepare;
    if (job->child.pid != 0)
        return client_fail(error, "a proposal for %s is being made", job->file);
    if (!folder_has(&workbench->folder[ASK_UPLOADS], ask->text, FOLDER_MESHES, NULL))
        return client_fail(error, "'%s' is no mesh of the list", ask->text);
    folder_copy_name(job->file, ask->text);
    workbench->asked = *ask;
    if (!ask->propose.even) // else what is known of the mesh is still true
        workbench->check[0] = '\0';
    return ask->propose.even ? make_even(workbench, error) : check(workbench, error);
}

// What was made of another mesh is checked like one that was sent.
static bool take_even(Workbench *workbench, PliantError *error)
{
    workbench->scene[0] = workbench->scene_text[0] = '\0';
    if (workbench->prepare.child.status != 0) // it says why
        return true;
    folder_copy_name(workbench->prepare.file, workbench->making);
    workbench->check[0] = '\0';
    workbench->asked.propose.label = workbench->asked.propose.layer = 0;
    workbench->asked.propose.together = false;
    workbench->asked.propose.units = "m"; // as its first lines say
    return check(workbench, error);
}

// After its check, whatever that says: the refusal of a proposal says more.
static bool propose(Workbench *workbench, PliantError *error)
{
    WorkbenchJob *job = &workbench->prepare;
    snprintf(workbench->check, sizeof workbench->check, "%s", job->child.text);
    workbench->step = PROPOSE;
    workbench->scene[0] = workbench->scene_text[0] = '\0';
    if (!name_making(workbench, ".cfg", FOLDER_SCENES, error))
        return false;
    Arguments arguments = {{workbench->program[PLIANT_PREPARE]}, 1};
    add(&arguments, "--propose");
    add(&arguments, job->file);
    add_option(&arguments, "--output", workbench->making);
    add_option(&arguments, "--model", workbench->asked.propose.model);
    add_option(&arguments, "--cuttable", workbench->asked.propose.cuttable);
    return run_prepare(workbench, &arguments, error);
}

// Gives a new scene the place of the last one for the same mesh, unless that has been changed.
static bool replace_last(Workbench *workbench, const Folder *folder)
{
    const FolderFile *last = &workbench->last;
    FolderFile now;
    return strcmp(workbench->last_mesh, workbench->prepare.file) == 0 &&
           folder_has(folder, last->name, FOLDER_SCENES, &now) && now.bytes == last->bytes &&
           now.utime == last->utime &&
           renameat(folder->fd, workbench->making, folder->fd, last->name) == 0;
}

static void read_proposal(Workbench *workbench)
{
    Child *child = &workbench->prepare.child;
    const Folder *folder = &workbench->folder[ASK_UPLOADS];
    if (child->status != 0) // it says why
        return;
    folder_copy_name(workbench->scene, workbench->making);
    if (replace_last(workbench, folder)) {
        folder_copy_name(workbench->scene, workbench->last.name);
        // Its last line has the name that is no more.
        char *line = strstr(child->text, workbench->making);
        if (line)
            *line = '\0';
    }
    int fd = folder_read(folder, workbench->scene, FOLDER_SCENES);
    ssize_t size = fd < 0 ? 0 : read(fd, workbench->scene_text, WORKBENCH_CFG_MAX - 1);
    if (fd >= 0)
        close(fd);
    workbench->scene_text[size > 0 ? size : 0] = '\0';
    // What is replaced next time.
    bool there = folder_has(folder, workbench->scene, FOLDER_SCENES, &workbench->last);
    folder_copy_name(workbench->last_mesh, there ? workbench->prepare.file : "");
}

// --- each turn ---

bool workbench_ask(Workbench *workbench, int32_t sender, const Ask *ask)
{
    pthread_mutex_lock(&workbench->lock);
    bool fits = workbench->waiting < WORKBENCH_QUEUE;
    if (fits)
        workbench->queue[workbench->waiting++] = (WorkbenchAsk){sender, *ask};
    pthread_mutex_unlock(&workbench->lock);
    return fits;
}

static bool take(Workbench *workbench, const WorkbenchAsk *from, const WorkbenchHeard *heard,
                 PliantError *error)
{
    switch (from->ask.kind) {
    case ASK_START:
        return take_start(workbench, from, heard, error);
    case ASK_END:
        return take_end(workbench, heard, error);
    case ASK_RECORD:
        return take_record(workbench, &from->ask, heard, error);
    case ASK_PROPOSE:
        return take_propose(workbench, &from->ask, error);
    default:
        return true;
    }
}

static void answer(Workbench *workbench, const WorkbenchAsk *from, bool ok,
                   const PliantError *error)
{
    if (!ok)
        board_send(workbench->board, from->sender, text_error(from->ask.id, error->text));
}

// Returns whether there were any.
static bool take_asks(Workbench *workbench, const WorkbenchHeard *heard)
{
    WorkbenchAsk queue[WORKBENCH_QUEUE];
    pthread_mutex_lock(&workbench->lock);
    int count = workbench->waiting;
    memcpy(queue, workbench->queue, (size_t)count * sizeof *queue);
    workbench->waiting = 0;
    pthread_mutex_unlock(&workbench->lock);
    for (int k = 0; k < count; k++) {
        PliantError error = {0};
        answer(workbench, &queue[k], take(workbench, &queue[k], heard, &error), &error);
    }
    return count > 0;
}

// Returns whether a program has ended.
static bool watch(Workbench *workbench, int64_t now_ns)
{
    PliantError error = {0};
    // What waited for the end of the daemon may start.
    bool news = child_turn(&workbench->daemon.child, now_ns);
    if (news && workbench->next.sender != 0) {
        WorkbenchAsk next = workbench->next;
        workbench->next = (WorkbenchAsk){0};
        answer(workbench, &next, start_scene(workbench, &next.ask, &error), &error);
    }
    if (child_turn(&workbench->recorder.child, now_ns))
        news = true;
    if (child_turn(&workbench->prepare.child, now_ns)) {
        news = true;
        if (workbench->step == PROPOSE)
            read_proposal(workbench);
        else if (!(workbench->step == EVEN ? take_even : propose)(workbench, &error))
            board_send_all(workbench->board, text_error(0, error.text));
    }
    return news;
}

static void list_folders(Workbench *workbench, int64_t now_ns)
{
    const Folder *folder = workbench->folder;
    workbench->listed_ns = now_ns;
    for (int k = 0; k < 3; k++)
        workbench->changed_ns[k] = folder_changed_ns(&folder[k]);
    folder_list(&folder[ASK_SCENES], FOLDER_SCENES, true, &workbench->scenes);
    folder_list(&folder[ASK_UPLOADS], FOLDER_SCENES, true, &workbench->uploaded);
    folder_list(&folder[ASK_UPLOADS], FOLDER_MESHES, false, &workbench->meshes);
    folder_list(&folder[ASK_RECORDINGS], FOLDER_RECORDINGS, false, &workbench->recordings);
}

// True if files came or went, or may have grown: then the folders are read. In a folder of
// thousands that takes so long that the live view would notice it each second.
static bool folders_changed(const Workbench *workbench, int64_t now_ns)
{
    bool changed = workbench->recorder.child.pid != 0 || workbench->prepare.child.pid != 0 ||
                   now_ns - workbench->listed_ns >= LIST_NS;
    for (int k = 0; k < 3; k++)
        changed |= folder_changed_ns(&workbench->folder[k]) != workbench->changed_ns[k];
    return changed;
}

static WorkbenchRun run_of(const WorkbenchJob *job, char how[CHILD_HOW_MAX])
{
    const Child *child = &job->child;
    child_how(child, how);
    // Asked so early that it could not catch the signal, it has done what it was asked to.
    const bool obeyed =
        child->asked && WIFSIGNALED(child->status) && WTERMSIG(child->status) == SIGTERM;
    return (WorkbenchRun){.file = job->file,
                          .runs = child->pid != 0,
                          .asked = child->asked,
                          .over = child->over,
                          .failed = child->over && child->status != 0 && !obeyed,
                          .how = how,
                          .text = child->text};
}

static void show(Workbench *workbench)
{
    char how[3][CHILD_HOW_MAX];
    const WorkbenchText text = {
        .scenes = &workbench->scenes,
        .uploaded = &workbench->uploaded,
        .meshes = &workbench->meshes,
        .recordings = &workbench->recordings,
        .plays = workbench->program[PLIANT_PLAY][0] != '\0',
        .foreign = workbench->foreign,
        .upload_bytes = WORKBENCH_MESH_BYTES,
        .daemon = run_of(&workbench->daemon, how[0]),
        .folder = workbench->daemon.folder,
        .recorder = run_of(&workbench->recorder, how[1]),
        .prepare = run_of(&workbench->prepare, how[2]),
        .check = workbench->check,
        .scene = workbench->scene,
        .scene_text = workbench->scene_text,
    };
    Parcel *parcel = text_workbench(&text);
    // Only this thread changes the slot.
    if (parcel_equal(parcel, workbench->board->slot[BOARD_WORKBENCH].parcel))
        parcel_drop(parcel);
    else
        board_set(workbench->board, BOARD_WORKBENCH, parcel);
}

void workbench_turn(Workbench *workbench, const WorkbenchHeard *heard, int64_t now_ns)
{
    bool asked = take_asks(workbench, heard), ended = watch(workbench, now_ns);
    bool foreign = is_foreign(workbench, heard);
    bool news = asked || ended || foreign != workbench->foreign || workbench->looked_ns == 0;
    // Folders change without notice, as a recording grows.
    if (!news && now_ns - workbench->looked_ns < LOOK_NS)
        return;
    if (board_pages(workbench->board) == 0) {
        workbench->looked_ns = 0; // the first page gets what there is then
        return;
    }
    workbench->foreign = foreign;
    workbench->looked_ns = now_ns;
    if (news || folders_changed(workbench, now_ns))
        list_folders(workbench, now_ns);
    show(workbench);
}
