// SPDX-License-Identifier: MIT
// Sliders for what SET can change. The server lists the keys of each body in its description, tells the present value and
// range of one (SET "try body.key"), and says what a value would do before it is set (SET "try body.key=value").

// From the left end of a slider to its right one. A factor: of the present value, on a logarithmic scale. Ends are wider
// than what the server takes: it gives the reason why a value is too much.
const SPANS = {
    gravity_x: { low: -20, high: 20, unit: 'm/s²' }, gravity_y: { low: -20, high: 20, unit: 'm/s²' },
    gravity_z: { low: -20, high: 20, unit: 'm/s²' },
    stiffness_scale: { factor: 8 }, damping_scale: { factor: 8 },
    friction: { low: 0, high: 2 },
    pressure: { unit: 'Pa' }, volume: { unit: 'm³' },
    adapt_force: { factor: 16, unit: 'N' }, adapt_speed: { factor: 16, unit: 'm/s' }, adapt_curvature: { factor: 16 },
};
const SCENE = ['gravity_x', 'gravity_y', 'gravity_z'];
const STEPS = 1000;      // of a slider
const LIMIT = 1.2;       // a slider goes beyond the server's limit by so much
const IS = /^(\S+) = (\S+), from (\S+) to (\S+)$/;
const SET = /^(\S+) = (\S+)$/;
const GRAVITY = /^gravity = \((\S+), (\S+), (\S+)\)$/;

const short = (x) => String(Number(x.toPrecision(4)));

/** The keys that have sliders, from a daemon's description: ["gravity_x", "ball.friction", ...]. */
export function keysOf(describe) {
    const keys = [];
    for (const [, body, list] of describe.matchAll(/^settings of (\S+): (.*)$/gm))
        for (const key of list.split(', ')) if (SPANS[key]) keys.push(`${body}.${key}`);
    return keys.length ? [...SCENE, ...keys] : [];
}

/** Between a slider's place in [0, 1] and a value. */
export class Span {
    constructor(key, value, low, high) {
        const { factor, low: left = low, high: right = LIMIT * high } = SPANS[key];
        const middle = value > 0 ? value : 1;
        this.log = Boolean(factor);
        this.low = this.log ? middle / factor : Math.min(left, value);
        this.high = this.log ? middle * factor : Math.max(right, value);
        if (!(this.high > this.low)) this.high = this.low + 1;
    }

    value(place) {
        return this.log ? this.low * (this.high / this.low) ** place : this.low + place * (this.high - this.low);
    }

    place(value) {
        const at = this.log ? Math.log(Math.max(value, this.low) / this.low) / Math.log(this.high / this.low)
            : (value - this.low) / (this.high - this.low);
        return Math.min(Math.max(at, 0), 1);
    }
}

class Row {
    constructor(settings, key) {
        this.settings = settings;
        this.key = key;
        this.kind = key.slice(key.lastIndexOf('.') + 1);
        this.node = document.createElement('div');
        this.node.className = 'setting';
        this.node.dataset.key = key;
        this.node.hidden = true;
        const label = document.createElement('label');
        label.append(key.replace('_scale', '').replaceAll('_', ' '));
        this.slider = Object.assign(document.createElement('input'), { type: 'range', min: 0, max: STEPS });
        this.box = Object.assign(document.createElement('input'), { type: 'number', step: 'any' });
        this.slider.setAttribute('aria-label', key);
        label.append(this.box, SPANS[this.kind].unit ?? '');
        this.text = document.createElement('p');
        this.text.setAttribute('role', 'status');
        this.node.append(label, this.slider, this.text);
        this.slider.addEventListener('input', () => this.try(this.span.value(this.slider.value / STEPS)));
        this.slider.addEventListener('change', () => this.set(short(this.span.value(this.slider.value / STEPS))));
        this.box.addEventListener('change', () => this.type());
    }

