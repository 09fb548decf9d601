// Private to cut_windows.c: packs one window's batches anew.
#ifndef PLIANT_VOXEL_CUT_CUT_PACK_H
#define PLIANT_VOXEL_CUT_CUT_PACK_H

#include "voxel/cut/cut_windows.h"

// `turns`: rotations go along with their elements, from places of before; else `last` stays as it
// is. Windows with finer elements first, so that leaves still find the rotation of what they came
// of.
void cut_pack(CutWindows *windows, int window, bool turns);

#endif
