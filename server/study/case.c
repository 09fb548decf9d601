#include "study/case.h"
