// SPDX-License-Identifier: MIT
// A picture of a running page, by a Chromium without a screen: `node picture.mjs CHROMIUM URL FILE.png`. Says "ready" once
// bodies are shown, keeps the picture of the largest force, and writes it at SIGTERM. Speaks with Chromium by its pipe,
// so that the demo needs no package for it.
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const [program, url, file] = process.argv.slice(2);
if (!file) {
    console.error('usage: node picture.mjs CHROMIUM URL FILE.png');
    process.exit(2);
}
const LOOK_MS = 200;
const profile = mkdtempSync(join(tmpdir(), 'pliant-picture-'));
const chromium = spawn(program, ['--headless=new', '--remote-debugging-pipe', `--user-data-dir=${profile}`, '--no-sandbox',
    '--disable-gpu', '--enable-unsafe-swiftshader', '--no-first-run', '--window-size=1280,900', 'about:blank'],
{ stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
let rest = '', last = 0, over = false;
const open = new Map(); // id -> resolve
process.on('SIGTERM', () => {
    over = true;
    setTimeout(() => chromium.kill('SIGKILL'), 10000); // one that does not answer
});
for (const pipe of [chromium.stdio[3], chromium.stdio[4]]) pipe.on('error', () => chromium.kill());
chromium.on('error', () => process.exit(1));
chromium.on('exit', () => {
    rmSync(profile, { recursive: true, force: true });
    process.exit(over ? 0 : 1);
});
// Messages end with a zero.
chromium.stdio[4].on('data', (data) => {
    const parts = (rest + data).split('\0');
    rest = parts.pop();
    for (const message of parts.map((part) => JSON.parse(part))) open.get(message.id)?.(message.result ?? {});
});

const ask = (method, params, sessionId) => new Promise((resolve) => {
    open.set(++last, resolve);
    chromium.stdio[3].write(`${JSON.stringify({ id: last, method, params, sessionId })}\0`);
});

const { targetId } = await ask('Target.createTarget', { url });
const { sessionId } = await ask('Target.attachToTarget', { targetId, flatten: true });
const evaluate = async (expression) =>
    (await ask('Runtime.evaluate', { expression, returnByValue: true }, sessionId)).result?.value;
const pause = () => new Promise((resolve) => setTimeout(resolve, LOOK_MS));

const shown = 'window.pliant?.bodies.length > 0 && pliant.bodies.every((body) => body.shown) && pliant.stage.frames > 1';
while (!over && !(await evaluate(shown))) await pause();
await evaluate('pliant.panel.fold(false)');
console.log('ready');
let most = -1, picture = null;
while (!over) {
    const force = await evaluate('Math.max(0, ...pliant.tools.list.map(({ touching, force }) => touching ? force : 0))');
    if (force > 1.02 * most || picture === null) {
        most = force;
        picture = (await ask('Page.captureScreenshot', { format: 'png' }, sessionId)).data ?? picture;
    }
    await pause();
}
if (picture) writeFileSync(file, Buffer.from(picture, 'base64'));
await ask('Browser.close');
