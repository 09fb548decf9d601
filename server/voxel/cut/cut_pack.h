// Private to cut_windows.c: packs one group of windows.
#ifndef PLIANT_VOXEL_CUT_CUT_PACK_H
#define PLIANT_VOXEL_CUT_CUT_PACK_H

#include "voxel/cut/cut_windows.h"

// Packs the group's windows whose is_changed is set, and what they and the others leave to the
// group. `turns`: rotations move along with their elements, from their previous places; otherwise
// `last` stays. Pack groups with finer elements first, so that leaves still find the rotation of
// the element from which they were divided.
void cut_pack(CutWindows *windows, int group, bool turns);

#endif
