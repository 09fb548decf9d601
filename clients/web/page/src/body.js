// One body: its mesh in slots, its node positions, and the drawn objects. Arrays grow with the mesh; a frame of
// positions allocates nothing.

import { BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, FrontSide, Group, LineBasicMaterial, LineSegments,
    Mesh, Points, PointsMaterial } from 'three';
import { addNormals, boxOf, isClosed } from './normals.js';
import { RestShape } from './rest_shape.js';
import { tissueMaterial } from './tissue.js';

const room = (count) => Math.ceil(Math.max(count, 64) * 1.25);

export class Body {
    constructor(number, { name, model }, images) {
        this.number = number;
        this.name = name;
        this.model = model;
        this.images = images; // {drawn, of(name), plain}
        this.topology = null; // of the mesh; null: none yet
        this.n = 0;
        this.m = 0;           // indices of triangles in use
        this.finest = 0;      // level of its nodes
        this.index = new Uint32Array(0);
        this.position = new Float32Array(0);
        this.id = new Int32Array(0);
        this.shown = false;   // there is something to draw
        this.moved = false;   // since the last frame
        this.next = null;     // a newer mesh whose positions have not arrived, and its rest message
        this.nextRest = null;
        this.dressed = false; // its material is set
        this.box = new Float32Array(6);
        this.restShape = new RestShape();
        this.group = new Group();
        this.show = { wireframe: false, springs: false };
    }

    /** Kept until positions of it come: the present ones are not its own. */
    takeMesh(mesh) {
        if (mesh.topology === this.topology && mesh.n === this.n) return; // a repeat of the same mesh
        this.next = mesh;
        this.nextRest = null;
    }

    changeMesh(mesh) {
        if (mesh.n > this.capacityNodes() || mesh.triangle.length > this.index.length) this.grow(mesh);
        this.topology = mesh.topology;
        this.n = mesh.n;
        this.id = mesh.id.slice();
        this.mesh = mesh;
        let m = 0;
        for (let i = 0; i < mesh.triangle.length; i += 3) {
            const a = mesh.triangle[i], b = mesh.triangle[i + 1], c = mesh.triangle[i + 2];
            if (a === b || b === c || a === c) continue; // a free slot
            this.index[m++] = a;
            this.index[m++] = b;
            this.index[m++] = c;
        }
        this.m = m;
        this.closed = isClosed(this.index, m);
        this.surface.geometry.index.needsUpdate = true;
        this.surface.geometry.setDrawRange(0, m);
        this.fillInfo(mesh);
        this.edgesValid = false;
    }

    capacityNodes() { return this.position.length / 3; }

    grow(mesh) {
        const n = room(mesh.n), m = 3 * room(mesh.triangle.length / 3);
        const geometry = new BufferGeometry();
        const add = (name, array, size) => {
            const attribute = new BufferAttribute(array, size);
            attribute.setUsage(DynamicDrawUsage);
            geometry.setAttribute(name, attribute);
            return array;
        };
        const old = this.position;
        this.position = add('position', new Float32Array(3 * n), 3);
        this.position.set(old.length <= 3 * n ? old : old.subarray(0, 3 * n));
        this.normal = add('normal', new Float32Array(3 * n), 3);
        this.rest = add('rest', new Float32Array(3 * n), 3);
        this.restNormal = add('restNormal', new Float32Array(3 * n), 3);
        this.uv = add('uv', new Float32Array(2 * n), 2);
        this.info = add('info', new Uint8Array(4 * n), 4);
        this.index = new Uint32Array(m);
        geometry.setIndex(new BufferAttribute(this.index, 1));
        this.replaceSurface(geometry);
    }

    replaceSurface(geometry) {
        const material = this.surface?.material;
        this.dispose();
        this.surface = new Mesh(geometry, material);
        // Edges share the positions and have their own indices.
        this.edges = new LineSegments(new BufferGeometry(), new LineBasicMaterial(
            { color: 0x101418, transparent: true, opacity: 0.55 }));
        this.edges.geometry.setAttribute('position', geometry.attributes.position);
        this.anchors = new Points(new BufferGeometry(), new PointsMaterial(
            { color: 0x8fd0ff, size: 3, sizeAttenuation: false, depthTest: false, transparent: true }));
        this.springs = new LineSegments(new BufferGeometry(), new LineBasicMaterial(
            { color: 0x8fd0ff, depthTest: false, transparent: true, opacity: 0.7 }));
        this.anchors.geometry.setAttribute('position', geometry.attributes.rest);
        const ends = new BufferAttribute(new Float32Array(2 * this.position.length), 3);
        ends.setUsage(DynamicDrawUsage);
        this.springs.geometry.setAttribute('position', ends);
        this.group.clear();
        for (const part of [this.surface, this.edges, this.anchors, this.springs]) {
            part.frustumCulled = false; // its bounds would be recomputed for every frame
            part.visible = false;
            this.group.add(part);
        }
    }

