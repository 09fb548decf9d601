#include "voxel/cut/template_cache.h"

// A ball has about a hundred shapes, a body that is cut everywhere a few hundred.
enum { SLOT_BITS = 9, SLOTS = 1 << SLOT_BITS, TRIES = 8 };

static size_t real_size(const TemplateCache *cache)
{
    return cache->precision == PRECISION_SINGLE ? sizeof(float) : sizeof(double);
}

static void *numbers_at(const TemplateCache *cache, int slot)
{
    return (char *)cache->number + (size_t)slot * TEMPLATE_NUMBERS * real_size(cache);
}

void template_cache_create(TemplateCache *cache, const char *name, VoxelLaw law,
                           Precision precision, Arena *arena)
{
    *cache = (TemplateCache){.law = law, .precision = precision};
    cache->mask = arena_allocate(arena, ARENA_TOPOLOGY, SLOTS, sizeof *cache->mask,
                                 "%s/masks of templates", name);
    cache->shape =
        arena_allocate(arena, ARENA_TOPOLOGY, SLOTS, sizeof *cache->shape, "%s/templates", name);
    cache->number =
        arena_allocate(arena, ARENA_TOPOLOGY, SLOTS, TEMPLATE_NUMBERS * real_size(cache),
                       "%s/tables of templates", name);
}

static double number_of(const TemplateCache *cache, const void *number, int at)
{
    return cache->precision == PRECISION_SINGLE ? (double)((const float *)number)[at]
                                                : ((const double *)number)[at];
}

static void scale(const TemplateCache *cache, void *number, int at, double by)
{
    const double value = by * number_of(cache, number, at);
    if (cache->precision == PRECISION_SINGLE)
        ((float *)number)[at] = (float)value;
    else
        ((double *)number)[at] = value;
}

static void fill(TemplateCache *cache, int slot, unsigned mask)
{
    Template *shape = &cache->shape[slot];
    void *number = numbers_at(cache, slot);
    template_create(shape, mask);
    voxel_table_put(number, shape, cache->law, cache->precision);
    if (cache->law == VOXEL_MIYAZAKI2004) {
        const double weight = 6.0 / template_spread(shape);
        scale(cache, number, 0, weight);
        scale(cache, number, 1, 1.0 / weight);
        for (int i = 0; i < shape->count; i++)
            scale(cache, number, TABLE_HEAD + i * TABLE_ROW + 3, weight);
    }
    cache->mask[slot] = mask + 1;
    cache->made++;
}

static int slot_of(TemplateCache *cache, unsigned mask)
{
    const unsigned home = mask * 2654435769u >> (32 - SLOT_BITS); // Fibonacci hashing
    for (unsigned i = 0; i < TRIES; i++) {
        const unsigned slot = (home + i) % SLOTS;
        if (cache->mask[slot] == mask + 1)
            return (int)slot;
        if (cache->mask[slot] == 0) {
            fill(cache, (int)slot, mask);
            return (int)slot;
        }
    }
    fill(cache, (int)home, mask);
    return (int)home;
}

const Template *template_cache_shape(TemplateCache *cache, unsigned mask)
{
    return &cache->shape[slot_of(cache, mask)];
}

const void *template_cache_numbers(TemplateCache *cache, unsigned mask)
{
    return numbers_at(cache, slot_of(cache, mask));
}
