// SPDX-License-Identifier: MIT
// Every block of the manual that has bodies is a whole scene, and runs as it is printed. The files
// that they name are made here: a closed mesh in millimetres and the volume of config/.
#include "effort.h"
#include "test.h"
#include "world_run.h"

#include "geometry/generator.h"

static const char *const READMES[] = {"../config/manual/organ.md", "../config/manual/solids.md",
                                      "../config/manual/cuts.md",  "../config/manual/holding.md",
                                      "../config/manual/touch.md", "../config/manual/membranes.md"};
enum { TICKS = 50, BLOCK = 8192 };

// Told apart by content, whatever it is called: this is an OBJ file.
static void write_organ(const char *name)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    Status status = {0};
    assert_true(generate_ico_sphere(&mesh, 3, 1.0, &status));
    FILE *file = fopen(scratch_at(name), "w");
    assert_non_null(file);
    for (int i = 0; i < mesh.node_count; i++) // [mm]
        fprintf(file, "v %.9g %.9g %.9g\n", 60.0 * mesh.position[i].x - 5.0,
                35.0 * mesh.position[i].y, 30.0 * mesh.position[i].z);
    for (int t = 0; t < mesh.triangle_count; t++)
        fprintf(file, "f %d %d %d\n", mesh.triangle[t][0] + 1, mesh.triangle[t][1] + 1,
                mesh.triangle[t][2] + 1);
    assert_int_equal(fclose(file), 0);
}

static void copy_volume(const char *name)
{
    size_t size;
    FREED unsigned char *data = file_read("../config/liver.nrrd", &size);
    scratch_write(&scratch_space, name, data, size);
}

static void run_block(const char *text)
{
    START_RUN(run, text);
    sim_ticks(run.world.sim, EFFORT(TICKS));
    for (int b = 0; b < sim_body_count(run.world.sim); b++) {
        BodyMeasure measure;
        sim_measure(run.world.sim, b, &measure);
        assert_true(isfinite(measure.kinetic) && isfinite(measure.max_displacement));
    }
    assert_int_equal(sim_resets(run.world.sim), 0);
}

static bool has_bodies(const char *block)
{
    return strncmp(block, "bodies ", 7) == 0 || strstr(block, "\nbodies ") != NULL;
}

// Runs the scenes of a file; how many there were.
static int run_file(const char *name)
{
    static char block[BLOCK];
    char line[1024];
    int scenes = 0, line_number = 0;
    size_t size = 0;
    bool inside = false;
    FILE *file = fopen(name, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file) != NULL) {
        line_number++;
        if (strncmp(line, "```", 3) != 0) {
            assert_true(size + strlen(line) < BLOCK);
            if (inside)
                size += (size_t)snprintf(block + size, BLOCK - size, "%s", line);
            continue;
        }
        inside = !inside;
        if (!inside && has_bodies(block)) {
            print_message("%s: the scene that ends in line %d\n", name, line_number);
            run_block(block);
            scenes++;
        }
        size = 0;
        block[0] = '\0';
    }
    fclose(file);
    return scenes;
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(scenes_of_the_readmes_run_as_printed)
{
    write_organ("organ.stl");
    write_organ("liver.stl");
    copy_volume("labels.nrrd");
    copy_volume("liver.nrrd");
    int scenes = 0;
    for (size_t i = 0; i < sizeof READMES / sizeof READMES[0]; i++)
        scenes += run_file(READMES[i]);
    assert_true(scenes >= 5); // one of each page of the manual that has any
}
