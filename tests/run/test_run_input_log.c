// SPDX-License-Identifier: MIT
// The log of inputs as a killed run leaves it: without its end.
#include "test.h"
#include "run/files_thread.h"
#include "scratch_folder.h"
#include "toy_body.h"

#include <unistd.h>

AROUND_ALL(scratch_begin, scratch_end)

typedef struct Rig {
    World world;
    TriMesh mesh;
    Toy *toy;
    Exchange exchange;
    FilesThread files;
} Rig;

static void create(Rig *rig, const char *path)
{
    memset(rig, 0, sizeof *rig);
    Status status = {0};
    rig->mesh = toy_sheet(2, 0.01);
    const SimOptions options = {.rate_hz = 1000.0};
    rig->world.sim = sim_create(&options, &rig->world.arena, &rig->world.state);
    const Body body = toy_body(&rig->toy, "wall", &rig->mesh, &(ToyOptions){0}, &rig->world.arena,
                               &rig->world.state);
    sim_add_body(rig->world.sim, &body);
    exchange_create(&rig->exchange, &rig->world, &(ExchangeOptions){.logs_inputs = true});
    expect_ok(exchange_open(&rig->exchange, &status), status);
    const InputLogHeader header = {"toy", "PLIANT", "baseline", 1000.0, 0, 0};
    rig->files = (FilesThread){.world = &rig->world, .exchange = &rig->exchange};
    rig->files.log = input_log_create(path, &header, &status);
    expect_ok(rig->files.log != NULL, status);
}

static void destroy(Rig *rig)
{
    assert_true(files_thread_finish(&rig->files, 0));
    exchange_close(&rig->exchange);
    mesh_destroy(&rig->mesh);
    world_destroy(&rig->world);
}

// Reads all that is there; the reader then knows what it met.
static InputLogReader read_log(const char *path)
{
    InputLogReader reader;
    Status status = {0};
    InputKind kind;
    int64_t step;
    expect_ok(input_log_open(&reader, path, &status), status);
    while (input_log_next(&reader, 1000.0, 0, &kind, &step, &status)) {
    }
    input_log_close_reader(&reader);
    return reader;
}

// A disk that was too slow: a replay is not the run, which must not show only where the log ends.
TEST(a_log_says_what_it_lacks_before_it_ends)
{
    enum { LOST = 3 };
    Rig rig;
    Status status = {0};
    const char *path = scratch_at("lacks.log");
    create(&rig, path);
    const AppliedInput load = {.input = {.kind = INPUT_LOAD}};
    while (ring_push(&rig.exchange.applied, &load)) {
    }
    atomic_store(&rig.exchange.applied_lost, LOST);
    expect_ok(files_thread_start(&rig.files, &status), status);
    const EventOut *event;
    for (int tries = 0; (event = ring_peek(&rig.exchange.files_event)) == NULL; tries++) {
        assert_in_range(tries, 0, 60000);
        usleep(1000);
    }
    assert_string_equal(event->kind, "inputs");
    assert_non_null(strstr(event->text, "lacks 3 inputs"));
    InputLogReader reader = read_log(path);
    assert_int_equal(reader.used, rig.exchange.applied.capacity);
    assert_int_equal(reader.lost, LOST);
    assert_false(reader.ended);
    destroy(&rig);
    reader = read_log(path);
    assert_int_equal(reader.lost, LOST);
    assert_true(reader.ended);
}
