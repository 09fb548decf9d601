// SPDX-License-Identifier: MIT
// Files that were made to hurt: bytes anywhere in a checkpoint, a prepared file, an initial state
// or a recording are changed, and what had a seal is sealed again. HDF5's library may fail on them;
// the program that reads them does not: it ends with an exit status of its own. How many of each
// kind: PLIANT_DAMAGES in the environment.
#include "test.h"
#include "scene_writer.h"

#include "effort.h"
#include "random.h"

#include "base/fnv.h"

#include <hdf5.h>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>

enum { SEAL = 512, FILE_MOST = 1 << 20 };

typedef struct Bytes {
    unsigned char at[FILE_MOST];
    size_t size;
} Bytes;

static void read_bytes(const char *path, Bytes *bytes)
{
    FREED unsigned char *data = file_read(path, &bytes->size);
    assert_true(bytes->size > SEAL && bytes->size < sizeof bytes->at);
    memcpy(bytes->at, data, bytes->size);
}

// A byte, a word or a stretch; most of HDF5's own tables lie in the first kilobytes.
static void change(Bytes *bytes, size_t from, uint64_t *chance)
{
    static const unsigned char strange[] = {0x00, 0x01, 0x7f, 0x80, 0xfe, 0xff};
    const int changes = 1 + random_below(chance, 4);
    for (int i = 0; i < changes; i++) {
        const bool early = random_below(chance, 2) == 0;
        size_t range = bytes->size - from;
        range = early && range > 8192 ? 8192 : range;
        size_t at = from + (size_t)random_below(chance, (int)range);
        size_t length = (size_t[]){1, 1, 2, 4, 8, 32}[random_below(chance, 6)];
        const bool random = random_below(chance, 2) == 0;
        const unsigned char value = strange[random_below(chance, sizeof strange)];
        for (size_t k = at; k < at + length && k < bytes->size; k++)
            bytes->at[k] = random ? (unsigned char)random_bits(chance) : value;
    }
}

typedef struct Kind {
    const char *name;
    bool sealed;
    const char *arguments; // of the daemon; NULL: --info of the recorder
    int known;             // a change on which HDF5 1.10.8 fails; 0: none
} Kind;

static const Kind kinds[] = {
    {"checkpoint", true, "--offline 0.003 --resume %s %s", 0},
    {"prepared", true, "--offline 0.003 --prepared %s %s", 0},
    {"initial", false, "--offline 0.003 %.0s%s", 705}, // the scene names it
    {"recording", false, NULL, 0},
};
enum { KINDS = sizeof kinds / sizeof kinds[0] };

static void make_initial(const char *path)
{
    static double row[SPHERE_NODES][3];
    const hsize_t size[2] = {SPHERE_NODES, 3};
    hid_t file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    hid_t space = H5Screate_simple(2, size, NULL);
    for (int v = 0; v < 2; v++) {
        hid_t set = H5Dcreate2(file, v ? "velocity" : "position", H5T_NATIVE_DOUBLE, space,
                               H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        assert_true(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, row) >= 0);
        H5Dclose(set);
    }
    H5Sclose(space);
    H5Fclose(file);
}

// The four files as they should be, called by their kind, and two scenes.
static void make_bases(char scene[PATH_TEXT * 2], char with_initial[PATH_TEXT * 2])
{
    Process daemon;
    snprintf(scene, PATH_TEXT * 2, "%s", write_scene("base.cfg", "", PROBE_TOOL));
    snprintf(with_initial, PATH_TEXT * 2, "%s", scratch("initial.cfg"));
    char text[2048];
    snprintf(text, sizeof text,
             "bodies = ( { name = \"sphere\"; initial = \"%s\";\n"
             "  mesh = { generator = \"ico_sphere\"; nodes = %d; radius = 0.05; }; } );",
             scratch("changed.h5"), SPHERE_NODES);
    write_text(with_initial, text);
    run_daemon_well(&daemon, "--offline 0.05 --checkpoint %s --record %s %s", scratch("checkpoint"),
                    scratch("recording"), scene);
    process_run_well(&daemon, program_path("pliant-prepare"), "-o %s %s", scratch("prepared"),
                     scene);
    make_initial(scratch("initial"));
}

