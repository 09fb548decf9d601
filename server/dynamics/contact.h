// Contact of one tool with one body: a penalty on faces, with remembered sides, a proxy and bristle
// friction. Contact owns no physics of the body: it reads node rows and adds node forces.
#ifndef PLIANT_DYNAMICS_CONTACT_H
#define PLIANT_DYNAMICS_CONTACT_H

#include "base/arena.h"
#include "base/state.h"
#include "dynamics/body.h"
#include "dynamics/tool.h"

typedef struct Contact Contact;

#endif
