// SPDX-License-Identifier: MIT
// Single key presses from a terminal, whose settings are restored at exit. One thread.
#ifndef PLIANT_CLIENTS_KEYS_H
#define PLIANT_CLIENTS_KEYS_H

#include <stdbool.h>

enum { KEY_NONE = 0, KEY_UP = 0x100, KEY_DOWN, KEY_LEFT, KEY_RIGHT };

// Delivers keys immediately and without echo; Ctrl-C stays a signal. Returns false if standard
// input is no terminal.
bool keys_open(void);
// Returns the next key (a character or one of the above), or KEY_NONE. Never blocks.
int keys_read(void);
void keys_close(void);

#endif
