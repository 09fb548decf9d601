// SPDX-License-Identifier: MIT
// Charts of the tools' forces: against time and against depth, and the numbers of what they show as a file.

import { download } from './capture.js';

const SAMPLES = 2048;   // of each tool: half a minute at 60 Hz
const TOOLS = 8;        // with lines of their own; of others there is the label in the picture
const DRAW_EVERY = 100; // [ms]
const COLOURS = ['#f0b429', '#7cc4f0', '#6fc28b', '#e0655f', '#c49be8', '#d7dde2', '#e8a27c', '#97a2ac'];
const MARGIN = { left: 34, right: 6, top: 6, bottom: 18 };
const FIELDS = ['utime', 'depth', 'overlap', 'force', 'fx', 'fy', 'fz'];

/** Steps of 1, 2 or 5 times a power of ten, at most `most` of them in `range`. */
export function tickOf(range, most) {
    const power = 10 ** Math.floor(Math.log10(range / most));
    return power * [1, 2, 5, 10].find((times) => times * power * most >= range * (1 - 1e-9));
}

/** The newest samples of one tool, in a ring. */
export class Series {
    constructor() {
        for (const field of FIELDS) this[field] = new Float64Array(SAMPLES);
        this.count = 0;
        this.next = 0;
        this.touch = null; // the contact that began the present touch
    }

    // How far the tool has gone into the tissue since it touched it; of one that holds, how far it has pulled [m].
    way({ position, contact }) {
        if (!contact) return 0;
        const { position: from, normal } = this.touch;
        const along = position.map((x, k) => x - from[k]);
        return Math.hypot(...normal) > 0 ? -along.reduce((sum, x, k) => sum + x * normal[k], 0) : Math.hypot(...along);
    }

    /** `contact` as it came; the same again is not kept twice. */
    add(message) {
        const { utime, depth, force, contact } = message;
        this.touch = contact ? this.touch ?? message : null;
        if (this.count && this.utime[(this.next + SAMPLES - 1) % SAMPLES] === utime) return;
        const k = this.next, [fx, fy, fz] = contact ? force : [0, 0, 0];
        Object.entries({ utime, depth: this.way(message), overlap: contact ? depth : 0, force: Math.hypot(fx, fy, fz), fx, fy, fz })
            .forEach(([field, value]) => { this[field][k] = Number.isFinite(value) ? value : 0; });
        this.next = (k + 1) % SAMPLES;
        this.count = Math.min(this.count + 1, SAMPLES);
    }

    /** Calls `see(k)` from the oldest to the newest. */
    each(see) {
        for (let i = 0; i < this.count; i++) see((this.next - this.count + i + SAMPLES) % SAMPLES);
    }
}

export class Forces {
    /** `on`: {time, depth (canvases), pause, save (buttons), legend}. */
    constructor(on) {
        this.on = on;
        this.tools = new Map(); // id -> {series, title, colour}
        this.paused = false;
        this.drawnAt = -Infinity;
        on.pause.addEventListener('click', () => this.pause(!this.paused));
        on.save.addEventListener('click', () => download(new Blob([this.csv()], { type: 'text/csv' }), 'forces.csv'));
        on.time.closest('details').addEventListener('toggle', () => this.draw());
    }

    pause(paused) {
        this.paused = paused;
        this.on.pause.textContent = paused ? 'Go on' : 'Hold';
        this.on.pause.setAttribute('aria-pressed', String(paused));
    }

    takeScene(tools) {
        this.tools.clear();
        this.pause(false);
        tools.filter(({ kind }) => kind !== 'static').slice(0, TOOLS).forEach(({ id, title }, k) =>
            this.tools.set(id, { title, colour: COLOURS[k], series: new Series() }));
        this.on.legend.replaceChildren(...Array.from(this.tools.values(), ({ title, colour }) => {
            const name = document.createElement('span');
            name.style.color = colour;
            name.textContent = `${title} `;
            return name;
        }));
        this.draw();
    }

    takeContacts(contacts, now) {
        if (this.paused) return;
        for (const contact of contacts) this.tools.get(contact.tool)?.series.add(contact);
        if (now - this.drawnAt >= DRAW_EVERY) this.draw(now);
    }

