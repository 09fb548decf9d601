// SPDX-License-Identifier: MIT
// One body: its mesh in slots, its node positions, and the drawn objects. Arrays grow with the mesh; a frame of
// positions allocates nothing.

import { BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, FrontSide, Group, LineBasicMaterial,
    LineSegments, Mesh, Points, PointsMaterial } from 'three';
import { colourOf, Colours } from './colours.js';
import { Elements } from './elements.js';
import { ErrorMap } from './errors.js';
import { coarserMeshes, facing, finerMeshes, meanEdge, placeMiddles } from './detail.js';
import { addLitNormals, addNormals, boxOf, findMates, isClosed, joinNormals, markInner, seamEdges } from './normals.js';
import { RestShape } from './rest_shape.js';
import { Seam } from './seam.js';
import { AT_CUT, COLOUR, KIND, colourTissue, look, tissueMaterial } from './tissue.js';

const FOLD = 0.04;     // of its size: a fold with this radius of curvature is in shade
const SINK = 0.4;     // of a mean edge: so much deeper walls of cuts count, or the closed ones show in front of the surface
const FINE = 1 / 60; // edges of a fine mesh are shorter than this part of its size

/** The nodes at rims: of outer triangles and of walls of cuts. */
function twinsOf(mesh) {
    const outer = 3 * mesh.firstWall, { triangle } = mesh;
    if (outer === 0 || outer >= triangle.length) return [];
    const seen = new Uint8Array(mesh.n), twin = [];
    for (let i = 0; i < outer; i++) seen[triangle[i]] = 1;
    for (let i = outer; i < triangle.length; i++)
        if (seen[triangle[i]] === 1) {
            seen[triangle[i]] = 2;
            twin.push(triangle[i]);
        }
    return twin;
}

const SETTLED_MS = 500; // without a change of the mesh, before coarser ones are made

const room = (count) => Math.ceil(Math.max(count, 64) * 1.25);

// Positions closer than this part of the body's size to those that were drawn draw the same picture: a fiftieth of a
// pixel of a body of a thousand.
const UNSEEN = 2e-5;

function differs(a, b, tolerance) {
    for (let i = 0; i < a.length; i++) if (Math.abs(a[i] - b[i]) > tolerance) return true;
    return false;
}

export class Body {
    constructor(number, { name, model }, images) {
        this.number = number;
        this.name = name;
        this.model = model;
        this.images = images; // {drawn, of(name), plain}
        this.topology = null; // of the mesh; null: none yet
        this.n = 0;
        this.twin = [];       // nodes that are drawn once more, behind the others: at rims, for walls of cuts
        this.m = 0;           // indices of triangles in use
        this.finest = 0;      // level of its nodes
        this.outer = 0;       // indices from here on are of walls of cuts; 0: there are none
        this.index = new Uint32Array(0);
        this.drawn = new Uint32Array(0); // the triangles of a frame
        this.finer = null;    // meshes and the middles of edges, nodes behind the twins
        this.levels = [];     // meshes to choose from, finest first
        this.level = null;    // the one of the last frame
        this.settleAt = 0;    // [ms] when coarser ones are made, if `index` has not changed until then; infinite: they are
        this.position = new Float32Array(0);
        this.id = new Int32Array(0);
        this.shown = false;   // there is something to draw
        this.moved = false;   // since the last frame
        this.next = null;     // a newer mesh whose positions have not arrived, and its rest message
        this.nextRest = null;
        this.dressed = false; // its material is set
        this.box = new Float32Array(6);
        this.restShape = new RestShape();
        this.seam = new Seam();
        this.mates = [];      // pairs of nodes that a cut parted
        this.edge = 0;        // mean [m]
        this.colours = new Colours();
        this.tint = colourOf(name); // without a look
        this.errorMap = new ErrorMap();
        this.elements = new Elements();
        this.shares = null;     // what nodes have in the fourth number of their look: COLOUR; null: of an older map or mesh
        this.imageName = '';  // of an image beside the scene,
        this.beside = null;   // once it is loaded
        this.group = new Group();
        this.show = { wireframe: false, springs: false };
    }

    /** Kept until positions of it come: the present ones are not its own. */
    takeMesh(mesh) {
        if (mesh.topology === this.topology && mesh.n === this.n && mesh.firstWall === this.mesh.firstWall)
            return; // a repeat of the same mesh
        this.next = mesh;
        this.nextRest = null;
    }

