#include "convert.h"

#include "io/event_log.h"
#include "writer.h"

#include <stdlib.h>
#include <string.h>

typedef struct Convert {
    Intake survey, intake;
    Writer writer;
    Queue nothing; // output of the first reading, unused
    LogEvent event;
} Convert;

// Reads the log to its end or to its first damage.
static void read_log(Convert *convert, const char *path, Intake *intake, bool record,
                     Status *status)
{
    EventLog log;
    if (!event_log_open(&log, path, status))
        return;
    LogEvent *event = &convert->event;
    while (!client_stopped() && event_log_next(&log, event, status)) {
        if (event->size > EVENT_LOG_DATA_MAX) // larger than any of ours
            continue;
        intake_take(intake, event->channel, event->data, event->size);
        if (record && (!intake_begin(intake, false) || writer_failed(&convert->writer)))
            break;
    }
    event_log_close(&log);
}

// Surveys the whole log: a recording begins with all bodies and tools.
static bool take_survey(Convert *convert, const char *log, const LiveOptions *options,
                        ClientError *error)
{
    Survey *survey = &convert->survey.survey;
    int bodies = 0;
    for (int i = 0; i < survey->body_count; i++) {
        SurveyBody *body = &survey->body[i];
        body->listed = body->seen && body->nodes > 0;
        bodies += body->listed;
        if (body->seen && !body->listed)
            fprintf(stderr, "pliant-record: %s: no mesh of body %s in it: skipped\n", log,
                    body->name);
    }
    survey->status_come = true;
    if (bodies == 0)
        return client_fail(error, "%s: no nodes and mesh of a body on %s_... in it", log,
                           options->intake.prefix);
    const char *missing = survey_missing(survey);
    if (missing)
        return client_fail(error, "--body %s: not in %s", missing, log);
    convert->intake.survey = *survey;
    *survey = (Survey){0};
    return true;
}

static bool record(Convert *convert, const char *log, const LiveOptions *options,
                   ClientError *error)
{
    Status damage = {0}, status = {0};
    read_log(convert, log, &convert->survey, false, &status);
    if (!take_survey(convert, log, options, error))
        return status.code == STATUS_OK ? false : client_fail(error, "%s", status.text);
    status = (Status){0};
    if (!writer_start(&convert->writer, options->queue_bytes, stdout, &status))
        return client_fail(error, "%s", status.text);
    read_log(convert, log, &convert->intake, true, &damage);
    intake_end(&convert->intake);
    bool ok = convert->intake.status.code == STATUS_OK ||
              client_fail(error, "%s", convert->intake.status.text);
    if (damage.code != STATUS_OK)
        ok = client_fail(error, "%s", damage.text);
    if (!writer_finish(&convert->writer, &status))
        ok = client_fail(error, "%s", status.text);
    if (convert->intake.restarts > 0)
        fprintf(stderr, "pliant-record: %s: the daemon restarted %d times: %d files\n", log,
                convert->intake.restarts, convert->intake.files);
    return ok;
}

bool convert_log(const char *log, const LiveOptions *options, ClientError *error)
{
    Convert *convert = calloc(1, sizeof *convert);
    if (!convert)
        return client_fail(error, "out of memory");
    IntakeOptions all = options->intake;
    all.when_full = QUEUE_WAIT;
    queue_create(&convert->nothing, 0);
    all.survey_only = true;
    intake_create(&convert->survey, &all, &convert->nothing);
    all.survey_only = false;
    intake_create(&convert->intake, &all, &convert->writer.queue);
    convert->survey.survey.wanted = options->body;
    convert->survey.survey.wanted_count = options->body_count;
    bool ok = record(convert, log, options, error);
    intake_destroy(&convert->survey);
    intake_destroy(&convert->intake);
    queue_destroy(&convert->nothing);
    free(convert);
    return ok;
}
