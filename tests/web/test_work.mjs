// SPDX-License-Identifier: MIT
// What one does with a body on the page, with a real daemon: settings, the blade and the grasper as the mouse's tools, a
// second hand, charts, pictures and videos, and what was refused.

import assert from 'node:assert/strict';
import { fileURLToPath } from 'node:url';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { openBrowser } from './browser.mjs';
import { drag as dragOn, figureOf, middle, newtons, PATIENCE, setting, startDaemon, startWeb, until,
    untilShown } from './live.mjs';

const paths = setting();
const SCENE = fileURLToPath(new URL('scenes/work.cfg', import.meta.url));
const options = { timeout: 3 * PATIENCE };

let daemon, web, browser, page;
const shot = (name) => page.screenshot({ path: join(paths.out, `work-${name}.png`) });
const moved = () => figureOf(page, 'ball', 'moved');
const events = () => page.locator('#events').innerText();
const hint = () => page.locator('#hint').textContent();
const isActive = (id) => page.evaluate((id) => {
    const tool = pliant.tools.byId.get(id);
    return tool.active && performance.now() - tool.poseAt < 1000;
}, id);

// A gamepad whose sticks the test moves, instead of the browser's own.
const FAKE_PAD = () => {
    window.fakePad = null;
    navigator.getGamepads = () => [null, window.fakePad];
    window.plug = () => { window.fakePad = { index: 1, connected: true, axes: [0, 0, 0, 0],
        buttons: Array.from({ length: 16 }, () => ({ value: 0, pressed: false })) }; };
};

before(async () => {
    daemon = startDaemon(paths, SCENE);
    web = await startWeb(paths);
    browser = await openBrowser({ width: 1100, height: 700 });
    page = browser.page;
    await page.addInitScript(FAKE_PAD);
    await page.goto(web.url);
    await untilShown(page);
}, options);

after(async () => {
    await browser?.close();
    await web?.program.stop();
    await daemon?.stop();
});

const drag = (...way) => dragOn(page, ...way);

async function reset() {
    await page.locator('#reset').click();
    await until('the ball is whole', async () => (await figureOf(page, 'ball', 'pieces')) === 1 &&
        (await figureOf(page, 'ball', 'nodes')) === 162);
}

const open = (name) => page.locator(`#panel details:has(> summary:text-is("${name}"))`)
    .evaluate((details) => { details.open = true; });
const row = (key) => page.locator(`.setting[data-key="${key}"]`);
const says = (key) => row(key).locator('p').textContent();

// Moves a slider without letting go of it.
const slide = (key, place) => row(key).locator('input[type=range]').evaluate((slider, place) => {
    slider.value = String(place * slider.max);
    slider.dispatchEvent(new Event('input', { bubbles: true }));
}, place);
const letGo = (key) => row(key).locator('input[type=range]')
    .evaluate((slider) => slider.dispatchEvent(new Event('change', { bubbles: true })));

test('a_slider_tells_its_effect_before_it_is_set_and_sets_it_when_let_go', options, async () => {
    await open('Settings');
    await row('ball.stiffness_scale').waitFor({ timeout: PATIENCE });
    assert.equal(await row('ball.stiffness_scale').locator('input[type=number]').inputValue(), '1');
    assert.deepEqual(await page.locator('.setting:visible').evaluateAll((rows) => rows.map((one) => one.dataset.key)),
        ['gravity_x', 'gravity_y', 'gravity_z', 'ball.stiffness_scale', 'ball.damping_scale', 'ball.friction']);
    await slide('ball.stiffness_scale', 0.25);
    await until('the effect is told', async () => / substeps a tick/.test(await says('ball.stiffness_scale')));
    assert.match(await says('ball.stiffness_scale'), /instead of 1: .* ms of 10 ms a tick/);
    await shot('1-try');
    assert.doesNotMatch(await events(), /stiffness_scale/);
    const rest = await moved();
    await slide('gravity_z', 0.1); // -16 m/s2
    await letGo('gravity_z');
    await until('it is set', async () => /gravity_z = -16/.test(await events()));
    await until('the ball hangs', async () => (await moved()) > rest + 1e-4);
    assert.equal(await says('gravity_z'), 'set to -16');
    await reset();
    await until('a reset brings the value back', async () =>
        (await row('gravity_z').locator('input[type=number]').inputValue()) === '0');
});

