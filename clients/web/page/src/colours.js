// SPDX-License-Identifier: MIT
// Colours of a body's nodes, through changes of its mesh. From `look` messages; a body without any has one by its name.

// Of tissue, none near the brown of inner walls; in the order of a hash.
const TISSUES = [0xc4695c, 0xa8503f, 0xb5607a, 0x9a5a7c, 0xc8606a, 0x8f4a52];

/** The same name has the same colour in every scene and every replay. */
export function colourOf(name) {
    let hash = 2166136261; // FNV-1a
    for (const byte of new TextEncoder().encode(name)) hash = Math.imul(hash ^ byte, 16777619) >>> 0;
    return TISSUES[((hash ^ hash >>> 15) >>> 0) % TISSUES.length];
}

export class Colours {
    constructor() {
        this.message = null; // the newest look
        this.known = new Map(); // id -> six numbers, outside and inside
    }

    /** Whether nodes have colours of their own. */
    get vary() { return this.message?.outer != null; }

    take(message) { this.message = message; }

    /** Writes six numbers a node, [n][3] outside and [n][3] inside. */
    fill(mesh, outer, inner) {
        const { message, known } = this;
        const own = message.topology === mesh.topology && message.n === mesh.n;
        for (let i = 0; i < mesh.n; i++) {
            const id = mesh.id[i];
            let six = null;
            if (own) {
                six = known.get(id) ?? new Uint8Array(6);
                six.set(message.outer.subarray(3 * i, 3 * i + 3));
                six.set(message.inner.subarray(3 * i, 3 * i + 3), 3);
            } else if (id >= 0) {
                six = known.get(id) ?? this.guess(mesh, i);
            }
            if (id >= 0) known.set(id, six);
            for (let c = 0; c < 3; c++) {
                outer[3 * i + c] = six ? six[c] : message.color[c];
                inner[3 * i + c] = six ? six[3 + c] : message.inside[c];
            }
        }
    }

    // A new node, until its colours come: those of the node that it was split from, or between its parents.
    guess(mesh, i) {
        const { message, known } = this;
        const a = known.get(mesh.origin[i]) ?? known.get(mesh.parent[2 * i]);
        const b = known.get(mesh.parent[2 * i + 1]) ?? a;
        if (!a) return Uint8Array.of(...message.color, ...message.inside);
        return a.map((value, k) => (value + b[k]) >> 1);
    }
}
