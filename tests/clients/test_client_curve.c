// The recorded curve and shape are those of the published frames.
#include "curve.h"
#include "test.h"

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

TEST(rows_hold_the_largest_displacement_against_the_first_frame)
{
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

TEST(another_topology_begins_anew)
{
    Curve curve = {0};
    take_nodes(&curve, 0, 1, 0.0f);
    take_nodes(&curve, 1, 1, 1.0f);
    take_nodes(&curve, 2, 2, 3.0f);
    expect_near(curve.shape[CURVE_LAST].displacement, 0.0, 0.0);
    expect_near(curve.shape[CURVE_PEAK].displacement, 0.0, 0.0);
    curve_destroy(&curve);
}

TEST(shape_is_written_of_the_last_frame_and_of_the_peak)
{
    Curve curve = {0};
    PliantError error;
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

// --- a mesh that changes ---

// Positions on a line; slot i at x[i].
static void take_line(Curve *curve, int sequence, int topology, int count, const float *x)
{
    float position[3 * 8] = {0};
    for (int i = 0; i < count; i++)
        position[3 * i] = x[i];
    pliant_nodes_t chunk = {.utime = 10 + sequence,
                            .sequence = sequence,
                            .time = 0.5 * sequence,
                            .topology = topology,
                            .node_count = count,
                            .chunk_count = 1,
                            .num_values = 3 * count,
                            .position = position};
    unsigned char data[512];
    int size = pliant_nodes_t_encode(data, 0, sizeof data, &chunk);
    assert_true(size > 0);
    curve_take_nodes(curve, data, (size_t)size);
}

// One triangle of slots 0, 1, 2.
static void take_ids(Curve *curve, int sequence, int topology, int count, const int32_t *id,
                     const int32_t *parent)
{
    int32_t triangle[3] = {0, 1, 2};
    int8_t level[8] = {0};
    pliant_mesh_t chunk = {.utime = 10 + sequence,
                           .sequence = sequence,
                           .topology = topology,
                           .node_count = count,
                           .triangle_count = 1,
                           .chunk_count = 1,
                           .num_indices = 3,
                           .triangle = triangle,
                           .num_nodes = count,
                           .num_parents = 2 * count,
                           .id = (int32_t *)(uintptr_t)id,
                           .origin = (int32_t *)(uintptr_t)id,
                           .parent = (int32_t *)(uintptr_t)parent,
                           .piece = (int32_t *)(uintptr_t)id,
                           .level = level};
    unsigned char data[512];
    int size = pliant_mesh_t_encode(data, 0, sizeof data, &chunk);
    assert_true(size > 0);
    curve_take_mesh(curve, data, (size_t)size);
}

// All numbers are small binary fractions: exact.
TEST(nodes_are_told_by_their_ids)
{
    Curve curve = {0};
    const int32_t parent[10] = {5, 5, 6, 6, 7, 7, 8, 8, 6, 7};
    take_ids(&curve, 0, 1, 4, (const int32_t[]){5, 6, 7, 8}, parent);
    take_line(&curve, 0, 1, 4, (const float[]){0.0f, 1.0f, 2.0f, 4.0f});
    take_line(&curve, 1, 1, 4, (const float[]){0.0f, 1.25f, 2.5f, 4.0f});
    expect_near(curve.shape[CURVE_LAST].displacement, 0.5, 0.0);
    // Slot 3 is another node now, between 6 and 7: it starts with the mean of their displacements,
    // however far it is from where node 8 was.
    const int32_t born[8] = {5, 5, 6, 6, 7, 7, 6, 7};
    take_ids(&curve, 1, 2, 4, (const int32_t[]){5, 6, 7, 70}, born);
    take_line(&curve, 2, 2, 4, (const float[]){0.0f, 1.25f, 2.5f, 1.875f});
    expect_near(curve.shape[CURVE_LAST].displacement, 0.5, 0.0);
    expect_near((double)curve.first[9], 1.5, 0.0); // in the middle of 1 and 2
    take_line(&curve, 3, 2, 4, (const float[]){0.0f, 1.25f, 2.5f, 2.5f});
    expect_near(curve.shape[CURVE_LAST].displacement, 1.0, 0.0);
    // A free slot moves nothing; the peak is kept with the mesh that it belongs to.
    take_ids(&curve, 2, 3, 5, (const int32_t[]){5, 6, 7, -1, 8}, parent);
    take_line(&curve, 4, 3, 5, (const float[]){0.0f, 1.25f, 2.5f, 99.0f, 4.0f});
    expect_near(curve.shape[CURVE_LAST].displacement, 0.5, 0.0);
    expect_near(curve.shape[CURVE_PEAK].displacement, 1.0, 0.0);
    assert_int_equal(curve.shape[CURVE_PEAK].topology, 2);
    assert_non_null(curve.shape[CURVE_PEAK].triangle);
    curve_destroy(&curve);
}

TEST(births_between_births_have_their_beginnings_too)
{
    Curve curve = {0};
    take_ids(&curve, 0, 1, 3, (const int32_t[]){5, 6, -1}, (const int32_t[]){5, 5, 6, 6, 0, 0});
    take_line(&curve, 0, 1, 3, (const float[]){0.0f, 1.0f, 0.0f});
    take_line(&curve, 1, 1, 3, (const float[]){1.0f, 2.0f, 0.0f}); // all by 1
    // Node 90 between 5 and 80, which itself is between 5 and 6 and comes in a later slot.
    const int32_t parent[8] = {5, 5, 6, 6, 5, 80, 5, 6};
    take_ids(&curve, 1, 2, 4, (const int32_t[]){5, 6, 90, 80}, parent);
    take_line(&curve, 2, 2, 4, (const float[]){1.0f, 2.0f, 1.25f, 1.5f});
    expect_near((double)curve.first[6], 0.25, 0.0);
    expect_near((double)curve.first[9], 0.5, 0.0);
    expect_near(curve.shape[CURVE_LAST].displacement, 1.0, 0.0);
    curve_destroy(&curve);
}

TEST(a_change_that_was_missed_begins_anew)
{
    Curve curve = {0};
    const int32_t parent[6] = {5, 5, 6, 6, 7, 7}, id[3] = {5, 6, 7};
    take_ids(&curve, 0, 1, 3, id, parent);
    take_line(&curve, 0, 1, 3, (const float[]){0.0f, 1.0f, 2.0f});
    take_line(&curve, 1, 1, 3, (const float[]){3.0f, 1.0f, 2.0f});
    take_line(&curve, 2, 2, 3, (const float[]){4.0f, 1.0f, 2.0f}); // no mesh of topology 2 came
    expect_near(curve.shape[CURVE_LAST].displacement, 0.0, 0.0);
    take_ids(&curve, 1, 2, 3, (const int32_t[]){6, 5, 7}, parent); // late
    take_line(&curve, 3, 2, 3, (const float[]){4.5f, 1.0f, 2.0f});
    expect_near(curve.shape[CURVE_LAST].displacement, 0.5, 0.0);
    take_ids(&curve, 2, 3, 3, (const int32_t[]){6, 5, -1}, parent);
    take_line(&curve, 4, 3, 3, (const float[]){4.75f, 1.0f, 0.0f});
    expect_near(curve.shape[CURVE_LAST].displacement, 0.75, 0.0);
    curve_destroy(&curve);
}