    changeMesh(mesh) {
        this.twin = twinsOf(mesh);
        if (mesh.triangle.length > this.index.length) this.index = new Uint32Array(3 * room(mesh.triangle.length / 3));
        this.topology = mesh.topology;
        this.n = mesh.n;
        this.id = mesh.id.slice();
        this.mesh = mesh;
        const twinOf = new Map(this.twin.map((node, k) => [node, mesh.n + k]));
        const wall = mesh.firstWall > 0 ? 3 * mesh.firstWall : Infinity;
        let m = 0, outer = 0;
        for (let i = 0; i < mesh.triangle.length; i += 3) {
            if (i === wall) outer = m;
            const a = mesh.triangle[i], b = mesh.triangle[i + 1], c = mesh.triangle[i + 2];
            if (a === b || b === c || a === c) continue; // a free slot
            this.index[m++] = a;
            this.index[m++] = b;
            this.index[m++] = c;
        }
        this.m = m;
        this.closed = isClosed(this.index, m);
        // Walls have normals of their own.
        for (let i = outer; i < m && this.twin.length > 0; i++)
            this.index[i] = twinOf.get(this.index[i]) ?? this.index[i];
        this.finer = finerMeshes(this.index, m, this.n + this.twin.length);
        this.levels = [...this.finer.levels].reverse().concat({ index: this.index, m, middles: 0 });
        this.level = null;
        this.settleAt = performance.now() + SETTLED_MS;
        const nodes = this.n + this.twin.length + this.finer.straight.length;
        if (nodes > this.capacityNodes() || this.levels[0].m > this.drawn.length) this.grow(nodes, this.levels[0].m);
        this.outer = outer;
        const surface = new Uint8Array(this.n);
        for (let i = 0; i < (outer || m); i++) surface[this.index[i]] = 1;
        this.mates = this.model === 'voxel' ? findMates(mesh.id, mesh.origin, surface) : [];
        this.fillInfo(mesh);
        this.edgesValid = false;
    }

    /** Gives twins the values of their nodes. */
    repeat(array, size) {
        for (let k = 0; k < this.twin.length; k++) {
            const from = size * this.twin[k], to = size * (this.n + k);
            for (let c = 0; c < size; c++) array[to + c] = array[from + c];
        }
    }

    /** Gives middles of edges the mean of their ends. */
    halve(array, size) {
        const { ends, straight } = this.finer;
        for (let k = 0, to = size * (this.n + this.twin.length); k < straight.length; k++, to += size)
            for (let c = 0; c < size; c++)
                array[to + c] = 0.5 * (array[size * ends[2 * k] + c] + array[size * ends[2 * k + 1] + c]);
    }

    // Levels, pieces and kinds have no mean.
    halveInfo() {
        const { info, finer: { ends, straight } } = this;
        for (let k = 0, to = 4 * (this.n + this.twin.length); k < straight.length; k++, to += 4) {
            const a = 4 * ends[2 * k], b = 4 * ends[2 * k + 1];
            info[to] = Math.min(info[a], info[b]);
            info[to + 1] = info[a + 1];
            info[to + 2] = (info[a + 2] + info[b + 2]) >> 1;
            info[to + 3] = info[a + 3];
        }
    }

    /** Rest positions of all nodes that there are. */
    livePoints() {
        return this.rest.slice(0, 3 * this.n).filter((_, i) => this.id[Math.floor(i / 3)] >= 0);
    }

    capacityNodes() { return this.position.length / 3; }

    grow(nodes, indices) {
        const n = room(nodes), m = 3 * room(indices / 3);
        const geometry = new BufferGeometry();
        const add = (name, array, size, normalized = false) => {
            const attribute = new BufferAttribute(array, size, normalized);
            attribute.setUsage(DynamicDrawUsage);
            geometry.setAttribute(name, attribute);
            return array;
        };
        const old = this.position;
        this.position = add('position', new Float32Array(3 * n), 3);
        this.position.set(old.length <= 3 * n ? old : old.subarray(0, 3 * n));
        this.normal = add('normal', new Float32Array(3 * n), 3);
        this.bend = new Float32Array(3 * n);
        this.rest = add('rest', new Float32Array(3 * n), 3);
        this.restNormal = add('restNormal', new Float32Array(3 * n), 3);
        this.uv = add('uv', new Float32Array(2 * n), 2);
        this.info = add('info', new Uint8Array(4 * n), 4);
        this.look = add('look', new Uint8Array(4 * n), 4, true);
        this.drawn = new Uint32Array(m);
        geometry.setIndex(new BufferAttribute(this.drawn, 1).setUsage(DynamicDrawUsage));
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
        this.elements.lines.geometry.setAttribute('position', geometry.attributes.position);
        this.group.add(this.seam.mesh, this.elements.lines);
        for (const part of [this.surface, this.edges, this.anchors, this.springs]) {
            part.frustumCulled = false; // its bounds would be recomputed for every frame
            part.visible = false;
            this.group.add(part);
        }
    }

