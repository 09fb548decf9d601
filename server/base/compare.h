// Orders for qsort and bsearch: ascending.
#ifndef PLIANT_BASE_COMPARE_H
#define PLIANT_BASE_COMPARE_H

// Of ints, and of structs that begin with one.
static inline int compare_ints(const void *a, const void *b)
{
    const int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

static inline int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

#endif