test('a_refused_value_is_told_beside_its_slider', options, async () => {
    await slide('ball.stiffness_scale', 1); // 8 times
    await until('it would be refused', async () => /would be refused: 8 needs a time step/
        .test(await says('ball.stiffness_scale')));
    await letGo('ball.stiffness_scale');
    await until('it is refused', async () => /^refused: .*take at most/.test(await says('ball.stiffness_scale')));
    assert.match(await row('ball.stiffness_scale').locator('p').getAttribute('class'), /bad/);
    assert.equal(await row('ball.stiffness_scale').locator('input[type=number]').inputValue(), '1');
    await shot('2-refused');
    // So is what is typed, whatever it is.
    await row('ball.friction').locator('input[type=number]').fill('1e9');
    await row('ball.friction').locator('input[type=number]').press('Enter');
    await until('the range is told', async () => /^refused: friction 1e\+09 outside \[0, 10\]/.test(await says('ball.friction')));
    await until('it is counted, with the reason', async () =>
        /\d+ inputs? so far, not_possible: the scene cannot do it/.test(await events()));
});

test('an_empty_box_sets_nothing', options, async () => {
    await row('ball.friction').locator('input[type=number]').fill('');
    await row('ball.friction').locator('input[type=number]').press('Enter');
    assert.equal(await says('ball.friction'), 'not a number');
    assert.equal(await row('ball.friction').locator('input[type=number]').inputValue(), '0.2');
});

test('the_mouse_has_the_tool_that_is_chosen', options, async () => {
    const cursor = () => page.locator('#picture').evaluate((canvas) => canvas.style.cursor);
    await open('Hand');
    await page.locator('#tool').selectOption('3');
    assert(await page.locator('input[name=mode][value=pull]').isChecked());
    assert.equal(await cursor(), 'grab');
    await page.locator('#picture').focus();
    await page.keyboard.press('3');
    assert.equal(await page.locator('#tool').inputValue(), '4');
    assert.equal(await cursor(), 'crosshair');
});

test('a_drag_with_the_grasper_grips_pulls_and_lets_go', options, async () => {
    await page.locator('#tool').selectOption('3');
    const rest = await moved();
    const m = await middle(page);
    await drag(m, m, 1);
    await until('the jaws hold', async () => /grasp/.test(await events()));
    for (let i = 1; i <= 10; i++) await page.mouse.move(m.x + 8 * i, m.y);
    await until('the body follows', async () => (await moved()) > rest + 2e-3);
    assert.match(await hint(), /Pulling by grasper 3/);
    await shot('3-grasper');
    await page.mouse.up();
    await until('it is let go of', async () => (await moved()) < rest + 1e-3);
    assert.match(await events(), /release/);
});

test('a_drag_with_the_blade_moves_the_tool_and_cuts', options, async () => {
    await page.keyboard.press('3');
    const m = await middle(page);
    await drag({ x: m.x - 300, y: m.y - 30 }, { x: m.x + 300, y: m.y - 30 }, 30);
    assert(await isActive(4), 'the blade is moved');
    await shot('4-blade');
    await until('the ball is in two pieces', async () => (await figureOf(page, 'ball', 'pieces')) >= 2);
    assert.match(await hint(), /Cutting with blade 4/);
    await page.mouse.up();
    await until('the blade is withdrawn', async () => !(await isActive(4)));
    assert.equal(await page.evaluate(() => pliant.hand.knife.stroke), null, 'no cut was sent as a message');
    await reset();
    await page.keyboard.press('1');
});

test('keys_move_a_second_tool_while_the_mouse_holds_another', options, async () => {
    await page.locator('#second').selectOption('3');
    await page.keyboard.down('e');
    await until('the second tool is there', () => isActive(3));
    const depth = () => page.evaluate(() => {
        const { stage, second } = pliant;
        return second.tip.clone().sub(stage.center).dot(stage.viewDirection(stage.center.clone())) / stage.size;
    });
    await until('it goes into the picture', async () => (await depth()) > -0.32); // the ball's face is at -0.29
    await page.keyboard.up('e');
    await page.keyboard.down('Space');
    const m = await middle(page);
    await until('its jaws are closed', async () => (await page.evaluate(() => pliant.tools.byId.get(3).grip)) === 1);
    await drag({ x: m.x - 60, y: m.y + 20 }, { x: m.x - 50, y: m.y + 20 });
    await until('the probe presses', async () => (await newtons(page)) > 0.02);
    assert(await isActive(3) && await isActive(1), 'both tools are in use');
    assert.match(await page.locator('#second-text').textContent(), /grasper 3: .*closed/);
    await shot('5-two-hands');
    await page.mouse.up();
    await page.keyboard.up('Space');
    // S moves the tool; it is not the page's key for a step.
    await page.keyboard.press('s');
    await page.keyboard.press('x');
    await until('it is withdrawn', async () => !(await isActive(3)));
    assert.equal(await page.locator('#state').textContent(), 'running');
    // Whoever chooses it for the keys takes it from the mouse.
    await page.locator('#second').selectOption('1');
    assert.equal(await page.evaluate(() => pliant.hand.toolOf('probe')), undefined);
    await page.locator('#second').selectOption('3');
});

