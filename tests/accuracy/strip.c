// SPDX-License-Identifier: MIT
// pliant-strip-accuracy SCENES OUT [REPEATS [PART...]]: strips of both models pulled at given
// rates, against closed forms of their laws; and materials fitted to curves of other laws.
#include "experiment.h"
#include "scoped.h"

#include "base/check.h"
#include "base/log.h"
#include "fit/fit.h"
#include "fit/strip.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void need(bool good, const Status *status)
{
    if (good)
        return;
    fprintf(stderr, "pliant-strip-accuracy: %s\n", status->text);
    exit(1);
}

// --- laws against their closed forms -------------------------------------------------------------

typedef struct Law {
    const char *name;
    SceneModel model;
    double modulus, strain, cap; // [Pa] or [N/m]; strain 0: linear
    double share, time;          // of a branch that relaxes, volume and all; 0: none
    double rate, most;           // of the pull [1/s], and its end
    const char *material;        // the whole group
} Law;

// Densities are low, so that no wave shows in the fastest pull.
static const Law LAWS[] = {
    {"solid, linear, nu = 0.3", MODEL_VOXEL, 2e4, 0.0, 1.0, 0.0, 0.0, 0.5, 0.5,
     "youngs_modulus = 2e4;  poisson_ratio = 0.3;  density = 100.0;"},
    {"surface, linear", MODEL_SURFACE, 20.0, 0.0, 1.0, 0.0, 0.0, 0.5, 0.5,
     "youngs_modulus_2d = 20.0;  areal_density = 0.1;"},
    {"solid, stiffening, nu = 0", MODEL_VOXEL, 2e4, 0.2, 14.0, 0.0, 0.0, 0.5, 0.5,
     "youngs_modulus = 2e4;  density = 100.0;  stiffening = { strain = 0.2;  cap = 14.0; };"},
    {"solid, stiffening, nu = 0.45", MODEL_VOXEL, 2e4, 0.2, 14.0, 0.0, 0.0, 0.5, 0.5,
     "youngs_modulus = 2e4;  poisson_ratio = 0.45;  density = 100.0;"
     "  stiffening = { strain = 0.2;  cap = 14.0; };"},
    {"surface, stiffening", MODEL_SURFACE, 20.0, 0.2, 14.0, 0.0, 0.0, 0.5, 0.5,
     "youngs_modulus_2d = 20.0;  areal_density = 0.1;"
     "  stiffening = { strain = 0.2;  cap = 14.0; };"},
#define RELAXING                                                                                   \
    "youngs_modulus = 2e4;  poisson_ratio = 0.3;  density = 50.0;  drag = 0.0;  damping = 0.2;"    \
    "  relaxation = ( { time = 0.5;  share = 0.5;  volumetric = true; } );"
    {"solid, half relaxes in 0.5 s, 0.2/s", MODEL_VOXEL, 2e4, 0.0, 1.0, 0.5, 0.5, 0.2, 0.5,
     RELAXING},
    {"solid, half relaxes in 0.5 s, 1/s", MODEL_VOXEL, 2e4, 0.0, 1.0, 0.5, 0.5, 1.0, 0.5, RELAXING},
    {"solid, half relaxes in 0.5 s, 5/s", MODEL_VOXEL, 2e4, 0.0, 1.0, 0.5, 0.5, 5.0, 0.5, RELAXING},
};
enum { LAW_COUNT = sizeof LAWS / sizeof LAWS[0], STEPS = 4 };

// The law as the README has it, on its own: the knee by halving.
static double elastic_stress(const Law *law, double strain)
{
    if (!(law->strain > 0.0))
        return law->modulus * strain;
    double low = 0.0, high = 3.0;
    for (int i = 0; i < 60; i++) {
        const double q = 0.5 * (low + high);
        *((1.0 + 2.0 * q) * exp(q) < law->cap ? &low : &high) = q;
    }
    const double knee = law->strain * sqrt(low), scaled = fmin(strain, knee) / law->strain;
    return law->modulus *
           (fmin(strain, knee) * exp(scaled * scaled) + law->cap * fmax(strain - knee, 0.0));
}

