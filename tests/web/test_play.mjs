// SPDX-License-Identifier: MIT
// The bar of time: of a live session, and of its recording, which pliant-play plays.

import assert from 'node:assert/strict';
import { existsSync, rmSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { openBrowser } from './browser.mjs';
import { change, figureOf, PATIENCE, picture, Program, setting, startDaemon, startWeb, until, untilShown } from './live.mjs';

const paths = setting();
const SCENE = fileURLToPath(new URL('scenes/ball.cfg', import.meta.url));
const RECORDING = join(paths.out, 'session.h5');
const beside = (name) => join(dirname(paths.daemon), name);
// As in test_page.mjs: a field's mean colour [of 255] where tissue becomes something else.
const SEEN = 8;
const options = { timeout: 3 * PATIENCE };

let server, web, browser, page;
const shot = (name) => page.screenshot({ path: join(paths.out, `${name}.png`) });
const pieces = () => figureOf(page, 'ball', 'pieces');
const bar = (what) => page.evaluate((what) => window.pliant.timeline[what], what);
const time = () => bar('time');
const run = async (name, ...args) => (await new Program(paths.out, name, beside(name), args).ended).code;

before(async () => {
    for (const name of [RECORDING, `${RECORDING}.xdmf`]) rmSync(name, { force: true });
    server = startDaemon(paths, SCENE, '--record', RECORDING);
    web = await startWeb(paths);
    browser = await openBrowser({ width: 1000, height: 640 });
    page = browser.page;
    await page.goto(web.url);
    await untilShown(page);
}, options);

after(async () => {
    await browser?.close();
    await web?.program.stop();
    await server?.stop();
});

// Presses and moves the mouse in the bar to a part of its width.
async function scrubTo(part) {
    let x, y, box;
    await until('the bar is grabbed', async () => { // it moves when a line above it grows
        await page.mouse.up();
        box = await page.locator('#timeline-curve').boundingBox();
        x = box.x + part * (box.width - 1);
        y = box.y + box.height / 2;
        await page.mouse.move(box.x + box.width / 2, y);
        await page.mouse.down();
        return bar('scrubs');
    });
    await page.mouse.move((box.x + box.width / 2 + x) / 2, y);
    await page.mouse.move(x, y);
    await page.mouse.up();
}

test('a_live_session_has_its_events_in_the_bar', options, async () => {
    await until('the bar is there', async () => page.locator('#timeline').isVisible());
    assert.equal(await page.locator('#timeline-controls').isVisible(), false);
    assert.equal(await run('pliant-cut', '--plane', '0,0,0.01,0,0,1'), 0);
    await until('the cut is a mark', async () => (await bar('marks')).some(({ kind }) => kind === 'cut'));
    await until('the ball is in two', async () => (await pieces()) === 2);
    await shot('play-1-live');
    const end = (await time()) + 0.5;
    await until('some time passes', async () => (await time()) > end);
});

test('its_recording_is_shown_with_the_same_marks', options, async () => {
    await server.stop();
    assert(existsSync(RECORDING));
    server = new Program(paths.out, 'pliant-play', beside('pliant-play'), ['--paused', RECORDING]);
    await until('it is a recording', () => bar('recorded'));
    await until('the page says so', async () => (await page.locator('#link').textContent()) === 'recording');
    await untilShown(page);
    await until('the marks are there', async () => (await bar('marks')).some(({ kind }) => kind === 'cut'));
    assert(await page.locator('#timeline-controls').isVisible());
    assert.equal(await page.locator('#bar [role=radiogroup]').isVisible(), false); // nothing can be pressed
    await until('the ball is whole at the start', async () => (await pieces()) === 1);
});

test('one_scrubs_through_it_and_back', options, async () => {
    const whole = await picture(page);
    await scrubTo(1);
    const end = await bar('end');
    await until('it is at the end', async () => Math.abs((await time()) - end) < 0.02 * end);
    await until('the ball is in two', async () => (await pieces()) === 2);
    // Nodes know what they were split from, as in the live session: the rim of the cut is another colour.
    await until('the rim is known', () => page.evaluate(() => window.pliant.bodies[0].lips > 0));
    await until('that is seen', async () => change(await picture(page), whole) > SEEN);
    await shot('play-2-end');
    await scrubTo(0);
    await until('the ball is whole', async () => (await pieces()) === 1);
    await until('the picture is as it was', async () => change(await picture(page), whole) < SEEN);
});

test('the_arrows_step_by_a_frame', options, async () => {
    await page.locator('#timeline-curve').focus();
    const frame = (await bar('recording')).frame_time;
    for (const [key, expected] of [['ArrowRight', 1], ['ArrowRight', 2], ['ArrowLeft', 1]]) {
        await page.keyboard.press(key);
        // Half a frame: times of frames are whole ticks.
        await until(`${key} moves by a frame`, async () => Math.abs((await time()) - expected * frame) < 0.5 * frame);
    }
});

test('it_plays_at_the_speed_that_one_chooses', options, async () => {
    await page.locator('#timeline-speed').selectOption('0.25');
    await until('the speed is taken', async () => (await bar('playback')).speed === 0.25);
    const before = await time();
    await page.locator('#timeline-play').click();
    await until('it plays', async () => (await bar('playback')).playing && (await time()) > before);
    await page.locator('#timeline-loop').check();
    await until('it repeats', async () => (await bar('playback')).loop);
    await page.keyboard.press('p');
    await until('it is paused', async () => !(await bar('playback')).playing);
});

test('a_daemon_after_it_is_live_again', options, async () => {
    await server.stop();
    server = startDaemon(paths, SCENE);
    await until('it is live', async () => !(await bar('recorded')));
    await untilShown(page);
    assert(await page.locator('#bar [role=radiogroup]').isVisible());
    assert.deepEqual(browser.errors, []);
});
