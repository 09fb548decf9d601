// Describes a study before its first run.
#include "base/isa.h"
#include "study/context.h"

#include <stdio.h>
#include <string.h>

// Finds the processor's name, if the system reports it.
static void find_processor(char *name, size_t size)
{
    char line[256];
    FILE *file = fopen("/proc/cpuinfo", "r");
    snprintf(name, size, "unknown processor");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        const char *colon = strchr(line, ':');
        if (strncmp(line, "model name", 10) != 0 || colon == NULL)
            continue;
        snprintf(name, size, "%.*s", (int)strcspn(colon + 2, "\n"), colon + 2);
        break;
    }
    if (file != NULL)
        fclose(file);
}

#ifdef __clang__
#define COMPILER "clang " __clang_version__
#else
#define COMPILER "gcc " __VERSION__
#endif

void study_describe(const StudyContext *context, StudyResult *result)
{
    char processor[96];
    IsaLevel level = isa_find(context->options.isa);
    find_processor(processor, sizeof processor);
    snprintf(result->scene, sizeof result->scene, "%s", context->scene.name);
    snprintf(result->body, sizeof result->body, "%s", context->scene.body[context->body].name);
    snprintf(result->inputs, sizeof result->inputs, "%s", context->inputs.text);
    snprintf(result->machine, sizeof result->machine, "%s, %s, %s", processor,
             level < ISA_COUNT ? isa_name(level) : context->options.isa, COMPILER);
    result->duration_s = context->options.duration_s;
    result->rate_hz = context->options.rate_hz;
}
