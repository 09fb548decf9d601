// SPDX-License-Identifier: MIT
// The recorded curve and shape are those of the published frames.
#include "curve.h"
#include "kit.h"
#include "test.h"

#include <unistd.h>

enum { NODES = 3 };

// A frame that is the curve's after this.
static void take(Curve *curve, int number, int topology, int count, const float *position,
                 const int32_t *id, const int32_t *parent)
{
    static const int32_t triangle[6] = {0, 1, 2, 0, 0, 0};
    const size_t bytes = (size_t)count * sizeof *id;
    KitMesh *mesh =
        kit_mesh_create(&(const KitMesh){.topology = topology,
                                         .node_count = count,
                                         .triangle_count = 2,
                                         .triangle = kit_copy(triangle, sizeof triangle),
                                         .id = kit_copy(id, bytes),
                                         .parent = kit_copy(parent, 2 * bytes)});
    const PliantBody *body = kit_frame_create(
        &(const PliantBody){.name = "body",
                            .count = number,
                            .time = 0.5 * number,
                            .position = kit_copy(position, (size_t)count * 3 * sizeof *position)},
        mesh);
    kit_mesh_release(mesh);
    curve_take(curve, body);
    pliant_body_release(body);
}

// One triangle whose node 2 is raised by `lift`.
static void take_nodes(Curve *curve, int number, float lift)
{
    const float position[3 * NODES] = {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, lift};
    take(curve, number, 1, NODES, position, (const int32_t[]){0, 1, 2}, (const int32_t[6]){0});
}

TEST(rows_hold_the_largest_displacement_against_the_first_frame)
{
    SCOPED(curve_destroy) Curve curve = {0};
    FREED char *text = NULL;
    size_t size = 0;
    curve.out = open_memstream(&text, &size);
    take_nodes(&curve, 0, 0.25f);
    take_nodes(&curve, 1, 0.75f);
    take_nodes(&curve, 2, 0.0f);
    fclose(curve.out);
    assert_string_equal(text, "0.000000\t0\t0\n0.500000\t0.5\t2\n1.000000\t0.25\t2\n");
}

TEST(unrelated_nodes_begin_where_they_are)
{
    SCOPED(curve_destroy) Curve curve = {0};
    const float there[3 * NODES] = {9.0f, 0.0f, 0.0f, 8.0f, 0.0f, 0.0f, 7.0f, 0.0f, 0.0f};
    take_nodes(&curve, 0, 0.0f);
    take(&curve, 1, 2, NODES, there, (const int32_t[]){5, 6, 7},
         (const int32_t[]){5, 5, 6, 6, 7, 7});
    expect_near(curve.shape[CURVE_LAST].displacement, 0.0, 0.0);
    expect_near(curve.shape[CURVE_PEAK].displacement, 0.0, 0.0);
}

TEST(shape_is_written_of_the_last_frame_and_of_the_peak)
{
    SCOPED(curve_destroy) Curve curve = {0};
    PliantError error;
    char path[] = "shape-XXXXXX", text[512];
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_false(curve_write_shape(&curve, CURVE_LAST, path, &error)); // no frame
    take_nodes(&curve, 0, 0.0f);
    take_nodes(&curve, 1, 0.5f);
    take_nodes(&curve, 2, 0.25f);
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
}

// --- a mesh that changes ---

// Positions on a line; slot i at x[i].
static void take_line(Curve *curve, int number, int topology, int count, const float *x,
                      const int32_t *id, const int32_t *parent)
{
    float position[3 * 8] = {0};
    for (int i = 0; i < count; i++)
        position[3 * i] = x[i];
    take(curve, number, topology, count, position, id, parent);
}

// All numbers are small binary fractions: exact.
TEST(nodes_are_told_by_their_ids)
{
    SCOPED(curve_destroy) Curve curve = {0};
    const int32_t parent[10] = {5, 5, 6, 6, 7, 7, 8, 8, 6, 7}, id[4] = {5, 6, 7, 8};
    take_line(&curve, 0, 1, 4, (const float[]){0.0f, 1.0f, 2.0f, 4.0f}, id, parent);
    take_line(&curve, 1, 1, 4, (const float[]){0.0f, 1.25f, 2.5f, 4.0f}, id, parent);
    expect_near(curve.shape[CURVE_LAST].displacement, 0.5, 0.0);
    // Slot 3 is another node now, between 6 and 7: it starts with the mean of their displacements,
    // however far it is from where node 8 was.
    const int32_t born[8] = {5, 5, 6, 6, 7, 7, 6, 7}, with_born[4] = {5, 6, 7, 70};
    take_line(&curve, 2, 2, 4, (const float[]){0.0f, 1.25f, 2.5f, 1.875f}, with_born, born);
    expect_near(curve.shape[CURVE_LAST].displacement, 0.5, 0.0);
    expect_near((double)curve.first[9], 1.5, 0.0); // in the middle of 1 and 2
    take_line(&curve, 3, 2, 4, (const float[]){0.0f, 1.25f, 2.5f, 2.5f}, with_born, born);
    expect_near(curve.shape[CURVE_LAST].displacement, 1.0, 0.0);
    // A free slot moves nothing; the peak is kept with the mesh that it belongs to.
    take_line(&curve, 4, 3, 5, (const float[]){0.0f, 1.25f, 2.5f, 99.0f, 4.0f},
              (const int32_t[]){5, 6, 7, -1, 8}, parent);
    expect_near(curve.shape[CURVE_LAST].displacement, 0.5, 0.0);
    expect_near(curve.shape[CURVE_PEAK].displacement, 1.0, 0.0);
    assert_int_equal(curve.shape[CURVE_PEAK].body->topology, 2);
}

TEST(births_between_births_have_their_beginnings_too)
{
    SCOPED(curve_destroy) Curve curve = {0};
    const int32_t id[3] = {5, 6, -1}, none[6] = {5, 5, 6, 6, 0, 0};
    take_line(&curve, 0, 1, 3, (const float[]){0.0f, 1.0f, 0.0f}, id, none);
    take_line(&curve, 1, 1, 3, (const float[]){1.0f, 2.0f, 0.0f}, id, none); // all by 1
    // Node 90 between 5 and 80, which itself is between 5 and 6 and comes in a later slot.
    take_line(&curve, 2, 2, 4, (const float[]){1.0f, 2.0f, 1.25f, 1.5f},
              (const int32_t[]){5, 6, 90, 80}, (const int32_t[]){5, 5, 6, 6, 5, 80, 5, 6});
    expect_near((double)curve.first[6], 0.25, 0.0);
    expect_near((double)curve.first[9], 0.5, 0.0);
    expect_near(curve.shape[CURVE_LAST].displacement, 1.0, 0.0);
}