    /** What the server says that it is. */
    take(value, low, high) {
        this.value = value;
        if (low !== undefined) this.span = new Span(this.kind, value, low, high);
        this.node.hidden = !this.span;
        if (this.span) this.show(value);
    }

    show(value) {
        this.slider.value = String(Math.round(STEPS * this.span.place(value)));
        this.box.value = short(value);
    }

    // One try at a time: the newest value waits for the answer to the last one.
    try(value) {
        this.box.value = short(value);
        this.wanted = short(value);
        if (this.trying || this.setting) return;
        this.trying = this.settings.ask(`try ${this.key}=${this.wanted}`, (ok, text) => {
            this.trying = 0;
            if (this.setting) return;
            this.say(ok ? '' : 'bad', ok ? text.replace(/^\S+ = /, '') : `would be refused: ${text}`);
            if (this.wanted !== undefined) this.try(Number(this.wanted));
        });
        this.wanted = undefined;
    }

    // What is typed goes to the server as it is; an empty box is not zero.
    type() {
        const text = this.box.value.trim();
        if (text && Number.isFinite(Number(text))) return this.set(text);
        this.show(this.value);
        return this.say('bad', 'not a number');
    }

    set(text) {
        this.wanted = undefined;
        this.setting = this.settings.ask(`${this.key}=${text}`, (ok, why) => {
            this.setting = 0;
            this.say(ok ? '' : 'bad', ok ? `set to ${text}` : `refused: ${why}`);
            if (ok) this.take(Number(text));
            else this.show(this.value);
        });
        if (!this.setting) this.show(this.value);
    }

    say(kind, text) {
        this.text.className = kind;
        this.text.textContent = text;
    }
}

export class Settings {
    /** `list`: where the rows go; `refused()`: why nothing can be done now, or ''. */
    constructor(list, link, refused) {
        this.list = list;
        this.link = link;
        this.refused = refused;
        this.rows = new Map();
        this.open = new Map(); // id of a request -> what takes its answer
        list.closest('details').addEventListener('toggle', () => this.askAll());
    }

    /** The description of a new daemon. */
    takeScene(describe) {
        this.open.clear();
        this.rows = new Map(keysOf(describe).map((key) => [key, new Row(this, key)]));
        this.list.replaceChildren(...Array.from(this.rows.values(), ({ node }) => node));
        this.list.closest('details').hidden = this.rows.size === 0;
        this.askAll();
    }

    // What the values are now, for whom looks: also after a reset, which brings back those of the start.
    askAll() {
        if (!this.list.closest('details').open) return;
        for (const row of this.rows.values())
            this.ask(`try ${row.key}`, (ok, text) => {
                const is = ok && IS.exec(text);
                if (is) row.take(Number(is[2]), Number(is[3]), Number(is[4]));
            });
    }

    /** Returns the request's id, 0 if it cannot be asked. */
    ask(argument, then) {
        const id = this.refused() ? 0 : this.link.request({ type: 'command', kind: 'set', value: 0, argument });
        if (id) this.open.set(id, then);
        return id;
    }

    /** A reply to a request, or that none will come; true: it is one of ours. */
    answered({ id, ok, text }) {
        const then = this.open.get(id);
        this.open.delete(id);
        then?.(ok, text);
        return Boolean(then);
    }

    /** What anyone has set. */
    takeEvent(kind, text) {
        if (kind === 'reset') {
            for (const row of this.rows.values()) row.say('', '');
            return this.askAll();
        }
        if (kind !== 'set') return undefined;
        const gravity = GRAVITY.exec(text), set = SET.exec(text);
        if (gravity) return SCENE.forEach((key, k) => this.rows.get(key)?.take(Number(gravity[k + 1])));
        if (!set) return undefined;
        for (const [key, row] of this.rows)
            if (key === set[1] || key.endsWith(`.${set[1]}`)) row.take(Number(set[2]));
        return undefined;
    }
}
