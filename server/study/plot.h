// The curves of a study, drawn by gnuplot where it is installed.
#ifndef PLIANT_STUDY_PLOT_H
#define PLIANT_STUDY_PLOT_H

#include "study/study.h"

typedef enum PlotResult { PLOT_DRAWN, PLOT_NO_GNUPLOT, PLOT_FAILED } PlotResult;

// Writes folder/study.gp, which holds its data and draws time.png, time.svg (error in time over the
// cost, by integrator, on the scene's own mesh), total.png and total.svg (total error over the
// cost, by detail, with the Pareto front), into its own folder. `error`: the limit that is drawn,
// as a fraction.
bool plot_write(const StudyResult *result, const char *folder, double error, Status *status);
// Runs `program` (a name to be found, "gnuplot") on it. A picture that fails is no failure of the
// study; why is in `status`.
PlotResult plot_draw(const char *program, const char *folder, Status *status);

#endif
