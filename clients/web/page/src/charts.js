// SPDX-License-Identifier: MIT
// Small charts of the last minutes, drawn when a status arrives.

const SAMPLES = 160;

export class Chart {
    /**
     * `lines`: [{colour, bars}]; `limit`: a dashed line at this value, or 0; `log`: a logarithmic
     * axis. A value that is not positive leaves a gap on it.
     */
    constructor(canvas, { lines, log = false }) {
        this.canvas = canvas;
        this.lines = lines.map((line) => ({ ...line, value: new Float32Array(SAMPLES).fill(NaN) }));
        this.log = log;
        this.limit = 0;
        this.next = 0;
    }

    clear() { for (const line of this.lines) line.value.fill(NaN); }

    add(values) {
        this.lines.forEach((line, k) => { line.value[this.next] = values[k]; });
        this.next = (this.next + 1) % SAMPLES;
        this.draw();
    }

    range() {
        let least = this.log ? Infinity : 0, most = this.limit || -Infinity;
        if (this.limit && this.log) least = this.limit;
        for (const { value } of this.lines)
            for (const x of value) {
                if (!(x >= 0) || (this.log && x === 0)) continue;
                least = Math.min(least, x);
                most = Math.max(most, x);
            }
        if (!(most > least)) most = least === Infinity ? 1 : least + 1;
        return this.log ? [least * 0.7, most * 1.4] : [0, most * 1.15];
    }

    draw() {
        const { canvas } = this;
        const ratio = Math.min(devicePixelRatio, 2);
        const width = canvas.clientWidth, height = canvas.clientHeight;
        if (width === 0) return; // collapsed
        if (canvas.width !== Math.round(width * ratio)) {
            canvas.width = Math.round(width * ratio);
            canvas.height = Math.round(height * ratio);
        }
        const context = canvas.getContext('2d');
        context.setTransform(ratio, 0, 0, ratio, 0, 0);
        context.clearRect(0, 0, width, height);
        const [least, most] = this.range();
        const scale = (x) => this.log ? Math.log(x / least) / Math.log(most / least)
            : (x - least) / (most - least);
        const y = (x) => height - 1 - (height - 2) * scale(x);
        if (this.limit) this.drawLimit(context, width, y(this.limit));
        for (const line of this.lines) this.drawLine(context, line, width, height, y);
    }

    drawLimit(context, width, y) {
        context.strokeStyle = '#e0655f';
        context.setLineDash([4, 4]);
        context.lineWidth = 1;
        context.beginPath();
        context.moveTo(0, y);
        context.lineTo(width, y);
        context.stroke();
        context.setLineDash([]);
    }

    drawLine(context, { value, colour, bars }, width, height, y) {
        context.strokeStyle = context.fillStyle = colour;
        context.lineWidth = 1.5;
        context.beginPath();
        let open = false;
        for (let i = 0; i < SAMPLES; i++) {
            const sample = value[(this.next + i) % SAMPLES];
            const x = width * i / (SAMPLES - 1);
            if (bars) {
                if (sample > 0) context.fillRect(x - 1, y(sample), 2, height - y(sample));
                continue;
            }
            if (!(sample > 0)) { open = false; continue; }
            if (open) context.lineTo(x, y(sample));
            else context.moveTo(x, y(sample));
            open = true;
        }
        context.stroke();
    }
}
