// SPDX-License-Identifier: MIT
#include "base/check.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

_Noreturn void check_failed(const char *condition, const char *file, int line)
{
    fprintf(stderr, "pliant: broken invariant at %s:%d: %s\n", file, line, condition);
    abort();
}

bool status_fail(Status *status, StatusCode code, const char *format, ...)
{
    if (status == NULL || status->code != STATUS_OK)
        return false;
    status->code = code;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(status->text, sizeof status->text, format, arguments);
    va_end(arguments);
    return false;
}
