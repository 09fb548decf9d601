// SPDX-License-Identifier: MIT
// The triangles of a picture: coarser meshes of a body, for where its own are small on the screen; finer ones, which
// follow the curve that the normals describe, for where they are large; and of the chosen one only what faces the eye.
// Nodes keep their places, normals and textures: a coarser mesh is another list of triangles between some of them, a
// finer one adds the middles of edges.

/** Triangles of a coarser mesh may turn by this much from those that they replace (20 degrees). */
const TURN = 0.94;
/** Passes between one mesh and the next coarser one; each removes about a quarter of the nodes. */
const PASSES = 2;
const LEVELS = 4;
const SMALLEST = 600; // triangles: fewer need no coarser mesh
const MOST = 16000;   // of a finer mesh
/** Edges bend where the normals of their ends differ by less than 37 degrees: else there is an edge of the body. */
const SMOOTH = 0.8;

/** The mean length of the edges of triangles, in the unit of `position`. */
export function meanEdge(index, m, position) {
    let sum = 0;
    for (let i = 0; i < m; i += 3)
        for (let k = 0; k < 3; k++) {
            const a = 3 * index[i + k], b = 3 * index[i + (k + 1) % 3];
            const x = position[a] - position[b], y = position[a + 1] - position[b + 1], z = position[a + 2] - position[b + 2];
            sum += Math.sqrt(x * x + y * y + z * z);
        }
    return m > 0 ? sum / m : 0;
}

/**
 * Coarser meshes of `index` [m], finest first: [{index, m, edge (mean length [m]), middles: 0}]. Nodes with
 * `fixed`[node] true stay; so do those at borders.
 */
export function coarserMeshes(index, m, position, fixed) {
    const levels = [];
    let mesh = index.slice(0, m);
    while (levels.length < LEVELS && mesh.length > 3 * SMALLEST) {
        const before = mesh.length;
        for (let k = 0; k < PASSES; k++) mesh = withoutSomeNodes(mesh, position, fixed);
        if (mesh.length > 0.8 * before) break; // what is left is needed
        levels.push({ index: mesh, m: mesh.length, middles: 0, edge: meanEdge(mesh, mesh.length, position) });
    }
    return levels;
}

// Moves nodes that are no neighbours of each other onto one of their neighbours, where that hardly changes the shape.
function withoutSomeNodes(index, position, fixed) {
    const n = fixed.length, m = index.length;
    const first = new Uint32Array(n + 1), of = new Uint32Array(m); // triangles of each node
    for (let i = 0; i < m; i++) first[index[i] + 1]++;
    for (let i = 0; i < n; i++) first[i + 1] += first[i];
    const fill = first.slice();
    for (let i = 0; i < m; i++) of[fill[index[i]]++] = i - i % 3;
    const stays = fixed.slice(), out = index.slice(), ring = [];
    for (let node = 0; node < n; node++) {
        if (stays[node] || first[node] === first[node + 1]) continue;
        const fan = of.subarray(first[node], first[node + 1]);
        if (!findRing(index, fan, node, ring)) continue;
        const onto = bestNeighbour(index, fan, node, ring, position);
        if (onto < 0) continue;
        for (const t of fan) for (let k = 0; k < 3; k++) if (index[t + k] === node) out[t + k] = onto;
        for (const neighbour of ring) stays[neighbour] = 1;
    }
    let used = 0;
    for (let i = 0; i < m; i += 3) {
        if (out[i] === out[i + 1] || out[i + 1] === out[i + 2] || out[i] === out[i + 2]) continue;
        out.copyWithin(used, i, i + 3);
        used += 3;
    }
    return out.slice(0, used);
}

// The neighbours of a node into `ring`; false: its triangles do not close around it once.
function findRing(index, fan, node, ring) {
    ring.length = 0;
    let at = 0;
    const corner = (t) => (index[t] === node ? 0 : index[t + 1] === node ? 1 : 2);
    // From triangle to triangle: the one whose second corner is the third of the last.
    const start = index[fan[0] + (corner(fan[0]) + 1) % 3];
    let from = start;
    for (; at < fan.length; at++) {
        const t = fan.find((other) => index[other + (corner(other) + 1) % 3] === from);
        if (t === undefined) return false;
        ring.push(from);
        from = index[t + (corner(t) + 2) % 3];
        if (from === start) break;
    }
    return at === fan.length - 1 && from === start;
}

const was = new Float64Array(4), now = new Float64Array(4);

