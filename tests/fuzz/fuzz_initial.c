// SPDX-License-Identifier: MIT
// An initial state, which comes from any program that writes HDF5: the data of one were changed.
// With an odd first byte the input is the file itself, as it comes.
#include "fuzz.h"

#include "base/log.h"
#include "io/checkpoint.h"
#include "hdf_edit.h"

#include <hdf5.h>

#include <stdlib.h>

enum { NODES = 12 };

static void make_base(HdfBase *base)
{
    const hsize_t size[2] = {NODES, 3};
    double value[NODES][3] = {{0.0}};
    for (int i = 0; i < NODES; i++)
        value[i][i % 3] = 0.01 * i;
    hid_t file = H5Fcreate(fuzz_path("base"), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    hid_t space = H5Screate_simple(2, size, NULL);
    const char *const names[] = {"/position", "/velocity"};
    for (int k = 0; k < 2; k++) {
        hid_t set = H5Dcreate2(file, names[k], H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT,
                               H5P_DEFAULT);
        H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, value);
        H5Dclose(set);
    }
    H5Sclose(space);
    H5Fclose(file);
    hdf_base_read(base, fuzz_path("base"));
}

static void check_rows(bool ok, int count, Vec3 *position, Vec3 *velocity, const Status *status)
{
    fuzz_print(ok ? "taken" : status->text);
    MUST(ok == (status->code == STATUS_OK));
    MUST(strchr(status->text, '\n') == NULL);
    MUST(ok == (position != NULL) && ok == (velocity != NULL));
    for (int i = 0; ok && i < count; i++)
        MUST(vec3_finite(position[i]) && vec3_finite(velocity[i]));
    free(position);
    free(velocity);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static HdfBase base;
    log_set_level(LOG_ERROR);
    if (base.bytes == NULL)
        make_base(&base);
    if (size == 0)
        return 0;
    Feed feed = {data + 1, size - 1};
    const char *path = data[0] & 1 ? fuzz_write("edited", data + 1, size - 1)
                                   : hdf_base_edit(&base, "edited", &feed, false);
    TriMesh mesh;
    mesh_create(&mesh, NODES, 1);
    Vec3 *position, *velocity;
    Status status = {0};
    bool ok = initial_read(path, &mesh, &position, &velocity, &status);
    check_rows(ok, NODES, position, velocity, &status);
    mesh_destroy(&mesh);
    int count = 0;
    status = (Status){0};
    ok = initial_read_rows(path, 1000, &count, &position, &velocity, &status);
    MUST(!ok || count <= 1000);
    check_rows(ok, count, position, velocity, &status);
    return 0;
}
