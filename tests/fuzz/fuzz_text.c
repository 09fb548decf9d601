// SPDX-License-Identifier: MIT
// Texts that users give to the clients: the files of pliant-probe --poses and pliant-cut --file,
// and arguments of command lines. The first byte says which.
#include "fuzz.h"

#include "blade.h"
#include "client.h"
#include "track.h"

#include <math.h>
#include <stdlib.h>

static void read_poses(const char *path)
{
    Track track = {0};
    PliantError error = {{0}};
    if (track_read(&track, path, &error)) {
        MUST(track.count > 0);
        TrackPose pose;
        double duration = track_duration(&track);
        MUST(duration >= 0.0 && duration <= TRACK_TIME);
        for (int i = 0; i <= 16; i++) {
            track_at(&track, duration * i / 16.0, &pose);
            double length = 0.0;
            for (int c = 0; c < 3; c++)
                MUST(fabs(pose.position[c]) <= TRACK_REACH);
            for (int c = 0; c < 4; c++)
                length += pose.orientation[c] * pose.orientation[c];
            MUST(fabs(length - 1.0) < 1e-3); // what the daemon allows
        }
    } else {
        MUST(error.text[0] != '\0' && strchr(error.text, '\n') == NULL);
    }
    track_destroy(&track);
}

static void read_blade(const char *path)
{
    BladePath blade = {0};
    PliantError error = {{0}};
    Track track = {0};
    if (blade_read(&blade, path, &error)) {
        MUST(blade_sweeps(&blade) > 0);
        for (int at = -1, n = 0; n < 100 && (at = blade_next_sweep(&blade, at)) >= 0; n++)
            MUST(at + 1 < blade.count);
        if (blade.count <= 1000)
            blade_track(&blade, 0, 0.1, &track);
    } else {
        MUST(error.text[0] != '\0' && strchr(error.text, '\n') == NULL);
    }
    track_destroy(&track);
    blade_destroy(&blade);
}

static void parse_arguments(const char *text)
{
    double number, vector[3], line[8];
    long long integer;
    char why[RECEIVER_WHY_MAX];
    Network network;
    if (argument_read_numbers(text, 1, -1.0, 1e6, &number))
        MUST(number >= -1.0 && number <= 1e6);
    if (argument_read_integer(text, 1, 100, &integer))
        MUST(integer >= 1 && integer <= 100);
    if (argument_read_numbers(text, 3, -10.0, 10.0, vector))
        for (int c = 0; c < 3; c++)
            MUST(fabs(vector[c]) <= 10.0);
    MUST(program_read_numbers(text, line, 8) <= 8);
    if (argument_is_name(text, CLIENT_PREFIX_MAX - 1))
        MUST(strlen(text) < CLIENT_PREFIX_MAX);
    if (network_read(&network, text, why))
        MUST(!network.udpm || network.group >> 28 == 14);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    switch (data[0] % 3) {
    case 0:
        read_poses(fuzz_write("poses", data + 1, size - 1));
        break;
    case 1:
        read_blade(fuzz_write("edges", data + 1, size - 1));
        break;
    default: {
        char *text = malloc(size);
        MUST(text != NULL);
        memcpy(text, data + 1, size - 1);
        text[size - 1] = '\0';
        parse_arguments(text);
        free(text);
    }
    }
    return 0;
}
