// SPDX-License-Identifier: MIT
// The ground below the bodies: a grid that shows their size, and their soft shadow. The shadow is a small picture of the
// triangles from above, made by the processor a few times a second.

import { BufferAttribute, Color, DynamicDrawUsage, GridHelper, LinearSRGBColorSpace, Mesh, PlaneGeometry,
    ShaderMaterial } from 'three';

const CELLS = 40;        // of the picture, along each side
const WIDE = 1.5;        // of the scene's size: the ground's side
const BLUR = 1;          // [cells], twice
const HIGH = 0.75;       // of the scene's size: from so high nothing is in the shadow
const EVERY = 150;       // [ms]

export class Ground {
    constructor(background) {
        this.cell = new Float32Array(CELLS * CELLS);
        this.room = new Float32Array(CELLS * CELLS);
        this.drawnAt = -Infinity;
        // One node a cell, and colours at nodes; only what is dark is drawn. Where the processor draws, a texture would cost
        // three times as much, and a floor all around 3 to 8 ms a frame.
        const plane = new PlaneGeometry(1, 1, CELLS - 1, CELLS - 1);
        this.quads = plane.index.array.slice();
        plane.index.setUsage(DynamicDrawUsage);
        this.dark = new BufferAttribute(new Float32Array(CELLS * CELLS), 1).setUsage(DynamicDrawUsage);
        plane.setAttribute('dark', this.dark);
        this.floor = new Mesh(plane, new ShaderMaterial({
            uniforms: { around: { value: new Color().setHex(background, LinearSRGBColorSpace) } },
            vertexShader: /* glsl */ `
attribute float dark;
uniform vec3 around;
varying vec3 vColour;
void main() {
    vColour = around * (1.0 - 0.85 * dark);
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`,
            fragmentShader: /* glsl */ `
varying vec3 vColour;
void main() { gl_FragColor = vec4(vColour, 1.0); }`,
            depthWrite: false }));
        // After the bodies, which hide most of it; before the grid.
        this.floor.renderOrder = 1;
        this.floor.visible = false;
    }

    /** Below a box; a grid of 1, 2 or 5 cm, m, .... */
    lay(scene, box, center, size, flat) {
        if (this.grid) {
            scene.remove(this.grid);
            this.grid.geometry.dispose();
            this.grid.material.dispose();
        }
        const power = 10 ** Math.floor(Math.log10(size / 14));
        const cell = power * [5, 2, 1].find((times) => times * power <= size / 14);
        const cells = 2 * Math.ceil(0.7 * size / cell);
        this.grid = new GridHelper(cells * cell, cells, 0x2c3238, 0x23292e);
        this.grid.rotation.x = Math.PI / 2;
        this.grid.position.set(center.x, center.y, box.min.z - (flat ? 0.05 : 0.02) * size);
        this.grid.renderOrder = 2;
        this.floor.position.copy(this.grid.position);
        this.floor.scale.setScalar(WIDE * size);
        this.size = size;
        this.floor.visible = true;
        this.drawnAt = -Infinity;
        scene.add(this.floor, this.grid);
    }

    /** Draws the shadow again, if the last one is old enough; true: later, since something moved. */
    shade(bodies, now) {
        if (!this.floor.visible) return false;
        if (now - this.drawnAt < EVERY) return true;
        this.drawnAt = now;
        this.cell.fill(0);
        for (const body of bodies) if (body.shown) this.addShadow(body);
        for (let k = 0; k < 2; k++) this.blur();
        for (let j = 0; j < CELLS; j++) // rows of a plane begin at the far side
            this.dark.array.set(this.cell.subarray(j * CELLS, (j + 1) * CELLS), (CELLS - 1 - j) * CELLS);
        this.dark.needsUpdate = true;
        const { geometry } = this.floor, index = geometry.index.array, { array } = this.dark;
        let used = 0;
        for (let t = 0; t < this.quads.length; t += 3) {
            const [a, b, c] = [this.quads[t], this.quads[t + 1], this.quads[t + 2]];
            if (array[a] + array[b] + array[c] === 0) continue;
            index[used++] = a;
            index[used++] = b;
            index[used++] = c;
        }
        geometry.index.needsUpdate = true;
        geometry.setDrawRange(0, used);
        return false;
    }

    // Each cell gets the darkest of the triangles above it.
    addShadow({ index, m, position }) {
        const { x, y, z } = this.floor.position, scale = (CELLS - 1) / (WIDE * this.size), half = 0.5 * CELLS;
        const px = (i) => (position[3 * i] - x) * scale + half, py = (i) => (position[3 * i + 1] - y) * scale + half;
        for (let t = 0; t < m; t += 3) {
            const a = index[t], b = index[t + 1], c = index[t + 2];
            const dark = 1 - (Math.min(position[3 * a + 2], position[3 * b + 2], position[3 * c + 2]) - z) / (HIGH * this.size);
            if (dark <= 0) continue;
            const ax = px(a), ay = py(a), bx = px(b), by = py(b), cx = px(c), cy = py(c);
            const left = Math.max(Math.floor(Math.min(ax, bx, cx)), 0), right = Math.min(Math.max(ax, bx, cx), CELLS - 1);
            const low = Math.max(Math.floor(Math.min(ay, by, cy)), 0), high = Math.min(Math.max(ay, by, cy), CELLS - 1);
            for (let j = low; j <= high; j++)
                for (let i = left; i <= right; i++) {
                    if (right - left > 2 && !isWithin(i + 0.5, j + 0.5, ax, ay, bx, by, cx, cy)) continue;
                    const at = j * CELLS + i;
                    if (dark > this.cell[at]) this.cell[at] = Math.min(dark, 1);
                }
        }
    }

    // A running mean along rows, written as columns: twice along both.
    blur() {
        for (let pass = 0; pass < 2; pass++) {
            const { cell, room } = this;
            for (let j = 0; j < CELLS; j++)
                for (let i = 0; i < CELLS; i++) {
                    let sum = 0;
                    for (let k = Math.max(i - BLUR, 0); k <= Math.min(i + BLUR, CELLS - 1); k++) sum += cell[j * CELLS + k];
                    room[i * CELLS + j] = sum / (2 * BLUR + 1);
                }
            this.cell = room;
            this.room = cell;
        }
    }
}

function isWithin(x, y, ax, ay, bx, by, cx, cy) {
    const p = (bx - ax) * (y - ay) - (by - ay) * (x - ax), q = (cx - bx) * (y - by) - (cy - by) * (x - bx);
    const r = (ax - cx) * (y - cy) - (ay - cy) * (x - cx);
    return (p >= 0 && q >= 0 && r >= 0) || (p <= 0 && q <= 0 && r <= 0);
}
