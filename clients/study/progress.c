// A progress bar.
#include "study/progress.h"

#include <string.h>

enum { BAR = 20, LINE = 256 };

void progress_begin(Progress *progress, FILE *out, bool terminal, int columns, double now_s)
{
    *progress = (Progress){
        .out = out, .terminal = terminal, .columns = columns, .begin_s = now_s, .told = -1};
}

double progress_left(double elapsed_s, int done, int count)
{
    return done > 0 ? elapsed_s * (count - done) / done : -1.0;
}

const char *progress_clock(double seconds, char *text)
{
    enum { SIZE = 32 };
    if (!(seconds >= 0.0 && seconds < 1e8)) {
        snprintf(text, SIZE, "?");
        return text;
    }
    long whole = (long)(seconds + 0.5);
    if (whole >= 3600)
        snprintf(text, SIZE, "%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60, whole % 60);
    else
        snprintf(text, SIZE, "%ld:%02ld", whole / 60, whole % 60);
    return text;
}

static void draw_bar(char *bar, int done, int count)
{
    int full = count > 0 ? BAR * done / count : BAR;
    for (int i = 0; i < BAR; i++)
        bar[i] = i < full ? '#' : '.';
    bar[BAR] = '\0';
}

void progress_tell(Progress *progress, int done, int count, const char *name, double now_s)
{
    char elapsed[32], left[32], bar[BAR + 1], line[LINE];
    double elapsed_s = now_s - progress->begin_s;
    int percent = count > 0 ? 100 * done / count : 100;
    progress_clock(elapsed_s, elapsed);
    progress_clock(progress_left(elapsed_s, done, count), left);
    if (!progress->terminal) {
        if (percent / 10 == progress->told)
            return;
        progress->told = percent / 10;
        fprintf(progress->out, "%3d %%  %s elapsed, %s left  %s\n", percent, elapsed, left, name);
        fflush(progress->out);
        return;
    }
    draw_bar(bar, done, count);
    int length = snprintf(line, sizeof line, "[%s] %3d %%  %s elapsed, %s left  %s", bar, percent,
                          elapsed, left, name);
    int most =
        progress->columns > 1 && progress->columns <= LINE ? progress->columns - 1 : LINE - 1;
    length = length < most ? length : most;
    // Overwrite the rest of a longer last line with spaces.
    int more = progress->width > length ? progress->width - length : 0;
    fprintf(progress->out, "\r%.*s%*s", length, line, more, "");
    fflush(progress->out);
    progress->width = length;
}

void progress_end(Progress *progress)
{
    if (progress->terminal && progress->width > 0)
        fprintf(progress->out, "\r%*s\r", progress->width, "");
    progress->width = 0;
    fflush(progress->out);
}