    dispose() {
        for (const part of [this.surface, this.edges, this.anchors, this.springs])
            part?.geometry.dispose();
    }

    // Level, piece, and whether the node is at a cut: a split one, or one that it was split from.
    fillInfo(mesh) {
        const split = new Set();
        for (let i = 0; i < mesh.n; i++)
            if (mesh.id[i] >= 0 && mesh.origin[i] !== mesh.id[i]) split.add(mesh.origin[i]);
        for (let i = 0, at = 0; i < mesh.n; i++, at += 4) {
            this.info[at] = Math.max(mesh.level[i], 0);
            this.info[at + 1] = mesh.piece[i];
            this.info[at + 2] =
                split.size > 0 && (mesh.origin[i] !== mesh.id[i] || split.has(mesh.id[i])) ? 1 : 0;
        }
        this.surface.geometry.attributes.info.needsUpdate = true;
        this.lips = split.size;
        this.finest = 0;
        for (let i = 0; i < mesh.n; i++) if (mesh.id[i] >= 0) this.finest = Math.max(this.finest, mesh.level[i]);
    }

    takeRest(message) {
        const { next } = this;
        if (next && message.topology === next.topology && message.n === next.n) this.nextRest = message;
        if (message.topology !== this.topology || message.n !== this.n) return;
        this.restShape.take(message, this.mesh);
        this.fillRest();
    }

    fillRest() {
        this.restShape.fill(this.mesh, this.position, this.rest, this.uv);
        const { attributes } = this.surface.geometry;
        addNormals(this.index, this.m, this.rest, this.restNormal);
        attributes.rest.needsUpdate = attributes.restNormal.needsUpdate = attributes.uv.needsUpdate = true;
        const textured = this.restShape.textured;
        if (!this.dressed || this.textured !== textured) this.dress(textured);
        this.surface.material.side = this.closed ? FrontSide : DoubleSide;
    }

    dress(textured) {
        this.textured = textured;
        this.dressed = true;
        boxOf(this.index, this.m, this.rest, this.box);
        const own = textured ? this.images.of(this.name) : null;
        this.surface.material?.dispose();
        this.surface.material = tissueMaterial({ number: this.number, model: this.model,
            grain: 2.2 / this.size(), image: own ?? this.images.drawn, own: own !== null,
            plain: this.images.plain });
    }

    /** Nodes of another mesh are refused: false. */
    takeNodes(message) {
        const { next, nextRest } = this;
        const changes = next !== null && message.topology === next.topology && message.n === next.n;
        if (!changes && (message.topology !== this.topology || message.n !== this.n)) return false;
        if (changes) this.changeMesh(next);
        this.position.set(message.position);
        this.moved = this.shown = true;
        if (changes) {
            this.next = this.nextRest = null;
            if (nextRest) this.restShape.take(nextRest, this.mesh);
            this.fillRest();
        }
        return true;
    }

    size() {
        const b = this.box;
        return Math.max(Math.hypot(b[3] - b[0], b[4] - b[1], b[5] - b[2]), 1e-6);
    }

    /** Before a frame: what follows from new positions. */
    prepare() {
        if (!this.surface) return;
        const { wireframe, springs } = this.show;
        this.surface.visible = this.shown;
        this.edges.visible = wireframe;
        this.anchors.visible = this.springs.visible = springs;
        if (wireframe && !this.edgesValid) this.findEdges();
        if (this.moved) {
            addNormals(this.index, this.m, this.position, this.normal);
            this.surface.geometry.attributes.position.needsUpdate = true;
            this.surface.geometry.attributes.normal.needsUpdate = true;
        }
        if (springs) this.fillSprings();
        this.moved = false;
    }

    fillSprings() {
        const ends = this.springs.geometry.attributes.position.array;
        let used = 0;
        for (let i = 0; i < this.n; i++) {
            if (this.id[i] < 0) continue;
            for (let k = 0; k < 3; k++) {
                ends[used + k] = this.rest[3 * i + k];
                ends[used + 3 + k] = this.position[3 * i + k];
            }
            used += 6;
        }
        this.springs.geometry.attributes.position.needsUpdate = true;
        this.springs.geometry.setDrawRange(0, used / 3);
        this.anchors.geometry.setDrawRange(0, this.n);
    }

    // Each edge once: of two triangles' directions the one from the smaller node; at a rim the only one.
    findEdges() {
        const seen = new Set(), list = [];
        for (let i = 0; i < this.m; i += 3)
            for (let k = 0; k < 3; k++) {
                const a = this.index[i + k], b = this.index[i + ((k + 1) % 3)];
                const key = Math.min(a, b) * this.n + Math.max(a, b);
                if (seen.has(key)) continue;
                seen.add(key);
                list.push(a, b);
            }
        this.edges.geometry.setIndex(new BufferAttribute(Uint32Array.from(list), 1));
        this.edgesValid = true;
    }
}
