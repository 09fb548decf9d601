// SPDX-License-Identifier: MIT
#include "base/library.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stddef.h>

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

// Returns a symbol as a program that is linked with the library sees it: such a program may have
// the library's variables in its own memory.
static void *find(void *handle, const char *name)
{
    void *found = dlsym(RTLD_DEFAULT, name);
    return found != NULL ? found : dlsym(handle, name);
}

// Finds all symbols at once, so that none is missing later.
static bool find_symbols(Library *library)
{
    void *handle = dlopen(library->soname, RTLD_NOW | RTLD_LOCAL);
    for (int i = 0; i < library->count && handle != NULL; i++) {
        library->symbol[i] = (uintptr_t)find(handle, library->name[i]);
        if (library->symbol[i] == 0)
            return false;
    }
    return handle != NULL;
}

bool library_load(Library *library, const char *path, Status *status)
{
    pthread_mutex_lock(&lock);
    library->loaded = library->loaded || find_symbols(library);
    bool loaded = library->loaded;
    // dlerror names the library.
    if (!loaded)
        status_fail(status, STATUS_FAILED, "%s: its format needs %s", path, dlerror());
    pthread_mutex_unlock(&lock);
    return loaded;
}
