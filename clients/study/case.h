// The grid of cases: every axis varied around the scene's own choice, and the combinations that the
// curves need: integrator x time step on the scene's mesh and on the coarsest; detail x the scene's
// integrator, the default one and the paper's.
#ifndef PLIANT_STUDY_CASE_H
#define PLIANT_STUDY_CASE_H

#include "study/study.h"

// Fills `cases` [STUDY_CASES] and returns their number. The first is the scene itself. Names are
// unique, and no two cases are equal. With options->only: the scene itself and the cases whose name
// contains this text.
int study_make_cases(const Scene *scene, const StudyOptions *options, StudyCase *cases);

// Returns the case that the scene specifies for its first body; the others follow it.
StudyCase study_scene_case(const Scene *scene);

// True if both have the same detail, rule and thresholds, whatever their time steps. DETAIL_SCENE
// equals the detail that it stands for, given by its level and threshold (0: held).
bool study_same_mesh(const StudyCase *a, const StudyCase *b);
// Writes the name of a case's mesh: "level 2", "adaptive 2 x 0.5, choi2005".
void study_name_mesh(const Scene *scene, const StudyCase *what, char *name, size_t size);
// Sets the name that follows from the other members.
void study_name_case(const Scene *scene, StudyCase *what);

#endif
