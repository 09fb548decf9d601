// SPDX-License-Identifier: MIT
// A drag across the picture as a blade: its edge is along the line of sight, and each part of the drag sweeps one
// quadrilateral, sent as one cut.

import { Vector3 } from 'three';

const STEP = 16;      // [css pixels] between two positions of the edge
const OVERLAP = 0.5;  // of a step: tissue that moves between two cuts leaves no bridge

// Some of the many cuts of one drag hit nothing.
export const isIdleCut = (text) => /met no tissue|was cut already/.test(text);

export class Knife {
    constructor(world, trail) {
        this.world = world;
        this.trail = trail; // an SVG polyline over the picture
        this.points = '';
        this.stroke = null; // the newest: {open (ids without answer yet), sent, severed, idle, refused, why}
    }

    begin(found, event) {
        this.begun = false;
        this.stroke = { open: new Set(), sent: 0, severed: 0, idle: 0, refused: 0, why: '', over: false };
        this.depth = found ? found.distance : null;
        this.points = '';
        this.frame = this.world.stage.canvas.getBoundingClientRect();
        this.trail.parentElement.removeAttribute('hidden');
        this.x = event.clientX;
        this.y = event.clientY;
        return { kind: 'cut' };
    }

    /** `pick(ray)` finds what is under the pointer, or null. */
    follow(event, pick) {
        const { stage, link } = this.world;
        const dx = event.clientX - this.x, dy = event.clientY - this.y;
        if (this.begun && Math.hypot(dx, dy) < STEP) return;
        this.points += `${event.clientX - this.frame.left},${event.clientY - this.frame.top} `;
        this.trail.setAttribute('points', this.points);
        if (this.begun) {
            // From a little before the last position.
            const before = this.edge(this.x - OVERLAP * dx, this.y - OVERLAP * dy, pick);
            const after = this.edge(event.clientX, event.clientY, pick);
            // Not by what is visible: a gaping cut hides the tissue beside it.
            const ray = stage.rayThrough(event.clientX, event.clientY);
            if (ray.distanceToPoint(stage.center) < 0.6 * stage.size) {
                this.stroke.sent++;
                this.stroke.open.add(link.request({ type: 'cut', before, after, body: '' }));
            }
        }
        this.begun = true;
        this.x = event.clientX;
        this.y = event.clientY;
    }

    // Through everything, or from just before the surface to a little behind it.
    edge(x, y, pick) {
        const { stage, settings } = this.world;
        const ray = stage.rayThrough(x, y);
        const found = settings.shallow ? pick(ray) : null;
        if (found) this.depth = found.distance;
        const across = new Vector3().subVectors(stage.center, ray.origin).dot(ray.direction);
        let near = across - 0.75 * stage.size, far = across + 0.75 * stage.size;
        if (settings.shallow) {
            const at = this.depth ?? across;
            near = at - 0.06 * stage.size;
            far = at + settings.depth * stage.size;
        }
        near = Math.max(near, 0.5 * stage.camera.near);
        return [ray.at(near, new Vector3()).toArray(), ray.at(far, new Vector3()).toArray()];
    }

    end() {
        this.trail.parentElement.setAttribute('hidden', '');
        this.trail.setAttribute('points', '');
        this.stroke.over = true;
        this.tell();
    }

    /** A reply to a request, or that none will come (`{id, ok: false, text}`); false: not one of ours. */
    answered({ id, ok, text, separated }) {
        const { stroke } = this;
        if (!stroke?.open.delete(id)) return false;
        if (isIdleCut(text)) stroke.idle++;
        else if (ok) stroke.severed += separated;
        else {
            stroke.refused++;
            stroke.why = text;
        }
        if (stroke.over) this.tell();
        return true;
    }

    tell() {
        const { sent, open, severed, refused, why } = this.stroke;
        if (!sent) this.world.told('Drag across the tissue to cut.');
        else if (open.size) this.world.told(`cutting: ${open.size} of ${sent} strokes wait for an answer`);
        else if (refused === sent) this.world.told(`Nothing was cut: ${why}`);
        else if (!severed && !refused) this.world.told('Nothing was cut: the drag met no tissue that is cuttable and not cut yet.');
        else this.world.told(`${severed} links or faces were cut` +
            (refused ? `; ${refused} of ${sent} strokes were refused: ${why}` : ''));
    }
}
