// SPDX-License-Identifier: MIT
// The page with a real daemon and a real pliant-web: what a person does, and what comes of it.

import assert from 'node:assert/strict';
import { fileURLToPath } from 'node:url';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { openBrowser } from './browser.mjs';
import { change, drag as dragOn, figureOf, middle, newtons, PATIENCE, picture, setting, startDaemon, startWeb, until,
    untilShown } from './live.mjs';

const paths = setting();
const SCENE = fileURLToPath(new URL('scenes/ball.cfg', import.meta.url));
// A field's mean colour [of 255] changes by this much where tissue becomes something else; noise of
// drawing is below 1, the body at rest stands still.
const SEEN = 8;
const options = { timeout: 3 * PATIENCE };

let daemon, web, browser, page;
const shot = (name) => page.screenshot({ path: join(paths.out, `${name}.png`) });

before(async () => {
    web = await startWeb(paths); // before the daemon: a late start must do
    browser = await openBrowser({ width: 1000, height: 640 });
    page = browser.page;
}, options);

after(async () => {
    await browser?.close();
    await web?.program.stop();
    await daemon?.stop();
});

const drag = (...way) => dragOn(page, ...way);

const moved = () => figureOf(page, 'ball', 'moved');
const nodes = () => figureOf(page, 'ball', 'nodes');
const state = () => page.locator('#state').textContent();

// The body swings out: two pictures alike.
async function untilStill() {
    let last = await picture(page);
    await until('the body stands still', async () => {
        await new Promise((resolve) => setTimeout(resolve, 200));
        const now = await picture(page);
        const still = change(now, last) < 0.5;
        last = now;
        return still;
    });
    return last;
}

async function reset() {
    await page.locator('#reset').click();
    await until('the ball is whole', async () => (await figureOf(page, 'ball', 'pieces')) === 1 &&
        (await nodes()) === 162);
    return untilStill();
}

test('page_waits_for_a_daemon_that_starts_later', options, async () => {
    await page.goto(web.url);
    await page.waitForSelector('#notice:has-text("pliantd")', { timeout: PATIENCE });
    daemon = startDaemon(paths, SCENE);
    await untilShown(page);
    assert.equal(await page.locator('#scene-name').textContent(), 'ball');
});

test('page_shows_a_shaded_body', options, async () => {
    const began = Date.now();
    await page.reload();
    await untilShown(page);
    console.log(`# page loaded and drawn in ${Date.now() - began} ms`);
    const seen = await untilStill();
    await shot('1-loaded');
    assert(seen.covered > 0.05, `body covers ${seen.covered} of the picture`);
    // One colour alone would be a silhouette.
    assert(seen.shades > 200, `${seen.shades} shades`);
    assert.deepEqual(browser.errors, []);
});

test('drag_presses_the_body_and_shows_the_force', options, async () => {
    const rest = await moved();
    const m = await middle(page);
    const before = await picture(page);
    await drag({ x: m.x - 20, y: m.y }, m);
    await until('a force is shown', async () => (await newtons(page)) > 0.02);
    // At rest the ball under tension is off its rest shape too: one millimetre more.
    await until('the body yields', async () => (await moved()) > rest + 1e-3);
    assert.match(await page.locator('#labels .newtons:visible').first().textContent(), /\d N$/);
    assert(change(await picture(page), before) > SEEN, 'the press is seen');
    await shot('2-pressed');
    await page.mouse.up();
    await until('no force remains', async () => (await newtons(page)) === 0);
    await until('the body springs back', async () => (await moved()) < rest + 1e-3);
});

test('drag_with_control_grasps_and_pulls', options, async () => {
    const rest = await moved();
    const m = await middle(page);
    await page.keyboard.down('Control');
    await drag(m, { x: m.x + 10, y: m.y }, 2);
    await until('the jaws hold', async () =>
        (await page.locator('#events').innerText()).includes('grasp'));
    for (let i = 0; i < 12; i++) await page.mouse.move(m.x + 10 + 8 * i, m.y);
    await until('the body follows', async () => (await moved()) > rest + 2e-3);
    await shot('3-pulled');
    await page.mouse.up();
    await page.keyboard.up('Control');
    await until('it is let go of', async () => (await moved()) < rest + 1e-3);
});

