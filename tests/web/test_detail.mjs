// SPDX-License-Identifier: MIT
// The triangles that the page chooses for a picture: without a browser.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { coarserMeshes, facing, finerMeshes, meanEdge, placeMiddles } from '../../clients/web/page/src/detail.js';
import { addLitNormals, addNormals, findMates, isClosed, joinNormals, markInner, seamEdges } from '../../clients/web/page/src/normals.js';
import { icoSphere } from './mock.mjs';

const RADIUS = 0.05;
const fine = icoSphere(4, RADIUS), coarse = icoSphere(1, RADIUS);
const free = (mesh) => new Uint8Array(mesh.position.length / 3);

function volume(index, p) {
    let sum = 0;
    for (let i = 0; i < index.length; i += 3) {
        const [a, b, c] = [3 * index[i], 3 * index[i + 1], 3 * index[i + 2]];
        sum += p[a] * (p[b + 1] * p[c + 2] - p[b + 2] * p[c + 1]) + p[a + 1] * (p[b + 2] * p[c] - p[b] * p[c + 2]) +
            p[a + 2] * (p[b] * p[c + 1] - p[b + 1] * p[c]);
    }
    return sum / 6;
}

test('coarser_meshes_have_fewer_triangles_and_the_same_shape', () => {
    const { triangle, position } = fine;
    const levels = coarserMeshes(triangle, triangle.length, position, free(fine));
    assert(levels.length >= 2);
    let last = { m: triangle.length, edge: meanEdge(triangle, triangle.length, position) };
    for (const level of levels) {
        assert(level.m < 0.8 * last.m && level.edge > last.edge);
        assert(isClosed(level.index, level.m), 'no hole');
        // Triangles with edges e are e^2 / 6 r below a sphere in their middle, half of that on average: e^2 / 4 r^2 of the
        // volume; more where they are not equilateral.
        const missing = 1 - volume(level.index, position) / (4 / 3 * Math.PI * RADIUS ** 3);
        assert(missing < 0.6 * (level.edge / RADIUS) ** 2, `${missing} with edges of ${level.edge} m`);
        last = level;
    }
});

test('coarser_meshes_keep_fixed_nodes_borders_and_edges', () => {
    const { triangle, position } = fine, fixed = free(fine);
    for (let i = 0; i < fixed.length; i += 7) fixed[i] = 1;
    for (const { index } of coarserMeshes(triangle, triangle.length, position, fixed)) {
        const used = new Set(index);
        for (let i = 0; i < fixed.length; i += 7) assert(used.has(i));
    }
    // Without its upper half: the rim is where it was.
    const half = triangle.filter((_, i) => [0, 1, 2].every((k) => position[3 * triangle[i - i % 3 + k] + 2] < 1e-3));
    const rim = (index) => {
        const one = new Set();
        for (let i = 0; i < index.length; i++) {
            const a = index[i], b = index[i - i % 3 + (i + 1) % 3];
            if (!one.delete(`${b} ${a}`)) one.add(`${a} ${b}`);
        }
        return [...one].sort().join();
    };
    for (const { index } of coarserMeshes(half, half.length, position, free(fine))) assert.equal(rim(index), rim(half));
});

test('middles_of_edges_lie_on_the_ball_that_the_nodes_lie_on', () => {
    const { triangle } = coarse, n = coarse.position.length / 3;
    const finer = finerMeshes(triangle, triangle.length, n), count = finer.straight.length;
    assert.equal(finer.levels.length, 2);
    const position = new Float32Array(3 * (n + count)), normal = position.slice();
    position.set(coarse.position);
    addNormals(triangle, triangle.length, position, normal);
    placeMiddles(finer, count, n, position, normal);
    for (let i = n; i < n + count; i++) {
        const radius = Math.hypot(...position.subarray(3 * i, 3 * i + 3));
        // A chord of 36 degrees is 5 % below; the cubic curve is 0.1 % off, the summed normals a little.
        assert(Math.abs(radius / RADIUS - 1) < 0.01, `${radius}`);
    }
    for (const level of finer.levels) assert(isClosed(level.index, level.m));
});

test('borders_stay_straight', () => {
    // Two triangles of a roof that is not steep: its ridge bends, its rim does not.
    const position = new Float32Array([0, -1, 0, 0, 1, 0, 1, 0, -0.2, -1, 0, -0.2, ...new Array(15).fill(0)]);
    const index = Uint32Array.from([0, 2, 1, 0, 1, 3]), normal = position.slice().fill(0);
    const finer = finerMeshes(index, 6, 4), count = finer.levels[0].middles;
    assert.equal(count, 5);
    addNormals(index, 6, position, normal);
    placeMiddles(finer, count, 4, position, normal);
    for (let k = 0; k < count; k++) {
        const [a, b] = [finer.ends[2 * k], finer.ends[2 * k + 1]];
        if (a + b === 1) continue; // the ridge
        for (let c = 0; c < 3; c++)
            assert.equal(position[3 * (4 + k) + c], Math.fround(0.5 * (position[3 * a + c] + position[3 * b + c])));
    }
});

