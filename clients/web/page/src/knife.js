// A drag across the picture as a blade: its edge lies along the line of sight, and each part of the
// drag sweeps one quadrilateral, sent as one cut.

import { Vector3 } from 'three';

const STEP = 16; // [css pixels] between two places of the edge

export class Knife {
    constructor(world, trail) {
        this.world = world;
        this.trail = trail; // an SVG polyline over the picture
        this.points = '';
    }

    begin(ray, found, event) {
        this.last = null;
        this.sent = 0;
        this.depth = found ? found.distance : null;
        this.points = '';
        this.frame = this.world.stage.canvas.getBoundingClientRect();
        this.trail.parentElement.removeAttribute('hidden');
        this.x = event.clientX;
        this.y = event.clientY;
        return { kind: 'cut' };
    }

    follow(ray, found, event) {
        const far = Math.hypot(event.clientX - this.x, event.clientY - this.y);
        if (this.last && far < STEP) return;
        this.points += `${event.clientX - this.frame.left},${event.clientY - this.frame.top} `;
        this.trail.setAttribute('points', this.points);
        const edge = this.edge(ray, found);
        if (this.last) {
            this.sent++;
            this.world.link.request({ type: 'cut', before: this.last, after: edge, body: '' });
        }
        this.last = edge;
        this.x = event.clientX;
        this.y = event.clientY;
    }

    // Through all that is there, or from just before the surface to a little behind it.
    edge(ray, found) {
        const { stage, settings } = this.world;
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
        this.last = null;
        this.trail.parentElement.setAttribute('hidden', '');
        this.trail.setAttribute('points', '');
        this.world.told(this.sent ? `${this.sent} cuts sent` : 'Drag farther to cut.');
    }
}
