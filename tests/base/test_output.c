// SPDX-License-Identifier: MIT
// Names of successive outputs, and temporaries that another writer holds.
#include "test.h"
#include "scratch.h"

#include "base/output.h"

#include <sys/stat.h>
#include <unistd.h>

static Scratch scratch_space;

static int make_folder(void **state)
{
    (void)state;
    return scratch_create(&scratch_space);
}

static int remove_folder(void **state)
{
    (void)state;
    scratch_destroy(&scratch_space);
    return 0;
}

static void expect_next(const char *name, const char *next)
{
    char path[SCRATCH_PATH], expected[SCRATCH_PATH];
    char *found = output_next(scratch_path(&scratch_space, name, path));
    assert_string_equal(found, scratch_path(&scratch_space, next, expected));
    free(found);
}

AROUND_ALL(make_folder, remove_folder)

TEST(the_next_output_is_one_above_the_highest_number)
{
    expect_next("run.h5", "run.h5");
    scratch_write(&scratch_space, "run.h5", "", 0);
    expect_next("run.h5", "run.h5"); // empty: nothing to lose
    scratch_write(&scratch_space, "run.h5", "x", 1);
    expect_next("run.h5", "run-2.h5");
    scratch_write(&scratch_space, "run-9.h5", "", 0);
    expect_next("run.h5", "run-10.h5"); // a gap is not filled: numbers tell the order
    static const char *const others[] = {"run-11.log", "run-012x.h5", "run-1.h5", "other-30.h5",
                                         "run--40.h5"};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++)
        scratch_write(&scratch_space, others[i], "x", 1);
    expect_next("run.h5", "run-10.h5");
    char path[SCRATCH_PATH];
    unlink(scratch_path(&scratch_space, "run.h5", path));
    expect_next("run.h5", "run-10.h5");

    scratch_write(&scratch_space, "plain", "x", 1);
    expect_next("plain", "plain-2");
    scratch_write(&scratch_space, ".hidden", "x", 1);
    expect_next(".hidden", ".hidden-2");
    char *device = output_next("/dev/null");
    assert_string_equal(device, "/dev/null");
    free(device);
}

TEST(one_writer_at_a_time_has_the_temporary)
{
    char path[SCRATCH_PATH];
    struct stat facts;
    Output first, second;
    Status status = {0};
    scratch_path(&scratch_space, "shared", path);
    assert_true(output_begin(&first, path, "mark", &status));
    assert_false(output_begin(&second, path, "mark", &status));
    assert_non_null(strstr(status.text, "shared: Device or resource busy"));
    status = (Status){0};
    assert_true(output_write(&first, "mark 1", 6));
    assert_true(output_commit(&first, true, &status));
    assert_true(output_begin(&second, path, "mark", &status));
    output_abandon(&second);
    assert_int_equal(stat(path, &facts), 0);
    assert_int_equal(facts.st_size, 6);
    // What a killed writer left is used again, and nothing else of that name.
    scratch_write(&scratch_space, "shared.tmp", "mar", 3);
    assert_true(output_begin(&second, path, "mark", &status));
    output_abandon(&second);
    scratch_write(&scratch_space, "shared.tmp", "mine", 4);
    assert_false(output_begin(&second, path, "mark", &status));
    assert_non_null(strstr(status.text, "shared.tmp: is in the way"));
}

static void write_claimed(OutputClaim *claim, const char *text)
{
    Output output;
    Status status = {0};
    assert_true(output_begin_claimed(&output, claim, &status));
    assert_true(output_write(&output, text, strlen(text)));
    assert_true(output_commit(&output, false, &status));
}

static void expect_claimed(const char *path, bool claimed)
{
    OutputClaim other;
    Status status = {0};
    assert_int_equal(output_claim(&other, path, "mark", &status), !claimed);
    assert_int_equal(status.code, claimed ? STATUS_INVALID : STATUS_OK);
    if (claimed)
        assert_non_null(strstr(status.text, path));
    output_release(&other);
}

TEST(a_claim_holds_before_between_and_after_what_is_written)
{
    char path[SCRATCH_PATH], temporary[SCRATCH_PATH];
    scratch_path(&scratch_space, "claimed.h5", path);
    scratch_path(&scratch_space, "claimed.h5.tmp", temporary);
    OutputClaim claim;
    Output output;
    Status status = {0};
    assert_true(output_claim(&claim, path, "mark", &status));
    expect_claimed(path, true);
    assert_int_not_equal(access(path, F_OK), 0);
    // What could not be written leaves it as it was.
    assert_true(output_begin_claimed(&output, &claim, &status));
    assert_true(output_write(&output, "half", 4));
    expect_claimed(path, true);
    output_abandon(&output);
    for (int i = 0; i < 3; i++) {
        expect_claimed(path, true);
        write_claimed(&claim, i == 0 ? "mark 1" : "mark");
        assert_int_not_equal(access(temporary, F_OK), 0);
    }
    expect_claimed(path, true);
    output_release(&claim);
    expect_claimed(path, false);
    struct stat facts;
    assert_int_equal(stat(path, &facts), 0);
    assert_int_equal(facts.st_size, 4);
}

TEST(a_claim_of_what_was_never_written_leaves_nothing)
{
    char path[SCRATCH_PATH], temporary[SCRATCH_PATH];
    scratch_path(&scratch_space, "nothing.h5", path);
    scratch_path(&scratch_space, "nothing.h5.tmp", temporary);
    OutputClaim claim;
    Status status = {0};
    assert_true(output_claim(&claim, path, "mark", &status));
    output_release(&claim);
    assert_int_not_equal(access(path, F_OK), 0);
    assert_int_not_equal(access(temporary, F_OK), 0);
    // A device is everybody's.
    assert_true(output_claim(&claim, "/dev/null", "mark", &status));
    expect_claimed("/dev/null", false);
    write_claimed(&claim, "mark");
    output_release(&claim);
}

// Somebody removed it, or put another one there: what is there then is claimed, or left to another.
TEST(a_claim_is_made_again_for_what_took_its_place)
{
    char path[SCRATCH_PATH], temporary[SCRATCH_PATH], other[SCRATCH_PATH];
    scratch_path(&scratch_space, "moved.h5", path);
    scratch_path(&scratch_space, "moved.h5.tmp", temporary);
    scratch_path(&scratch_space, "other.h5", other);
    OutputClaim claim, second;
    Output output;
    Status status = {0};
    assert_true(output_claim(&claim, path, "mark", &status));
    assert_int_equal(unlink(temporary), 0);
    write_claimed(&claim, "mark");
    expect_claimed(path, true);
    assert_int_equal(unlink(path), 0);
    write_claimed(&claim, "mark");
    expect_claimed(path, true);
    scratch_write(&scratch_space, "other.h5", "mark", 4);
    assert_int_equal(rename(other, path), 0);
    write_claimed(&claim, "mark");
    expect_claimed(path, true);

    assert_int_equal(unlink(path), 0);
    assert_true(output_claim(&second, path, "mark", &status));
    assert_false(output_begin_claimed(&output, &claim, &status));
    write_claimed(&second, "mark");
    status = (Status){0};
    assert_false(output_begin_claimed(&output, &claim, &status));
    output_release(&second);
    output_release(&claim);
}
