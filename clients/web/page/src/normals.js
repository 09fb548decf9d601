// SPDX-License-Identifier: MIT
// Quantities computed from all triangles of a body. Plain loops over typed arrays, without allocation.

const DARKEST = 0.7;    // part of the light that the sharpest fold loses
const OPEN_FOLD = 0.05; // a fold this open loses none

/**
 * Adds up the triangles' normals, weighted by area, at their nodes; the shader makes them unit.
 * `index` [m] holds whole triangles; `position` and `normal` are [n][3].
 */
export function addNormals(index, m, position, normal) {
    normal.fill(0);
    for (let i = 0; i < m; i += 3) {
        const a = 3 * index[i], b = 3 * index[i + 1], c = 3 * index[i + 2];
        const ax = position[a], ay = position[a + 1], az = position[a + 2];
        const ux = position[b] - ax, uy = position[b + 1] - ay, uz = position[b + 2] - az;
        const vx = position[c] - ax, vy = position[c + 1] - ay, vz = position[c + 2] - az;
        const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
        normal[a] += x; normal[a + 1] += y; normal[a + 2] += z;
        normal[b] += x; normal[b + 1] += y; normal[b + 2] += z;
        normal[c] += x; normal[c + 1] += y; normal[c + 2] += z;
    }
}

/**
 * Normals of unit length times the light that reaches a node: less in folds, by their curvature times `reach` [m]. `bend`
 * [n][3] is room for sums. Of triangles around a node let N be the sum of normals, as long as twice their areas, and L that
 * of both ways to their other corners: for even ones of curvature k, N L = 1.155 k N N.
 */
export function addLitNormals(index, m, position, normal, bend, reach) {
    normal.fill(0);
    bend.fill(0);
    for (let i = 0; i < m; i += 3) {
        const a = 3 * index[i], b = 3 * index[i + 1], c = 3 * index[i + 2];
        const ax = position[a], ay = position[a + 1], az = position[a + 2];
        const ux = position[b] - ax, uy = position[b + 1] - ay, uz = position[b + 2] - az;
        const vx = position[c] - ax, vy = position[c + 1] - ay, vz = position[c + 2] - az;
        const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
        normal[a] += x; normal[a + 1] += y; normal[a + 2] += z;
        normal[b] += x; normal[b + 1] += y; normal[b + 2] += z;
        normal[c] += x; normal[c + 1] += y; normal[c + 2] += z;
        bend[a] += ux + vx; bend[a + 1] += uy + vy; bend[a + 2] += uz + vz;
        bend[b] += vx - 2 * ux; bend[b + 1] += vy - 2 * uy; bend[b + 2] += vz - 2 * uz;
        bend[c] += ux - 2 * vx; bend[c + 1] += uy - 2 * vy; bend[c + 2] += uz - 2 * vz;
    }
    // Curvatures, then means over neighbours: what one node alone has is noise of the mesh.
    for (let i = 0; i < normal.length; i += 3) {
        const x = normal[i], y = normal[i + 1], z = normal[i + 2], square = x * x + y * y + z * z;
        const curved = square > 0 ? 0.866 * reach * (x * bend[i] + y * bend[i + 1] + z * bend[i + 2]) / square : 0;
        bend[i] = curved > 2 ? 2 : curved < -2 ? -2 : curved;
        bend[i + 1] = 2 * bend[i];
        bend[i + 2] = 2;
    }
    for (let i = 0; i < m; i += 3) {
        const a = 3 * index[i], b = 3 * index[i + 1], c = 3 * index[i + 2];
        const p = bend[a], q = bend[b], r = bend[c];
        bend[a + 1] += q + r; bend[a + 2] += 2;
        bend[b + 1] += r + p; bend[b + 2] += 2;
        bend[c + 1] += p + q; bend[c + 2] += 2;
    }
    for (let i = 0; i < normal.length; i += 3) {
        const x = normal[i], y = normal[i + 1], z = normal[i + 2], square = x * x + y * y + z * z;
        if (square === 0) continue;
        const mean = bend[i + 1] / bend[i + 2] - OPEN_FOLD, fold = mean > 0 ? mean : 0;
        const scale = (1 - DARKEST * fold / (fold + 0.5)) / Math.sqrt(square);
        normal[i] = x * scale;
        normal[i + 1] = y * scale;
        normal[i + 2] = z * scale;
    }
}

/**
 * The nearest triangle that the ray from `o` along the unit vector `d` meets, at more than `near`
 * [m]: writes {distance, triangle (offset into index)} into `hit`. False: none.
 */
export function pickTriangle(index, m, position, o, d, near, hit) {
    let best = Infinity, found = -1;
    for (let i = 0; i < m; i += 3) {
        const a = 3 * index[i], b = 3 * index[i + 1], c = 3 * index[i + 2];
        const ax = position[a], ay = position[a + 1], az = position[a + 2];
        const ux = position[b] - ax, uy = position[b + 1] - ay, uz = position[b + 2] - az;
        const vx = position[c] - ax, vy = position[c + 1] - ay, vz = position[c + 2] - az;
        const px = d.y * vz - d.z * vy, py = d.z * vx - d.x * vz, pz = d.x * vy - d.y * vx;
        const det = ux * px + uy * py + uz * pz;
        if (det === 0) continue;
        const sx = o.x - ax, sy = o.y - ay, sz = o.z - az;
        const u = (sx * px + sy * py + sz * pz) / det;
        if (u < 0 || u > 1) continue;
        const qx = sy * uz - sz * uy, qy = sz * ux - sx * uz, qz = sx * uy - sy * ux;
        const v = (d.x * qx + d.y * qy + d.z * qz) / det;
        if (v < 0 || u + v > 1) continue;
        const t = (vx * qx + vy * qy + vz * qz) / det;
        if (t > near && t < best) {
            best = t;
            found = i;
        }
    }
    hit.distance = best;
    hit.triangle = found;
    return found >= 0;
}