test('drag_beside_the_body_turns_the_view_alone', options, async () => {
    const before = await untilStill();
    const frame = await page.locator('#picture').boundingBox();
    await drag({ x: frame.x + frame.width - 30, y: frame.y + 100 }, { x: frame.x + frame.width - 130, y: frame.y + 140 });
    await page.mouse.up();
    assert(change(await picture(page), before) > SEEN, 'another side is seen');
    assert.equal(await newtons(page), 0);
    await page.locator('#home').click();
    assert(change(await picture(page), before) < SEEN, 'the view is back');
});

test('switches_change_the_picture', options, async () => {
    await page.locator('#pause').click();
    await until('paused', async () => (await state()) === 'paused');
    const before = await untilStill();
    const look = async (name, on, off) => {
        await on();
        const now = await picture(page);
        assert(change(now, before) > SEEN, `${name} is seen: ${change(now, before)}`);
        await shot(`4-${name}`);
        await off();
        assert(change(await picture(page), before) < 1, `${name} is off again`);
    };
    const check = (id) => [() => page.locator(`#${id}`).check(), () => page.locator(`#${id}`).uncheck()];
    const choose = (value) => () => page.locator('#colouring').selectOption(value);
    await look('wireframe', ...check('wireframe'));
    await look('virtual-nodes', ...check('springs'));
    await look('levels', choose('1'), choose('0'));
    await page.locator('#threshold').fill('5'); // 0.1 mm: the tension has moved more
    await look('red', ...check('red'));
    await page.locator('#resume').click();
    await until('running', async () => (await state()) === 'running');
});

test('shift_drag_cuts_the_ball_in_two', options, async () => {
    const before = await untilStill();
    const count = await nodes();
    const m = await middle(page);
    await page.keyboard.down('Shift');
    await drag({ x: m.x - 330, y: m.y - 40 }, { x: m.x + 330, y: m.y - 40 }, 24);
    await shot('5-cutting');
    await page.mouse.up();
    await page.keyboard.up('Shift');
    await until('nodes are added', async () => (await nodes()) > count);
    await until('there are two pieces', async () => (await figureOf(page, 'ball', 'pieces')) >= 2);
    await until('the cut is seen', async () => change(await picture(page), before) > SEEN);
    assert.match(await page.locator('#events').innerText(), /cut/);
    const open = await untilStill();
    await page.locator('#lips').check();
    assert(change(await picture(page), open) > SEEN, 'faces at the cut are marked');
    await shot('6-cut');
    await page.locator('#lips').uncheck();
    await page.locator('#colouring').selectOption('2');
    assert(change(await picture(page), open) > SEEN, 'pieces have colours');
    await shot('7-pieces');
    await page.locator('#colouring').selectOption('0');
});

test('a_click_pins_and_the_list_releases', options, async () => {
    const list = page.locator('#ties li'), hint = page.locator('#hint');
    assert.equal(await list.count(), 0);
    await page.keyboard.press('4');
    const m = await middle(page);
    await page.mouse.click(m.x, m.y);
    await until('the pin is listed', async () => (await list.count()) === 1);
    assert.match(await list.innerText(), /tie 1: pin of \d+ nodes of body ball/);
    await shot('8-pinned');
    // A clip between two places of one side has no walls to close; a drag that ends beside the tissue ties nothing.
    await drag(m, { x: m.x + 40, y: m.y }, 4);
    await page.mouse.up();
    await until('it says why not', async () => /Nothing was tied: .*no walls/.test(await hint.innerText()));
    await drag(m, { x: m.x + 330, y: m.y }, 8);
    await page.mouse.up();
    await until('it says what is missing', async () => /must end on tissue/.test(await hint.innerText()));
    assert.equal(await list.count(), 1);
    await page.reload();
    await untilShown(page);
    await until('a page that comes later lists it too', async () => (await list.count()) === 1);
    await list.locator('button').click();
    await until('it is released', async () => (await list.count()) === 0);
    assert.equal(await list.isVisible(), false);
    await page.keyboard.press('1');
});

