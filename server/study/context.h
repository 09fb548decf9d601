// What a study works on: the scene without what does not matter to its motion, what drives it, the
// points that are sampled, when, and the references that were made. Made once, by study_prepare;
// the same on every process that is given the same scene and options.
#ifndef PLIANT_STUDY_CONTEXT_H
#define PLIANT_STUDY_CONTEXT_H

#include "study/study.h"
#include "study/trace.h"

enum { STUDY_POINTS = 512 };

// What drives the scene.
typedef enum StudyDrive {
    DRIVE_LOADS, // the scene's own, its gravity, or the built-in one, which stands in `scene`
    DRIVE_LOG,   // a log of inputs
    DRIVE_PRESS, // a tool that comes down on the body
} StudyDrive;

// The built-in press: the tool's path along a line, by time.
typedef struct StudyPress {
    int tool;
    Quat orientation;
    Vec3 start;                    // of the tool's frame [m]
    Vec3 inward;                   // unit
    double way;                    // from `start` to the deepest point [m]
    double down_s, hold_s, back_s; // one after the other
} StudyPress;

typedef struct StudyInputs {
    StudyDrive drive;
    const char *log; // DRIVE_LOG
    StudyPress press;
    Vec3 center;   // of the pressed patch [m]
    double radius; // [m]
    double end_s;  // nothing is pressed any more
    char text[STUDY_WHY];
} StudyInputs;

// Points of the studied body that every case has: those of its coarsest mesh, or of the outside of
// its lattice.
typedef struct StudyPoints {
    int count;
    int id[STUDY_POINTS];      // BodyMesh.id
    int fine_id[STUDY_POINTS]; // in a lattice of half the cells; -1: there is none
    Vec3 rest[STUDY_POINTS];
    double weight[STUDY_POINTS]; // share in the pressed patch, sum 1
} StudyPoints;

typedef struct StudyContext {
    const Scene *given;   // as read; outlives the context
    Scene scene;          // own copy of what is changed: bodies, loads
    StudyOptions options; // complete: duration, rate, jobs, repeats filled in
    StudyInputs inputs;
    StudyPoints points;
    SceneLoad *own_load; // the built-in one, owned, or NULL
    bool plane;          // the body lies in z = 0
    int body;            // the one that is pressed and sampled
    double extent;       // its largest edge at rest [m]
    double rest_volume;  // enclosed [m3]; NAN: it encloses none
    bool may_halve;      // its lattice can be had with half the cells
    double sample_s;     // time between samples; a multiple of the scene's tick [s]
    int sample_count;    // the first at sample_s
    double limit_s;      // CPU time of one run beyond which it is given up [s]
    int mesh_count;
    StudyMesh mesh[STUDY_MESHES];         // what is to be known of each
    StudyTrace *mesh_trace[STUDY_MESHES]; // their finest run, or NULL
    StudyReference finest;
    StudyTrace *finest_trace; // of the total error, or NULL
} StudyContext;

// Reads nothing but the log; builds the scene once to see its body. `scene` and the strings of
// `options` outlive the context. False with `status`: no body, a scene that cannot be built.
bool study_prepare(StudyContext *context, const Scene *scene, const StudyOptions *options,
                   Status *status);
void study_destroy(StudyContext *context);
// Frees the references that were made, if any.
void study_forget_references(StudyContext *context);
// What is known before the first run: names, inputs, the machine.
void study_describe(const StudyContext *context, StudyResult *result);

// The index in context->mesh of what a case is compared with in time; -1: there is none.
int study_mesh_of(const StudyContext *context, const StudyCase *what);
#endif
