// SPDX-License-Identifier: MIT
// Ranks of mpirun.
#include "study/run.h"

#ifdef PLIANT_WITH_MPI

#include <mpi.h>
#include <stdlib.h>

// True if a launcher has started this process: otherwise MPI is not even begun.
static bool is_launched(void)
{
    return getenv("OMPI_COMM_WORLD_SIZE") != NULL || getenv("PMIX_RANK") != NULL ||
           getenv("PMI_SIZE") != NULL || getenv("PMI_RANK") != NULL;
}

int ranks_begin(int *argc, char ***argv)
{
    int rank = 0;
    if (!is_launched())
        return 0;
    MPI_Init(argc, argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    return rank;
}

bool ranks_go(bool ok)
{
    int begun = 0, own = ok, all = ok;
    MPI_Initialized(&begun);
    if (begun == 0)
        return ok;
    MPI_Allreduce(&own, &all, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
    // Left here: a rank that died later would keep the others in MPI_Finalize for ever.
    MPI_Finalize();
    return all != 0;
}

#else

int ranks_begin(int *argc, char ***argv)
{
    (void)argc, (void)argv;
    return 0;
}

bool ranks_go(bool ok)
{
    return ok;
}
#endif
