#include "grip.h"

#include <stdlib.h>

// Reads a number at *text and advances past it.
static bool take_number(const char **text, double low, double high, double *number)
{
    char *end;
    *number = strtod(*text, &end);
    bool ok = end != *text && *number >= low && *number <= high;
    *text = end;
    return ok;
}

bool grip_parse(const char *text, Grip *grip)
{
    *grip = (Grip){0};
    double first;
    const char *at = text;
    if (!take_number(&at, -1e5, 1e5, &first))
        return false;
    if (*at == '\0') {
        grip->count = 1;
        grip->value[0] = first;
        return first >= 0.0 && first <= 1.0;
    }
    for (at = text; grip->count < GRIP_POINTS;) {
        int i = grip->count++;
        if (!take_number(&at, 0.0, 1e5, &grip->time[i]) || *at++ != ':' ||
            !take_number(&at, 0.0, 1.0, &grip->value[i]) ||
            (i > 0 && grip->time[i] < grip->time[i - 1]))
            return false;
        if (*at == '\0')
            return true;
        if (*at++ != ',')
            return false;
    }
    return false;
}

double grip_at(const Grip *grip, double time)
{
    if (grip->count == 0)
        return 0.0;
    int next = 0;
    while (next < grip->count && grip->time[next] <= time)
        next++;
    if (next == 0 || next == grip->count)
        return grip->value[next == 0 ? 0 : next - 1];
    double from = grip->time[next - 1], to = grip->time[next];
    double share = (time - from) / (to - from);
    return grip->value[next - 1] + share * (grip->value[next] - grip->value[next - 1]);
}