// The stress at each point of a curve, from its strains alone. Ticks are of 1 ms.
static double *expect(const Law *law, const StripCurve *curve)
{
    double *stress = zeroed((size_t)curve->count, sizeof *stress), branch = 0.0;
    // Of a branch, exactly for a strain that is straight between ticks.
    const double stiffness = law->modulus * law->share / (1.0 - law->share);
    const double step = law->time > 0.0 ? 1e-3 / law->time : 0.0;
    for (int i = 1; i < curve->count; i++) {
        // The first point is in the middle of a tick.
        const double h = i == 1 ? 0.5 * step : step;
        if (law->time > 0.0)
            branch = branch * exp(-h) +
                     stiffness * (curve->strain[i] - curve->strain[i - 1]) * -expm1(-h) / h;
        stress[i] = elastic_stress(law, curve->strain[i]) + branch;
    }
    return stress;
}

// A table of some strains, and curves: strain, closed form, computed.
static void laws(const Experiment *experiment)
{
    CLOSED FILE *out = experiment_open(experiment, "strip.tsv");
    fprintf(out, "strip");
    for (int s = 1; s <= STEPS; s++)
        fprintf(out, "\tkPa (N/m) at %g", LAWS[0].most * s / STEPS);
    fprintf(out, "\toff by %% at most, from a tenth of the pull on\n");
    for (int k = 0; k < LAW_COUNT; k++) {
        const Law *law = &LAWS[k];
        const double unit = law->model == MODEL_VOXEL ? 1e-3 : 1.0; // kPa, N/m
        char path[4096], name[32];
        Status status = {0};
        SCOPED(strip_destroy) StripCurve curve;
        need(strip_write(experiment->out, "strip", law->model, law->material, "", &status),
             &status);
        snprintf(path, sizeof path, "%s/strip.cfg", experiment->out);
        need(strip_pull(path, law->most, law->rate, &curve, &status), &status);
        double *stress = expect(law, &curve), worst = 0.0;
        snprintf(name, sizeof name, "strip-%d.dat", k);
        FILE *points = experiment_open(experiment, name);
        for (int i = 1; i < curve.count; i++) {
            fprintf(points, "%.6g\t%.6g\t%.6g\n", curve.strain[i], unit * stress[i],
                    unit * curve.stress[i]);
            if (curve.strain[i] > 0.1 * law->most)
                worst = fmax(worst, fabs(curve.stress[i] / stress[i] - 1.0));
        }
        fclose(points);
        fprintf(out, "%s", law->name);
        for (int s = 1; s <= STEPS; s++)
            fprintf(out, "\t%.4g", unit * strip_stress_at(&curve, law->most * s / STEPS));
        fprintf(out, "\t%.2f\n", 100.0 * worst);
        free(stress);
    }
}

// --- fits to other laws --------------------------------------------------------------------------

// Nominal stress of incompressible Ogden material with one term, under tension.
static double ogden(double strain, double mu, double alpha)
{
    const double stretch = 1.0 + strain;
    return 2.0 * mu / alpha * (pow(stretch, alpha - 1.0) - pow(stretch, -0.5 * alpha - 1.0));
}

// One such term describes pig skin: Shergold, Fleck and Radford 2006 (Int. J. Impact Eng. 32,
// 1384). The two exponents stiffen slowly and suddenly.
static double ogden_9(double strain)
{
    return ogden(strain, 1.1e5, 9.0);
}
static double ogden_26(double strain)
{
    return ogden(strain, 1e4, 26.0);
}
// Fung 1967: a slope that grows in proportion to the stress.
static double fung_1967(double strain)
{
    return 1e4 * expm1(5.0 * strain);
}
// A toe of 20 kPa up to a strain of 0.15, then a line that is 5 and 14 times as steep.
static double toe(double strain, double steeper)
{
    return 2e4 * (fmin(strain, 0.15) + steeper * fmax(strain - 0.15, 0.0));
}
static double toe_5(double strain)
{
    return toe(strain, 5.0);
}
static double toe_14(double strain)
{
    return toe(strain, 14.0);
}

typedef struct Other {
    const char *name, *file;
    double (*stress)(double strain);
    double most; // where the slope is 5 or 14 times that at the start; of Fung's e^2.5 times
} Other;

