// SPDX-License-Identifier: MIT
// What the page reaches with a real daemon and pliant-web: prints one row a figure, tab-separated.
//
//     tests/daemon/in_namespace.sh tests/web/run.sh measure.mjs PLIANTD PLIANT-WEB PAGE-FOLDER OUTPUT-FOLDER
//
// page_load: from the navigation's start to the first picture of the bodies. frames: pictures of a
// ball of 10242 nodes a second, in a window of 1280 x 800 or WIDTH x HEIGHT of the environment, drawn by the processor:
// `page_alone` waves, as fast as the page takes it; `with_daemon` is pressed, published 60 times a second. browser_ and
// daemon_per_frame: processor time of all processes of the browser, and of pliantd with pliant-web: depends less on what else
// runs. Of the page's window the picture is all but the panel. drag_to_pose: from the browser's time of a pointer event to
// the arrival of its pose at lcm-logger.

import { mkdtempSync, readdirSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { fileURLToPath } from 'node:url';
import { join } from 'node:path';
import { openBrowser } from './browser.mjs';
import { icoSphere, meshMessage, nodesMessage, serve } from './mock.mjs';
import { figureOf, middle, newtons, Program, setting, startDaemon, startWeb, until, untilShown } from './live.mjs';

const SECONDS = 5, LOADS = 5; // of a measurement; of the page
const paths = setting();
const scene = fileURLToPath(new URL('scenes/big.cfg', import.meta.url));
const row = (metric, value, unit, digits = 1) => console.log(['web', metric, value.toFixed(digits), unit].join('\t'));
const part = (sorted, p) => sorted[Math.min(sorted.length - 1, Math.floor(p * sorted.length))];

// The poses of an LCM event log: [{utime of arrival, key of the position}]. Everything is big-endian.
function posesOf(file) {
    const data = readFileSync(file), poses = [];
    for (let at = 0; at + 28 <= data.length;) {
        const utime = Number(data.readBigInt64BE(at + 12));
        const name = data.readInt32BE(at + 20), size = data.readInt32BE(at + 24);
        const body = at + 28 + name;
        at = body + size;
        if (at > data.length) break; // still being written
        // fingerprint, utime, sender, sequence, tool, position
        const position = [0, 1, 2].map((k) => data.readDoubleBE(body + 28 + 8 * k));
        poses.push({ utime, key: position.join() });
    }
    return poses;
}

async function loads(page, url) {
    const times = [];
    for (let i = 0; i < LOADS; i++) {
        await page.goto('about:blank');
        await page.goto(url);
        await untilShown(page);
        // Drawn a moment after it is told.
        times.push(await (await page.waitForFunction(() => window.pliant.stage.firstBodies)).jsonValue());
    }
    times.sort((a, b) => a - b);
    row('page_load_median', part(times, 0.5), 'ms');
    row('page_load_max', times.at(-1), 'ms');
}

// Notes for each pose that the page sends when its pointer event was.
const noteEvents = () => {
    let stamp = 0;
    window.noted = [];
    const note = (event) => { stamp = performance.timeOrigin + event.timeStamp; };
    for (const kind of ['pointerrawupdate', 'pointermove']) addEventListener(kind, note, { capture: true });
    const { send } = WebSocket.prototype;
    WebSocket.prototype.send = function (text) {
        if (stamp && text.startsWith('{"type":"tool"')) {
            const { position } = JSON.parse(text);
            window.noted.push({ utime: 1000 * stamp, key: position.join() });
            stamp = 0; // only the first pose after an event is its own
        }
        send.call(this, text);
    };
};

// Processor time so far [ms] of processes that this one has started: {browser, daemon}.
function processorTime() {
    const TICK = 10; // [ms] of /proc
    const all = new Map(), sum = { browser: 0, daemon: 0 };
    for (const id of readdirSync('/proc').filter((name) => /^\d+$/.test(name)))
        try {
            const text = readFileSync(`/proc/${id}/stat`, 'utf8'), end = text.lastIndexOf(')');
            const fields = text.slice(end + 2).split(' ').map(Number);
            all.set(Number(id), { name: text.slice(text.indexOf('(') + 1, end), parent: fields[1],
                ms: TICK * (fields[11] + fields[12]) });
        } catch {
            // has ended
        }
    for (const { name, parent, ms } of all.values()) {
        let at = parent;
        while (at > 1 && at !== process.pid) at = all.get(at)?.parent ?? 0;
        if (at === process.pid) sum[name.startsWith('pliant') ? 'daemon' : 'browser'] += ms;
    }
    return sum;
}

async function drag(page, log) {
    await page.evaluate(noteEvents);
    const m = await middle(page);
    await page.mouse.move(m.x - 40, m.y);
    await page.mouse.down();
    await until('the ball is pressed', async () => (await newtons(page)) > 0);
    const frames = () => page.evaluate(() => [window.pliant.stage.frames, performance.now()]);
    const [first, began] = await frames(), used = processorTime();
    const end = Date.now() + 1000 * SECONDS;
    for (let i = 0; Date.now() < end; i++) {
        await page.mouse.move(m.x + 40 * Math.sin(i / 30), m.y + 30 * Math.cos(i / 40));
        await new Promise((resolve) => setTimeout(resolve, 8));
    }
    const [last, ended] = await frames(), more = processorTime();
    const moved = await figureOf(page, 'ball', 'moved');
    await page.mouse.up();
    row('frames_with_daemon', 1000 * (last - first) / (ended - began), 'Hz');
    for (const part of ['browser', 'daemon']) row(`${part}_per_frame`, (more[part] - used[part]) / (last - first), 'ms');
    row('ball_moved', 1000 * moved, 'mm');
    const noted = await page.evaluate(() => window.noted);
    await new Promise((resolve) => setTimeout(resolve, 1500)); // the logger writes what it has
    const arrived = new Map(posesOf(log).reverse().map(({ key, utime }) => [key, utime])); // the first of each
    const times = noted.filter(({ key }) => arrived.has(key)).map(({ key, utime }) => (arrived.get(key) - utime) / 1000)
        .sort((a, b) => a - b);
    row('drag_to_pose_p50', part(times, 0.5), 'ms', 2);
    row('drag_to_pose_p95', part(times, 0.95), 'ms', 2);
    row('drag_to_pose_max', times.at(-1), 'ms', 2);
    row('poses_compared', times.length, 'count', 0);
}

// Sends a waving ball, the next as soon as the page has drawn the last.
async function wave(session) {
    const { position, triangle } = icoSphere(5, 0.05);
    session.text({ type: 'hello', version: '0', prefix: 'PLIANT', read_only: false, rate_hz: 1000, textures: [] });
    session.text({ type: 'scene', name: 'wave', bodies: [{ name: 'ball', model: 'surface' }], tools: [], describe: '' });
    session.text({ type: 'link', daemon: true, age: 0 });
    session.binary(meshMessage(0, 1, { position, triangle }));
    const moving = position.slice();
    for (let k = 0; !session.closed; k++) {
        for (let i = 0; i < position.length; i += 3) {
            const times = 1 + 0.1 * Math.sin(60 * position[i] + 0.1 * k);
            for (let j = i; j < i + 3; j++) moving[j] = position[j] * times;
        }
        session.binary(nodesMessage(0, 1, moving, k / 60, k));
        await session.round();
    }
}

async function alone(page) {
    const server = await serve(paths.page, wave);
    await page.goto(server.url);
    await untilShown(page);
    const frames = () => page.evaluate(() => [window.pliant.stage.frames, performance.now()]);
    const [first, began] = await frames();
    await new Promise((resolve) => setTimeout(resolve, 1000 * SECONDS));
    const [last, ended] = await frames();
    row('frames_page_alone', 1000 * (last - first) / (ended - began), 'Hz');
    await page.goto('about:blank');
    await server.close();
}

const folder = mkdtempSync(join(tmpdir(), 'pliant-measure-'));
const log = join(folder, 'poses.log');
const browser = await openBrowser({ width: Number(process.env.WIDTH ?? 1280), height: Number(process.env.HEIGHT ?? 800),
    options: process.env.CHROMIUM_OPTIONS?.split(' ') });
console.log(['case', 'metric', 'value', 'unit'].join('\t'));
await alone(browser.page);
const daemon = startDaemon(paths, scene);
const web = await startWeb(paths);
const logger = new Program(paths.out, 'lcm-logger', 'lcm-logger', ['--channel=.*TOOL_POSE', '--flush-interval=200', log]);
try {
    await loads(browser.page, web.url);
    await drag(browser.page, log);
} finally {
    await browser.close();
    for (const program of [logger, web.program, daemon]) await program.stop();
    rmSync(folder, { recursive: true, force: true });
}
