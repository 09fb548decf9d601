// The precisions in which a body's rows and springs can be held.
#ifndef PLIANT_SURFACE_PRECISION_H
#define PLIANT_SURFACE_PRECISION_H

typedef enum Precision { PRECISION_DOUBLE, PRECISION_SINGLE, PRECISION_COUNT } Precision;

#endif
