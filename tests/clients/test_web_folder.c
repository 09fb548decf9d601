// SPDX-License-Identifier: MIT
// The folders of the workbench: no name leads out of them, and meshes that come in pieces are
// bounded.
#include "folder.h"
#include "test.h"
#include "scratch_folder.h"

#include <sys/stat.h>
#include <sys/wait.h>

static Folder folder;
static PliantError why;

static int begin(void **state)
{
    (void)state;
    return scratch_create(&scratch_space) == 0 &&
                   folder_open(&folder, scratch_space.folder, false, &why)
               ? 0
               : -1;
}

static int end(void **state)
{
    (void)state;
    folder_close(&folder);
    scratch_destroy(&scratch_space);
    return 0;
}

AROUND_EACH(begin, end)

TEST(names_that_could_lead_elsewhere_are_none)
{
    char longest[FOLDER_NAME_MAX + 1];
    memset(longest, 'a', sizeof longest);
    strcpy(longest + FOLDER_NAME_MAX - 4, ".cfg");
    const char *const no[] = {"",
                              ".cfg",
                              "..",
                              "../organ.cfg",
                              "/etc/organ.cfg",
                              "a/organ.cfg",
                              "a\\organ.cfg",
                              ".organ.cfg",
                              "-organ.cfg",
                              "--check.cfg",
                              "organ.cfg\n",
                              "or\"gan.cfg",
                              "organ.cfg/",
                              "organ.cfg.",
                              "organ",
                              "organ.stl",
                              "\xc3\xb6rgan.cfg",
                              longest};
    for (size_t k = 0; k < sizeof no / sizeof *no; k++) {
        if (folder_name_valid(no[k], FOLDER_SCENES) ||
            folder_has(&folder, no[k], FOLDER_SCENES, NULL))
            fail_msg("'%s' is a name", no[k]);
    }
    assert_true(folder_name_valid("my organ (2).cfg", FOLDER_SCENES));
    assert_true(folder_name_valid(longest + 1, FOLDER_SCENES));
    assert_true(folder_name_valid("a..b.CFG", FOLDER_SCENES));
}

TEST(links_and_folders_are_no_files)
{
    scratch_write(&scratch_space, "one.cfg", "# One.\n", 7);
    assert_int_equal(symlink("/etc/passwd", scratch_at("away.cfg")), 0);
    assert_int_equal(symlink("one.cfg", scratch_at("near.cfg")), 0);
    assert_int_equal(mkdir(scratch_at("folder.cfg"), 0700), 0);
    assert_int_equal(mkfifo(scratch_at("pipe.cfg"), 0600), 0);
    static FolderList list;
    folder_list(&folder, FOLDER_SCENES, true, &list);
    assert_int_equal(list.count, 1);
    assert_string_equal(list.file[0].name, "one.cfg");
    assert_int_equal(list.file[0].bytes, 7);
    static const char *const no[] = {"away.cfg", "near.cfg", "folder.cfg", "pipe.cfg", "none.cfg"};
    for (size_t k = 0; k < sizeof no / sizeof *no; k++)
        assert_int_equal(folder_read(&folder, no[k], FOLDER_SCENES), -1);
    int fd = folder_read(&folder, "one.cfg", FOLDER_SCENES);
    assert_true(fd >= 0);
    close(fd);
}

TEST(a_scene_is_described_by_the_sentence_that_it_begins_with)
{
    static const char *const texts[][2] = {
        {"# A ball: it falls.\nname = \"a\";\n", "A ball"},
        {"# Two lines that\n# are one. Not this.\n", "Two lines that are one."},
        {"# As Choi et al. (2005), Fig. 8, and\n# Kim et al.\n# 2007. No more.\n",
         "As Choi et al. (2005), Fig. 8, and Kim et al. 2007."},
        {"# A ball.\nbodies = ();\n", "A ball."},
        {"bodies = ();\n# later\n", ""},
        {"# tab\tand \x1b[31m\n", "tab and  [31m"},
        {"#", ""},
        {"", ""}};
    static FolderList list;
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
        scratch_write(&scratch_space, "a.cfg", texts[k][0], strlen(texts[k][0]));
        folder_list(&folder, FOLDER_SCENES, true, &list);
        assert_int_equal(list.count, 1);
        assert_string_equal(list.file[0].about, texts[k][1]);
    }
}

TEST(no_more_files_are_listed_than_there_is_place_for)
{
    static FolderList list;
    for (int k = 0; k < FOLDER_FILES_MAX + 3; k++) {
        char name[32];
        snprintf(name, sizeof name, "%03d.stl", k);
        scratch_write(&scratch_space, name, "x", 1);
    }
    folder_list(&folder, FOLDER_MESHES, false, &list);
    assert_int_equal(list.count, FOLDER_FILES_MAX);
    assert_int_equal(list.more, 3);
    int meshes;
    scratch_write(&scratch_space, "a.cfg", "xy", 2);
    assert_int_equal(folder_bytes(&folder, FOLDER_MESHES, &meshes), FOLDER_FILES_MAX + 5);
    assert_int_equal(meshes, FOLDER_FILES_MAX + 3);
}