test('a_gamepad_moves_it_beyond_its_dead_zone_and_withdraws_it_when_it_is_gone', options, async () => {
    await page.evaluate(() => { plug(); fakePad.axes = [0.1, -0.1, 0, 0.14]; });
    await page.waitForTimeout(200); // at rest nothing must happen: there is no event to wait for
    assert.equal(await page.evaluate(() => pliant.second.held), null);
    await page.evaluate(() => { fakePad.axes = [0.9, 0, 0, 0]; fakePad.buttons[7] = { value: 0.6, pressed: true }; });
    await until('the tool is there', () => isActive(3));
    const right = () => page.evaluate(() => {
        const { stage, second } = pliant;
        const axis = stage.center.clone().setFromMatrixColumn(stage.camera.matrixWorld, 0);
        return second.tip.clone().sub(stage.center).dot(axis);
    });
    const first = await right();
    await until('it goes to the right', async () => (await right()) > first + 0.005);
    await until('its jaws follow the trigger', async () => {
        const grip = await page.evaluate(() => pliant.tools.byId.get(3).grip);
        return Math.abs(grip - 0.55 / 0.95) < 1e-6; // 0.6 beyond 0.05 of dead zone
    });
    await page.evaluate(() => { fakePad = null; });
    await until('it is withdrawn', async () => !(await isActive(3)));
    assert.match(await page.locator('#second-text').textContent(), /withdrawn: the gamepad is gone/);
    await page.locator('#second').selectOption('');
});

test('charts_and_their_file_hold_the_numbers_of_the_contacts', options, async () => {
    await open('Forces');
    await page.evaluate(() => {
        window.seen = new Map();
        const { forces } = pliant, take = forces.takeContacts.bind(forces);
        forces.takeScene(pliant.tools.list);
        forces.takeContacts = (contacts, now) => {
            if (!forces.paused) for (const one of contacts) if (one.tool === 1) seen.set(one.utime, structuredClone(one));
            take(contacts, now);
        };
    });
    const m = await middle(page);
    await drag({ x: m.x - 20, y: m.y }, m);
    await until('there are forces', () => page.evaluate(() =>
        Array.from(seen.values()).filter(({ force }) => Math.hypot(...force) > 0.2).length > 20));
    // Not by the mouse, which holds the probe.
    await page.locator('#force-pause').evaluate((button) => button.click());
    await page.mouse.up();
    const { rows, contacts } = await page.evaluate(() => ({ rows: pliant.forces.csv(), contacts: Array.from(seen.values()) }));
    const lines = rows.trim().split('\n');
    assert.equal(lines.shift(), 'tool,time_s,depth_m,overlap_m,force_N,fx_N,fy_N,fz_N');
    const own = lines.map((line) => line.split(',').map(Number)).filter(([tool]) => tool === 1);
    assert.equal(own.length, contacts.length);
    let touch = null;
    contacts.forEach(({ position, normal, force, depth, contact }, k) => {
        const [fx, fy, fz] = contact ? force : [0, 0, 0];
        assert.deepEqual(own[k].slice(3), [contact ? depth : 0, Math.hypot(fx, fy, fz), fx, fy, fz]);
        touch = contact ? touch ?? { position, normal } : null;
        const way = contact ? touch.normal.reduce((sum, n, c) => sum - n * (position[c] - touch.position[c]), 0) : 0;
        assert(Math.abs(own[k][2] - way) <= 1e-15, `${own[k][2]} instead of ${way}`); // another order of sums
    });
    // Pressed on to the depth of the panel, 17 mm; its first contact is near the first touch.
    assert(own.some(([, , depth]) => depth > 5e-3), 'the depth is measured');
    const inked = (id) => page.locator(id).evaluate((canvas) => canvas.getContext('2d')
        .getImageData(0, 0, canvas.width, canvas.height).data.some((byte, k) => k % 4 === 0 && byte > 0xe0));
    assert(await inked('#force-time') && await inked('#force-depth'), 'the line of the probe is drawn');
    await page.locator('#force-time').scrollIntoViewIfNeeded();
    await shot('6-forces');
    // Held: what comes later is not kept.
    const count = await page.evaluate(() => pliant.forces.tools.get(1).series.count);
    await page.evaluate(() => pliant.forces.takeContacts([{ tool: 1, utime: 1, contact: true, depth: 0, force: [0, 0, 1],
        position: [0, 0, 0], normal: [0, 0, 1] }], 0));
    assert.equal(await page.evaluate(() => pliant.forces.tools.get(1).series.count), count);
    const download = page.waitForEvent('download', { timeout: PATIENCE });
    await page.locator('#force-save').click();
    assert.equal((await download).suggestedFilename(), 'forces.csv');
});

