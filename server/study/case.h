// The grid of cases: every axis varied around the scene's own choice, and the crosses that curves
// need: integrator x time step on the scene's mesh; detail x the scene's integrator, the default
// one and the paper's.
#ifndef PLIANT_STUDY_CASE_H
#define PLIANT_STUDY_CASE_H

#include "study/study.h"

// Fills `cases` [STUDY_CASES] and returns how many. The first is the scene itself. Names are
// unique. With options->only: the scene itself and the cases whose name has this text.
int study_make_cases(const Scene *scene, const StudyOptions *options, StudyCase *cases);

// What the scene itself asks of its first body.
StudyCase study_scene_case(const Scene *scene);
// Writes the name that follows from the other members.
void study_name_case(const Scene *scene, StudyCase *what);
// What a case's mesh is called: "level 2", "adaptive 2 at 0.5", with "choi2005" when it is the
// paper's.
void study_name_mesh(const Scene *scene, const StudyCase *what, char *name, size_t size);

#endif
