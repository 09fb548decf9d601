// SPDX-License-Identifier: MIT
// Small pictures of scenes: those that this browser has shown, which it keeps for itself, and those of config/.

import CONFIG from './pictures.json'; // by name and first sentence; tests/web/scene_pictures.mjs makes them

const WIDTH = 96, HEIGHT = 72; // pixels
const SHOWN = 0.75;            // of the picture's height or width: the rest is empty
const MOST = 100;              // pictures, of some 2 kB
const STORE = 'pliant-pictures';

export class Thumbs {
    constructor() {
        this.count = 0; // of the pictures that were taken
        try {
            this.pictures = new Map(JSON.parse(localStorage.getItem(STORE) ?? '[]'));
        } catch { // a browser that keeps nothing, or something else under this name
            this.pictures = new Map();
        }
    }

    /** A picture as a URL; undefined: there is none. A file of another size is another scene. */
    of(folder, name, bytes, about) {
        return this.pictures.get(`${folder}/${name}/${bytes}`) ?? CONFIG[`${name}: ${about}`];
    }

    /** Keeps the middle of what is drawn now. */
    keep(folder, name, bytes, stage) {
        const { canvas } = stage;
        stage.draw(); // what was drawn is only there in the same task; it may change the canvas's size
        const copy = Object.assign(document.createElement('canvas'), { width: WIDTH, height: HEIGHT });
        const scale = SHOWN * Math.min(canvas.width / WIDTH, canvas.height / HEIGHT);
        copy.getContext('2d').drawImage(canvas, (canvas.width - scale * WIDTH) / 2, (canvas.height - scale * HEIGHT) / 2,
            scale * WIDTH, scale * HEIGHT, 0, 0, WIDTH, HEIGHT);
        this.pictures.set(`${folder}/${name}/${bytes}`, copy.toDataURL('image/jpeg', 0.8));
        this.count++;
        for (const key of [...this.pictures.keys()].slice(0, -MOST)) this.pictures.delete(key);
        try {
            localStorage.setItem(STORE, JSON.stringify([...this.pictures]));
        } catch { /* they last as long as this page */ }
    }
}
