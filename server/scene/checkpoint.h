// Checkpoints, in HDF5 (server/io/README.md, "What HDF5 does").
#ifndef PLIANT_SCENE_CHECKPOINT_H
#define PLIANT_SCENE_CHECKPOINT_H

#include "base/output.h"
#include "scene/build.h"

// The data copied at the end of a tick, into memory reserved at load time. `block` holds
// state_bytes(); the rest is indexed by node slot (BodyMesh).
typedef struct CheckpointImage {
    void *block;
    int *node_count; // [body]
    int **id; // [body][node_count] of bodies whose mesh changes; else NULL: the body's own ids hold
    Vec3 **position; // [body][node_count]
    Vec3 **velocity; // [body][node_count]
    double time;
    int64_t step;
    int64_t inputs; // applied since that step (world_inputs)
} CheckpointImage;

// Reserves the image from the world's arena. Load time.
void checkpoint_reserve(CheckpointImage *image, World *world);
// Copies the state; step thread, between two ticks.
void checkpoint_take(CheckpointImage *image, const World *world);

// True if a run from the world's current step may write its checkpoints to `path`: they must not
// replace a file of another kind, nor a later checkpoint of the same physics. Returns false with
// `status` (STATUS_INVALID). Load time.
bool checkpoint_check_target(const char *path, const World *world, const Scene *scene,
                             Status *status);
// Does the same and claims the path until output_release, so that no other run replaces the file
// meanwhile.
bool checkpoint_claim(OutputClaim *claim, const char *path, const World *world, const Scene *scene,
                      Status *status);
// True if the path holds anything but an empty file or a device: a checkpoint or an obstacle.
bool checkpoint_is_there(const char *path);

// Writes the image as base/output.h does, synced to the disk; replaces only a sealed file. Root
// attributes: format, version, scene, created_by. Data: /time, /step, /inputs; /bodies/<name>/{id,
// position, velocity} float64 of the live nodes, in ascending id; /state/<array> as bytes, with
// attribute isa. Every dataset has the attribute unit. The first 512 bytes, which HDF5 leaves to
// its user, hold a seal: the hash of the rest.
bool checkpoint_write(const char *path, const CheckpointImage *image, const World *world,
                      const Scene *scene, Status *status);
bool checkpoint_write_claimed(OutputClaim *claim, const CheckpointImage *image, const World *world,
                              const Scene *scene, Status *status);
// Validates the file against the scene and the world (format, version, names, sizes, hash of the
// scene's physics) and replaces the world's state. The continued run is bit-identical.
bool checkpoint_read(const char *path, World *world, const Scene *scene, Status *status);

#endif
