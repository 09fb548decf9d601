// Checkpoints (design: files) and initial states, in HDF5.
#ifndef PLIANT_FILES_CHECKPOINT_H
#define PLIANT_FILES_CHECKPOINT_H

#include "files/build.h"

// What is copied at the end of a tick, into space reserved at load. `block` holds state_bytes();
// the rest is by node slot (BodyMesh).
typedef struct CheckpointImage {
    void *block;
    int *node_count; // [body]
    int **id;        // [body][node_count] of bodies whose mesh changes, else NULL: the body's own
    Vec3 **position; // [body][node_count]
    Vec3 **velocity; // [body][node_count]
    double time;
    int64_t step;
    int64_t inputs; // applied since that step (world_inputs)
} CheckpointImage;

// Load time: reserves the image from the world's arena.
void checkpoint_reserve(CheckpointImage *image, World *world);
// Step thread, between two ticks: copies, nothing else.
void checkpoint_take(CheckpointImage *image, const World *world);

// Writes FILE.tmp, flushes, renames, flushes the folder. Root attributes format, version, scene,
// created_by; /time, /step, /inputs; /bodies/<name>/{id, position, velocity} float64 of the nodes
// alive, in ascending id; /state/<array> as bytes, with attribute isa; every dataset with attribute
// unit. The first 512 bytes, which HDF5 leaves to its user, hold a seal: the hash of the rest.
bool checkpoint_write(const char *path, const CheckpointImage *image, const World *world,
                      const Scene *scene, Status *status);
// Validates everything against the scene and the world (format, version, names, sizes, hash of the
// scene's physics) and replaces the world's state: the run continues with the same bits.
bool checkpoint_read(const char *path, World *world, const Scene *scene, Status *status);

// /position and /velocity [n][3] float64 of an `initial` file; n must be mesh->node_count, or
// mesh->file_node_count (then each node takes its row of the file). Arrays are malloc'ed for the
// caller.
bool initial_read(const char *path, const TriMesh *mesh, Vec3 **position, Vec3 **velocity,
                  Status *status);
// The same for a body whose nodes are not known yet: as many rows as the file has, at most `most`.
bool initial_read_rows(const char *path, int most, int *count, Vec3 **position, Vec3 **velocity,
                       Status *status);

#endif
