// Single key presses from a terminal, which is put back as it was at exit. One thread.
#ifndef PLIANT_CLIENTS_KEYS_H
#define PLIANT_CLIENTS_KEYS_H

#include <stdbool.h>

enum { KEY_NONE = 0, KEY_UP = 0x100, KEY_DOWN, KEY_LEFT, KEY_RIGHT };

// Keys come at once and unseen; Ctrl-C stays a signal. False when standard input is no terminal.
bool keys_open(void);
// The next key (a character or one of the above), or KEY_NONE. Never waits.
int keys_read(void);
void keys_close(void);

#endif
