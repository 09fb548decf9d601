// SPDX-License-Identifier: MIT
// Pictures and videos of what is seen, as files.

import { Vector3 } from 'three';
import { lengthText } from './units.js';

const KINDS = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm'];
const FRAMES = 30;              // per second
const BITS = 8e6;               // per second
const MOST = 10 * 60 * 1000;    // [ms] of a video, which is kept in memory: 600 MB
const PIECE = 1000;             // [ms]
const MIME_TYPES = () => KINDS.find((kind) => window.MediaRecorder?.isTypeSupported?.(kind));

export function download(blob, name) {
    const link = Object.assign(document.createElement('a'), { href: URL.createObjectURL(blob), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** "ball 2026-11-26 21-05-03" in the time of the place: a name that every file system takes. */
export function fileName(scene, date) {
    const two = (x) => String(x).padStart(2, '0');
    const day = [date.getFullYear(), two(date.getMonth() + 1), two(date.getDate())].join('-');
    const time = [date.getHours(), date.getMinutes(), date.getSeconds()].map(two).join('-');
    return `${(scene || 'pliant').replace(/[^\w.-]+/g, '_')} ${day} ${time}`;
}

/** A length of 1, 2 or 5 times a power of ten, at most `most`. */
export function roundLength(most) {
    const power = 10 ** Math.floor(Math.log10(most));
    return power * [5, 2, 1].find((times) => times * power <= most * (1 + 1e-9));
}

export class Capture {
    /** `on`: {picture, video (buttons), told(text), scene()}. */
    constructor(stage, on) {
        this.stage = stage;
        this.on = on;
        this.recorder = null;
        this.last = null;  // {blob, name} of the newest file
        on.picture.addEventListener('click', () => this.picture());
        on.video.addEventListener('click', () => (this.recorder ? this.recorder.stop() : this.start()));
        const why = this.lacks();
        on.video.disabled = Boolean(why);
        if (why) on.video.title = why;
    }

    lacks() {
        if (!window.MediaRecorder || !this.stage.canvas.captureStream) return 'this browser cannot record videos';
        return MIME_TYPES() ? '' : 'this browser cannot encode WebM videos';
    }

    save(blob, name) {
        this.last = { blob, name };
        download(blob, name);
        this.on.told(`${name}: ${(blob.size / 1e6).toFixed(blob.size < 1e6 ? 2 : 1)} MB`);
    }

    /** The picture as it is now, with the scene, the date and a bar of a round length at the scene's middle. */
    picture() {
        const { stage } = this, { canvas } = stage;
        stage.render(true); // what was drawn is only there in the same task; and it changes the size
        const copy = Object.assign(document.createElement('canvas'), { width: canvas.width, height: canvas.height });
        const context = copy.getContext('2d');
        context.drawImage(canvas, 0, 0);
        const ratio = canvas.width / canvas.clientWidth;
        context.setTransform(ratio, 0, 0, ratio, 0, 0);
        const date = new Date(), name = fileName(this.on.scene(), date);
        const bottom = canvas.clientHeight - 14;
        context.font = '13px system-ui, sans-serif';
        context.fillStyle = context.strokeStyle = '#d7dde2';
        context.fillText(`${this.on.scene()} · ${date.toLocaleString()}`, 14, bottom);
        const { length, pixels } = this.bar();
        if (pixels > 0) {
            const right = canvas.clientWidth - 14;
            context.fillRect(right - pixels, bottom - 2, pixels, 3);
            context.textAlign = 'right';
            context.fillText(lengthText(length), right, bottom - 8);
        }
        copy.toBlob((blob) => (blob ? this.save(blob, `${name}.png`)
            : this.on.told('This browser made no picture.')), 'image/png');
    }

    /** The bar: its length [m] and how many css pixels that is, across the view at the middle of the scene. */
    bar() {
        const { stage } = this;
        const right = new Vector3().setFromMatrixColumn(stage.camera.matrixWorld, 0);
        const a = new Vector3(), b = new Vector3();
        stage.onScreen(stage.center, a);
        stage.onScreen(stage.center.clone().addScaledVector(right, stage.size), b);
        const perMetre = Math.hypot(b.x - a.x, b.y - a.y) / stage.size;
        if (!(perMetre > 0) || !Number.isFinite(perMetre)) return { length: 0, pixels: 0 };
        const length = roundLength(0.25 * stage.canvas.clientWidth / perMetre);
        return { length, pixels: length * perMetre };
    }

    start() {
        const type = MIME_TYPES(), pieces = [];
        let recorder;
        try {
            recorder = new MediaRecorder(this.stage.canvas.captureStream(FRAMES), { mimeType: type,
                videoBitsPerSecond: BITS });
        } catch (error) {
            return this.on.told(`No video: ${error.message}`);
        }
        const name = `${fileName(this.on.scene(), new Date())}.webm`, began = performance.now();
        recorder.addEventListener('dataavailable', ({ data }) => { if (data.size) pieces.push(data); });
        recorder.addEventListener('error', ({ error }) => this.on.told(`The video ended: ${error?.message ?? 'error'}`));
        recorder.addEventListener('stop', () => {
            clearInterval(this.timer);
            this.recorder = null;
            this.show('Video', false);
            recorder.stream.getTracks().forEach((track) => track.stop());
            if (pieces.length) this.save(new Blob(pieces, { type: 'video/webm' }), name);
            else this.on.told('The video is empty.');
        });
        this.recorder = recorder;
        recorder.start(PIECE);
        // A picture that stands still makes no frames by itself.
        this.timer = setInterval(() => {
            const ms = performance.now() - began;
            this.stage.invalidate();
            this.show(`Stop ${Math.floor(ms / 60000)}:${String(Math.floor(ms / 1000) % 60).padStart(2, '0')}`, true);
            if (ms > MOST) recorder.stop();
        }, 250);
        this.show('Stop 0:00', true);
        return this.stage.invalidate();
    }

    show(text, on) {
        this.on.video.textContent = text;
        this.on.video.classList.toggle('recording', on);
    }
}
