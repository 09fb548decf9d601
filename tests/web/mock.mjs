// SPDX-License-Identifier: MIT
// A stand-in for pliant-web: serves the page and speaks clients/web/protocol.md with bodies that move by a
// formula. For what the real one cannot be made to do at will, and for measuring the page alone.

import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { extname, join, normalize } from 'node:path';
import { WebSocketServer } from 'ws';

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css' };

/** An icosahedron whose triangles are divided `times` times: 10 * 4^times + 2 nodes on a sphere. */
export function icoSphere(times, radius) {
    const g = (1 + Math.sqrt(5)) / 2;
    const points = [[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g], [0, -1, -g],
        [0, 1, -g], [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]];
    let faces = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2],
        [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11],
        [6, 2, 10], [8, 6, 7], [9, 8, 1]];
    for (let k = 0; k < times; k++) {
        const middles = new Map();
        const middle = (a, b) => {
            const key = a < b ? `${a} ${b}` : `${b} ${a}`;
            if (!middles.has(key)) {
                middles.set(key, points.length);
                points.push(points[a].map((x, i) => x + points[b][i]));
            }
            return middles.get(key);
        };
        // The sum points the right way; its length is put right below.
        const unit = (p) => p.map((x) => x / Math.hypot(...p));
        for (let i = 0; i < points.length; i++) points[i] = unit(points[i]);
        faces = faces.flatMap(([a, b, c]) => {
            const ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            return [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]];
        });
    }
    const position = new Float32Array(points.flatMap((p) => p.map((x) => radius * x / Math.hypot(...p))));
    return { position, triangle: new Int32Array(faces.flat()) };
}

export function meshMessage(body, topology, { position, triangle, level, piece, id, origin, parent,
    firstWall = 0 }) {
    const n = position.length / 3, t = triangle.length / 3;
    const data = new ArrayBuffer(24 + 12 * t + 21 * n);
    new Uint32Array(data, 0, 6).set([1, body, topology, n, t, firstWall]);
    let at = 24;
    const put = (list) => {
        new Int32Array(data, at, list.length).set(list);
        at += 4 * list.length;
    };
    const own = id ?? Int32Array.from({ length: n }, (_, i) => i);
    put(triangle);
    put(own);
    put(origin ?? own);
    put(parent ?? Int32Array.from({ length: 2 * n }, (_, i) => own[i >> 1]));
    put(piece ?? new Int32Array(n));
    new Int8Array(data, at, n).set(level ?? new Int8Array(n));
    return data;
}

export function nodesMessage(body, topology, position, time = 0, step = 0) {
    const data = new ArrayBuffer(40 + 4 * position.length);
    new Uint32Array(data, 0, 4).set([2, body, topology, position.length / 3]);
    new Float64Array(data, 16, 3).set([time, step, Date.now() * 1000]);
    new Float32Array(data, 40).set(position);
    return data;
}

export function restMessage(body, topology, position, texture) {
    const n = position.length / 3;
    const data = new ArrayBuffer(24 + 12 * n + (texture ? 8 * n : 0));
    new Uint32Array(data, 0, 6).set([3, body, topology, n, texture ? 1 : 0, 0]);
    new Float32Array(data, 24, 3 * n).set(position);
    if (texture) new Float32Array(data, 24 + 12 * n).set(texture);
    return data;
}

export function errorMapMessage(body, topology, share) {
    const data = new ArrayBuffer(24 + share.length);
    new Uint32Array(data, 0, 6).set([5, body, topology, share.length, 0, 0]);
    new Uint8Array(data, 24).set(share);
    return data;
}

/** `count`: elements of the body by level. */
export function elementsMessage(body, topology, count, tag, level) {
    const n = tag.length, data = new ArrayBuffer(24 + 4 * count.length + 3 * n);
    new Uint32Array(data, 0, 6).set([6, body, topology, n, count.length, 0]);
    new Int32Array(data, 24, count.length).set(count);
    new Uint16Array(data, 24 + 4 * count.length, n).set(tag);
    new Uint8Array(data, 24 + 4 * count.length + 2 * n).set(level);
    return data;
}

/** `nodes`: null, or {outer, inner}, three bytes a node. */
export function lookMessage(body, topology, n, color, inside, nodes = null) {
    const data = new Uint8Array(30 + (nodes ? 6 * n : 0));
    new Uint32Array(data.buffer, 0, 6).set([4, body, topology, n, nodes ? 1 : 0, 0]);
    data.set([...color, ...inside], 24);
    if (nodes) data.set([...nodes.outer, ...nodes.inner], 30);
    return data.buffer;
}

export function statusMessage(scene, over = {}) {
    return { type: 'status', utime: Date.now() * 1000, sequence: 1, scene: scene.name, state: 'running', step: 1000,
        time: 1, rate_hz: 1000, real_time_factor: 1, late_ticks: 0, resets: 0, rejected: 0,
        step_us: [110 + 20 * Math.random(), 180 + 60 * Math.random(), 300, 420 + 300 * Math.random()],
        wake_us: [10, 40, 80, 90], stages: {}, reasons: {},
        body: scene.bodies.map(({ name, model }) => ({ name, model, integrator: 'leapfrog', topology: 1,
            nodes: 10242, springs: 30720, elements: 0, pieces: 1, finest_level: 0, time_step: 0.0005, kinetic: 0,
            elastic: 0, mass: 0.1, max_displacement: 0.004, estimated_error: 2e-4 * (1 + Math.random()) })),
        ...over };
}

/**
 * Serves `folder` on a free port of 127.0.0.1. `script(session)` runs for each page; a session has
 * text(message), binary(data), round() (resolves when the page has drawn), got (messages of the page)
 * and closed. Resolves to {url, close()}.
 */
export async function serve(folder, script) {
    const http = createServer(async (request, response) => {
        const path = normalize(new URL(request.url, 'http://x').pathname);
        const file = join(folder, path === '/' ? 'index.html' : path);
        try {
            const data = await readFile(file);
            response.writeHead(200, { 'Content-Type': TYPES[extname(file)] ?? 'application/octet-stream' });
            response.end(data);
        } catch {
            response.writeHead(404);
            response.end();
        }
    });
    const sockets = new WebSocketServer({ server: http, path: '/live' });
    sockets.on('connection', (socket) => {
        let round = 0, drawn = null;
        const session = {
            got: [], closed: false,
            text: (message) => socket.send(JSON.stringify(message)),
            binary: (data) => socket.send(data),
            round: () => new Promise((resolve) => {
                drawn = resolve;
                session.text({ type: 'round', round: ++round });
            }),
            onMessage: null,
        };
        socket.on('message', (data) => {
            const message = JSON.parse(data);
            if (message.type === 'drawn') return drawn?.(message.round);
            session.got.push(message);
            return session.onMessage?.(message);
        });
        socket.on('close', () => {
            session.closed = true;
            drawn?.();
        });
        script(session);
    });
    await new Promise((resolve) => http.listen(0, '127.0.0.1', resolve));
    return {
        url: `http://127.0.0.1:${http.address().port}/`,
        close() {
            for (const socket of sockets.clients) socket.terminate();
            http.closeAllConnections();
            return new Promise((resolve) => http.close(resolve));
        },
    };
}
