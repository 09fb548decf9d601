// SPDX-License-Identifier: MIT
// The line of a cut on the surface of a solid, which is closed until something pulls it open: red, with a darker rim.
// Ribbons that face the eye along the edges where walls of cuts meet the surface.

import { BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, Mesh, ShaderMaterial, Vector2 } from 'three';
import { look } from './tissue.js';

const WIDE = 0.009;    // of the body's size: the ribbon, of which the line is a third
const PIXELS = 4.5;    // no narrower

const vertexShader = /* glsl */ `
attribute vec3 other;  // the edge's other end
attribute vec2 corner; // -1 or 1: across; along, 1 at the second end
uniform float wide;    // [m]
uniform vec2 window;   // [pixels]
varying float vAcross, vBeyond;
const float BEYOND = 0.2;
void main() {
    vec4 eye = modelViewMatrix * vec4(position, 1.0), end = modelViewMatrix * vec4(other, 1.0);
    vec4 at = projectionMatrix * eye, to = projectionMatrix * end;
    vec2 way = (to.xy / to.w - at.xy / at.w) * window * corner.y;
    float length_ = max(length(way), 1e-6);
    way /= length_;
    // Half its width in pixels, and a little beyond its end, where the next edge joins.
    float half_ = 0.5 * max(wide * projectionMatrix[1].y / at.w * 0.5 * window.y, ${PIXELS.toFixed(1)});
    vec2 off = half_ * (vec2(-way.y, way.x) * corner.x - BEYOND * way * corner.y);
    vAcross = corner.x;
    vBeyond = corner.y * (1.0 + 2.0 * BEYOND * half_ / (0.5 * length_)); // -1 and 1: the ends
    // As if nearer by its width, or the surface beside it hides a half.
    float nearer = eye.z + wide;
    at.z = (projectionMatrix[2].z * nearer + projectionMatrix[3].z) / -nearer * at.w;
    gl_Position = at + vec4(off / (0.5 * window) * at.w, 0.0, 0.0);
}`;

const fragmentShader = /* glsl */ `
uniform float silent;
varying float vAcross, vBeyond;
void main() {
    float a = abs(vAcross), line = 1.0 - smoothstep(0.24, 0.42, a);
    vec3 colour = mix(vec3(0.30, 0.05, 0.04), vec3(0.64, 0.05, 0.055), line);
    colour = mix(colour, vec3(0.28), silent);
    gl_FragColor = vec4(colour, max(line, abs(vBeyond) > 1.0 ? 0.0 : 0.45 * (1.0 - a)));
}`;

export class Seam {
    constructor() {
        this.edges = new Uint32Array(0);
        this.placed = true;
        const material = new ShaderMaterial({ vertexShader, fragmentShader, transparent: true, depthWrite: false,
            side: DoubleSide,
            uniforms: { wide: { value: 0 }, window: { value: new Vector2() }, silent: { value: 0 } } });
        this.mesh = new Mesh(new BufferGeometry(), material);
        this.mesh.frustumCulled = false;
        this.mesh.visible = false;
        this.mesh.onBeforeRender = (renderer) => {
            renderer.getDrawingBufferSize(material.uniforms.window.value);
            material.uniforms.silent.value = look.silent ? 1 : 0;
        };
    }

    /** `edges` [..][2]: as seamEdges() finds them. */
    take(edges, size) {
        this.edges = edges;
        this.placed = false;
        this.mesh.visible = edges.length > 0;
        this.mesh.material.uniforms.wide.value = WIDE * size;
        this.mesh.geometry.dispose();
        const quads = edges.length / 2, geometry = this.mesh.geometry = new BufferGeometry();
        const corner = new Float32Array(8 * quads), corners = new Uint32Array(6 * quads);
        for (let q = 0; q < quads; q++) {
            corner.set([-1, -1, 1, -1, -1, 1, 1, 1], 8 * q);
            corners.set([0, 1, 2, 2, 1, 3].map((k) => 4 * q + k), 6 * q);
        }
        const add = (name, array, items) =>
            geometry.setAttribute(name, new BufferAttribute(array, items).setUsage(DynamicDrawUsage));
        add('position', new Float32Array(12 * quads), 3);
        add('other', new Float32Array(12 * quads), 3);
        add('corner', corner, 2);
        geometry.setIndex(new BufferAttribute(corners, 1));
    }

    /** Follows the nodes, if they have moved. */
    place(position, moved) {
        if (!this.mesh.visible || (this.placed && !moved)) return;
        this.placed = true;
        const { edges, mesh: { geometry: { attributes } } } = this;
        const here = attributes.position.array, there = attributes.other.array;
        for (let e = 0, to = 0; e < edges.length; e += 2)
            for (let k = 0; k < 4; k++, to += 3) {
                const a = 3 * edges[e + (k >> 1)], b = 3 * edges[e + 1 - (k >> 1)];
                for (let c = 0; c < 3; c++) {
                    here[to + c] = position[a + c];
                    there[to + c] = position[b + c];
                }
            }
        attributes.position.needsUpdate = attributes.other.needsUpdate = true;
    }
}
