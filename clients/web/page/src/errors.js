// SPDX-License-Identifier: MIT
// How far bodies and forces may be from the truth: the figures, and the share of each node of a body.

import { figure, lengthText } from './units.js';

const element = (id) => document.getElementById(id);

/** Good below 5 %, bad from 20 % on. */
const classOf = (share) => (share < 0.05 ? 'good' : share < 0.2 ? 'warm' : 'bad');
const errorText = (length) => (length < 0 ? '?' : lengthText(length));
const percentText = (share) => (share < 0 ? '?' : `${figure(100 * share, share < 0.0995 ? 1 : 0)} %`);

/** Of a force: "± 0.05 N, 4.0 %", and how its bar looks; null: unknown. */
export function forceError({ error, share }) {
    if (!(error >= 0)) return null;
    return { text: `± ${figure(error, error < 0.0995 ? 3 : 2)} N, ${percentText(share)}`,
        length: `${figure(100 * Math.min(share, 1), 1)}%`, className: classOf(share) };
}

/** Makes an element the bar of an error, which it is given as its width. */
export function drawBar(bar, error) {
    bar.className = `error-bar ${error?.className ?? ''}`;
    bar.style.setProperty('--error', error?.length ?? '0%');
    return bar;
}

function row(cells, title) {
    const line = document.createElement('tr');
    for (const content of cells) {
        const cell = document.createElement('td');
        cell.append(content);
        line.append(cell);
    }
    line.title = title;
    return line;
}

/** The box with the figures. */
export class Errors {
    constructor() { this.box = element('errors'); }

    clear() { this.box.hidden = true; }

    /** `titles`: what tools are called, by number. */
    take({ body, tool }, titles) {
        element('errors-bodies').replaceChildren(...body.map(({ name, space, steps, total, relative, age }) =>
            row([name, errorText(total), percentText(relative)],
                `in space ${errorText(space)}, of the time steps ${errorText(steps)}` +
                (age < 0 ? '; not estimated yet' : `; estimated ${age} ticks ago`))));
        element('errors-tools').replaceChildren(...tool.map((of) => {
            const error = forceError(of);
            return row([titles.get(of.tool) ?? `tool ${of.tool}`, `${figure(of.force)} N`,
                drawBar(document.createElement('span'), error), error?.text ?? '?'], 'of the discretisation in space');
        }));
        element('errors-tools').parentElement.hidden = tool.length === 0;
        this.box.hidden = false;
    }
}

/** The error around each node of a body, through changes of its mesh until the next map comes. */
export class ErrorMap {
    constructor() {
        this.message = null; // the newest map
        this.known = new Map(); // id -> share
    }

    take(message) { this.message = message; }

    /** Writes the root of the share of each node slot, 0 to 255: most of a body has a small part of its largest error. */
    fill(mesh, out) {
        const own = this.message.topology === mesh.topology && this.message.n === mesh.n;
        for (let i = 0; i < mesh.n; i++) {
            const id = mesh.id[i];
            if (id < 0) continue;
            const share = own ? this.message.share[i] : this.known.get(id) ?? this.guess(mesh, i);
            this.known.set(id, share);
            out[i] = Math.sqrt(255 * share);
        }
    }

    // A new node has what that has from which it was split, or the larger of those between which it lies.
    guess(mesh, i) {
        const { known } = this;
        return known.get(mesh.origin[i]) ??
            Math.max(known.get(mesh.parent[2 * i]) ?? 0, known.get(mesh.parent[2 * i + 1]) ?? 0);
    }
}