TEST(any_name_of_a_mesh_becomes_a_valid_one)
{
    char longest[3000], name[FOLDER_NAME_MAX];
    memset(longest, 'x', sizeof longest);
    strcpy(longest + sizeof longest - 8, ".nii.gz");
    const char *const texts[][2] = {{"organ.stl", "organ.stl"},
                                    {"../../organ.stl", "organ.stl"},
                                    {"C:\\meshes\\organ.STL", "organ.STL"},
                                    {"my organ;rm -rf $HOME.obj", "my_organ_rm_-rf__HOME.obj"},
                                    {"-o.ply", "_o.ply"},
                                    {".hidden.ply", "_hidden.ply"},
                                    {"\xc3\xb6.off", "__.off"},
                                    {"a\nb.nrrd", "a_b.nrrd"},
                                    {"a.b.nii.gz", "a.b.nii.gz"}};
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
        assert_true(folder_name_clean(texts[k][0], FOLDER_MESHES, name, &why));
        assert_string_equal(name, texts[k][1]);
        assert_true(folder_name_valid(name, FOLDER_MESHES));
    }
    assert_true(folder_name_clean(longest, FOLDER_MESHES, name, &why));
    assert_true(folder_name_valid(name, FOLDER_MESHES));
    static const char *const no[] = {"",     "organ",  "organ.cfg", "organ.stl.sh",
                                     ".stl", "a/.stl", "a/"};
    for (size_t k = 0; k < sizeof no / sizeof *no; k++) {
        if (folder_name_clean(no[k], FOLDER_MESHES, name, &why))
            fail_msg("'%s' is a mesh", no[k]);
    }
}

static int file_count(void)
{
    static FolderList list;
    folder_list(&folder, FOLDER_MESHES, false, &list);
    return list.count;
}

TEST(a_mesh_appears_when_it_is_complete_and_replaces_none)
{
    Upload upload;
    for (int k = 1; k <= 3; k++) {
        assert_true(upload_begin(&upload, &folder, "a.stl", 8, &why));
        assert_true(upload_add(&upload, "soli", 4, &why));
        assert_true(upload_add(&upload, "d", 1, &why));
        assert_int_equal(file_count(), k - 1);
        assert_true(upload_finish(&upload, &why));
        assert_int_equal(file_count(), k);
    }
    assert_string_equal(upload.name, "a-3.stl");
    size_t size = 0;
    FREED unsigned char *data = scratch_read(&scratch_space, "a-3.stl", &size);
    assert_string_equal((char *)data, "solid");
    assert_int_equal(folder_bytes(&folder, FOLDER_MESHES, &(int){0}), 15); // nothing hidden is left
}

TEST(a_link_in_the_place_of_a_mesh_is_not_written_through)
{
    Upload upload;
    scratch_write(&scratch_space, "precious", "old", 3);
    assert_int_equal(symlink("precious", scratch_at("a.stl")), 0);
    assert_true(upload_begin(&upload, &folder, "a.stl", 8, &why));
    assert_true(upload_add(&upload, "new", 3, &why));
    assert_true(upload_finish(&upload, &why));
    assert_string_equal(upload.name, "a-2.stl");
    size_t size = 0;
    FREED unsigned char *data = scratch_read(&scratch_space, "precious", &size);
    assert_string_equal((char *)data, "old");
}

TEST(a_mesh_that_is_too_large_empty_or_broken_off_leaves_nothing)
{
    Upload upload;
    assert_true(upload_begin(&upload, &folder, "a.stl", 8, &why));
    assert_true(upload_add(&upload, "12345678", 8, &why));
    assert_false(upload_add(&upload, "9", 1, &why));
    upload_drop(&upload);
    assert_true(upload_begin(&upload, &folder, "a.stl", 8, &why));
    assert_false(upload_finish(&upload, &why)); // empty
    upload_drop(&upload);
    upload_drop(&upload); // again: without effect
    assert_int_equal(folder_bytes(&folder, FOLDER_MESHES, &(int){0}), 0);
    assert_int_equal(file_count(), 0);
}

TEST(what_killed_servers_left_is_removed_and_nothing_else)
{
    char gone[32], runs[32], path[SCRATCH_PATH];
    pid_t pid = fork();
    if (pid == 0)
        _exit(0);
    waitpid(pid, NULL, 0);
    snprintf(gone, sizeof gone, ".upload-%d", (int)pid);
    snprintf(runs, sizeof runs, ".upload-%d", (int)getpid());
    const char *const kept[] = {runs, ".upload-", ".upload-1x", ".upload", "a.stl"};
    scratch_write(&scratch_space, gone, "x", 1);
    for (size_t k = 0; k < sizeof kept / sizeof *kept; k++)
        scratch_write(&scratch_space, kept[k], "x", 1);
    upload_sweep(&folder);
    assert_int_equal(access(scratch_path(&scratch_space, gone, path), F_OK), -1);
    for (size_t k = 0; k < sizeof kept / sizeof *kept; k++)
        assert_int_equal(access(scratch_path(&scratch_space, kept[k], path), F_OK), 0);
}
