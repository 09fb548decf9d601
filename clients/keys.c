// SPDX-License-Identifier: MIT
// Single key presses from a terminal. One thread.
#include "keys.h"

#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

static struct termios saved;
static bool is_open;

bool keys_open(void)
{
    if (tcgetattr(STDIN_FILENO, &saved) != 0)
        return false;
    struct termios raw = saved;
    raw.c_lflag &= ~(tcflag_t)(ICANON | ECHO);
    raw.c_cc[VMIN] = 0; // read returns immediately
    raw.c_cc[VTIME] = 0;
    // A stop or core dump in between would leave the terminal modified.
    raw.c_cc[VSUSP] = _POSIX_VDISABLE;
    raw.c_cc[VQUIT] = _POSIX_VDISABLE;
    if (tcsetattr(STDIN_FILENO, TCSANOW, &raw) != 0)
        return false;
    is_open = true;
    atexit(keys_close);
    return true;
}

int keys_read(void)
{
    unsigned char c;
    if (!is_open || read(STDIN_FILENO, &c, 1) != 1)
        return KEY_NONE;
    if (c != 0x1b)
        return c;
    // An arrow is ESC [ A..D in one piece; a lone ESC has no meaning.
    unsigned char rest[2];
    if (read(STDIN_FILENO, rest, 2) != 2 || (rest[0] != '[' && rest[0] != 'O'))
        return KEY_NONE;
    // The arrows; everything else in that form is ignored.
    switch (rest[1]) {
    case 'A':
        return KEY_UP;
    case 'B':
        return KEY_DOWN;
    case 'C':
        return KEY_RIGHT;
    case 'D':
        return KEY_LEFT;
    default:
        return KEY_NONE;
    }
}

void keys_close(void)
{
    if (is_open)
        tcsetattr(STDIN_FILENO, TCSANOW, &saved);
    is_open = false;
}
