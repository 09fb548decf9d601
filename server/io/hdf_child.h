// A child process that reads a file for us. HDF5 crashes on some damaged or malicious files; in the
// child it takes no other process with it, and its time and memory are limited. Private to io/.
// For load time and programs that only read, never while the simulation runs.
#ifndef PLIANT_IO_HDF_CHILD_H
#define PLIANT_IO_HDF_CHILD_H

#include "base/status.h"

#include <stddef.h>
#include <sys/types.h>

typedef struct HdfChild {
    pid_t pid;
    int fd; // socket to the child
} HdfChild;

// Runs in the child: answers on `fd` until the other end closes. Its memory is a copy of ours at
// the start.
typedef void HdfServe(int fd, void *user);

// Starts a child for the file at `path`. Returns NULL with `status` (STATUS_FAILED) on failure.
HdfChild *hdf_child_start(const char *path, HdfServe *serve, void *user, Status *status);
// Ends the child and frees it.
void hdf_child_end(HdfChild *child);

// Transfer exactly `size` bytes, in either direction and from either side; return false if the
// other end is gone.
bool hdf_child_send(int fd, const void *data, size_t size);
bool hdf_child_receive(int fd, void *data, size_t size);

// After one of these returned false: sets the reason why the child is gone; returns false.
bool hdf_child_failed(HdfChild *child, const char *path, Status *status);

#endif
