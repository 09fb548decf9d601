// Private to cut_windows.c: packs one group of windows anew.
#ifndef PLIANT_VOXEL_CUT_CUT_PACK_H
#define PLIANT_VOXEL_CUT_CUT_PACK_H

#include "voxel/cut/cut_windows.h"

// Of the group's windows those whose is_changed is set, and what they and the others leave to the
// group. `turns`: rotations go along with their elements, from the places of before; else `last`
// stays as it is. Groups with finer elements first, so that leaves still find the rotation of what
// they came of.
void cut_pack(CutWindows *windows, int group, bool turns);

#endif
