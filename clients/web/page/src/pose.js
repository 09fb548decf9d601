// SPDX-License-Identifier: MIT
// A tool in a hand: how it is held, and the messages that move it.

import { Quaternion, Vector3 } from 'three';
import { turnBlade } from './instruments.js';
import { turned } from './tools.js';

/**
 * How a hand holds a tool that works along `direction`: {tool, radius (of its tip), tip (from its origin to the tip, in
 * the world), turn, stick}. A blade's edge lies along the direction; other shafts tilt towards the viewer's upper right,
 * so that their tip stays visible; a stick stands as it is.
 */
export function hold(stage, tool, direction) {
    const { at, axis, radius, stick } = tool.tip();
    if (stick) return { tool, radius: 0, tip: new Vector3(), turn: new Quaternion(), stick };
    const back = direction.clone().negate();
    if (!tool.edge) {
        const lean = new Vector3(0.62, 0.68, 0).normalize().transformDirection(stage.camera.matrixWorld);
        back.multiplyScalar(0.72).addScaledVector(lean, 0.69).normalize();
    }
    const turn = turned(axis, back);
    return { tool, radius, tip: at.clone().applyQuaternion(turn), turn, stick };
}

/** Turns a blade that is held about its edge, by `most` [rad] at most, towards the side `trail` for its back. */
export function turnHeld(held, trail, most) {
    const { at, axis } = held.tool.tip(), back = axis.clone().applyQuaternion(held.turn);
    if (trail.clone().cross(back).length() < 1e-3) return; // no side of it
    held.turn.rotateTowards(turnBlade(axis, back, trail), most);
    held.tip.copy(at).applyQuaternion(held.turn);
}

/** The poses of one hand, in one message that is used again and again. */
export class Pose {
    constructor(link) {
        this.link = link;
        this.message = { type: 'tool', tool: 0, position: [0, 0, 0], orientation: [1, 0, 0, 0], grip: 0, time: 0,
            active: false };
    }

    /** `held` as of hold(); `place`: of the tool's origin; `time`: when it was there [ms], as of performance.now(). */
    send(held, place, grip, time = performance.now()) {
        const { message } = this;
        const { x, y, z, w } = held.turn;
        message.tool = held.tool.id;
        place.toArray(message.position);
        message.orientation = [w, x, y, z];
        message.grip = grip;
        message.time = Math.max(time / 1000, message.time); // timers may be ahead of events that waited
        message.active = true;
        return this.link.send(message);
    }

    /** Opens the jaws and withdraws the tool. */
    withdraw() {
        if (!this.message.active) return;
        this.message.active = false;
        this.message.grip = 0;
        this.message.time = performance.now() / 1000;
        this.link.send(this.message);
    }
}
