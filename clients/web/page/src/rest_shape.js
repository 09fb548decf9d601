// SPDX-License-Identifier: MIT
// Rest positions of a body's nodes and texture coordinates of an image, through changes of its mesh. From `rest`
// messages; before or without these a node's rest position is where it was first seen.

export class RestShape {
    constructor() {
        this.known = new Map(); // id -> [x, y, z, u, v]
        this.textured = false;
        this.told = false;      // by a rest message
        this.message = null;    // of the current mesh
    }

    take(message, mesh) {
        if (!this.told) this.known.clear(); // guesses
        this.told = true;
        this.message = message;
        this.textured = message.texture !== null;
        for (let i = 0; i < mesh.n; i++) {
            if (mesh.id[i] < 0) continue;
            const node = this.known.get(mesh.id[i]) ?? [0, 0, 0, 0, 0];
            for (let k = 0; k < 3; k++) node[k] = message.rest[3 * i + k];
            for (let k = 0; k < 2 && message.texture; k++) node[3 + k] = message.texture[2 * i + k];
            this.known.set(mesh.id[i], node);
        }
    }

    /** Writes rest [n][3] and uv [n][2] of a mesh whose nodes are at `position`. */
    fill(mesh, position, rest, uv) {
        const message = this.message;
        if (message && message.topology === mesh.topology && message.n === mesh.n) {
            rest.set(message.rest);
            if (message.texture) uv.set(message.texture);
            return;
        }
        for (let i = 0; i < mesh.n; i++) {
            const node = mesh.id[i] < 0 ? null : this.find(mesh, i, position);
            for (let k = 0; k < 3; k++) rest[3 * i + k] = node ? node[k] : 0;
            for (let k = 0; k < 2; k++) uv[2 * i + k] = node ? node[3 + k] : 0;
        }
    }

    // A node without rest position: a duplicate gets its origin's, a midpoint the mean of its parents'.
    find(mesh, i, position) {
        const id = mesh.id[i];
        let node = this.known.get(id);
        if (node) return node;
        const origin = this.known.get(mesh.origin[i]);
        const a = this.known.get(mesh.parent[2 * i]), b = this.known.get(mesh.parent[2 * i + 1]);
        if (origin) node = origin.slice();
        else if (a && b) node = a.map((x, k) => 0.5 * (x + b[k]));
        else node = [position[3 * i], position[3 * i + 1], position[3 * i + 2], 0, 0];
        this.known.set(id, node);
        return node;
    }
}
