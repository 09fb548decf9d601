// SPDX-License-Identifier: MIT
// Constants of heat in soft tissue, near the middle of what is measured (Duck 1990, "Physical
// Properties of Tissue"; Hasgall et al., IT'IS database). Perfusion is that of liver at rest, in
// volumes of blood per volume and second; it cools to body temperature (Pennes 1948).
#ifndef PLIANT_BODY_HEAT_H
#define PLIANT_BODY_HEAT_H

#define HEAT_BODY         37.0    // [C]
#define HEAT_COAGULATES   60.0    // within a second (Henriques 1947) [C]
#define HEAT_BOILING      100.0   // [C]
#define HEAT_CONDUCTIVITY 0.5     // [W/(m K)]
#define HEAT_CAPACITY     3600.0  // of tissue and of blood [J/(kg K)]
#define HEAT_PERFUSION    0.015   // [1/s]
#define HEAT_LATENT       1.582e6 // of tissue with 70 % of water, 0.7 * 2.26e6 [J/kg]

#endif
