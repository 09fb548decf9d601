// MPI ranks take cases one after the other from a counter on the first rank.

#include "study/run.h"

#ifdef PLIANT_WITH_MPI

#include <mpi.h>

enum { TAG_RUN = 1 };

void ranks_begin(int *argc, char ***argv)
{
    MPI_Init(argc, argv);
}

void ranks_end(StatusCode code)
{
    if (code != STATUS_OK && ranks_count() > 1)
        MPI_Abort(MPI_COMM_WORLD, (int)code);
    MPI_Finalize();
}

static int own_rank(void)
{
    int rank;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    return rank;
}

bool ranks_is_first(void)
{
    return own_rank() == 0;
}

int ranks_count(void)
{
    int count;
    MPI_Comm_size(MPI_COMM_WORLD, &count);
    return count;
}

// --- references ----------------------------------------------------------------------------------

static void send_to_all(void *data, size_t bytes)
{
    enum { PIECE = 1 << 30 };
    for (size_t at = 0; at < bytes; at += PIECE) {
        size_t rest = bytes - at;
        MPI_Bcast((char *)data + at, (int)(rest < PIECE ? rest : PIECE), MPI_BYTE, 0,
                  MPI_COMM_WORLD);
    }
}

static bool share_trace(const StudyContext *context, StudyTrace **trace, Status *status)
{
    int there = *trace != NULL;
    send_to_all(&there, sizeof there);
    if (!there)
        return true;
    if (*trace == NULL)
        *trace = study_trace_create(context->sample_count, context->points.count);
    if (*trace == NULL)
        return status_fail(status, STATUS_FAILED, "pliant-study: no memory");
    send_to_all(*trace, study_trace_bytes(context->sample_count, context->points.count));
    return true;
}

bool ranks_make_references(StudyContext *context, const StudyCase *cases, int count,
                           StudyReferenceProgress *progress, void *user, StudyResult *result,
                           Status *status)
{
    if (ranks_count() > 1)
        context->options.jobs = 1; // MPI processes must not fork
    if (ranks_is_first() &&
        !study_make_references(context, cases, count, progress, user, result, status))
        return false; // ranks_end ends the others
    send_to_all(&context->mesh_count, sizeof context->mesh_count);
    send_to_all(context->mesh, sizeof context->mesh);
    send_to_all(&context->finest, sizeof context->finest);
    for (int i = 0; i < context->mesh_count; i++)
        if (!share_trace(context, &context->mesh_trace[i], status))
            return false;
    return share_trace(context, &context->finest_trace, status);
}

// --- cases ---------------------------------------------------------------------------------------

// Takes the next free case.
static int take_case(MPI_Win counter)
{
    const int one = 1;
    int taken = 0;
    MPI_Win_lock(MPI_LOCK_SHARED, 0, 0, counter);
    MPI_Fetch_and_op(&one, &taken, MPI_INT, 0, 0, MPI_SUM, counter);
    MPI_Win_unlock(0, counter);
    return taken;
}

// Sends results to the first rank, each with its index in the tag.
static void gather(StudyRun *runs, const bool *mine, int count)
{
    for (int i = 0; i < count; i++)
        if (mine[i] && !ranks_is_first())
            MPI_Send(&runs[i], sizeof runs[i], MPI_BYTE, 0, TAG_RUN + i, MPI_COMM_WORLD);
    for (int i = 0; i < count; i++)
        if (!mine[i] && ranks_is_first())
            MPI_Recv(&runs[i], sizeof runs[i], MPI_BYTE, MPI_ANY_SOURCE, TAG_RUN + i,
                     MPI_COMM_WORLD, MPI_STATUS_IGNORE);
}

bool ranks_run_all(const StudyContext *context, const StudyCase *cases, int count, int jobs,
                   StudyProgress *progress, void *user, StudyResult *result, Status *status)
{
    if (ranks_count() == 1)
        return study_run_all(context, cases, count, jobs, progress, user, result, status);
    // A counter on the first rank says which case is next.
    bool mine[STUDY_CASES] = {false}, ok = true;
    int *next;
    MPI_Win counter;
    MPI_Win_allocate(ranks_is_first() ? sizeof *next : 0, sizeof *next, MPI_INFO_NULL,
                     MPI_COMM_WORLD, &next, &counter);
    if (ranks_is_first())
        *next = 0;
    MPI_Barrier(MPI_COMM_WORLD);
    // Take cases until there are none.
    for (int i = take_case(counter); i < count; i = take_case(counter)) {
        mine[i] = true;
        ok = study_run_case(context, &cases[i], &result->run[i]) && ok;
        if (progress != NULL)
            progress(user, i + 1, count, &result->run[i]);
    }
    if (!ok)
        return status_fail(status, STATUS_FAILED, "pliant-study: no memory");
    // The first rank gets the results of all.
    result->run_count = count;
    gather(result->run, mine, count);
    MPI_Win_free(&counter);
    return true;
}

#else

void ranks_begin(int *argc, char ***argv)
{
    (void)argc, (void)argv;
}

void ranks_end(StatusCode code)
{
    (void)code;
}

bool ranks_is_first(void)
{
    return true;
}

int ranks_count(void)
{
    return 1;
}

bool ranks_make_references(StudyContext *context, const StudyCase *cases, int count,
                           StudyReferenceProgress *progress, void *user, StudyResult *result,
                           Status *status)
{
    return study_make_references(context, cases, count, progress, user, result, status);
}

bool ranks_run_all(const StudyContext *context, const StudyCase *cases, int count, int jobs,
                   StudyProgress *progress, void *user, StudyResult *result, Status *status)
{
    return study_run_all(context, cases, count, jobs, progress, user, result, status);
}
#endif
