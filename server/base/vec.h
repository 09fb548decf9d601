// SPDX-License-Identifier: MIT
// Vectors of three doubles and unit quaternions (w x y z), by value.
#ifndef PLIANT_BASE_VEC_H
#define PLIANT_BASE_VEC_H

#include <math.h>

typedef struct Vec3 {
    double x, y, z;
} Vec3;

typedef struct Quat {
    double w, x, y, z;
} Quat;
#define QUAT_NONE ((Quat){1.0, 0.0, 0.0, 0.0}) // no rotation

static inline Vec3 vec3(double x, double y, double z)
{
    return (Vec3){x, y, z};
}

static inline Vec3 vec3_add(Vec3 a, Vec3 b)
{
    return (Vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline Vec3 vec3_sub(Vec3 a, Vec3 b)
{
    return (Vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline Vec3 vec3_scale(double s, Vec3 a)
{
    return (Vec3){s * a.x, s * a.y, s * a.z};
}

// a + s b
static inline Vec3 vec3_madd(Vec3 a, double s, Vec3 b)
{
    return (Vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static inline double vec3_dot(Vec3 a, Vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline Vec3 vec3_cross(Vec3 a, Vec3 b)
{
    return (Vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline double vec3_length(Vec3 a)
{
    return sqrt(vec3_dot(a, a));
}

// Returns a / |a|, or zero for a vector too short to have a direction.
static inline Vec3 vec3_unit(Vec3 a)
{
    double length = vec3_length(a);
    return length > 1e-300 ? vec3_scale(1.0 / length, a) : (Vec3){0.0, 0.0, 0.0};
}

static inline int vec3_finite(Vec3 a)
{
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

static inline Quat quat_multiply(Quat a, Quat b)
{
    return (Quat){a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
                  a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                  a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                  a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

static inline Quat quat_conjugate(Quat q)
{
    return (Quat){q.w, -q.x, -q.y, -q.z};
}

static inline Quat quat_unit(Quat q)
{
    double length = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    if (!(length > 1e-300))
        return (Quat){1.0, 0.0, 0.0, 0.0};
    return (Quat){q.w / length, q.x / length, q.y / length, q.z / length};
}

// Rotates v by the unit quaternion q.
static inline Vec3 quat_rotate(Quat q, Vec3 v)
{
    Vec3 u = {q.x, q.y, q.z};
    Vec3 t = vec3_scale(2.0, vec3_cross(u, v));
    return vec3_add(vec3_madd(v, q.w, t), vec3_cross(u, t));
}

// Returns the rotation by the vector r: axis r/|r|, angle |r| [rad].
static inline Quat quat_from_rotation(Vec3 r)
{
    double angle = vec3_length(r);
    if (angle < 1e-12)
        return quat_unit((Quat){1.0, 0.5 * r.x, 0.5 * r.y, 0.5 * r.z});
    double s = sin(0.5 * angle) / angle;
    return (Quat){cos(0.5 * angle), s * r.x, s * r.y, s * r.z};
}

// Returns the rotation vector of the unit quaternion q, angle in [0, pi].
static inline Vec3 quat_to_rotation(Quat q)
{
    if (q.w < 0.0)
        q = (Quat){-q.w, -q.x, -q.y, -q.z};
    Vec3 u = {q.x, q.y, q.z};
    double s = vec3_length(u);
    if (s < 1e-12)
        return vec3_scale(2.0, u);
    return vec3_scale(2.0 * atan2(s, q.w) / s, u);
}

#endif