test('triangles_that_face_away_are_dropped_and_no_others', () => {
    const { triangle, position } = fine, out = new Uint32Array(triangle.length), eye = { x: 0.1, y: -0.3, z: 0.2 };
    const kept = facing(triangle, triangle.length, position, eye, out);
    // Seen from that far, a little less than half of a ball: (1 - radius / distance) / 2.
    const share = 0.5 * (1 - RADIUS / Math.hypot(eye.x, eye.y, eye.z));
    assert(Math.abs(kept / triangle.length - share) < 0.01);
    assert.equal(facing(triangle, triangle.length, position, { x: 0, y: 0, z: 0 }, out), 0, 'from within: none');
});

test('inner_walls_are_found_whole_and_cut', () => {
    // A ball with a cavity, and the same with the cavity's wall parted: nodes of its upper half split off.
    const n = coarse.position.length / 3, turned = coarse.triangle.slice();
    for (let i = 0; i < turned.length; i += 3) [turned[i], turned[i + 1]] = [turned[i + 1], turned[i]];
    const position = [...coarse.position, ...coarse.position.map((x) => 0.6 * x), ...coarse.position.map((x) => 0.6 * x)];
    const upper = (i) => coarse.position[3 * turned[i - i % 3] + 2] > 0;
    for (const parted of [false, true]) {
        const inner = turned.map((node, i) => node + n + (parted && upper(i) ? n : 0));
        const index = [...coarse.triangle, ...inner];
        const origin = Int32Array.from({ length: 3 * n }, (_, i) => (i >= 2 * n ? i - n : i)), mark = new Uint8Array(3 * n);
        markInner(index, index.length, origin, position, mark);
        for (let i = 0; i < index.length; i++) assert.equal(mark[index[i]], i < coarse.triangle.length ? 0 : 1);
    }
});

// The light in each node of a mesh.
function lit({ triangle, position }, reach) {
    const normal = position.slice(), bend = position.slice();
    addLitNormals(triangle, triangle.length, position, normal, bend, reach);
    return Array.from({ length: position.length / 3 }, (_, i) => Math.hypot(...normal.subarray(3 * i, 3 * i + 3)));
}

test('a_fold_gets_the_light_that_its_curvature_leaves_and_what_bulges_gets_all', () => {
    for (const light of lit(fine, RADIUS / 2)) assert(Math.abs(light - 1) < 1e-6); // single precision
    const inside = { position: fine.position, triangle: fine.triangle.slice() };
    for (let i = 0; i < inside.triangle.length; i += 3)
        [inside.triangle[i], inside.triangle[i + 1]] = [inside.triangle[i + 1], inside.triangle[i]];
    for (const reach of [0.1, 0.5, 1]) {
        const fold = Math.max(reach - 0.05, 0), left = 1 - 0.7 * fold / (fold + 0.5);
        // Triangles are not equilateral: the formula is off by their shapes, and so is the light by a part of that.
        for (const light of lit(inside, reach * RADIUS))
            assert(Math.abs(light - left) < 0.05, `${light} for ${left} where the radius is ${1 / reach} of the reach`);
    }
});

// A plate of two squares, cut between them: its upper side, and the two walls of the cut below the line.
const plate = {
    n: 10, triangle: [0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7, 10, 11, 8, 10, 12, 9], twin: [1, 2, 4], outer: 12,
    id: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9], origin: [0, 1, 2, 3, 1, 5, 6, 2, 8, 9],
};

test('the_line_of_a_cut_is_where_walls_meet_the_surface_and_its_sides_are_mates', () => {
    const { n, triangle, twin, outer, id, origin } = plate;
    const edges = seamEdges(Uint32Array.from(triangle), triangle.length, outer, n, twin);
    assert.deepEqual([...edges], [1, 2]);
    assert.equal(seamEdges(Uint32Array.from(triangle), outer, 0, n, []).length, 0, 'nothing is known of walls');
    const surface = Uint8Array.from(id, (i) => (i < 8 ? 1 : 0));
    assert.deepEqual([...findMates(Int32Array.from(id), Int32Array.from(origin), surface)], [1, 4, 2, 7]);
});

test('normals_are_joined_across_a_closed_cut_and_not_across_an_open_one', () => {
    const pairs = [0, 1], slanted = [0, 0, 1, 0.6, 0, 0.8];
    const joined = (gap) => {
        const normal = new Float32Array(slanted);
        joinNormals(pairs, new Float32Array([0, 0, 0, gap, 0, 0]), normal, 0.01);
        return [...normal];
    };
    const [ax, ay, az, bx, by, bz] = joined(0);
    assert(Math.hypot(ax - bx, ay - by, az - bz) < 1e-6 && Math.abs(Math.hypot(ax, ay, az) - 1) < 1e-6);
    assert.deepEqual(joined(0.02), [...new Float32Array(slanted)]);
    const opposite = new Float32Array([0, 0, 1, 0, 0, -1]); // no mean: but nothing that is no number
    joinNormals(pairs, new Float32Array(6), opposite, 0.01);
    assert(opposite.every(Number.isFinite));
});
