#include "io/units.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static const struct {
    const char *name, *word; // `word`: first letters of the long name
    double scale;
} UNITS[] = {{"m", "met", 1.0},
             {"dm", "deci", 0.1},
             {"cm", "centi", 0.01},
             {"mm", "milli", 0.001},
             {"um", "micro", 1e-6}};
enum { UNIT_COUNT = sizeof UNITS / sizeof *UNITS };

// By extent in file units: the unit that makes it 5 to 50 cm, the size of organs. In doubt if a
// more common unit makes it 5 mm to 5 m.
static const struct {
    double below; // upper limit of the extent
    int unit;
    bool doubt;
    const char *why;
} GUESSES[] = {
    {0.005, 0, true, "no unit makes it as large as an organ"},
    {0.05, 0, false, "other units would make it smaller still"},
    {0.5, 0, false, "that is the size of an organ"},
    {5.0, 1, true, "that is the size of an organ, but files in decimetres are rare"},
    {50.0, 2, true, "that is the size of an organ, but most files are in mm"},
    {500.0, 3, false, "that is the size of an organ"},
    {5e3, 3, true, "that is large for an organ"},
    {2e4, 4, true, "that is small for an organ, but in mm it would be larger than any"},
    {5e5, 4, false, "that is the size of an organ"},
    {HUGE_VAL, 4, true, "no unit makes it as small as an organ"},
};

enum { GUESS_COUNT = sizeof GUESSES / sizeof *GUESSES };

bool units_parse(const char *name, double *scale)
{
    for (int i = 0; i < UNIT_COUNT; i++)
        if (strcmp(name, UNITS[i].name) == 0) {
            *scale = UNITS[i].scale;
            return true;
        }
    return false;
}

void units_length(double metres, char text[UNITS_LENGTH])
{
    const double length = fabs(metres);
    const int unit = length >= 1.0 ? 0 : length >= 1e-3 ? 3 : 4;
    snprintf(text, UNITS_LENGTH, "%.3g %s", metres / UNITS[unit].scale, UNITS[unit].name);
}

// Returns the unit that a word names; -1: none. It ends at the first character that is no letter.
static int unit_of_word(const char *at)
{
    size_t length = 0;
    while (isalpha((unsigned char)at[length]))
        length++;
    for (int i = 0; i < UNIT_COUNT; i++)
        if ((length == strlen(UNITS[i].name) && strncasecmp(at, UNITS[i].name, length) == 0) ||
            (length > 4 && strncasecmp(at, UNITS[i].word, strlen(UNITS[i].word)) == 0))
            return i;
    return -1;
}

// Searches the beginning of the file: "units: mm", "UNITS=mm", or a frame of 3D Slicer, which
// exports in millimetres. -1: nothing found.
static int unit_in_file(const char *path, const char **says)
{
    char text[1001] = "";
    FILE *file = fopen(path, "rb");
    size_t size = file != NULL ? fread(text, 1, sizeof text - 1, file) : 0;
    if (file != NULL)
        fclose(file);
    for (size_t i = 0; i < size; i++)
        text[i] = text[i] == '\0' ? ' ' : text[i];
    text[size] = '\0';
    *says = "its first lines come from 3D Slicer, which writes mm";
    if (strstr(text, "SPACE=LPS") != NULL || strstr(text, "SPACE=RAS") != NULL)
        return 3;
    *says = "its first lines say so";
    for (const char *at = text; (at = strcasestr(at, "unit")) != NULL; at++) {
        const char *word = at + 4;
        word += *word == 's' || *word == 'S';
        size_t between = strspn(word, " \t:=");
        int unit = between > 0 && between < 8 ? unit_of_word(word + between) : -1;
        if (unit >= 0)
            return unit;
    }
    return -1;
}

Units units_guess(const char *path, double extent)
{
    const char *says;
    char size[UNITS_LENGTH];
    Units units = {0};
    int unit = unit_in_file(path, &says);
    if (unit < 0) {
        int row = 0;
        while (row < GUESS_COUNT - 1 && extent >= GUESSES[row].below)
            row++;
        unit = GUESSES[row].unit;
        units.doubt = GUESSES[row].doubt;
        says = GUESSES[row].why;
    }
    units.scale = UNITS[unit].scale;
    units.name = UNITS[unit].name;
    units_length(extent * units.scale, size);
    snprintf(units.reason, sizeof units.reason, "taken as %s: %.4g of them are %s, %s", units.name,
             extent, size, says);
    return units;
}
