// SPDX-License-Identifier: MIT
// The bar of time: forces, cuts and other events. Of a recording (pliant-play) the whole of it, with which one
// moves in it; of a live session the last minutes.

import { figure } from './units.js';

const LIVE_S = 120;       // shown of a live session
const SAMPLES = 2400;     // of the live curve, at most
const MARKS = 512;        // of a live session; the oldest go
// pliant-web repeats a seek for 3.2 s, then it answers that none came. No newer one may overtake the repeats: the older
// would be the last to arrive. Later the connection is gone.
const ANSWER_MS = 5000;
const CHOSEN_MS = 1000;   // for which what was chosen is shown, whatever comes
const NEAR = 6;           // [pixels] from a mark, to be told of it
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const COLOURS = [
    [/refused|restored|withdrawn|stopped/, '#e0655f'],
    [/cut|tear|piece/, '#f0b429'],
    [/./, '#7cc4f0'],
];
const colourOf = (kind) => COLOURS.find(([pattern]) => pattern.test(kind))?.[1] ?? '#7cc4f0';

/** "1:02:03.45", without the hours if there are none. */
export function clock(seconds) {
    const total = Math.round(Math.abs(seconds) * 100) / 100;
    const hours = Math.floor(total / 3600), minutes = Math.floor(total / 60) % 60;
    const rest = (total % 60).toFixed(2).padStart(5, '0');
    return `${seconds < 0 ? '-' : ''}${hours ? `${hours}:${String(minutes).padStart(2, '0')}` : minutes}:${rest}`;
}

export class Timeline {
    /** `set(argument)` and `command(kind)` send requests and return their id, 0 if nothing was sent. */
    constructor(root, { set, command }) {
        this.root = root;
        this.set = set;
        this.command = command;
        this.build();
        this.clear();
        new ResizeObserver(() => this.later()).observe(this.canvas);
    }

    build() {
        const make = (tag, properties, ...children) => {
            const node = Object.assign(document.createElement(tag), properties);
            node.append(...children);
            return node;
        };
        const button = (text, title, act) => make('button', { type: 'button', textContent: text, title, onclick: act });
        this.play = button('▶', 'play or pause (key P)', () => this.toggle());
        this.play.id = 'timeline-play';
        this.speed = make('select', { id: 'timeline-speed', title: 'times as fast as recorded',
            onchange: () => this.choose(`speed=${this.speed.value}`) },
        ...SPEEDS.map((x) => make('option', { value: String(x), textContent: `${x}×` })));
        this.loop = make('input', { id: 'timeline-loop', type: 'checkbox',
            onchange: () => this.choose(`loop=${this.loop.checked ? 1 : 0}`) });
        this.controls = make('div', { className: 'group', id: 'timeline-controls' },
            button('◂|', 'a frame back (left arrow)', () => this.step(-1)), this.play,
            button('|▸', 'a frame on (right arrow)', () => this.step(1)), this.speed,
            make('label', { className: 'switch' }, this.loop, 'loop'));
        this.figure = make('output', { className: 'figure', id: 'timeline-clock' });
        this.canvas = make('canvas', { id: 'timeline-curve', tabIndex: 0 });
        this.canvas.setAttribute('role', 'slider');
        this.canvas.setAttribute('aria-label', 'time: forces as a curve, cuts and other events as marks');
        this.root.append(this.canvas, make('div', { className: 'row' }, this.controls, this.figure));
        this.canvas.addEventListener('pointerdown', (event) => this.grab(event));
        this.canvas.addEventListener('pointermove', (event) => this.move(event));
        for (const end of ['pointerup', 'pointercancel'])
            this.canvas.addEventListener(end, () => { this.scrubs = false; });
        document.addEventListener('keydown', (event) => this.key(event));
    }

    /** For another scene, which is live until a recording says otherwise. */
    clear() {
        this.recording = this.playback = null;
        this.marks = [];
        this.curve = []; // live: [{time, force}]
        this.time = 0;
        this.first = undefined; // live: [s] the first status
        this.strongest = 0; // [N] since the last status
        this.sought = null; // {id, at}: a seek without reply
        this.wanted = null; // [s] the seek after that: the newest wins
        this.scrubs = false;
        this.show();
    }

    /** True if a recording is played. */
    get recorded() { return this.playback !== null; }

    get start() { return this.recording ? this.recording.start : Math.max(this.time - LIVE_S, this.first ?? 0); }
    get end() { return this.recording ? this.recording.end : Math.max(this.time, this.start + 1); }

    // --- what comes ---

    takeRecording(message) {
        this.recording = message;
        this.marks = message.marks;
        // The strongest tool in each part.
        const parts = Math.max(0, ...message.tools.map(({ force }) => force.length));
        this.curve = Array.from({ length: parts }, (_, k) => ({
            time: message.start + (message.end - message.start) * (k + 0.5) / parts,
            force: Math.max(...message.tools.map(({ force }) => force[k] ?? 0)) }));
        this.show();
    }

    takePlayback(message) {
        this.playback = message;
        // While one scrubs, the bar follows the hand.
        if (!this.scrubs && this.wanted === null && this.sought === null) this.time = message.time;
        this.show();
    }

    takeStatus({ time }) {
        if (this.recorded) return;
        if (time < this.time) { // it began again
            this.curve = [];
            this.marks = [];
            this.first = undefined;
        }
        this.first ??= time;
        if (time > this.time) {
            this.curve.push({ time, force: this.strongest });
            this.strongest = 0;
        }
        this.time = time;
        if (this.curve.length > SAMPLES) this.curve.splice(0, this.curve.length - SAMPLES);
        this.show();
    }