static const Other OTHERS[] = {
    {"Ogden, alpha 9, slope to 5 times", "ogden-9-5", ogden_9, 0.354},
    {"Ogden, alpha 9, slope to 14 times", "ogden-9-14", ogden_9, 0.571},
    {"Ogden, alpha 26, slope to 5 times", "ogden-26-5", ogden_26, 0.0884},
    {"Ogden, alpha 26, slope to 14 times", "ogden-26-14", ogden_26, 0.137},
    {"Fung 1967, slope to 12 times", "fung-1967", fung_1967, 0.5},
    {"toe and line, 5 times", "toe-5", toe_5, 0.4},
    {"toe and line, 14 times", "toe-14", toe_14, 0.4},
};
enum { OTHER_COUNT = sizeof OTHERS / sizeof OTHERS[0], POINTS = 200 };

// Returns the rms of a strip of the law against the table, over its peak.
static double pull(const Experiment *experiment, const FitTable *table, const FitLaw *law,
                   SceneModel model)
{
    char material[256], path[4096];
    const double strain = table->strain[table->count - 1];
    double squares = 0.0;
    Status status = {0};
    SCOPED(strip_destroy) StripCurve curve;
    snprintf(material, sizeof material,
             "youngs_modulus%s = %.6e;  %sdensity = %.6e;%s"
             "  stiffening = { strain = %.6e;  cap = %.6e; };",
             model == MODEL_SURFACE ? "_2d" : "", law->modulus,
             model == MODEL_SURFACE ? "areal_" : "", 0.01 * law->modulus,
             model == MODEL_SURFACE ? "" : "  poisson_ratio = 0.3;", law->strain, law->cap);
    need(strip_write(experiment->out, "strip", model, material, "", &status), &status);
    snprintf(path, sizeof path, "%s/strip.cfg", experiment->out);
    need(strip_pull(path, strain, strain, &curve, &status), &status);
    for (int i = 0; i < table->count; i++) {
        const double off = strip_stress_at(&curve, table->strain[i]) - table->stress[i];
        squares += off * off;
    }
    return sqrt(squares / table->count) / table->peak;
}

static void fits(const Experiment *experiment)
{
    CLOSED FILE *out = experiment_open(experiment, "strip-fit.tsv");
    fprintf(out,
            "curve\tE, Pa\tstrain\tcap\trms of the line, %%\trms of stiffening, %%\trms of a solid "
            "strip, %%\trms of a surface strip, %%\n");
    for (int k = 0; k < OTHER_COUNT; k++) {
        const Other *other = &OTHERS[k];
        char name[64], path[4096];
        Status status = {0};
        SCOPED(fit_table_destroy) FitTable table;
        Fit fit;
        // The table goes through a file, as a user's does.
        snprintf(name, sizeof name, "%s.csv", other->file);
        FILE *csv = experiment_open(experiment, name);
        fprintf(csv, "strain [-], stress [Pa]\n");
        for (int i = 0; i < POINTS; i++) {
            const double strain = other->most * i / (POINTS - 1);
            fprintf(csv, "%.9g,%.9g\n", strain, other->stress(strain));
        }
        fclose(csv);
        snprintf(path, sizeof path, "%s/%s", experiment->out, name);
        need(fit_table_read(path, &table, &status), &status);
        need(fit_make(&table, path, &fit, &status), &status);
        fprintf(out, "%s\t%.4g\t%.4g\t%.4g\t%.2f\t%.2f\t%.2f\t%.2f\n", other->name,
                fit.stiff.modulus, fit.stiff.strain, fit.stiff.cap,
                100.0 * fit.linear.rms / table.peak, 100.0 * fit.stiff.rms / table.peak,
                100.0 * pull(experiment, &table, &fit.stiff, MODEL_VOXEL),
                100.0 * pull(experiment, &table, &fit.stiff, MODEL_SURFACE));
        // For the picture.
        snprintf(name, sizeof name, "strip-%s.dat", other->file);
        CLOSED FILE *points = experiment_open(experiment, name);
        for (int i = 0; i < table.count; i++)
            fprintf(points, "%.6g\t%.6g\t%.6g\t%.6g\n", table.strain[i],
                    table.stress[i] / table.peak,
                    fit_stress(&fit.linear, table.strain[i]) / table.peak,
                    fit_stress(&fit.stiff, table.strain[i]) / table.peak);
    }
}

int main(int argc, char **argv)
{
    static const ExperimentPart parts[] = {{"strip", laws}, {"strip-fit", fits}};
    log_set_level(LOG_ERROR); // that a damping time is shortened
    return experiment_main(argc, argv, parts, sizeof parts / sizeof parts[0]);
}
