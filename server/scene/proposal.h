// SPDX-License-Identifier: MIT
// Proposes a scene for a mesh or a label volume, as a wall or as a solid. The verdict is what
// pliantd makes of that scene: it is written, read and built. Load time only.
#ifndef PLIANT_SCENE_PROPOSAL_H
#define PLIANT_SCENE_PROPOSAL_H

#include "base/check.h"
#include "geometry/mesh.h"
#include "io/volume_import.h"
#include "scene/scene.h"

#include <stdio.h>

// A wall of 25 cm can be stepped in real time with so many nodes.
enum { PROPOSAL_PIECES = 64, PROPOSAL_NODES = 1000 };

// What can be made of a file: a wall, a wall full of a fluid, or a solid.
typedef enum ProposalWay { WAY_WALL, WAY_FILLED, WAY_SOLID, PROPOSAL_WAYS } ProposalWay;

// A scene of one body, and tools of each kind that fit its size.
typedef struct Proposal {
    const char *path; // of the mesh or volume
    bool volume;
    int label, layer;             // of a volume: the label of the body; 0: the only layer
    char label_name[VOLUME_NAME]; // "": none
    const VolumeLabel *part;      // where all labels of a layer are one body (`label` is 0): those,
    int part_count;               // of `labels` of its Proposals
    double scale;     // metres per unit of a mesh file; for a volume a factor on its own units
    SceneModel model; // MODEL_SURFACE: a wall
    bool fluid;       // the wall is full of it
    bool implicit;    // the wall uses the implicit integrator
    bool whole;       // not cuttable,
    bool chosen;      // because somebody has said so; else a tick has no time for it
    bool filled;      // a solid without the cavities of its mesh
    double cell;      // edge of a solid's cells [m]; 0: the volume's own
    bool coloured;    // by the file, or by its name
    float colour[3];  // red, green and blue, 0 to 1
    Box box;          // of the body
    // Pieces of a solid, each of which is fixed at its lower end; 0: one piece, or too many.
    int piece_count;
    Box piece[PROPOSAL_PIECES];
} Proposal;

// What pliantd would make of the proposal.
typedef struct Verdict {
    bool usable;
    bool remesh; // of a wall: even triangles would make it one, or a faster one
    Proposal proposal;
    char text[640]; // "yes, 3 substeps a tick, about 0.05 ms"
    bool cavity;    // of a solid: holes are at least a quarter of it
} Verdict;

// Which part of a label volume is meant.
typedef struct LabelChoice {
    const char *label; // number, name, or "all" for all as one body; NULL: the largest
    int layer;         // from 1; 0: any
} LabelChoice;

// The proposals for a file.
typedef struct Proposals {
    Proposal subject;     // common to all of the following
    int components;       // of a mesh: surfaces that share no edge
    int triangles, loose; // of a mesh, and those that share no edge with another
    double shortest;      // of a mesh: edge [m]
    double even;          // of a mesh: edges that make PROPOSAL_NODES of it [m]
    double volume;        // enclosed by a mesh, or of the label [m3]; 0: it has borders
    LabelVolume frame;    // of a volume, scaled, without its voxels; owned
    VolumeLabels labels;  // in it; owned
    double thinnest;      // shortest side of the chosen label's box [m]; 0: of a mesh
    char hollow[80]; // "its name says duodenum": why it may be a hollow organ; "": nothing says so
    bool named_hollow; // its name says so
    Verdict verdict[PROPOSAL_WAYS];
} Proposals;

// True if the content of the file is a label volume.
bool proposal_is_volume(const char *path);

// Judges all ways. `scale`: metres per unit of a mesh file, or factor on the units of a volume.
// Returns false with a status if the file cannot be read.
bool proposal_judge(const char *path, double scale, LabelChoice choice, Proposals *proposals,
                    Status *status);
void proposals_destroy(Proposals *proposals);
// Returns the word for a way: "surface", "filled" or "voxel".
const char *proposal_way_name(ProposalWay way);
// Prints "as a wall: ..." and the like, each line indented by two blanks.
void proposal_print(const Proposals *proposals, FILE *out);

// --- proposal_choice.c: which way is proposed ---

// Sets `hollow` by the name of the label or file, or by the cavity of the solid.
void proposal_find_hollow(Proposals *proposals);
// Sets the colour of all ways: that of the label in the file, or by the name.
void proposal_find_colour(Proposals *proposals);
// Returns the colour of a label in the file, or by its name; NULL: neither says one.
const float *proposal_label_colour(const VolumeLabel *label);
// Writes the scene's `score`: of a body of several labels a margin around tumours, and vessels to
// keep.
void proposal_write_score(const Proposal *proposal, FILE *out);
// Returns the best way. By the name a hollow organ: a wall. With a cavity: a solid, which keeps the
// hollow. Else a wall with explicit steps, then a solid, then a wall with implicit steps. -1: none
// is usable. `why`, if not NULL, gets the rule as a sentence.
int proposal_best(const Proposals *proposals, const char **why);
// Returns what an organ made that way is good for.
const char *proposal_use(const Proposals *proposals, ProposalWay way);
// Writes all of it, and the report of mesh_report_print, as one JSON object
// (server/scene/README.md).
void proposal_json(const Proposals *proposals, const char *report, FILE *out);

// Makes a mesh of about 1000 nodes and even edges [m] of the outer surface of a closed mesh or of a
// label, for a wall. Parameters as of proposal_judge. Returns false with a status; then there is no
// mesh.
bool proposal_even(const char *path, double scale, LabelChoice choice, TriMesh *mesh,
                   Status *status);

// Writes the scene; `file`: the name by which it refers to the mesh or volume.
void proposal_write(const Proposal *proposal, const char *file, FILE *out);

// The report of `pliant-prepare --check`: contents of a mesh file, necessary repairs, quality of
// its triangles, the time step that it allows, and the models that it fits. Load time only.

// Prints the report of a mesh file whose unit is `scale` metres (0: guessed, io/mesh_import.h), or
// of a label volume, whose own units are multiplied by `scale` (0: 1), and whether it can be a wall
// or a solid. `found` gets that, which the caller destroys; `list`: print all labels. Returns false
// with one sentence in `status` if it can be neither; prints nothing about a file that cannot be
// read.
bool mesh_report_print(const char *path, double scale, LabelChoice choice, bool list,
                       Proposals *found, FILE *out, Status *status);

#endif
