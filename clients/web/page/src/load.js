// SPDX-License-Identifier: MIT
// The largest force of a drag without grasper.

const GRAVITY = 9.81;  // [m/s2]
const WHILE_UNKNOWN = 2; // [N] before the daemon's first status

/**
 * The most that a load pulls a body [N]: what the strongest tool of the scene may, else the body's weight. `tools`:
 * [{kind, maxForce}], `mass` of the body [kg].
 */
export function mostLoad(tools, mass) {
    const forces = tools.filter(({ kind, maxForce }) => kind !== 'static' && maxForce > 0 && Number.isFinite(maxForce))
        .map(({ maxForce }) => maxForce);
    if (forces.length > 0) return Math.max(...forces);
    return mass > 0 && Number.isFinite(mass) ? mass * GRAVITY : WHILE_UNKNOWN;
}