static void read_changed(Process *daemon, const Kind *kind, const char *path, const char *scene)
{
    if (kind->arguments == NULL) {
        process_run(daemon, program_path("pliant-record"), "--info %s", path);
        return;
    }
    char line[4096];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    snprintf(line, sizeof line, kind->arguments, path, scene);
#pragma GCC diagnostic pop
    run_daemon(daemon, "%s", line);
}

static int quiet_hdf5(void **state)
{
    (void)state;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return 0;
}

AROUND_ALL(quiet_hdf5, NULL)

TEST(no_damage_brings_a_reader_down)
{
    static Bytes base, changed;
    const char *text = getenv("PLIANT_DAMAGES");
    const int count = text != NULL ? atoi(text) : EFFORT(60);
    char scene[PATH_TEXT * 2], with_initial[PATH_TEXT * 2];
    make_bases(scene, with_initial);
    const char *path = scratch("changed.h5");
    print_message("%-11s %6s %8s %5s %6s\n", "kind", "taken", "refused", "HDF5", "signal");
    for (int k = 0; k < KINDS; k++) {
        const Kind *kind = &kinds[k];
        int taken = 0, refused = 0, failed = 0, signals = 0;
        read_bytes(scratch(kind->name), &base);
        for (int i = 0; i < count; i++) {
            const int number = i == 0 ? kind->known : i;
            uint64_t chance = UINT64_C(0x9e3779b97f4a7c15) * (uint64_t)(number + 1) + (uint64_t)k;
            memcpy(&changed, &base, sizeof base);
            change(&changed, kind->sealed ? SEAL : 0, &chance);
            if (kind->sealed)
                seal_bytes(changed.at, changed.size);
            file_write(path, changed.at, changed.size);
            read_changed(&pliantd, kind, path, k == 2 ? with_initial : scene);
            taken += pliantd.code == 0;
            refused += pliantd.code == 1 || pliantd.code == 2;
            signals += pliantd.code >= 1000;
            failed += strstr(pliantd.err, ": HDF5 ") != NULL;
            if (pliantd.code >= 1000)
                print_error("%s, change %d: signal %d\n", kind->name, number, pliantd.code - 1000);
        }
        print_message("%-11s %6d %8d %5d %6d\n", kind->name, taken, refused, failed, signals);
        assert_int_equal(signals, 0);
        assert_int_equal(taken + refused, count);
    }
}

// Fifteen terabytes of holes, with events all the way.
TEST(a_recording_of_holes_is_told_of_in_no_time)
{
    const char *path = scratch("holes.h5");
    const char *scene = write_scene("holes.cfg", "", "");
    run_daemon_well(&pliantd, "--offline 0.05 --record %s %s", path, scene);
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    hid_t events = H5Dopen2(file, "/events", H5P_DEFAULT);
    const hsize_t rows = UINT64_C(15) << 32;
    assert_true(H5Dset_extent(events, &rows) >= 0);
    H5Dclose(events);
    H5Fclose(file);
    if (truncate(path, (off_t)15 << 40) != 0) {
        print_message("skipped: no file of 15 TB here\n");
        skip();
    }
    // As the shell's ulimit would: what is read must fit into it. A sanitizer's own memory does
    // not.
    struct rlimit before, tight;
    assert_int_equal(getrlimit(RLIMIT_DATA, &before), 0);
    tight = before;
    if (EFFORT(60) == 60)
        tight.rlim_cur = (rlim_t)1 << 31;
    assert_int_equal(setrlimit(RLIMIT_DATA, &tight), 0);
    process_run(&pliantd, program_path("pliant-record"), "--info %s",
                path); // within the bound of process_wait
    assert_int_equal(setrlimit(RLIMIT_DATA, &before), 0);
    if (pliantd.code != 0 && pliantd.code != 2)
        fail_msg("exit %d: %s", pliantd.code, pliantd.err);
    unlink(path);

    // And one that says so in its seal.
    static Bytes sealed;
    run_daemon_well(&pliantd, "--offline 0.05 --checkpoint %s %s", path, scene);
    read_bytes(path, &sealed);
    memset(sealed.at, 0, SEAL);
    snprintf((char *)sealed.at, SEAL, "pliant: %zu bytes follow, fnv1a %016x\n",
             ((size_t)15 << 40) - SEAL, 0u);
    file_write(path, sealed.at, sealed.size);
    assert_int_equal(truncate(path, (off_t)15 << 40), 0);
    run_daemon(&pliantd, "--offline 0 --resume %s %s", path, scene);
    assert_int_equal(pliantd.code, 2);
    unlink(path);
}
