// SPDX-License-Identifier: MIT
// Turns binary messages into views of their numbers: copies nothing, checks everything.

const MESH = 1, NODES = 2, REST = 3, LOOK = 4, ERROR_MAP = 5, ELEMENTS = 6;
const NODES_MAX = 4e6, TRIANGLES_MAX = 8e6;

/** The message as {kind, body, topology, n, ...}, or null: not as clients/web/protocol.md says. */
export function decode(buffer) {
    if (buffer.byteLength < 16) return null;
    const head = new DataView(buffer);
    const kind = head.getUint32(0, true);
    const message = {
        kind: 'mesh', body: head.getUint32(4, true), topology: head.getInt32(8, true),
        n: head.getUint32(12, true),
    };
    if (message.n > NODES_MAX) return null;
    if (kind === NODES) return nodes(message, buffer, head);
    if (buffer.byteLength < 24) return null;
    if (kind === MESH) return mesh(message, buffer, head.getUint32(16, true), head.getUint32(20, true));
    if (kind === REST) return rest(message, buffer, head.getUint32(16, true));
    if (kind === LOOK) return look(message, buffer, head.getUint32(16, true), head.getUint32(20, true));
    if (kind === ERROR_MAP) return errorMap(message, buffer);
    if (kind === ELEMENTS) return elements(message, buffer, head.getUint32(16, true));
    return null;
}

function nodes(message, buffer, head) {
    if (buffer.byteLength !== 40 + 12 * message.n) return null;
    message.kind = 'nodes';
    message.time = head.getFloat64(16, true);
    message.step = head.getFloat64(24, true);
    message.utime = head.getFloat64(32, true);
    message.position = new Float32Array(buffer, 40, 3 * message.n);
    return message;
}

function mesh(message, buffer, t, firstWall) {
    const n = message.n;
    if (t > TRIANGLES_MAX || buffer.byteLength !== 24 + 12 * t + 21 * n) return null;
    let at = 24;
    const ints = (count) => {
        const view = new Int32Array(buffer, at, count);
        at += 4 * count;
        return view;
    };
    message.t = t;
    message.firstWall = firstWall; // triangles from here on are walls of cuts; 0: none
    message.triangle = ints(3 * t);
    message.id = ints(n);
    message.origin = ints(n);
    message.parent = ints(2 * n);
    message.piece = ints(n);
    message.level = new Int8Array(buffer, at, n);
    const { triangle } = message;
    for (let i = 0; i < triangle.length; i++)
        if (triangle[i] < 0 || triangle[i] >= n) return null;
    return message;
}

function rest(message, buffer, texture) {
    const n = message.n;
    if (texture > 1 || buffer.byteLength !== 24 + 12 * n + 8 * n * texture) return null;
    message.kind = 'rest';
    message.rest = new Float32Array(buffer, 24, 3 * n);
    message.texture = texture ? new Float32Array(buffer, 24 + 12 * n, 2 * n) : null;
    return message;
}

function look(message, buffer, varies, name) {
    const n = varies ? message.n : 0;
    if (varies > 1 || buffer.byteLength !== 30 + 6 * n + name) return null;
    message.kind = 'look';
    message.color = new Uint8Array(buffer, 24, 3);   // of sRGB
    message.inside = new Uint8Array(buffer, 27, 3);
    message.outer = varies ? new Uint8Array(buffer, 30, 3 * n) : null; // of nodes
    message.inner = varies ? new Uint8Array(buffer, 30 + 3 * n, 3 * n) : null;
    message.texture = new TextDecoder().decode(new Uint8Array(buffer, 30 + 6 * n, name));
    return message;
}

function errorMap(message, buffer) {
    if (buffer.byteLength !== 24 + message.n) return null;
    message.kind = 'error map';
    message.share = new Uint8Array(buffer, 24, message.n); // 0 to 255 of the largest
    return message;
}

function elements(message, buffer, levels) {
    const n = message.n; // squares
    if (levels > 8 || buffer.byteLength !== 24 + 4 * levels + 3 * n) return null;
    message.kind = 'elements';
    message.count = new Int32Array(buffer, 24, levels);
    message.tag = new Uint16Array(buffer, 24 + 4 * levels, n);
    message.level = new Uint8Array(buffer, 24 + 4 * levels + 2 * n, n);
    return message;
}
