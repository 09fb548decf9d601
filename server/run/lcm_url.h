// Checks of an LCM URL and of the network behind it before LCM sees it, because LCM's own messages
// about them mislead. Main thread, at start.
#ifndef PLIANT_RUN_LCM_URL_H
#define PLIANT_RUN_LCM_URL_H

#include "base/status.h"

// `url` NULL: LCM_DEFAULT_URL, else LCM's default. False with a sentence that says what to do: not
// a URL that LCM has, or no route for its multicast group.
bool lcm_url_check(const char *url, Status *status);

#endif
