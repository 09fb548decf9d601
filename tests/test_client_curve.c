// The recorded curve and shape are those of the published frames.
#include "curve.h"
#include "expect.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "pliant_mesh_t.h"
#include "pliant_nodes_t.h"

enum { NODES = 3 };

// One triangle whose node 2 is raised by `lift`.
static void take_nodes(Curve *curve, int sequence, int topology, float lift)
{
    float position[3 * NODES] = {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, lift};
    pliant_nodes_t chunk = {.utime = 10 + sequence,
                            .sequence = sequence,
                            .time = 0.5 * sequence,
                            .topology = topology,
                            .node_count = NODES,
                            .chunk_count = 1,
                            .num_values = 3 * NODES,
                            .position = position};
    unsigned char data[256];
    int size = pliant_nodes_t_encode(data, 0, sizeof data, &chunk);
    assert_true(size > 0);
    curve_take_nodes(curve, data, (size_t)size);
}

static void take_mesh(Curve *curve, int topology)
{
    int32_t triangle[6] = {0, 1, 2, 0, 0, 0}, id[NODES] = {0, 1, 2}, parent[2 * NODES] = {0};
    int8_t level[NODES] = {0};
    pliant_mesh_t chunk = {.topology = topology,
                           .node_count = NODES,
                           .triangle_count = 2,
                           .chunk_count = 1,
                           .num_indices = 6,
                           .triangle = triangle,
                           .num_nodes = NODES,
                           .num_parents = 2 * NODES,
                           .id = id,
                           .origin = id,
                           .parent = parent,
                           .piece = id,
                           .level = level};
    unsigned char data[512];
    int size = pliant_mesh_t_encode(data, 0, sizeof data, &chunk);
    assert_true(size > 0);
    curve_take_mesh(curve, data, (size_t)size);
}

static void rows_hold_the_largest_displacement_against_the_first_frame(void **state)
{
    (void)state;
    Curve curve = {0};
    char *text = NULL;
    size_t size = 0;
    curve.out = open_memstream(&text, &size);
    take_nodes(&curve, 0, 1, 0.25f);
    take_nodes(&curve, 1, 1, 0.75f);
    take_nodes(&curve, 2, 1, 0.0f);
    fclose(curve.out);
    assert_string_equal(text, "0.000000\t0\t0\n0.500000\t0.5\t2\n1.000000\t0.25\t2\n");
    free(text);
    curve_destroy(&curve);
}

static void another_topology_begins_anew(void **state)
{
    (void)state;
    Curve curve = {0};
    take_nodes(&curve, 0, 1, 0.0f);
    take_nodes(&curve, 1, 1, 1.0f);
    take_nodes(&curve, 2, 2, 3.0f);
    expect_near(curve.shape[CURVE_LAST].displacement, 0.0, 0.0);
    expect_near(curve.shape[CURVE_PEAK].displacement, 0.0, 0.0);
    curve_destroy(&curve);
}

static void shape_is_written_of_the_last_frame_and_of_the_peak(void **state)
{
    (void)state;
    Curve curve = {0};
    ClientError error;
    char path[] = "shape-XXXXXX", text[512];
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_false(curve_write_shape(&curve, CURVE_LAST, path, &error)); // no frame
    take_nodes(&curve, 0, 1, 0.0f);
    take_nodes(&curve, 1, 1, 0.5f);
    take_nodes(&curve, 2, 1, 0.25f);
    assert_false(curve_write_shape(&curve, CURVE_LAST, path, &error)); // no mesh
    take_mesh(&curve, 1);
    static const char *const expected[CURVE_FRAMES] = {
        [CURVE_LAST] = "# x_m y_m z_m displacement_m at 1.000000 s, largest 0.25 m\n"
                       "0 0 0 0\n0 0 0 0\n\n1 0 0 0\n0 1 0.25 0.25\n\n\n",
        [CURVE_PEAK] = "# x_m y_m z_m displacement_m at 0.500000 s, largest 0.5 m\n"
                       "0 0 0 0\n0 0 0 0\n\n1 0 0 0\n0 1 0.5 0.5\n\n\n"};
    for (int k = 0; k < CURVE_FRAMES; k++) {
        assert_true(curve_write_shape(&curve, (CurveFrame)k, path, &error));
        ssize_t size = pread(fd, text, sizeof text - 1, 0);
        assert_true(size > 0);
        text[size] = '\0';
        assert_memory_equal(text, expected[k], strlen(expected[k]));
    }
    close(fd);
    unlink(path);
    curve_destroy(&curve);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_hold_the_largest_displacement_against_the_first_frame),
        cmocka_unit_test(another_topology_begins_anew),
        cmocka_unit_test(shape_is_written_of_the_last_frame_and_of_the_peak),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