    dispose() {
        for (const part of [this.surface, this.edges, this.anchors, this.springs, this.elements.lines, this.seam.mesh])
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
                split.size > 0 && (mesh.origin[i] !== mesh.id[i] || split.has(mesh.id[i])) ? AT_CUT : 0;
        }
        this.repeat(this.info, 4);
        this.lips = split.size;
        this.finest = 0;
        for (let i = 0; i < mesh.n; i++) if (mesh.id[i] >= 0) this.finest = Math.max(this.finest, mesh.level[i]);
    }

    // Walls of cuts have nodes of their own, and so do inner walls: no colour runs into another. After `rest` is filled.
    findKinds() {
        const { mesh, info } = this, outer = this.outer > 0 ? this.outer : this.m;
        const kind = new Uint8Array(this.n + this.twin.length);
        const slot = new Map();
        for (let i = 0; i < mesh.n; i++) if (mesh.id[i] >= 0) slot.set(mesh.id[i], i);
        const origin = Int32Array.from(kind, (_, i) => (i < mesh.n ? slot.get(mesh.origin[i]) ?? i : i));
        if (this.model === 'voxel') markInner(this.index, outer, origin, this.rest, kind);
        for (let i = outer; i < this.m; i++) kind[this.index[i]] = KIND.CUT;
        for (let i = 0; i < kind.length; i++) info[4 * i + 3] = kind[i];
    }

    takeRest(message) {
        const { next } = this;
        if (next && message.topology === next.topology && message.n === next.n) this.nextRest = message;
        if (message.topology !== this.topology || message.n !== this.n) return;
        this.restShape.take(message, this.mesh);
        this.fillRest();
    }

    fillRest(anew = false) {
        this.restShape.fill(this.mesh, this.position, this.rest, this.uv);
        this.repeat(this.rest, 3);
        this.repeat(this.uv, 2);
        this.halve(this.rest, 3);
        this.halve(this.uv, 2);
        const { attributes } = this.surface.geometry;
        this.levels.forEach((level) => { level.edge = meanEdge(level.index, level.m, this.rest); });
        addNormals(this.index, this.m, this.rest, this.restNormal);
        this.halve(this.restNormal, 3);
        this.findKinds();
        this.halveInfo();
        attributes.info.needsUpdate = true;
        attributes.rest.needsUpdate = attributes.restNormal.needsUpdate = attributes.uv.needsUpdate = true;
        const textured = this.restShape.textured;
        if (anew || !this.dressed || this.textured !== textured) this.dress(textured);
        this.seam.take(seamEdges(this.index, this.m, this.outer, this.n, this.twin), this.size());
        const { material } = this.surface;
        this.edge = meanEdge(this.index, this.m, this.rest);
        material.uniforms.sink.value = SINK * this.edge;
        material.side = this.closed ? FrontSide : DoubleSide;
        material.userData.rim = this.model !== 'voxel' && this.lips > 0;
        this.colour();
    }

    /** New colours; repeats of the same change nothing. */
    takeLook(message) {
        this.colours.take(message);
        this.findImage(message.texture);
        if (!this.dressed) return false;
        this.colour();
        return true;
    }

    /** Where the error is. */
    takeErrorMap(message) {
        this.errorMap.take(message);
        this.shares = null;
    }

    /** Which elements are at its surface. */
    takeElements(message) {
        this.elements.take(message);
        this.shares = null;
    }

    // Only while they are shown: errors, or elements and their borders.
    fillShares(colouring) {
        const { n, twin, look, mesh, elements } = this, share = new Uint8Array(n);
        if (colouring === COLOUR.ERROR) this.errorMap.fill(mesh, share);
        else elements.show(mesh, share);
        this.shares = colouring;
        for (let i = 0; i < n + twin.length; i++) look[4 * i + 3] = share[i < n ? i : twin[i - n]];
        this.halve(look, 4);
        this.surface.geometry.attributes.look.needsUpdate = true;
    }

    // An image that the scene names is put on when it is loaded; without it the colour stays.
    findImage(name) {
        if (!name || name === this.imageName) return;
        this.imageName = name;
        this.images.beside(name, (image) => {
            this.beside = image;
            if (this.dressed && this.textured) this.fillRest(true);
        });
    }

    // The material's colours, and those of the nodes.
    colour() {
        const { message } = this.colours;
        if (this.colours.vary) this.fillColours();
        this.shares = null;
        colourTissue(this.surface.material, { outside: message?.color ?? this.tint, inside: message?.inside,
            vary: this.colours.vary, own: this.own, model: this.model });
    }

    // Nodes of walls have the inside's.
    fillColours() {
        const { n, twin, info, look } = this, outer = new Uint8Array(3 * n), inner = new Uint8Array(3 * n);
        this.colours.fill(this.mesh, outer, inner);
        for (let i = 0; i < n + twin.length; i++) {
            const from = info[4 * i + 3] === KIND.CUT ? inner : outer, node = i < n ? i : twin[i - n];
            for (let c = 0; c < 3; c++) look[4 * i + c] = from[3 * node + c];
        }
        this.halve(look, 4);
        this.surface.geometry.attributes.look.needsUpdate = true;
    }

    dress(textured) {
        this.textured = textured;
        this.dressed = true;
        boxOf(this.index, this.m, this.rest, this.box);
        const own = textured ? this.images.of(this.name) ?? this.beside : null;
        this.surface.material?.dispose();
        this.own = own !== null;
        this.surface.material = tissueMaterial({ model: this.model,
            grain: 2.2 / this.size(), image: own ?? this.images.drawn, own: own !== null,
            plain: this.images.plain,
            fine: this.levels[0].edge < FINE * this.size() });
    }

    /** Nodes of another mesh are refused: false. */
    takeNodes(message) {
        const { next, nextRest } = this;
        const changes = next !== null && message.topology === next.topology && message.n === next.n;
        if (!changes && (message.topology !== this.topology || message.n !== this.n)) return false;
        if (changes) this.changeMesh(next);
        else if (this.shown && !differs(message.position, this.position, UNSEEN * this.size())) return true;
        this.position.set(message.position);
        this.repeat(this.position, 3);
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

    /** The mesh to draw: the coarsest whose edges are below `edge` [m]; the body's own where its edges are shown. */
    levelFor(edge) {
        if (performance.now() > this.settleAt) this.findCoarser();
        if (this.show.wireframe || this.elements.lines.visible) return this.levels[this.finer.levels.length];
        return this.levels.findLast((level) => level.edge < edge) ?? this.levels[0];
    }

    findCoarser() {
        const fixed = new Uint8Array(this.n + this.twin.length);
        for (let i = 0; i < fixed.length; i++) fixed[i] = this.info[4 * i + 2];
        this.levels.push(...coarserMeshes(this.index, this.m, this.rest, fixed));
        this.settleAt = Infinity;
    }

    /** Chooses the triangles of a frame: `view` as stage.js says. */
    chooseTriangles({ eye, edge, turned }) {
        const level = this.levelFor(edge);
        if (level === this.level && !this.moved && !turned) return;
        const { index: drawn, attributes } = this.surface.geometry;
        if (this.moved || level !== this.level) {
            placeMiddles(this.finer, level.middles, this.n + this.twin.length, this.position, this.normal);
            attributes.position.needsUpdate = attributes.normal.needsUpdate = true;
        }
        this.level = level;
        let used = level.m;
        if (this.closed) used = facing(level.index, level.m, this.position, eye, this.drawn);
        else this.drawn.set(level.index.subarray(0, level.m));
        drawn.clearUpdateRanges();
        drawn.addUpdateRange(0, used);
        drawn.needsUpdate = true;
        this.surface.geometry.setDrawRange(0, used);
    }

    /** Before a frame: what follows from new positions. */
    prepare(view) {
        if (!this.surface) return;
        const { wireframe, springs } = this.show;
        this.surface.visible = this.shown;
        this.edges.visible = wireframe;
        this.anchors.visible = this.springs.visible = springs;
        if (wireframe && !this.edgesValid) this.findEdges();
        const told = (look.colouring === COLOUR.ERROR && this.errorMap.message) ||
            (look.colouring === COLOUR.ELEMENT && this.elements.message);
        if (told && this.dressed && this.shares !== look.colouring) this.fillShares(look.colouring);
        this.elements.lines.visible = this.shown && look.colouring === COLOUR.ELEMENT && this.elements.message !== null;
        if (this.moved) {
            addLitNormals(this.index, this.m, this.position, this.normal, this.bend, FOLD * this.size());
            joinNormals(this.mates, this.position, this.normal, SINK * this.edge);
        }
        if (this.shown) this.chooseTriangles(view);
        if (springs) this.fillSprings();
        this.seam.place(this.position, this.moved);
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
                const key = Math.min(a, b) * (this.n + this.twin.length) + Math.max(a, b);
                if (seen.has(key)) continue;
                seen.add(key);
                list.push(a, b);
            }
        this.edges.geometry.setIndex(new BufferAttribute(Uint32Array.from(list), 1));
        this.edgesValid = true;
    }
}
