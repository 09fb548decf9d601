// SPDX-License-Identifier: MIT
// Why bodies do not come to rest, or are taken back, where they do not or are.
#include "matrix.h"

#include <stddef.h>
#include <string.h>

typedef struct Remark {
    const char *at_case; // how the name of the case begins
    const char *model;   // how that of the model begins; "": any
    const char *integrator;
    Verdict verdict;
    const char *sentence;
} Remark;

#define CIRCLES                                                                                    \
    "Shape springs that are damped along themselves, as the paper prints its equation 10, take "   \
    "nothing from nodes that circle about their places: it still moves, with no more energy than " \
    "at first."

#define ENCLOSED                                                                                   \
    "It stands still with a dent: faces that were refined enclose more than those it began with, " \
    "so that what is inside draws them in, and the dent keeps them refined."

#define BEYOND                                                                                     \
    "Beyond the bound energy grows without limit: the check of numbers takes the body back again " \
    "and again, which is what unsafe_time_step asks for."

static const Remark REMARKS[] = {
    {"no damping", "", "", VERDICT_BOUNDED,
     "Nothing takes energy out: it swings for ever, with no more energy than at first."},
    {"node masses", "voxel", "", VERDICT_BOUNDED,
     "Damping is measured in the critical step of the lightest elements, so that the heavy ones "
     "are hardly damped: they still swing, with less energy than at first."},
    {"node masses", "surface, adaptive", "", VERDICT_BOUNDED,
     "It stands still, with a dent of about 1/1000 of its size: a wall of springs has no bending "
     "stiffness, and a refined face may stay folded that little."},
    {"stiffness", "voxel", "", VERDICT_BOUNDED,
     "The softest motions, as the rocking of a disc on the few vertices that hold it, are the "
     "least "
     "damped, damping being that of changes of shape in units of the critical step: it still "
     "swings "
     "after 25,000 steps, with less energy than at first."},
    {"light damping", "voxel", "", VERDICT_BOUNDED,
     "A quarter of the usual damping: the softest motions, as the rocking of a disc on the few "
     "vertices that hold it, still swing after 25,000 steps, with less energy than at first."},
    {"Poisson ratio 0.49", "voxel, graded", "", VERDICT_BOUNDED,
     "Towards 0.5 the critical step gets short, and with it the damping that is measured in it: it "
     "still swings after 25,000 steps, with less energy than at first."},
    {"rest lengths", "surface", "", VERDICT_BOUNDED,
     "Springs that are nine tenths too short draw the sphere together: it rests where they and the "
     "shape springs are in balance."},
    {"tool left in the outside", "", "", VERDICT_BOUNDED,
     "The tool lies in the outside for ever and dents it: it rests against the tool."},
    {"1e3 N", "voxel", "", VERDICT_BOUNDED,
     "100 N s on 0.125 kg: stretched to many times its length it whirls about the face that is "
     "held; "
     "damping acts on changes of shape alone and has not yet taken all of its energy."},
    {"1e6 N", "voxel", "", VERDICT_BOUNDED,
     "1e5 N s on 0.125 kg: stretched to many times its length it whirls about the face that is "
     "held; "
     "damping acts on changes of shape alone and has not yet taken all of its energy."},
    {"cut while", "surface", "", VERDICT_BOUNDED,
     "It stands still, but with a fold in its wall: a wall of springs has no bending stiffness, "
     "and "
     "shape springs as soft as these do not open every fold of a crumpled wall that was cut."},
    {"starts inside out", "surface, adaptive", "", VERDICT_BOUNDED,
     "It stands still, but with a fold in its wall: a wall of springs has no bending stiffness, "
     "and shape springs as soft as these do not open every fold."},
    {"cut while", "voxel", "", VERDICT_BOUNDED,
     "The cut sets pieces free whose elements push apart: they fly off, and nothing slows them."},
    {"everything cut away", "voxel", "", VERDICT_BOUNDED,
     "Pieces that nothing holds fly on as they were pushed."},
    {"time step 1.2 of the bound, unsafe", "voxel", "", VERDICT_BOUNDED,
     "Beyond the bound it buzzes without end, as far as the turning of its elements lets it."},
    {"time step 1.1 of the bound, unsafe", "", "", VERDICT_RESET, BEYOND},
    {"time step 1.2 of the bound, unsafe", "", "", VERDICT_RESET, BEYOND},
    {"time step 2.5 of the bound, unsafe", "", "", VERDICT_RESET, BEYOND},
    {"node masses 1 : 1e6", "surface, choi2005, held", "", VERDICT_BOUNDED, CIRCLES},
    {"starts at random", "surface, choi2005, held", "", VERDICT_BOUNDED, CIRCLES},
    {"1e3 N", "surface, choi2005, held", "", VERDICT_BOUNDED, CIRCLES},
    {"1e6 N", "surface, choi2005, held", "", VERDICT_BOUNDED, CIRCLES},
    {"one element", "surface, choi2005, held", "", VERDICT_BOUNDED, CIRCLES},
    {"stiffening", "surface, choi2005, held", "", VERDICT_BOUNDED, CIRCLES},
    {"pushed against", "surface, choi2005, held", "", VERDICT_BOUNDED, CIRCLES},
    {"pinned", "surface, choi2005, held", "", VERDICT_BOUNDED, CIRCLES},
    {"grasped", "surface, choi2005, held", "", VERDICT_BOUNDED, CIRCLES},
    {"pressure", "surface", "", VERDICT_BOUNDED,
     "The pressure keeps it inflated: it rests where the wall carries it."},
    {"gas", "surface, adaptive", "", VERDICT_BOUNDED, ENCLOSED},
    {"fluid", "surface, adaptive", "", VERDICT_BOUNDED, ENCLOSED},
    {"stiffening", "voxel", "", VERDICT_BOUNDED,
     "The critical step of what may stiffen 100 times is a tenth as long, and with it the damping "
     "that is measured in it: it still swings after 25,000 steps, with less energy than at first."},
    {"attached", "surface", "", VERDICT_BOUNDED,
     "It stands still, at 1/200 of its size from its rest shape: nodes that come where it refines "
     "are attached where they come, midway between others, not on the round shape."},
    {"gravity", "", "", VERDICT_BOUNDED,
     "A hundred times the earth's gravity draws it from its rest shape for ever, with no more "
     "energy than gravity has brought."},
    {"fitted surface, cut", "voxel", "", VERDICT_BOUNDED,
     "The cut sets pieces free whose elements push apart: they fly off, and nothing slows them."},
    {"free", "", "", VERDICT_BOUNDED,
     "Nothing holds it: it drifts and turns, or rests elsewhere, with no more energy than at "
     "first."},
};

static bool begins(const char *text, const char *with)
{
    return strncmp(text, with, strlen(with)) == 0;
}

const char *remark_find(const Cell *cell, const char *integrator)
{
    for (size_t i = 0; i < sizeof REMARKS / sizeof *REMARKS; i++) {
        const Remark *remark = &REMARKS[i];
        if (remark->verdict == cell->verdict &&
            begins(CASES[cell->at_case].name, remark->at_case) &&
            begins(MODELS[cell->model].name, remark->model) &&
            begins(integrator, remark->integrator))
            return remark->sentence;
    }
    return NULL;
}