    takeForce(newtons) { this.strongest = Math.max(this.strongest, newtons); }

    takeEvent(kind, text) {
        if (this.recorded) return;
        this.marks.push({ time: this.time, kind, text });
        if (this.marks.length > MARKS) this.marks.shift();
        this.later();
    }

    /** A reply or an error. */
    answered({ id }) {
        if (this.sought?.id !== id) return;
        this.sought = null;
        this.seek();
    }

    // --- what one does ---

    get allowed() { return this.recorded && !document.body.classList.contains('read-only'); }

    toggle() { this.command(this.playback?.playing ? 'pause' : 'resume'); }

    choose(argument) {
        this.chosenAt = performance.now();
        this.set(argument);
    }

    step(frames) { if (this.allowed) this.set(`step=${frames}`); }

    key(event) {
        if (event.ctrlKey || event.metaKey || event.altKey || !this.allowed) return;
        // On the picture arrows turn the view; in fields they mean something else.
        if (event.target.id === 'picture' || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
        const frames = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        if (!frames) return;
        event.preventDefault();
        this.step(frames);
    }

    timeAt(event) {
        const { left, width } = this.canvas.getBoundingClientRect();
        const part = Math.min(Math.max((event.clientX - left) / width, 0), 1);
        return this.start + part * (this.end - this.start);
    }

    grab(event) {
        if (!this.allowed || event.button !== 0) return;
        this.canvas.setPointerCapture(event.pointerId);
        this.scrubs = true;
        this.scrub(event);
    }

    move(event) {
        if (this.scrubs) return this.scrub(event);
        const time = this.timeAt(event);
        const near = NEAR * (this.end - this.start) / Math.max(this.canvas.clientWidth, 1);
        const mark = this.marks.reduce((best, one) =>
            Math.abs(one.time - time) < Math.abs((best?.time ?? Infinity) - time) ? one : best, null);
        this.canvas.title = mark && Math.abs(mark.time - time) < near
            ? `${clock(mark.time)} ${mark.kind}: ${mark.text}` : clock(time);
        return undefined;
    }

    scrub(event) {
        this.time = this.wanted = this.timeAt(event);
        this.seek();
        this.show();
    }

    // One seek is under way at a time; of those that follow meanwhile only the newest is sent.
    seek() {
        const now = performance.now();
        if (this.wanted === null || (this.sought && now - this.sought.at < ANSWER_MS)) return;
        const id = this.set(`seek=${this.wanted}`);
        this.wanted = null;
        this.sought = id ? { id, at: now } : null;
        // A reply that gets lost must not stop the bar.
        if (id) setTimeout(() => this.answered({ id }), ANSWER_MS);
    }

    // --- how it looks ---

    show() {
        const { playback } = this;
        document.body.classList.toggle('playback', this.recorded);
        this.root.hidden = !this.recorded && this.first === undefined;
        this.controls.hidden = !this.recorded;
        if (playback) {
            this.play.textContent = playback.playing ? '❚❚' : '▶';
            // What was chosen just now is not undone by a message from before.
            if (!(performance.now() - this.chosenAt < CHOSEN_MS)) {
                this.loop.checked = playback.loop;
                this.speed.value = String(playback.speed);
            }
        }
        const text = this.recorded ? `${clock(this.time)} of ${clock(this.end)}` +
            (this.recording?.left_out ? ` · ${this.recording.left_out} events are not marked` : '')
            : `the last ${figure(this.end - this.start, 0)} s`;
        if (this.figure.textContent !== text) this.figure.textContent = text;
        for (const [name, value] of [['min', this.start], ['max', this.end], ['now', this.time]])
            this.canvas.setAttribute(`aria-value${name}`, value.toFixed(2));
        this.canvas.setAttribute('aria-valuetext', text);
        this.later();
    }

    later() { this.frame ??= requestAnimationFrame(() => this.draw()); }

    draw() {
        this.frame = null;
        const { canvas } = this, ratio = Math.min(devicePixelRatio, 2);
        const width = canvas.clientWidth, height = canvas.clientHeight;
        if (width === 0) return;
        if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
            canvas.width = Math.round(width * ratio);
            canvas.height = Math.round(height * ratio);
        }
        const context = canvas.getContext('2d');
        context.setTransform(ratio, 0, 0, ratio, 0, 0);
        context.clearRect(0, 0, width, height);
        const x = (time) => width * (time - this.start) / Math.max(this.end - this.start, 1e-9);
        this.drawCurve(context, x, height);
        for (const { time, kind } of this.marks) {
            if (time < this.start) continue;
            context.fillStyle = colourOf(kind);
            context.fillRect(x(time) - 0.75, 0, 1.5, 9);
        }
        if (!this.recorded) return;
        // What is outside the range, then where it is.
        context.fillStyle = '#171b1fb0';
        context.fillRect(0, 0, x(this.playback.from), height);
        context.fillRect(x(this.playback.to), 0, width, height);
        context.fillStyle = '#eaf6ff';
        context.fillRect(x(this.time) - 1, 0, 2, height);
    }

    drawCurve(context, x, height) {
        const most = Math.max(1e-3, ...this.curve.map(({ force }) => force));
        context.beginPath();
        context.moveTo(x(this.curve[0]?.time ?? this.start), height);
        for (const { time, force } of this.curve) context.lineTo(x(time), height - (height - 12) * force / most);
        context.lineTo(x(this.curve.at(-1)?.time ?? this.end), height);
        context.fillStyle = '#f0b42966';
        context.fill();
    }
}
