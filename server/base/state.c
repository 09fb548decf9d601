#include "base/state.h"

#include "base/check.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void state_add(StateList *list, void *memory, size_t bytes, const char *format, ...)
{
    if (list->count == list->capacity) {
        list->capacity = list->capacity == 0 ? 32 : 2 * list->capacity;
        list->array = realloc(list->array, (size_t)list->capacity * sizeof *list->array);
        ASSERT(list->array != NULL);
    }
    StateArray *array = &list->array[list->count];
    *array = (StateArray){.memory = memory, .bytes = bytes};
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(array->name, sizeof array->name, format, arguments);
    va_end(arguments);
    ASSERT(length > 0 && length < (int)sizeof array->name);
    for (int i = 0; i < list->count; i++)
        ASSERT(strcmp(list->array[i].name, array->name) != 0);
    list->count++;
}

size_t state_bytes(const StateList *list)
{
    size_t bytes = 0;
    for (int i = 0; i < list->count; i++)
        bytes += list->array[i].bytes;
    return bytes;
}

void state_copy_out(const StateList *list, void *block)
{
    unsigned char *to = block;
    for (int i = 0; i < list->count; i++) {
        memcpy(to, list->array[i].memory, list->array[i].bytes);
        to += list->array[i].bytes;
    }
}

void state_copy_in(const StateList *list, const void *block)
{
    const unsigned char *from = block;
    for (int i = 0; i < list->count; i++) {
        memcpy(list->array[i].memory, from, list->array[i].bytes);
        from += list->array[i].bytes;
    }
}

uint64_t state_hash(const StateList *list)
{
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    for (int i = 0; i < list->count; i++) {
        const unsigned char *byte = list->array[i].memory;
        for (size_t k = 0; k < list->array[i].bytes; k++)
            hash = (hash ^ byte[k]) * UINT64_C(0x100000001b3);
    }
    return hash;
}

void state_destroy(StateList *list)
{
    free(list->array);
    *list = (StateList){0};
}