test('a_picture_holds_what_is_seen_and_a_video_shows_that_it_runs', options, async () => {
    const download = page.waitForEvent('download', { timeout: PATIENCE });
    await page.locator('#shoot').click();
    assert.match((await download).suggestedFilename(), /^work \d{4}-\d\d-\d\d \d\d-\d\d-\d\d\.png$/);
    const picture = await page.evaluate(async () => {
        const image = await createImageBitmap(pliant.capture.last.blob);
        const canvas = new OffscreenCanvas(image.width, image.height), context = canvas.getContext('2d');
        context.drawImage(image, 0, 0);
        const { data } = context.getImageData(0, 0, image.width, image.height);
        // Of the lower right quarter: the body is in the middle of the whole.
        const shades = new Set();
        for (let k = 2 * image.width * image.height; k < data.length; k += 4)
            if (k / 4 % image.width > image.width / 2) shades.add((data[k] << 16) | (data[k + 1] << 8) | data[k + 2]);
        const { clientWidth, clientHeight } = pliant.stage.canvas;
        return { times: [image.width / clientWidth, image.height / clientHeight], shades: shades.size,
            bar: pliant.capture.bar() };
    });
    // As finely as what stands still is drawn here, two pixels for one.
    assert.deepEqual(picture.times, [2, 2]);
    assert(picture.shades > 200, JSON.stringify(picture));
    assert(picture.bar.length > 0 && picture.bar.pixels > 50, JSON.stringify(picture.bar));
    if (await page.locator('#video').isDisabled()) {
        assert.match(await page.locator('#video').getAttribute('title'), /cannot/);
        return;
    }
    await page.locator('#video').click();
    await until('its length is shown', async () => (await page.locator('#video').textContent()) === 'Stop 0:01');
    const video = page.waitForEvent('download', { timeout: PATIENCE });
    await page.locator('#video').click();
    assert.match((await video).suggestedFilename(), /\.webm$/);
    const start = await page.evaluate(async () =>
        Array.from(new Uint8Array(await pliant.capture.last.blob.slice(0, 4).arrayBuffer())));
    assert.deepEqual(start, [0x1a, 0x45, 0xdf, 0xa3]); // EBML: what a WebM file begins with
    assert((await page.evaluate(() => pliant.capture.last.blob.size)) > 1000);
    assert.equal(await page.locator('#video').textContent(), 'Video');
});

test('late_ticks_are_told_with_what_helps', options, async () => {
    // Neither when a server is late nor by which stage can be chosen: a status as it would send it.
    await page.evaluate(() => {
        const { panel } = pliant;
        const take = panel.takeStatus.bind(panel);
        window.late = 0;
        panel.takeStatus = (status) => take({ ...status, late_ticks: window.late,
            stages: { forces: 2000, contact: 7000 } });
    });
    // On a busy machine it has been late before.
    await until('no advice is there', async () => !await page.locator('#advice').isVisible());
    await page.evaluate(() => { window.late = 3; });
    await until('the advice is there', () => page.locator('#advice').isVisible());
    assert.match(await page.locator('#advice').textContent(), /“contact” takes 7000 of 10000 µs: fewer or simpler tools/);
    await shot('7-late');
});

test('nothing_failed_in_the_page', options, () => {
    assert.deepEqual(browser.errors, []);
});
