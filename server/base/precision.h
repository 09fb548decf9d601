// The precisions in which the kernels of bodies compute and store their numbers.
#ifndef PLIANT_BASE_PRECISION_H
#define PLIANT_BASE_PRECISION_H

typedef enum Precision { PRECISION_DOUBLE, PRECISION_SINGLE, PRECISION_COUNT } Precision;

#endif
