// The text of a scene file, checked before libconfig reads it. Private to scene/.
#ifndef PLIANT_SCENE_SCENE_SOURCE_H
#define PLIANT_SCENE_SCENE_SOURCE_H

#include "base/status.h"

#include <libconfig.h>

// Returns the folder of a file, "." for a bare name. The caller frees it.
char *scene_source_folder(const char *path);
// Returns `name` relative to `folder`; absolute names stay. The caller frees it.
char *scene_source_resolve(const char *folder, const char *name);

// Reads and parses a scene file with all its includes. The caller initialises and owns `config`.
// Returns the text of the scene file itself, which the caller frees, or NULL with a status that
// names file and line.
char *scene_source_read(const char *path, config_t *config, Status *status);

#endif
