// SPDX-License-Identifier: MIT
// ./dev web: the page outlives the daemon, and Ctrl-C ends all.

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { dirname } from 'node:path';
import { fileURLToPath } from 'node:url';
import { after, before, test } from 'node:test';
import { openBrowser } from './browser.mjs';
import { PATIENCE, setting, until, untilShown } from './live.mjs';

const { daemon } = setting();
const DEV = fileURLToPath(new URL('../../dev', import.meta.url));
const SCENE = fileURLToPath(new URL('scenes/ball.cfg', import.meta.url));
const PORT = 18080; // of a network of its own
const options = { timeout: 3 * PATIENCE };

let dev, browser, page, said = '', ended = null;

before(async () => {
    dev = spawn('bash', [DEV, 'web-inside', SCENE, String(PORT)], { detached: true,
        env: { ...process.env, PLIANT_BIN: dirname(daemon), DISPLAY: '', WAYLAND_DISPLAY: '' } });
    for (const out of [dev.stdout, dev.stderr]) out.on('data', (data) => { said += data; });
    dev.on('exit', (code) => { ended = code; });
    await until('it says where the page is', () => said.includes('page: http') || ended !== null);
    browser = await openBrowser({ width: 900, height: 600 });
    page = browser.page;
    await page.goto(`http://127.0.0.1:${PORT}/`);
    await untilShown(page);
}, options);

after(async () => {
    await browser?.close();
    if (ended === null) process.kill(-dev.pid, 'SIGKILL');
});

const childrenOf = (pid) => readFileSync(`/proc/${pid}/task/${pid}/children`, 'utf8').split(' ').filter(Boolean);
const nameOf = (pid) => readFileSync(`/proc/${pid}/comm`, 'utf8').trim();
const running = (name) => childrenOf(dev.pid).filter((pid) => nameOf(pid) === name).map(Number);
const isGone = () => page.waitForSelector('#notice:has-text("pliantd is gone")', { timeout: PATIENCE });

async function comesBack() {
    dev.stdin.write('\n');
    await until('a daemon runs again', () => running('pliantd').length === 1);
    await untilShown(page);
    // Of the new one nothing is known before its first status.
    await until('it runs', async () => await page.locator('#state').textContent() === 'running');
}

test('the_page_outlives_a_daemon_that_is_killed', options, async () => {
    const [server] = running('pliant-web');
    process.kill(running('pliantd')[0], 'SIGKILL');
    await isGone();
    await until('the terminal says so', () => said.includes('pliantd has ended (signal KILL)'));
    assert.deepEqual(running('pliant-web'), [server]);
    await comesBack();
});

test('the_page_outlives_a_daemon_that_is_stopped_from_it', options, async () => {
    await page.evaluate(() => window.pliant.link.request({ type: 'command', kind: 'stop', value: 0, argument: '' }));
    await isGone();
    await until('the terminal says so', () => said.includes('pliantd has ended (exit status 0)'));
    await comesBack();
});

test('ctrl_c_ends_all', options, async () => {
    const pids = [...running('pliantd'), ...running('pliant-web')];
    assert.equal(pids.length, 2);
    process.kill(-dev.pid, 'SIGINT'); // to all of them, as a terminal does
    await until('it has ended', () => ended !== null);
    assert.equal(ended, 0, said);
    for (const pid of pids) assert.throws(() => process.kill(pid, 0), { code: 'ESRCH' });
});

test('without_a_scene_the_page_starts_those_of_config', options, async () => {
    said = '';
    ended = null;
    dev = spawn('bash', [DEV, 'web-inside', '', String(PORT + 1)], { detached: true,
        env: { ...process.env, PLIANT_BIN: dirname(daemon), DISPLAY: '', WAYLAND_DISPLAY: '' } });
    for (const out of [dev.stdout, dev.stderr]) out.on('data', (data) => { said += data; });
    dev.on('exit', (code) => { ended = code; });
    await until('it says where the page is', () => said.includes('page: http') || ended !== null);
    await page.goto(`http://127.0.0.1:${PORT + 1}/`);
    await page.locator('[data-start="minimal.cfg"]').click({ timeout: PATIENCE });
    await untilShown(page);
    process.kill(-dev.pid, 'SIGINT');
    await until('it has ended', () => ended !== null);
    assert.equal(ended, 0, said);
});
