// Requests of a page: JSON text to plain numbers, all of them validated. Pure functions, any
// thread.
#ifndef PLIANT_WEB_ASK_H
#define PLIANT_WEB_ASK_H

#include "client.h"

enum {
    ASK_BYTES_MAX = 16384, // of one message of a page
    ASK_TEXT_MAX = 112,    // of a body's name and of an argument, with the terminating zero
};

typedef enum AskKind { ASK_DRAWN, ASK_TOOL, ASK_CUT, ASK_LOAD, ASK_COMMAND } AskKind;

typedef struct Ask {
    AskKind kind;
    int32_t id;              // of a cut, load or command: the page's own number
    char text[ASK_TEXT_MAX]; // cut and load: the body, "" = all; command: the argument
    union {
        int64_t round; // of `drawn`
        struct {
            int32_t tool;
            double position[3];    // [m]
            double orientation[4]; // w x y z, unit
            double grip;           // [0, 1]
            bool active;
        } pose;
        struct {
            double before[2][3], after[2][3]; // [m]
        } cut;
        struct {
            double center[3], radius, force[3], duration; // [m], [m], [N], [s]
        } load;
        struct {
            int32_t kind; // PLIANT_COMMAND_T_...
            int64_t value;
        } command;
    };
} Ask;

// Parses a message. Returns false if it is none, or if a number is outside its range; `error` says
// which.
bool ask_parse(const char *text, size_t size, Ask *ask, ClientError *error);

#endif
