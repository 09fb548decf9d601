// A drag across the picture as a blade: its edge lies along the line of sight, and each part of the
// drag sweeps one quadrilateral, sent as one cut.

import { Vector3 } from 'three';

const STEP = 16;      // [css pixels] between two places of the edge
const OVERLAP = 0.5;  // of a step: tissue that moves between two cuts leaves no bridge

export class Knife {
    constructor(world, trail) {
        this.world = world;
        this.trail = trail; // an SVG polyline over the picture
        this.points = '';
    }

    begin(found, event) {
        this.begun = false;
        this.sent = 0;
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
            // From a little before the last place.
            const before = this.edge(this.x - OVERLAP * dx, this.y - OVERLAP * dy, pick);
            const after = this.edge(event.clientX, event.clientY, pick);
            // Not by what is seen: a cut that gapes hides what is left beside it.
            const ray = stage.rayThrough(event.clientX, event.clientY);
            if (ray.distanceToPoint(stage.center) < 0.6 * stage.size) {
                this.sent++;
                link.request({ type: 'cut', before, after, body: '' });
            }
        }
        this.begun = true;
        this.x = event.clientX;
        this.y = event.clientY;
    }

    // Through all that is there, or from just before the surface to a little behind it.
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
        this.world.told(this.sent ? `${this.sent} cuts sent` : 'Drag across the tissue to cut.');
    }
}
