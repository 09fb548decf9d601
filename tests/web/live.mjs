// SPDX-License-Identifier: MIT
// A real daemon and a real pliant-web for tests, and what tests ask of a page.

import { spawn } from 'node:child_process';
import { closeSync, openSync, readFileSync } from 'node:fs';
import { join } from 'node:path';

export const PATIENCE = 120000; // [ms]: a loaded machine, under sanitizers

/** Polls `look` until it gives something true; fails with `what` after PATIENCE. */
export async function until(what, look) {
    const end = Date.now() + PATIENCE;
    for (;;) {
        const found = await look();
        if (found) return found;
        if (Date.now() > end) throw new Error(`not in ${PATIENCE / 1000} s: ${what}`);
        await new Promise((resolve) => setTimeout(resolve, 50));
    }
}

/** A program whose output goes to a file of `folder`. */
export class Program {
    constructor(folder, name, path, args) {
        this.log = join(folder, `${name}.log`);
        const out = openSync(this.log, 'w');
        this.process = spawn(path, args, { stdio: ['ignore', out, out] });
        closeSync(out);
        this.ended = new Promise((resolve) => this.process.on('exit', (code, signal) => resolve({ code, signal })));
    }

    text() { return readFileSync(this.log, 'utf8'); }

    async stop(signal = 'SIGTERM') {
        this.process.kill(signal);
        return this.ended;
    }
}

/** Paths and the folder for outputs, from the command line of a test. */
export function setting() {
    const [daemon, web, page, out] = process.argv.slice(2);
    if (!out) throw new Error('usage: node TEST.mjs PLIANTD PLIANT-WEB PAGE-FOLDER OUTPUT-FOLDER');
    return { daemon, web, page, out };
}

export const startDaemon = ({ daemon, out }, scene, ...options) =>
    new Program(out, `pliantd-${Date.now()}`, daemon, [...options, scene]);

/** Resolves to {program, url} once it says where it listens. */
export async function startWeb({ web, page, out }, ...options) {
    const program = new Program(out, `pliant-web-${Date.now()}`, web, ['--port', '0', '--page', page, ...options]);
    let over = null;
    program.ended.then((how) => { over = how; });
    const url = await until('pliant-web says where it listens', () => {
        if (over) throw new Error(`pliant-web ended:\n${program.text()}`);
        return program.text().match(/http:\/\/127\.0\.0\.1:\d+\/\S*/)?.[0];
    });
    return { program, url };
}

/** Waits until the page shows all bodies of its scene. */
export async function untilShown(page) {
    await page.waitForFunction(() => window.pliant?.bodies.length > 0 && pliant.bodies.every((b) => b.shown) &&
        pliant.stage.frames > 1 && !document.body.classList.contains('silent'), null, { timeout: PATIENCE });
}

/**
 * The picture as it would be drawn now: {covered (part that is not background), shades (different
 * colours), tiles (means of 32 x 24 fields, rgb)}.
 */
export function picture(page) {
    return page.evaluate(() => {
        const { stage } = window.pliant;
        stage.draw(); // reading is only right in the same task
        const gl = stage.renderer.getContext();
        const width = gl.drawingBufferWidth, height = gl.drawingBufferHeight;
        const pixels = new Uint8Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        const tiles = new Float64Array(32 * 24 * 3), count = new Float64Array(32 * 24);
        const shades = new Set();
        let covered = 0;
        let looked = 0;
        for (let y = 0; y < height; y += 2) // every fourth pixel will do
            for (let x = 0; x < width; x += 2) {
                const at = 4 * (y * width + x);
                looked++;
                const [r, g, b] = [pixels[at], pixels[at + 1], pixels[at + 2]];
                if (Math.abs(r - 23) + Math.abs(g - 27) + Math.abs(b - 31) > 60) {
                    covered++;
                    shades.add((r << 16) | (g << 8) | b);
                }
                const tile = Math.floor(24 * y / height) * 32 + Math.floor(32 * x / width);
                count[tile]++;
                tiles[3 * tile] += r;
                tiles[3 * tile + 1] += g;
                tiles[3 * tile + 2] += b;
            }
        return { covered: covered / looked, shades: shades.size,
            tiles: Array.from(tiles, (sum, i) => sum / count[Math.floor(i / 3)]) };
    });
}

/** The largest change of a field of the picture [of 255]. */
export const change = (a, b) => Math.max(...a.tiles.map((x, i) => Math.abs(x - b.tiles[i])));

/** Where a point of the first body's surface is on the page: of the node nearest to `world`. */
export function onPage(page, world) {
    return page.evaluate((world) => {
        const { stage, bodies: [body] } = window.pliant;
        const point = stage.center.clone().fromArray(world), screen = stage.center.clone();
        let best = Infinity;
        const node = stage.center.clone();
        for (let i = 0; i < body.n; i++) {
            if (body.id[i] < 0) continue;
            node.fromArray(body.position, 3 * i);
            if (node.distanceTo(point) < best) {
                best = node.distanceTo(point);
                screen.copy(node);
            }
        }
        stage.onScreen(screen, screen);
        const frame = stage.canvas.getBoundingClientRect();
        return { x: frame.left + screen.x, y: frame.top + screen.y };
    }, world);
}

/** Drags from one point to another in small steps and stays there, button down. */
export async function drag(page, from, to, steps = 12) {
    await page.mouse.move(from.x, from.y);
    await page.mouse.down();
    for (let i = 1; i <= steps; i++)
        await page.mouse.move(from.x + (to.x - from.x) * i / steps, from.y + (to.y - from.y) * i / steps);
}

/** The middle of the picture, where the bodies are. */
export function middle(page) {
    return page.evaluate(() => {
        const { stage } = window.pliant;
        const screen = stage.center.clone();
        stage.onScreen(stage.center, screen);
        const frame = stage.canvas.getBoundingClientRect();
        return { x: frame.left + screen.x, y: frame.top + screen.y };
    });
}

/** A figure of a body in the table: nodes, pieces, or moved [m]. */
export async function figureOf(page, body, field) {
    const cell = page.locator(`tr[data-body="${body}"] [data-field="${field}"]`);
    return Number(field === 'moved' ? await cell.getAttribute('data-metres') : await cell.textContent());
}

export const newtons = async (page) => parseFloat(await page.locator('#force').textContent());