/** The box of the nodes that triangles use, into `box` [6]: least x y z, greatest x y z. */
export function boxOf(index, m, position, box) {
    box[0] = box[1] = box[2] = Infinity;
    box[3] = box[4] = box[5] = -Infinity;
    for (let i = 0; i < m; i++) {
        const a = 3 * index[i];
        for (let k = 0; k < 3; k++) {
            const x = position[a + k];
            if (x < box[k]) box[k] = x;
            if (x > box[k + 3]) box[k + 3] = x;
        }
    }
    return m > 0;
}

/**
 * Whether each edge has a triangle on either side (then nothing is seen from behind): the directed
 * edges a -> b and b -> a cancel out in a sum of mixed numbers. Wrong once in four thousand million.
 */
export function isClosed(index, m) {
    let sum = 0;
    for (let i = 0; i < m; i += 3)
        for (let k = 0; k < 3; k++) {
            const a = index[i + k], b = index[i + (k + 1) % 3];
            let mixed = Math.imul(Math.min(a, b) + 1, 0x9e3779b1) ^ Math.imul(Math.max(a, b) + 1, 0x85ebca6b);
            mixed = Math.imul(mixed ^ (mixed >>> 15), 0x2c1b3c6d);
            sum = (a < b ? sum + mixed : sum - mixed) | 0;
        }
    return sum === 0;
}

/**
 * Marks the nodes of inner walls of a hollow solid body: `mark`[node] = 1 in parts of the surface that face inwards, if
 * another part is larger. `index` [m] is the surface without walls of cuts, `origin`[node] the slot of the node that it
 * was split from, or itself: a cut does not part what is one wall. `position` is that at rest.
 */
export function markInner(index, m, origin, position, mark) {
    const of = origin.slice(); // a node of the same part, the part's own node in the end
    const find = (i) => {
        while (of[i] !== i) i = of[i] = of[of[i]];
        return i;
    };
    for (let i = 0; i < m; i += 3) {
        const a = find(index[i]);
        of[find(index[i + 1])] = a;
        of[find(index[i + 2])] = a;
    }
    // Six times the volume that each part encloses, less than zero if it faces inwards.
    const volume = new Float64Array(of.length);
    for (let i = 0; i < m; i += 3) {
        const a = 3 * index[i], b = 3 * index[i + 1], c = 3 * index[i + 2];
        volume[find(index[i])] +=
            position[a] * (position[b + 1] * position[c + 2] - position[b + 2] * position[c + 1]) +
            position[a + 1] * (position[b + 2] * position[c] - position[b] * position[c + 2]) +
            position[a + 2] * (position[b] * position[c + 1] - position[b + 1] * position[c]);
    }
    let largest = 0;
    for (const v of volume) largest = Math.max(largest, v);
    for (let i = 0; i < of.length; i++) {
        const v = volume[find(i)];
        mark[i] = v < 0 && -v < largest ? 1 : 0;
    }
}

/**
 * The edges [..][2] where walls of cuts meet the surface, each cut's on either side. `index` [m]: triangles, from `outer` on
 * those of walls (0: none), whose nodes from n on are copies: `twin`[node - n] is the node of the surface at the same place.
 */
export function seamEdges(index, m, outer, n, twin) {
    if (outer === 0 || twin.length === 0) return new Uint32Array(0);
    const node = (i) => (i < n ? i : twin[i - n]), walls = new Set(), edges = [];
    const sides = (from, to, take) => {
        for (let i = from; i < to; i += 3)
            for (let k = 0; k < 3; k++) {
                const a = node(index[i + k]), b = node(index[i + (k + 1) % 3]);
                take(a, b, Math.min(a, b) * n + Math.max(a, b));
            }
    };
    sides(outer, m, (a, b, key) => walls.add(key));
    sides(0, outer, (a, b, key) => { if (walls.has(key)) edges.push(a, b); });
    return Uint32Array.from(edges);
}

/** Pairs of nodes of the surface (`surface` [n]: 1) that a cut parted: those that were split from one. */
export function findMates(id, origin, surface) {
    const first = new Map(), pairs = [];
    for (let i = 0; i < id.length; i++) {
        if (id[i] < 0 || !surface[i]) continue;
        const mate = first.get(origin[i]);
        if (mate === undefined) first.set(origin[i], i);
        else pairs.push(mate, i);
    }
    return Uint32Array.from(pairs);
}

/**
 * Where a cut is closed the surface is shaded as if it were whole: normals of addLitNormals become alike on both sides, the
 * less the farther they are apart, up to `near` [m].
 */
export function joinNormals(pairs, position, normal, near) {
    const length = (a) => Math.hypot(normal[a], normal[a + 1], normal[a + 2]);
    for (let k = 0; k < pairs.length; k += 2) {
        const a = 3 * pairs[k], b = 3 * pairs[k + 1];
        const gap = Math.hypot(position[a] - position[b], position[a + 1] - position[b + 1], position[a + 2] - position[b + 2]);
        const weight = 0.5 * (1 - gap / near), la = length(a), lb = length(b);
        if (weight <= 0) continue;
        for (let c = 0; c < 3; c++) {
            const way = weight * (normal[b + c] - normal[a + c]);
            normal[a + c] += way;
            normal[b + c] -= way;
        }
        // As long as before: that is light.
        for (const [at, mine, other] of [[a, la, lb], [b, lb, la]]) {
            const scale = (mine + weight * (other - mine)) / Math.max(length(at), 1e-9);
            for (let c = 0; c < 3; c++) normal[at + c] *= scale;
        }
    }
}
