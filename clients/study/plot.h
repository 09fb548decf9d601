// Draws the curves of a study with gnuplot, if installed.
#ifndef PLIANT_STUDY_PLOT_H
#define PLIANT_STUDY_PLOT_H

#include "study/study.h"

typedef enum PlotResult { PLOT_DRAWN, PLOT_NO_GNUPLOT, PLOT_FAILED } PlotResult;

// Writes folder/study.gp. It contains its data and draws, into its own folder, time.png and
// time.svg (error in time over cost, by integrator, on the scene's own mesh), total.png and
// total.svg (total error over cost, by detail, with the Pareto front). `error`: the limit that is
// drawn, as a fraction.
bool plot_write(const StudyResult *result, const char *folder, double error, Status *status);
// Runs `program` (found by name, "gnuplot") on it. A failed picture is no failure of the study;
// `status` has the reason.
PlotResult plot_draw(const char *program, const char *folder, Status *status);

#endif