test('reset_makes_the_ball_whole_again', options, async () => {
    await reset();
    assert.equal(await nodes(), 162);
});

test('buttons_pause_step_and_resume', options, async () => {
    const clock = () => page.locator('#clock').textContent();
    await page.locator('#pause').click();
    await until('paused', async () => (await state()) === 'paused');
    await page.locator('#step').click();
    await until('in lockstep', async () => (await state()) === 'lockstep');
    const stood = await clock();
    await page.locator('#step').click();
    await page.locator('#resume').click();
    await until('running', async () => (await state()) === 'running');
    await until('time goes on', async () => (await clock()) !== stood);
    await page.locator('#picture').focus();
    await page.keyboard.press('p');
    await until('paused by a key', async () => (await state()) === 'paused');
    await page.keyboard.press('p');
    await until('resumed by a key', async () => (await state()) === 'running');
});

test('page_survives_a_restart_of_the_daemon', options, async () => {
    await daemon.stop('SIGKILL');
    await page.waitForSelector('body.silent', { timeout: PATIENCE });
    await page.waitForSelector('#notice:has-text("pliantd is gone")', { timeout: PATIENCE });
    assert.equal(await page.locator('#state').isVisible(), false, 'nothing is said to run');
    await shot('8-silent');
    daemon = startDaemon(paths, SCENE);
    await untilShown(page);
    // What was shown of the old daemon goes when the new one has described its scene, and a press of it too.
    await until('the new daemon is pressed', async () => {
        await page.mouse.up();
        const m = await middle(page);
        await drag({ x: m.x - 20, y: m.y }, m);
        const end = Date.now() + 2000;
        while (Date.now() < end) {
            if ((await newtons(page)) > 0.02) return true;
            await new Promise((resolve) => setTimeout(resolve, 50));
        }
        return false;
    });
    await page.mouse.up();
});

test('page_survives_a_restart_of_pliant_web', options, async () => {
    const { port } = new URL(web.url);
    await web.program.stop();
    await page.waitForSelector('#link:has-text("no connection")', { timeout: PATIENCE });
    web = await startWeb(paths, '--port', port);
    await untilShown(page);
});

test('read_only_page_shows_and_refuses', options, async () => {
    const quiet = await startWeb(paths, '--read-only');
    try {
        await page.goto(quiet.url);
        await untilShown(page);
        assert.equal(await page.locator('#pause').isVisible(), false);
        assert.equal(await page.locator('input[name=mode]').first().isVisible(), false);
        const m = await middle(page);
        const before = await untilStill();
        await drag({ x: m.x - 60, y: m.y }, m);
        await page.mouse.up();
        assert(change(await picture(page), before) > SEEN, 'the drag turns the view');
        // What a page sends all the same is refused.
        await page.evaluate(() => window.pliant.link.request({ type: 'command', kind: 'pause', value: 0, argument: '' }));
        await page.waitForSelector('#events .bad', { timeout: PATIENCE });
        assert.equal(await state(), 'running');
        await shot('9-read-only');
    } finally {
        await quiet.program.stop();
    }
});

test('small_window_shows_everything_that_is_needed', options, async () => {
    await page.setViewportSize({ width: 640, height: 480 });
    await page.goto(web.url);
    await untilShown(page);
    await untilStill();
    for (const id of ['force', 'pause', 'reset', 'home', 'panel-button', 'state']) {
        const box = await page.locator(`#${id}`).boundingBox();
        assert(box && box.x >= 0 && box.y >= 0 && box.x + box.width <= 640 && box.y + box.height <= 480, id);
    }
    await shot('10-small');
    await page.locator('#panel-button').click();
    assert(await page.locator('#wireframe').isVisible());
    await shot('11-small-panel');
});

test('nothing_failed_in_the_page', options, () => {
    // Chromium reports a lost connection as an error of the page.
    const errors = browser.errors.filter((text) => !/WebSocket connection|ERR_CONNECTION/.test(text));
    assert.deepEqual(errors, []);
});
