// SPDX-License-Identifier: MIT
// A disk that fills up while the daemon runs: a recording, checkpoints and the log of inputs end
// with an event and exit status 1, what was written stays whole, the simulation goes on. The disk
// is a small tmpfs that only this test sees.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "figure.h"
#include "recording_view.h"

#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>

static char disk[PATH_TEXT];

static int mount_disk(void **state)
{
    (void)state;
    snprintf(disk, sizeof disk, "%s", scratch("disk"));
    if (unshare(CLONE_NEWNS) != 0 || mount(NULL, "/", NULL, MS_REC | MS_PRIVATE, NULL) != 0 ||
        mkdir(disk, 0700) != 0 || mount("none", disk, "tmpfs", 0, "size=2m") != 0)
        test_skip_program("a file system of our own is not permitted here");
    return 0;
}

static int unmount_disk(void **state)
{
    (void)state;
    return umount(disk);
}

static const char *on_disk(const char *name)
{
    static char path[4][PATH_TEXT + 64];
    static int next;
    char *text = path[next++ % 4];
    snprintf(text, sizeof path[0], "%s/%s", disk, name);
    return text;
}

// Takes all of the disk but `left` bytes.
static void fill_disk(const char *name, long left)
{
    enum { PIECE = 4096 };
    static const char nothing[PIECE];
    const char *path = on_disk(name);
    int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    assert_true(fd >= 0);
    off_t size = 0;
    while (write(fd, nothing, sizeof nothing) == (ssize_t)sizeof nothing)
        size += PIECE;
    assert_int_equal(errno, ENOSPC);
    assert_int_equal(ftruncate(fd, size > left ? size - left : 0), 0);
    close(fd);
}

static int files_on_disk(const char *but)
{
    char command[PATH_TEXT + 128], text[32] = "";
    snprintf(command, sizeof command, "ls -A %s | grep -vcx '%s'", disk, but);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    assert_non_null(fgets(text, sizeof text, pipe));
    pclose(pipe);
    return atoi(text);
}

static void expect_running(Client *client)
{
    int64_t step = client->status.step;
    wait_until(client, client->status.step > step + 50);
}

static int end(Client *client, Process *daemon)
{
    process_finish(daemon, SIGTERM);
    client_destroy(client);
    return daemon->code;
}

// On a busy machine frames are dropped too, which is reported under the same kind.
static bool saw_end(const Client *client, const char *kind)
{
    for (int i = 0; i < client->events; i++)
        if (strcmp(client->event[i].kind, kind) == 0 && strstr(client->event[i].text, "ends"))
            return true;
    return false;
}

AROUND_ALL(mount_disk, unmount_disk)

TEST(a_full_disk_ends_the_recording_whole)
{
    const char *path = on_disk("full.h5");
    Client *client = client_create();
    // It falls: what stands still takes no room.
    daemon_start(&pliantd, "--record %s %s", path,
                 write_scene("record.cfg",
                             "gravity = [0.0, 0.0, -1.0];"
                             "publish = { nodes_hz = 1000.0; status_hz = 20.0; };",
                             ""));
    client_wait_for_daemon(client);
    wait_until(client, client->status.step > 200);
    fill_disk("ballast", 0);
    wait_until(client, saw_end(client, "recording"));
    expect_running(client);
    wait_until(client, refused(client, "frames_not_recorded") > 0);
    assert_int_equal(end(client, &pliantd), 1);
    expect_in(pliantd.err, "full.h5");
    expect_in(pliantd.err, strerror(ENOSPC));
    SCOPED(view_free) BodyView view;
    view_read(&view, path, "sphere");
    expect_at_least(view.frames, 100.0);
    figure("disk full while recording: event, exit status 1, %d frames whole, %lld more simulated",
           view.frames, printed(&pliantd, "step") - view.frames);
    unlink(on_disk("ballast"));
    unlink(path);
    unlink(on_disk("full.h5.xdmf"));
}

TEST(a_full_disk_leaves_the_last_checkpoint_whole)
{
    char path[PATH_TEXT + 64];
    snprintf(path, sizeof path, "%s", on_disk("kept.h5"));
    const char *scene =
        write_scene("checkpoint.cfg", "rate_hz = 500.0; publish = { status_hz = 20.0; };", "");
    Process daemon, resumed;
    Client *client = server_start(&daemon, "--checkpoint %s %s", path, scene);
    const Reply *reply = command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, "");
    assert_true(reply->ok);
    int64_t step = reply->step;
    fill_disk("ballast", 8192); // space for a beginning
    reply = command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, "");
    assert_false(reply->ok);
    expect_in(reply->text, "kept.h5");
    expect_running(client);
    // The one before is whole, and no half-written file is left.
    assert_int_equal(files_on_disk("ballast"), 1);
    run_daemon_well(&resumed, "--offline 0 --resume %s %s", path, scene);
    assert_int_equal(printed(&resumed, "step"), step);
    // There is space again: checkpoints are written.
    unlink(on_disk("ballast"));
    reply = command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, "");
    assert_true(reply->ok);
    fill_disk("ballast", 8192);
    assert_int_equal(end(client, &daemon), 1); // the one at the end could not be written
    expect_in(daemon.err, "kept.h5");
    unlink(on_disk("ballast"));
    run_daemon_well(&resumed, "--offline 0 --resume %s %s", path, scene);
    expect_at_least((double)printed(&resumed, "step"), (double)step + 50.0);
    figure("disk full while writing a checkpoint: reply and event say so, the one before is whole");
    unlink(path);
}

TEST(a_full_disk_ends_the_log_of_inputs_with_status_1)
{
    const char *path = on_disk("inputs.log");
    Client *client = client_create();
    daemon_start(&pliantd, "--log-inputs %s %s", path,
                 write_scene("inputs.cfg",
                             "rate_hz = 500.0; publish = { status_hz = 20.0; contact_hz = 0.0; };",
                             PROBE_TOOL));
    client_wait_for_daemon(client);
    fill_disk("ballast", 16384);
    for (double limit = client_now() + 30.0; !saw_end(client, "inputs") && client_now() < limit;) {
        send_pose_at(client, (const double[]){0.0, 0.0, 0.2});
        client_listen(client, 1);
    }
    assert_true(saw_end(client, "inputs"));
    expect_running(client);
    assert_int_equal(end(client, &pliantd), 1);
    expect_in(pliantd.err, "inputs.log");
    figure("disk full while logging inputs: event, exit status 1, the simulation goes on");
    unlink(on_disk("ballast"));
    unlink(path);
}