    /** Lines "tool,time_s,depth_m,overlap_m,force_N,fx_N,fy_N,fz_N" of all that is kept; time since the first of them. */
    csv() {
        const { first } = this.span();
        const lines = ['tool,time_s,depth_m,overlap_m,force_N,fx_N,fy_N,fz_N'];
        for (const [id, { series: s }] of this.tools)
            s.each((k) => lines.push([id, ((s.utime[k] - first) / 1e6).toFixed(6), s.depth[k], s.overlap[k], s.force[k],
                s.fx[k], s.fy[k], s.fz[k]].join(',')));
        return `${lines.join('\n')}\n`;
    }

    /** What the axes hold: times [us], and the largest force [N] and depth [m]. */
    span() {
        let first = Infinity, last = -Infinity, force = 0, least = 0, most = 0;
        for (const { series: s } of this.tools.values())
            s.each((k) => {
                first = Math.min(first, s.utime[k]);
                last = Math.max(last, s.utime[k]);
                force = Math.max(force, s.force[k]);
                least = Math.min(least, s.depth[k]);
                most = Math.max(most, s.depth[k]);
            });
        return { first, last, force, least, most };
    }

    draw(now = performance.now()) {
        this.drawnAt = now;
        if (!this.on.time.clientWidth) return; // folded away
        const { first, last, force, least, most } = this.span();
        const top = force > 0 ? 1.1 * force : 1;
        const seconds = last > first ? (last - first) / 1e6 : 1;
        this.chart(this.on.time, { low: -seconds, high: 0, unit: 's', of: (s, k) => (s.utime[k] - last) / 1e6 }, top);
        this.chart(this.on.depth, { low: 1e3 * least, high: most > least ? 1e3 * most : 1, unit: 'mm',
            of: (s, k) => 1e3 * s.depth[k] }, top);
    }

    chart(canvas, across, top) {
        const ratio = Math.min(devicePixelRatio, 2);
        const { clientWidth: width, clientHeight: height } = canvas;
        canvas.width = Math.round(width * ratio);
        canvas.height = Math.round(height * ratio);
        const context = canvas.getContext('2d');
        context.setTransform(ratio, 0, 0, ratio, 0, 0);
        const x = (value) => MARGIN.left + (width - MARGIN.left - MARGIN.right) *
            (value - across.low) / (across.high - across.low);
        const y = (value) => height - MARGIN.bottom - (height - MARGIN.top - MARGIN.bottom) * value / top;
        this.axes(context, { width, height, x, y, across, top });
        for (const { series, colour } of this.tools.values()) {
            context.strokeStyle = colour;
            context.lineWidth = 1.3;
            context.beginPath();
            let open = false;
            series.each((k) => {
                const at = [x(across.of(series, k)), y(series.force[k])];
                if (open) context.lineTo(...at);
                else context.moveTo(...at);
                open = true;
            });
            context.stroke();
        }
    }

    axes(context, { width, height, x, y, across, top }) {
        context.font = '10.5px system-ui, sans-serif';
        context.fillStyle = '#97a2ac';
        context.strokeStyle = '#30373e';
        context.lineWidth = 1;
        context.beginPath();
        const digits = (step) => Math.max(0, -Math.floor(Math.log10(step)));
        let step = tickOf(top, 4);
        context.textAlign = 'right';
        for (let k = 0; k * step <= top; k++) {
            context.moveTo(MARGIN.left, y(k * step));
            context.lineTo(width - MARGIN.right, y(k * step));
            context.fillText((k * step).toFixed(digits(step)), MARGIN.left - 4, y(k * step) + 3.5);
        }
        context.textAlign = 'left';
        context.fillText('N', MARGIN.left + 4, MARGIN.top + 8);
        step = tickOf(across.high - across.low, 5);
        context.textAlign = 'center';
        for (let k = Math.ceil(across.low / step); k * step <= across.high; k++) {
            context.moveTo(x(k * step), MARGIN.top);
            context.lineTo(x(k * step), height - MARGIN.bottom);
            if (x(k * step) < width - 28) context.fillText((k * step).toFixed(digits(step)), x(k * step), height - 5);
        }
        context.stroke();
        context.textAlign = 'right';
        context.fillText(across.unit, width - 4, height - 5);
    }
}
