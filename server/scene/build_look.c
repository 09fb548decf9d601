// SPDX-License-Identifier: MIT
// Makes the look of a body. Called once per body, at load time.
#include "scene/build_parts.h"

#ifdef PLIANT_WITH_LATTICES
#include "io/volume_picture.h"
#endif

#include <string.h>

static const unsigned char *keep(World *world, const SceneBody *body, const void *from,
                                 size_t bytes)
{
    unsigned char *to =
        arena_allocate(&world->arena, ARENA_OUTPUT, bytes, 1, "%s/look", body->name);
    memcpy(to, from, bytes);
    return to;
}

#ifdef PLIANT_WITH_LATTICES
// Keeps the labels where some have a colour of their own.
static void make_labels(World *world, const SceneBody *body, const Lattice *lattice, BodyLook *look)
{
    Vec3 step[3];
    for (int a = 0; a < 3; a++)
        step[a] =
            quat_rotate(lattice->turn, vec3_scale(lattice->size, vec3(a == 0, a == 1, a == 2)));
    const size_t cells =
        (size_t)lattice->count[0] * (size_t)lattice->count[1] * (size_t)lattice->count[2];
    look->labels = look_grid(lattice->count, lattice_point(lattice, 0.5, 0.5, 0.5), step,
                             keep(world, body, lattice->label, cells));
    // Material m is the m-th label.
    for (int m = 0; m < body->voxels.label_count; m++)
        look->of_label[m + 1] = body->look.label[m];
}

static bool make_image(World *world, const SceneBody *body, const Lattice *lattice, BodyLook *look,
                       Status *status)
{
    const VoxelSource *voxels = &body->voxels;
    const PicturePlace place = {voxels->scale, voxels->rotation, voxels->translation};
    VolumePicture picture;
    if (!volume_import_picture(body->look.image, lattice, &place, body->look.black,
                               body->look.white, &picture, status))
        return false;
    const size_t voxels_in =
        (size_t)picture.count[0] * (size_t)picture.count[1] * (size_t)picture.count[2];
    look->image = look_grid(picture.count, picture.origin, picture.axis,
                            keep(world, body, picture.colour, 3 * voxels_in));
    volume_picture_destroy(&picture);
    return true;
}
#endif

bool build_look(World *world, const SceneBody *body, const Lattice *lattice, bool heats,
                const BodyLook **look, Status *status)
{
    *look = NULL;
    if (!body->look.given && !heats)
        return true;
    BodyLook *made =
        arena_allocate(&world->arena, ARENA_OUTPUT, 1, sizeof *made, "%s/looks", body->name);
    // Tissue that is heated shows it: without colours of its own it has those of liver.
    const LookColours liver = {{178, 76, 70}, {150, 40, 40}};
    made->usual = body->look.given ? body->look.usual : liver;
    made->texture = body->look.texture != NULL ? body->look.texture : "";
    *look = made;
#ifdef PLIANT_WITH_LATTICES
    if (lattice != NULL && body->look.label != NULL)
        make_labels(world, body, lattice, made);
    return lattice == NULL || body->look.image == NULL ||
           make_image(world, body, lattice, made, status);
#else
    (void)lattice, (void)status, (void)keep;
    return true;
#endif
}
