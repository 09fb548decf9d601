// SPDX-License-Identifier: MIT
// Ties: a click on tissue pins it, a drag ties it to the body at its end, or clips two walls of one body; a list
// releases them. The list is what events tell, whoever made the ties; the server repeats them for a page that comes later.

import { Vector3 } from 'three';

const CLICK = 6;      // [css pixels] a shorter drag is a click
const RADIUS = 0.05;  // of the scene's size: of the ball whose nodes are tied
const NUMBER = /^tie (\d+)[: ,]/;

export class Ties {
    /** `world` as of the hand, with `list`: an element for the buttons. */
    constructor(world, trail) {
        this.world = world;
        this.trail = trail; // an SVG polyline over the picture
        this.open = null;   // id of the request that lacks its answer
    }

    begin(found, point, event) {
        const { canvas } = this.world.stage;
        this.frame = canvas.getBoundingClientRect();
        this.start = { x: event.clientX, y: event.clientY, point, body: found.body };
        this.at = this.start;
        return { kind: 'tie' };
    }

    follow(event) {
        this.at = { x: event.clientX, y: event.clientY };
        const { x, y } = this.frame;
        this.trail.setAttribute('points',
            `${this.start.x - x},${this.start.y - y} ${this.at.x - x},${this.at.y - y}`);
        this.trail.parentElement.removeAttribute('hidden');
    }

    /** `pick(ray)` finds what is under the pointer, or null; `given` up: nothing is tied. */
    end(pick, givenUp) {
        this.trail.parentElement.setAttribute('hidden', '');
        this.trail.setAttribute('points', '');
        if (givenUp) return;
        const { stage, link } = this.world;
        const { start, at } = this;
        const pin = Math.hypot(at.x - start.x, at.y - start.y) < CLICK;
        const ray = stage.rayThrough(at.x, at.y);
        const found = pin ? null : pick(ray);
        if (!pin && !found) return this.world.told('Nothing was tied: the drag must end on tissue.');
        const message = { type: 'tie', action: 'make', kind: 'pin', body: start.body.name, to_body: '',
            center: start.point.toArray(), radius: RADIUS * stage.size };
        if (found && found.body !== start.body) {
            message.kind = 'tie';
            message.to_body = found.body.name;
        } else if (found) {
            // A ball around both ends: the walls in it close on each other.
            const end = ray.at(found.distance, new Vector3());
            message.kind = 'clip';
            message.radius += 0.5 * end.distanceTo(start.point);
            message.center = end.add(start.point).multiplyScalar(0.5).toArray();
        }
        this.open = link.request(message);
        this.world.told(`A ${message.kind} waits for an answer …`);
    }

    /** A reply to a request, or that none will come (`{id, ok: false, text}`). */
    answered({ id, ok, text }) {
        if (id !== this.open) return;
        this.open = null;
        this.world.told(ok ? text : `Nothing was tied: ${text}`);
    }

    /** Keeps the list by what events tell. */
    takeEvent(kind, text) {
        if (kind === 'reset') return this.clear();
        const number = /^tie/.test(kind) && NUMBER.exec(text)?.[1];
        if (number === undefined || number === false) return undefined;
        if (kind === 'tie_broken' || / released$/.test(text)) this.item(number)?.remove();
        else if (!/: stiffness /.test(text)) this.add(number, text);
        return this.showWhether();
    }

    clear() {
        this.world.list.replaceChildren();
        this.showWhether();
    }

    item(number) { return this.world.list.querySelector(`[data-tie="${number}"]`); }

    add(number, text) {
        this.item(number)?.remove();
        const item = document.createElement('li');
        const button = document.createElement('button');
        item.dataset.tie = number;
        button.type = 'button';
        button.textContent = 'Release';
        button.className = 'input';
        button.addEventListener('click', () => {
            if (!this.world.refused())
                this.open = this.world.link.request({ type: 'tie', action: 'release', tie: Number(number) });
        });
        item.append(button, ` ${text}`);
        this.world.list.append(item);
    }

    showWhether() { this.world.list.closest('details').hidden = !this.world.list.children.length; }
}
