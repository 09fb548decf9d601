// SPDX-License-Identifier: MIT
// The WebSocket: connects, reconnects with a growing delay, hands over messages.

import { decode } from './decode.js';

const FIRST_DELAY = 250, LAST_DELAY = 5000; // [ms]

export class Link {
    /** `on`: {text(message), binary(message), state(text)}. */
    constructor(url, on) {
        this.url = url;
        this.on = on;
        this.delay = FIRST_DELAY;
        this.nextId = 1;
        this.refused = 0; // messages that could not be read
        this.connect();
    }

    connect() {
        this.on.state('connecting');
        const socket = new WebSocket(this.url);
        socket.binaryType = 'arraybuffer';
        socket.onopen = () => {
            this.delay = FIRST_DELAY;
            this.on.state('open');
        };
        socket.onmessage = (event) => this.take(event.data);
        socket.onclose = () => {
            this.on.state('closed');
            setTimeout(() => this.connect(), this.delay);
            this.delay = Math.min(2 * this.delay, LAST_DELAY);
        };
        this.socket = socket;
    }

    take(data) {
        let message = null;
        if (typeof data === 'string') {
            try { message = JSON.parse(data); } catch { /* counted below */ }
            if (message && typeof message.type === 'string') return this.on.text(message);
        } else if ((message = decode(data))) {
            return this.on.binary(message);
        }
        this.refused++;
    }

    get open() { return this.socket.readyState === WebSocket.OPEN; }

    /** False: not connected, nothing was sent. */
    send(message) {
        if (!this.open) return false;
        this.socket.send(JSON.stringify(message));
        return true;
    }

    /** Sends a request that is answered by a reply; returns its id, 0 if not connected. */
    request(message) {
        const id = this.nextId++;
        return this.send({ ...message, id }) ? id : 0;
    }
}
