// The text of a scene file, looked through before libconfig reads it. Private to files/.
#ifndef PLIANT_FILES_SCENE_SOURCE_H
#define PLIANT_FILES_SCENE_SOURCE_H

#include "base/status.h"

#include <libconfig.h>

// The folder of a file, "." for a bare name; malloc'ed.
char *scene_source_folder(const char *path);
// `name` as seen from `folder`; absolute names stay. malloc'ed.
char *scene_source_resolve(const char *folder, const char *name);

// Reads and parses a scene file with everything it includes. `config` is initialised by the caller
// and stays the caller's; returns the malloc'ed text of the scene file itself, or NULL with a
// status that names file and line.
char *scene_source_read(const char *path, config_t *config, Status *status);

#endif
