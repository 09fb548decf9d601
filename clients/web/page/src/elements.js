// SPDX-License-Identifier: MIT
// The elements of a solid at its surface: lines along their borders, and a tint by how wide they are.

import { BufferAttribute, BufferGeometry, DynamicDrawUsage, LineBasicMaterial, LineSegments } from 'three';
import { ELEMENTS } from './tissue.js';

const element = (id) => document.getElementById(id);

// The edges between squares of a mesh, once each: two nodes, and the two squares; -1: none, or more than two meet there.
function edgesOf({ n, triangle }) {
    const seen = new Map(), list = [];
    for (let t = 0; 3 * t < triangle.length; t++) {
        const square = t >> 1;
        for (let k = 0; k < 3; k++) {
            const a = triangle[3 * t + k], b = triangle[3 * t + (k + 1) % 3];
            if (a === b) continue; // a free slot
            const key = Math.min(a, b) * n + Math.max(a, b), at = seen.get(key);
            if (at === undefined) {
                seen.set(key, list.length);
                list.push(a, b, square, -2);
            } else list[at + 3] = list[at + 3] === -2 ? square : -1;
        }
    }
    return Int32Array.from(list);
}

export class Elements {
    constructor() {
        this.message = null; // the last one
        this.edges = null;   // of `mesh`
        this.mesh = null;
        this.lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial(
            { color: 0x0c1116, transparent: true, opacity: 0.7 }));
        this.lines.frustumCulled = this.lines.visible = false;
    }

    take(message) { this.message = message; }

    /** Draws borders, and writes the tint of each node. */
    show(mesh, tint) {
        this.draw(mesh);
        this.fill(mesh, tint);
    }

    /**
     * Draws the borders between elements, along the edges of a mesh. Squares keep their places through cuts, so elements
     * of the mesh before are right but for new squares, which get single cells until the next message.
     */
    draw(mesh) {
        const { message, lines: { geometry } } = this;
        if (this.mesh !== mesh) {
            this.mesh = mesh;
            this.edges = edgesOf(mesh);
            geometry.setIndex(new BufferAttribute(new Uint32Array(this.edges.length / 2), 1).setUsage(DynamicDrawUsage));
        }
        const { edges } = this, { tag } = message, { array } = geometry.index;
        let used = 0;
        for (let i = 0; i < edges.length; i += 4) {
            const other = edges[i + 3];
            if (other === edges[i + 2] || (other >= 0 && other < tag.length && tag[edges[i + 2]] === tag[other])) continue;
            array[used++] = edges[i];
            array[used++] = edges[i + 1];
        }
        geometry.index.needsUpdate = true;
        geometry.setDrawRange(0, used);
    }

    /** Fills in the level of the elements around each node, 0 to 255 for levels 0 to the last colour's. */
    fill(mesh, tint) {
        const { message: { level } } = this;
        const sum = new Uint16Array(mesh.n), count = new Uint8Array(mesh.n), { triangle } = mesh, last = ELEMENTS.length - 1;
        for (let i = 0; i < triangle.length; i++) {
            sum[triangle[i]] += level[Math.floor(i / 6)] ?? 0;
            count[triangle[i]]++;
        }
        for (let i = 0; i < mesh.n; i++) tint[i] = count[i] ? 255 * Math.min(sum[i] / count[i] / last, 1) : 0;
    }
}

/** The colours, and how many elements of each width there are in all bodies. */
export function showElements(bodies) {
    const count = [];
    for (const { elements: { message } } of bodies)
        message?.count.forEach((value, level) => { count[level] = (count[level] ?? 0) + value; });
    while (count.length > 1 && count.at(-1) === 0) count.pop();
    element('elements-legend').replaceChildren(...count.map((value, level) => {
        const field = document.createElement('span');
        field.textContent = `${1 << level} ${level ? 'cells' : 'cell'}: ${value.toLocaleString('en')}`;
        field.title = 'so many elements are as wide as that, inside too';
        field.style.background = `#${ELEMENTS[Math.min(level, ELEMENTS.length - 1)].toString(16).padStart(6, '0')}`;
        return field;
    }));
}
