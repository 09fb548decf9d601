// SPDX-License-Identifier: MIT
// File systems without locks: a run is recorded and saved all the same, which is said once.
#include "test.h"
#include "harness.h"
#include "scene_writer.h"
#include "recording_view.h"

#include <string.h>

TEST(without_locks_a_run_is_recorded_and_read)
{
    const char *preload = test_argument(2), *path = scratch("unlocked.h5");
    process_run_well(&pliantd, NULL, "LD_PRELOAD=%s --offline 0.1 --record %s --checkpoint %s %s",
                     preload, path, scratch("unlocked.chk"),
                     write_scene("locks.cfg", "publish = { nodes_hz = 100.0; };", ""));
    const char *said = strstr(pliantd.err, "has no locks");
    assert_non_null(said);
    assert_null(strstr(said + 1, "has no locks"));
    SCOPED(view_free) BodyView view;
    view_read(&view, path, "sphere");
    expect_at_least(view.frames, 10); // of 0.1 s at 100 Hz
    // A checkpoint is claimed, and replaced by the next run.
    process_run_well(&pliantd, NULL, "LD_PRELOAD=%s --offline 0.1 --continue --checkpoint %s %s",
                     preload, scratch("unlocked.chk"),
                     write_scene("locks.cfg", "publish = { nodes_hz = 100.0; };", ""));
    Process reader;
    process_run_well(&reader, program_path("pliant-record"), "LD_PRELOAD=%s --info %s", preload,
                     path);
    expect_printed(&reader, "sphere");
}
