// Status texts. Called at load time and where input enters, never on the step thread.
#include "base/status.h"

#include <stdarg.h>
#include <stdio.h>

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
