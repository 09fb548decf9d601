// SPDX-License-Identifier: MIT
// Checkpoints and initial states of bodies, in HDF5 (README.md, "What HDF5 does").
#ifndef PLIANT_IO_CHECKPOINT_H
#define PLIANT_IO_CHECKPOINT_H

#include "base/check.h"
#include "base/output.h"
#include "sim/world.h"
#include "geometry/mesh.h"

// True if a run from the world's current step may write its checkpoints to `path`: they must not
// replace a file of another kind, nor a later checkpoint of the same physics. Returns false with
// `status` (STATUS_INVALID). Load time.
bool checkpoint_check_target(const char *path, const World *world, Status *status);
// Does the same and claims the path until output_release, so that no other run replaces the file
// meanwhile. Each file that is written then keeps the one before it as PATH.1.
bool checkpoint_claim(OutputClaim *claim, const char *path, const World *world, Status *status);
// True if the path holds anything but an empty file or a device: a checkpoint or an obstacle.
bool checkpoint_is_there(const char *path);

// Writes the image as base/output.h does, synced to the disk; replaces only a sealed file, and by
// nothing that could not be resumed (WorldImage.fault: STATUS_FAILED). Root
// attributes: format, version, scene, created_by. Data: /time, /step, /inputs; /bodies/<name>/{id,
// position, velocity} float64 of the live nodes, in ascending id; /state/<array> as bytes, with
// attribute isa. Every dataset has the attribute unit. The first 512 bytes, which HDF5 leaves to
// its user, hold a seal: the hash of the rest.
bool checkpoint_write(const char *path, const WorldImage *image, const World *world,
                      Status *status);
bool checkpoint_write_claimed(OutputClaim *claim, const WorldImage *image, const World *world,
                              Status *status);
// Validates the file against the scene and the world (format, version, names, sizes, hash of the
// scene's physics) and replaces the world's state. The continued run is bit-identical.
bool checkpoint_read(const char *path, World *world, Status *status);
// After checkpoint_read failed with `status`: reads the checkpoint before it (PATH.1), renames PATH
// to PATH.refused, reports both and clears `status`. False, with nothing changed, without one that
// can be read, or while another run writes PATH.
bool checkpoint_fall_back(const char *path, World *world, Status *status);

// --- initial states; load time only --------------------------------------------------------------

// Reads /position [m] and /velocity [m/s], [n][3] float64, of an `initial` file. n must be
// mesh->node_count, or mesh->file_node_count (each node then takes its row of the file). The caller
// frees the arrays.
bool initial_read(const char *path, const TriMesh *mesh, Vec3 **position, Vec3 **velocity,
                  Status *status);
// Reads the same for a body whose nodes are not known yet: all rows of the file, at most `most`.
bool initial_read_rows(const char *path, int most, int *count, Vec3 **position, Vec3 **velocity,
                       Status *status);

#endif