// The normal of a triangle, unit, and the ratio of its area to its edges' squares, into `out`.
function shapeOf(position, a, b, c, out) {
    const ux = position[3 * b] - position[3 * a], uy = position[3 * b + 1] - position[3 * a + 1];
    const uz = position[3 * b + 2] - position[3 * a + 2], vx = position[3 * c] - position[3 * a];
    const vy = position[3 * c + 1] - position[3 * a + 1], vz = position[3 * c + 2] - position[3 * a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    const length = Math.sqrt(x * x + y * y + z * z), wx = ux - vx, wy = uy - vy, wz = uz - vz;
    const scale = length > 0 ? 1 / length : 0;
    out[0] = x * scale;
    out[1] = y * scale;
    out[2] = z * scale;
    out[3] = length / (ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz + 1e-300);
}

// The neighbour onto which the node moves so that the worst new triangle is best; -1: none will do.
function bestNeighbour(index, fan, node, ring, position) {
    let best = 0.08, onto = -1; // of 0.289, an equilateral triangle's
    for (const neighbour of ring) {
        let worst = Infinity;
        for (let f = 0; f < fan.length && worst > best; f++) {
            const [a, b, c] = [index[fan[f]], index[fan[f] + 1], index[fan[f] + 2]];
            if (a === neighbour || b === neighbour || c === neighbour) continue; // vanishes
            shapeOf(position, a, b, c, was);
            shapeOf(position, a === node ? neighbour : a, b === node ? neighbour : b, c === node ? neighbour : c, now);
            const turn = was[0] * now[0] + was[1] * now[1] + was[2] * now[2];
            worst = Math.min(worst, turn < TURN ? 0 : now[3]);
        }
        if (worst > best && worst < Infinity) {
            best = worst;
            onto = neighbour;
        }
    }
    return onto;
}

/**
 * Finer meshes of `index` [m], whose nodes are 0 ... n - 1: {levels: [{index, m, middles}], coarsest first; ends
 * [middles][2], nodes n, n + 1, ... lie between; straight [middles]: at a border}. A level needs the first `middles`.
 */
export function finerMeshes(index, m, n) {
    const levels = [], ends = [], straight = [];
    let mesh = index.subarray(0, m);
    while (levels.length < 2 && 4 * mesh.length <= 3 * MOST) {
        const middle = new Map(), nodes = n + ends.length / 2, out = new Uint32Array(4 * mesh.length);
        const between = (a, b) => {
            const key = a < b ? a * nodes + b : b * nodes + a;
            let at = middle.get(key);
            if (at === undefined) {
                at = n + ends.length / 2;
                ends.push(a, b);
                straight.push(1);
                middle.set(key, at);
            } else straight[at - n] = 0; // a second triangle
            return at;
        };
        for (let i = 0, o = 0; i < mesh.length; i += 3, o += 12) {
            const a = mesh[i], b = mesh[i + 1], c = mesh[i + 2];
            const ab = between(a, b), bc = between(b, c), ca = between(c, a);
            out.set([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], o);
        }
        mesh = out;
        levels.push({ index: out, m: out.length, middles: ends.length / 2 });
    }
    return { levels, ends: Int32Array.from(ends), straight: Uint8Array.from(straight) };
}

/**
 * Puts the first `count` middles, nodes from n on, between their ends, and gives them normals: on the cubic curve that
 * leaves both ends at right angles to their normals (curved PN triangles, Vlachos et al. 2001). Normals have any length.
 */
export function placeMiddles({ ends, straight }, count, n, position, normal) {
    for (let k = 0; k < count; k++) {
        const a = 3 * ends[2 * k], b = 3 * ends[2 * k + 1], at = 3 * (n + k);
        const la = unitScale(normal, a), lb = unitScale(normal, b);
        const ax = normal[a] * la, ay = normal[a + 1] * la, az = normal[a + 2] * la;
        const bx = normal[b] * lb, by = normal[b + 1] * lb, bz = normal[b + 2] * lb;
        const dx = position[b] - position[a], dy = position[b + 1] - position[a + 1], dz = position[b + 2] - position[a + 2];
        const bends = !straight[k] && ax * bx + ay * by + az * bz > SMOOTH;
        const from = bends ? 0.125 * (dx * ax + dy * ay + dz * az) : 0;
        const to = bends ? 0.125 * (dx * bx + dy * by + dz * bz) : 0;
        position[at] = 0.5 * (position[a] + position[b]) - from * ax + to * bx;
        position[at + 1] = 0.5 * (position[a + 1] + position[b + 1]) - from * ay + to * by;
        position[at + 2] = 0.5 * (position[a + 2] + position[b + 2]) - from * az + to * bz;
        // As long as the mean of both: addLitNormals.
        const scale = (la > 0 && lb > 0 ? 0.5 / la + 0.5 / lb : 1) / Math.max(Math.hypot(ax + bx, ay + by, az + bz), 1e-9);
        normal[at] = scale * (ax + bx);
        normal[at + 1] = scale * (ay + by);
        normal[at + 2] = scale * (az + bz);
    }
}

function unitScale(normal, a) {
    const square = normal[a] * normal[a] + normal[a + 1] * normal[a + 1] + normal[a + 2] * normal[a + 2];
    return square > 0 ? 1 / Math.sqrt(square) : 0;
}

/** Writes those triangles of `index` [m] that face `eye` to `out`; returns how many numbers. */
export function facing(index, m, position, eye, out) {
    let used = 0;
    for (let i = 0; i < m; i += 3) {
        const ia = index[i], ib = index[i + 1], ic = index[i + 2];
        const a = 3 * ia, b = 3 * ib, c = 3 * ic;
        const ax = position[a], ay = position[a + 1], az = position[a + 2];
        const ux = position[b] - ax, uy = position[b + 1] - ay, uz = position[b + 2] - az;
        const vx = position[c] - ax, vy = position[c + 1] - ay, vz = position[c + 2] - az;
        const away = (uy * vz - uz * vy) * (ax - eye.x) + (uz * vx - ux * vz) * (ay - eye.y) +
            (ux * vy - uy * vx) * (az - eye.z);
        if (away >= 0) continue;
        out[used] = ia;
        out[used + 1] = ib;
        out[used + 2] = ic;
        used += 3;
    }
    return used;
}
