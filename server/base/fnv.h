// SPDX-License-Identifier: MIT
// FNV-1a hash of plain values, member by member: the padding bytes of structures are undefined.
#ifndef PLIANT_BASE_FNV_H
#define PLIANT_BASE_FNV_H

#include "base/vec.h"

#include <inttypes.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#define FNV_START UINT64_C(0xcbf29ce484222325)

static inline uint64_t fnv_bytes(uint64_t hash, const void *memory, size_t bytes)
{
    const unsigned char *byte = memory;
    for (size_t i = 0; i < bytes; i++)
        hash = (hash ^ byte[i]) * UINT64_C(0x100000001b3);
    return hash;
}

static inline void fnv_real(uint64_t *hash, double value)
{
    *hash = fnv_bytes(*hash, &value, sizeof value);
}

static inline void fnv_int(uint64_t *hash, int64_t value)
{
    *hash = fnv_bytes(*hash, &value, sizeof value);
}

static inline void fnv_vector(uint64_t *hash, Vec3 v)
{
    fnv_real(hash, v.x);
    fnv_real(hash, v.y);
    fnv_real(hash, v.z);
}

enum { FNV_TEXT = 17 };
// Writes 16 hexadecimal digits.
static inline void fnv_text(char text[FNV_TEXT], uint64_t hash)
{
    snprintf(text, FNV_TEXT, "%016" PRIx64, hash);
}

#endif
