// SPDX-License-Identifier: MIT
// Bullet's btSoftBody, stepped as its own world would, without anything but links.
#include "bullet.h"

#include <BulletSoftBody/btSoftBody.h>

#include <vector>

struct BulletBody {
    btSoftBodyWorldInfo world;
    btSoftBody *body;
};

BulletBody *bullet_create(const BulletOptions *options)
{
    BulletBody *made = new BulletBody;
    made->world.m_gravity = btVector3(0, 0, 0);
    made->world.air_density = 0;
    made->world.water_density = 0;
    made->world.m_broadphase = nullptr;
    made->world.m_dispatcher = nullptr;

    std::vector<btVector3> position;
    std::vector<btScalar> mass;
    for (int i = 0; i < options->node_count; i++) {
        const double *x = options->position[i];
        position.emplace_back(btScalar(x[0]), btScalar(x[1]), btScalar(x[2]));
        mass.push_back(btScalar(options->mass[i]));
    }
    made->body = new btSoftBody(&made->world, options->node_count, position.data(), mass.data());
    made->body->m_materials[0]->m_kLST = btScalar(0.5);
    for (int k = 0; k < options->link_count; k++)
        made->body->appendLink(options->link[k][0], options->link[k][1]);
    made->body->m_cfg.collisions = 0;
    made->body->m_cfg.piterations = options->iterations;
    for (int i = 0; i < options->node_count; i++) {
        const double *v = options->velocity[i];
        made->body->m_nodes[i].m_v = btVector3(btScalar(v[0]), btScalar(v[1]), btScalar(v[2]));
    }
    return made;
}

void bullet_destroy(BulletBody *body)
{
    if (body == nullptr)
        return;
    delete body->body;
    delete body;
}

void bullet_step(BulletBody *body, double h)
{
    body->body->predictMotion(btScalar(h));
    body->body->solveConstraints();
}

void bullet_position(const BulletBody *body, int node, double position[3])
{
    const btVector3 &x = body->body->m_nodes[node].m_x;
    for (int c = 0; c < 3; c++)
        position[c] = double(x[c]);
}
