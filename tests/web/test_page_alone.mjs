// SPDX-License-Identifier: MIT
// The page with a stand-in for pliant-web: what a real one cannot be made to send at will.

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { openBrowser } from './browser.mjs';
import { change, middle, PATIENCE, picture, setting, until, untilShown } from './live.mjs';
import { elementsMessage, errorMapMessage, icoSphere, meshMessage, nodesMessage, restMessage, serve, statusMessage } from './mock.mjs';

const { page: folder, out } = setting();
const options = { timeout: 3 * PATIENCE };
const SEEN = 8; // as in test_page.mjs
const ball = icoSphere(3, 0.05);
const COUNT = ball.position.length / 3;
const SCENE = { type: 'scene', name: 'alone', bodies: [{ name: 'ball', model: 'surface' }], tools: [], describe: '' };

let server, browser, page, session, sessions = 0;
let greeting = {}, scene = SCENE;

before(async () => {
    server = await serve(folder, (opened) => {
        sessions++;
        session = opened;
        session.text({ type: 'hello', version: '0', prefix: 'PLIANT', read_only: false, rate_hz: 60, textures: [],
            ...greeting });
        session.text(scene);
        session.text({ type: 'link', daemon: true, age: 0 });
    });
    browser = await openBrowser({ width: 900, height: 600 });
    page = browser.page;
}, options);

after(async () => {
    await browser?.close();
    await server?.close();
});

// A page anew, with the ball in it unless told otherwise.
async function open({ mesh = ball, hello = {}, what = SCENE } = {}) {
    greeting = hello;
    scene = what;
    const seen = sessions;
    await page.goto(server.url);
    await until('the page connects', () => sessions > seen);
    if (!mesh) return;
    session.text(statusMessage(scene));
    session.binary(meshMessage(0, 1, mesh));
    session.binary(nodesMessage(0, 1, mesh.position));
    await session.round();
    await untilShown(page);
}

/** Presses the mouse at a point of the picture and drags it so many pixels to the right. */
async function drag(from, right) {
    await page.mouse.move(from.x, from.y);
    await page.mouse.down();
    await page.mouse.move(from.x + right, from.y, { steps: 4 });
}

// The ball with these changes; settles into one picture.
async function shows(position, topology = 1) {
    session.binary(nodesMessage(0, topology, position));
    await session.round();
    return picture(page);
}

const bulge = () => {
    const position = ball.position.slice();
    for (let i = 0; i < position.length; i += 3) if (position[i + 2] > 0) position[i + 2] *= 1.6;
    return position;
};

test('nodes_of_another_mesh_are_not_drawn', options, async () => {
    await open();
    const before = await picture(page);
    assert(change(await shows(bulge(), 7), before) < 1, 'of an unknown topology');
    session.binary(nodesMessage(0, 1, bulge().subarray(0, 30)));
    await session.round();
    assert(change(await picture(page), before) < 1, 'too few');
    assert(change(await shows(bulge(), 1), before) > SEEN, 'their own are');
});

test('messages_out_of_order_or_broken_leave_the_page_as_it_was', options, async () => {
    await open();
    const before = await picture(page);
    const wrong = meshMessage(0, 2, ball);
    new Int32Array(wrong, 24, 1)[0] = COUNT; // a triangle's node that is not there
    session.binary(wrong);
    session.binary(new ArrayBuffer(3));
    session.binary(nodesMessage(0, 1, ball.position).slice(0, 100));
    session.binary(new Uint32Array([9, 0, 1, 5, 0, 0]).buffer);
    session.binary(nodesMessage(5, 1, ball.position)); // no such body
    session.binary(nodesMessage(0, 2, bulge()));
    session.text({ type: 'something new' });
    await session.round();
    assert.equal(await page.evaluate(() => window.pliant.link.refused), 4);
    assert(change(await picture(page), before) < 1);
    assert(change(await shows(bulge()), before) > SEEN, 'it goes on');
});

test('free_slots_are_hidden', options, async () => {
    // Free nodes at the far end of the world, free triangles between.
    const position = new Float32Array(3 * (COUNT + 2)).fill(9);
    position.set(ball.position);
    const triangle = new Int32Array(ball.triangle.length + 6);
    triangle.set(ball.triangle, 6);
    const id = Int32Array.from({ length: COUNT + 2 }, (_, i) => (i < COUNT ? i : -1));
    await open();
    const before = await picture(page);
    session.binary(meshMessage(0, 2, { position, triangle, id }));
    assert(change(await shows(position, 2), before) < 1);
});

test('rest_message_says_what_is_red', options, async () => {
    await open();
    await page.locator('#red').check();
    await page.locator('#threshold').fill('50'); // a sixteenth of the size, 11 mm
    const plain = await picture(page);
    assert(change(await shows(bulge()), plain) > SEEN, 'displaced from where it was first seen');
    await shows(ball.position);
    session.binary(restMessage(0, 1, bulge()));
    await session.round();
    assert(change(await picture(page), plain) > SEEN, 'displaced from where it was told to rest');
    await page.screenshot({ path: join(out, '20-red.png') });
});

test('image_lies_on_the_body_by_its_texture_coordinates', options, async () => {
    const picturePath = '**/texture/ball';
    // 2 x 2 pixels: red, green, blue, white.
    const svg = '<svg xmlns="http://www.w3.org/2000/svg" width="64" height="64"><rect width="64" height="64" fill="#0c0"/>' +
        '<rect width="32" height="32" fill="#d00"/><rect x="32" y="32" width="32" height="32" fill="#00d"/></svg>';
    await page.route(picturePath, (route) => route.fulfill({ contentType: 'image/svg+xml', body: svg }));
    await open({ hello: { textures: ['ball'] } });
    const uv = new Float32Array(2 * COUNT);
    for (let i = 0; i < COUNT; i++) {
        uv[2 * i] = 0.5 + 10 * ball.position[3 * i];
        uv[2 * i + 1] = 0.5 + 10 * ball.position[3 * i + 2];
    }
    session.binary(restMessage(0, 1, ball.position, uv));
    await session.round();
    await until('the image has all its colours', async () => {
        const { tiles } = await picture(page);
        const most = [0, 0, 0];
        for (let i = 0; i < tiles.length; i += 3)
            for (let k = 0; k < 3; k++)
                most[k] = Math.max(most[k], tiles[i + k] - Math.max(tiles[i + (k + 1) % 3], tiles[i + (k + 2) % 3]));
        return most.every((excess) => excess > 40);
    });
    await page.screenshot({ path: join(out, '21-image.png') });
    await page.unroute(picturePath);
});

test('levels_pieces_and_cut_faces_have_colours', options, async () => {
    const half = (value, other) => (_, i) => (ball.position[3 * i] > 0 ? value : other);
    const of = { length: COUNT };
    const mesh = { ...ball, level: Int8Array.from(of, half(3, 0)), piece: Int32Array.from(of, half(1, 0)),
        origin: Int32Array.from(of, (_, i) => (ball.position[3 * i] > 0 ? 0 : i)) };
    await open({ mesh });
    const plain = await picture(page);
    for (const colouring of ['1', '2']) {
        await page.locator('#colouring').selectOption(colouring);
        const seen = await picture(page);
        assert(change(seen, plain) > SEEN);
        assert(seen.tiles.some((x, i) => i % 3 === 0 && Math.abs(seen.tiles[i + 2] - x) > 40), 'two colours');
    }
    await page.locator('#colouring').selectOption('0');
    await page.locator('#lips').check();
    assert(change(await picture(page), plain) > SEEN, 'faces at cuts');
});

test('page_draws_only_when_something_changed', options, async () => {
    await open();
    await picture(page);
    const frames = () => page.evaluate(() => window.pliant.stage.frames);
    await until('it has drawn all there is', async () => {
        const before = await frames();
        await new Promise((resolve) => setTimeout(resolve, 300));
        return (await frames()) === before;
    });
    const before = await frames();
    for (let i = 0; i < 5; i++) {
        session.text(statusMessage(SCENE));
        await session.round(); // answered all the same
    }
    assert.equal(await frames(), before);
    await shows(bulge());
    assert((await frames()) > before);
});

const contactOf = (tool, force) => ({ tool, contact: true, position: [0, 0, 0.05], force, torque: [0, 0, 0],
    point: [0, 0, 0.05], normal: [0, 0, 1], depth: 0.001, pose_utime: 0, utime: 0 });

// Pixels beside the ball's middle that a drag goes.
const PULL = 60;

test('pulling_sends_poses_of_closed_jaws_and_never_a_load', options, async () => {
    await open({ what: { ...SCENE, tools: [GRASPER] } });
    const m = await middle(page);
    await page.keyboard.press('2');
    await drag(m, PULL);
    await until('it says that nothing is held', async () => /^grasper 6 closed on nothing/.test(await hint()));
    session.text({ type: 'contact', tools: [contactOf(6, [0, 0, -1])] });
    await session.round();
    await until('it pulls', async () => /^Pulling by grasper 6/.test(await hint()));
    await page.mouse.up();
    const poses = await until('they open', () => session.got.at(-1)?.active === false && session.got);
    assert(poses.every(({ type, tool }) => type === 'tool' && tool === 6), 'nothing else is sent');
    const held = poses.slice(0, -1), [first] = held, last = held.at(-1);
    assert(held.every(({ active, grip }) => active && grip === 1), 'closed from the first one on');
    // Where the pointer takes hold the ball's surface is: its faces are within 0.2 mm of it, its radius is 50 mm.
    assert(Math.abs(Math.hypot(...first.position) - 0.05) < 2e-4, `${first.position}`);
    assert(Math.hypot(...last.position.map((x, k) => x - first.position[k])) > 5e-3, 'they follow the pointer');
    await page.keyboard.press('1');
});

test('a_scene_without_the_tool_says_which_line_adds_it', options, async () => {
    await open();
    const m = await middle(page);
    // A twentieth, and for the shaft half, of the ball's diagonal of 0.17 m.
    for (const [key, kind, shaft] of [['2', 'grasper', ''], ['1', 'probe', 'to = \\[0.0, 0.0, 0.087\\];  ']]) {
        await page.keyboard.press(key);
        await drag(m, PULL);
        await page.mouse.up();
        assert.match(await hint(), new RegExp(`^This scene has no ${kind}\\. Add to it: tools = \\( { id = 1;  ` +
            `kind = "${kind}";  capsules = \\( { ${shaft}radius = 0.0087; } \\); } \\);$`));
    }
    assert.deepEqual(session.got, [], 'the drags turned the view');
});

test('pose_is_repeated_while_the_button_is_held', options, async () => {
    await open({ what: { ...SCENE, tools: [{ id: 4, kind: 'probe', max_force: 3.3,
        capsules: [{ from: [0, 0, 0], to: [0, 0, 0.1], radius: 0.005 }] }] } });
    const m = await middle(page);
    await page.mouse.move(m.x, m.y);
    await page.mouse.down();
    const poses = () => session.got.filter(({ type }) => type === 'tool');
    await until('it comes again and again', () => poses().length > 20);
    await page.mouse.up();
    const last = await until('it is withdrawn', () => poses().find(({ active }) => !active));
    assert.equal(last.tool, 4);
    for (const { orientation } of poses())
        assert(Math.abs(Math.hypot(...orientation) - 1) < 1e-6, 'a unit quaternion');
});

const GRASPER = { id: 6, kind: 'grasper', max_force: 3.3, capsules: [{ from: [0, 0, 0], radius: 0.009 }] };
const PROBE = { id: 4, kind: 'probe', max_force: 3.3, capsules: [{ from: [0, 0, 0], to: [0, 0, 0.1], radius: 0.005 }] };
const hint = () => page.locator('#hint').textContent();

// Drags across the ball with the knife; `reply(cut)` is what the daemon says to each cut.
async function cutAcross(reply) {
    session.onMessage = (message) => {
        if (message.type === 'cut') session.text({ type: 'reply', id: message.id, step: 1, nodes_added: 0, pieces: 1, ...reply(message) });
    };
    const m = await middle(page);
    await page.keyboard.press('3');
    await page.mouse.move(m.x - 120, m.y);
    await page.mouse.down();
    await page.mouse.move(m.x + 120, m.y, { steps: 12 });
    await page.mouse.up();
}

test('a_stroke_tells_what_came_of_its_cuts_not_that_they_were_sent', options, async () => {
    const why = "body 'ball' is not cuttable";
    await open();
    await cutAcross(() => ({ ok: false, separated: 0, text: why }));
    await until('it says that nothing was cut', async () => (await hint()) === `Nothing was cut: ${why}`);
    // One line with its number, not one a cut.
    const cuts = session.got.filter(({ type }) => type === 'cut').length;
    await until('events are told once', async () => (await page.locator('#events').innerText()) === `refused ${why} ×${cuts}`);
    let count = 0;
    await cutAcross(() => (count++ ? { ok: true, separated: 3, text: 'cut' } : { ok: false, separated: 0, text: why }));
    await until('both are told', async () =>
        (await hint()) === `${3 * (count - 1)} links or faces were cut; 1 of ${count} strokes were refused: ${why}`);
    await cutAcross(() => ({ ok: true, separated: 0, text: 'the stroke met no tissue' }));
    await until('a drag beside is told', async () => /^Nothing was cut: the drag met/.test(await hint()));
    await page.keyboard.press('1');
});

test('a_press_tells_how_deep_it_goes', options, async () => {
    await open({ what: { ...SCENE, tools: [PROBE] } });
    const m = await middle(page);
    await page.mouse.move(m.x, m.y);
    await page.mouse.down();
    // A tenth of the ball's diagonal of 0.17 m.
    await until('the whole depth is told', async () => 
        /^Pressing: (17\.\d mm) of \1 past the first touch, but the probe touches nothing/.test(await hint()));
    session.text({ type: 'contact', tools: [contactOf(4, [0, 0, 1])] });
    await session.round();
    await until('it touches', async () => /^Pressing: (17\.\d mm) of \1 past the first touch · wheel/.test(await hint()));
    await page.mouse.wheel(0, 100);
    await until('the wheel changes it', async () => /of 13\.\d mm/.test(await hint()));
    await page.mouse.up();
    assert.match(await hint(), /^Drag on tissue/);
});

test('figures_have_their_units', options, async () => {
    const step = (step_us) => async () => {
        session.text(statusMessage(SCENE, { step_us }));
        await session.round();
        return page.locator('#step-text').textContent();
    };
    await open();
    assert.equal(await step([1100, 1400, 1700, 1780])(), '1.10 / 1.40 / 1.78 ms of 1.00 ms');
    assert.equal(await step([6, 11, 50, 64])(), '6 / 11 / 64 µs of 1.00 ms');
    // A status in whose time there was no step says nothing of steps, nor of the pace.
    session.text(statusMessage(SCENE, { step_us: [0, 0, 0, 0], real_time_factor: 0, time: 2 }));
    await session.round();
    assert.equal(await page.locator('#step-text').textContent(), '6 / 11 / 64 µs of 1.00 ms');
    assert.equal(await page.locator('#clock').textContent(), '2.0 s · 1.00× real time');
    // A piece that flies off: 147 m, not 147317.5 mm.
    const far = statusMessage(SCENE);
    far.body[0].max_displacement = 147.3175;
    session.text(far);
    await session.round();
    assert.equal(await page.locator('[data-field=moved]').textContent(), '147.3 m');
});

test('the_legend_shows_the_levels_that_there_are', options, async () => {
    const legend = async () => page.locator('#legend span').allTextContents();
    await open();
    await page.locator('#colouring').selectOption('1');
    await until('there is one', async () => (await legend()).join() === '0: nothing is refined now');
    const level = Int8Array.from({ length: COUNT }, (_, i) => i % 3);
    session.binary(meshMessage(0, 2, { ...ball, level }));
    await shows(ball.position, 2);
    await until('there are three', async () => (await legend()).join() === '0,1,2');
    await page.locator('#colouring').selectOption('0');
});

test('a_daemon_that_is_gone_is_said_to_be_gone', options, async () => {
    await open({ what: { ...SCENE, tools: [PROBE] } });
    assert(await page.locator('#state').isVisible());
    session.text({ type: 'link', daemon: false, age: 3.2 });
    await session.round();
    assert.match(await page.locator('#notice').textContent(), /^pliantd is gone: .* 3 s\. What you see is old\./);
    assert.equal(await page.locator('#state').isVisible(), false, 'nothing is said to run');
    for (const id of ['pause', 'resume', 'step', 'reset']) assert(await page.locator(`#${id}`).isDisabled(), id);
    // A drag turns the view; nothing is kept for the next daemon.
    const m = await middle(page);
    await drag(m, 30);
    assert.match(await hint(), /^pliantd is silent/);
    await page.mouse.up();
    await page.keyboard.press('p');
    assert.deepEqual(session.got, []);
    session.text({ type: 'link', daemon: true, age: 0 });
    await session.round();
    assert.equal(await page.locator('#notice').isVisible(), false);
    assert.equal(await page.locator('#state').textContent(), 'running');
});

test('nothing_of_the_last_scene_or_recording_stays_in_the_next', options, async () => {
    const blade = { id: 4, kind: 'blade', edge: [[0, 0, 0], [0, 0, 0.15]] };
    await open({ what: { ...SCENE, tools: [PROBE, blade] } });
    session.text(statusMessage(SCENE, { time: 500, state: 'paused' }));
    session.text({ type: 'event', kind: 'tie', text: 'tie 1: pin of 3 nodes of body ball', body: 'ball', step: 1, utime: 1 });
    session.text({ type: 'contact', tools: [contactOf(4, [0, 0, 1])] });
    session.text({ type: 'recording', parts: 1, start: 0, end: 9, frame_time: 0.1, marks: [], tools: [], left_out: 0 });
    session.text({ type: 'playback', playing: true, loop: false, from: 0, to: 9, time: 4, speed: 1, step: 1 });
    await session.round();
    const seen = () => page.evaluate(() => ({ items: document.querySelectorAll('#events li, #ties li').length,
        figures: ['state', 'clock', 'step-text', 'counts'].map((id) => document.getElementById(id).textContent).join(''),
        recorded: pliant.timeline.recorded, marks: pliant.timeline.marks.length, curve: pliant.timeline.curve.length,
        force: pliant.forces.csv().split('\n').length - 2 + pliant.timeline.strongest }));
    assert.notDeepEqual(await seen(), NOTHING);
    session.text({ ...SCENE, name: 'next' });
    await session.round();
    assert.deepEqual(await seen(), NOTHING);
    // The bar of time lives by the new clock.
    for (const time of [0.1, 0.2, 0.3]) session.text(statusMessage(SCENE, { time }));
    await session.round();
    assert.deepEqual(await page.evaluate(() => [pliant.timeline.start, pliant.timeline.time]), [0.1, 0.3]);
});
const NOTHING = { items: 0, figures: '–', recorded: false, marks: 0, curve: 0, force: 0 };

test('a_grasp_that_slips_and_a_stroke_of_a_blade_say_what_came_of_them', options, async () => {
    const blade = { id: 4, kind: 'blade', edge: [[0, 0, 0], [0, 0, 0.15]] };
    const event = (kind, text) => session.text({ type: 'event', kind, text, body: 'ball', step: 1, utime: 1 });
    await open({ what: { ...SCENE, tools: [GRASPER, blade] } });
    const m = await middle(page);
    await page.keyboard.press('2');
    await drag(m, PULL);
    event('grasp', 'tool 6 grasped 5 nodes');
    event('slipped', 'tool 7 lost what it held'); // another one's
    session.text({ type: 'contact', tools: [contactOf(6, [0, 0, -1])] });
    await until('it pulls', async () => /^Pulling by grasper 6/.test(await hint()));
    event('slipped', 'tool 6 lost what it held');
    await until('it has slipped', async () => /^The tissue slipped out of grasper 6/.test(await hint()));
    await page.mouse.up();
    assert.match(await hint(), /^The tissue slipped/, 'that stays until the next drag');
    await page.keyboard.press('3');
    for (const [kind, text, says] of [
        ['cut', "tool 4, stroke ended: body 'ball': 7 links severed, 6 nodes added, 2 pieces",
            /^Cut: ball: 7 links, in 2 pieces now$/],
        ['cut_refused', "tool 4: body 'ball' may need 9 more nodes", /^Nothing was cut: body 'ball' may need 9 more nodes$/],
        ['', '', /^Nothing was cut: blade 4 met no tissue that is cuttable$/]]) {
        await drag(m, PULL);
        await until('it cuts', async () => /^Cutting with blade 4/.test(await hint()));
        await page.mouse.up();
        if (kind) event(kind, text);
        await until(`what came of it is told: ${says}`, async () => says.test(await hint()));
    }
    await page.keyboard.press('1');
});

test('a_stroke_says_all_that_was_cut_and_why_not_more', options, async () => {
    const blade = { id: 4, kind: 'blade', edge: [[0, 0, 0], [0, 0, 0.03]] };
    const event = (kind, text) => session.text({ type: 'event', kind, text, body: 'ball', step: 1, utime: 1 });
    await open({ what: { ...SCENE, tools: [blade] } });
    const m = await middle(page);
    await page.keyboard.press('3');
    await drag(m, PULL);
    event('jump', 'tool 4: ignored a pose 0.1 m away: no hand is so fast'); // one of many: no matter
    event('stopped', 'for 0.300 s: these ticks are skipped, all tools withdrawn');
    event('cut', "tool 4, stroke ended: body 'ball': 7 links severed");
    await page.mouse.up();
    event('cut', "tool 4, stroke ended: body 'other': 2 links severed");
    const says = "Cut: ball: 7 links; other: 2 links. Not on all of the way: " +
        'the server stood still for 0.300 s: these ticks are skipped, all tools withdrawn';
    await until('both bodies, and the gap', async () => (await hint()) === says);
    await page.keyboard.press('1');
});

test('a_blade_of_a_page_that_stalls_is_sent_along_the_pointers_whole_way', options, async () => {
    const blade = { id: 4, kind: 'blade', edge: [[0, 0, 0], [0, 0, 0.03]] };
    await open({ what: { ...SCENE, tools: [blade] } });
    const m = await middle(page);
    await page.keyboard.press('3');
    await page.mouse.move(m.x - 100, m.y);
    await page.mouse.down();
    session.got.length = 0;
    // Busy while the pointer goes along a corner.
    const busy = page.evaluate(() => { for (const end = performance.now() + 400; performance.now() < end;); });
    const moves = [];
    for (let i = 1; i <= 20; i++) {
        await new Promise((resolve) => setTimeout(resolve, 15)); // a hand's pace: events have times
        moves.push(page.mouse.move(m.x - 100 + 10 * Math.min(i, 10), m.y - 10 * Math.max(i - 10, 0)));
    }
    await Promise.all([busy, ...moves]);
    await page.mouse.up();
    const poses = await until('it is withdrawn', () => {
        const list = session.got.filter(({ type, tool }) => type === 'tool' && tool === 4);
        return list.length && !list.at(-1).active ? list : null;
    });
    // Where the poses are on the picture.
    const way = await page.evaluate((list) => list.map((place) => {
        const { stage } = pliant, point = stage.center.clone().fromArray(place), out = stage.center.clone();
        stage.onScreen(point, out);
        const { left, top } = stage.canvas.getBoundingClientRect();
        return { x: out.x + left, y: out.y + top };
    }), poses.map(({ position }) => position));
    const nearest = (x, y) => Math.min(...way.map((p) => Math.hypot(p.x - x, p.y - y)));
    // The tip is below the surface and not on the pointer's line of sight: a few pixels.
    assert(nearest(m.x, m.y) < 16, `the corner was left out: ${nearest(m.x, m.y)} pixels`);
    assert(nearest(m.x, m.y - 100) < 16, 'the end was left out');
    assert(poses.every(({ time }, i) => i === 0 || time >= poses[i - 1].time), 'times grow');
    await page.keyboard.press('1');
});

test('a_drag_with_a_remover_holds_its_pedal_down', options, async () => {
    const remover = { id: 9, kind: 'remover', removes_by: 'suction', mouth: { from: [0, 0, 0], to: [0, 0, 0], radius: 0.004 } };
    await open({ what: SCENE });
    assert.equal(await page.locator('#remove-mode').isVisible(), false, 'there is none');
    await open({ what: { ...SCENE, tools: [PROBE, remover] } });
    const m = await middle(page);
    await page.keyboard.press('5');
    assert.equal(await page.locator('#tool').inputValue(), '9');
    await drag(m, 20);
    await until('it is told', async () => /^remover 9 takes tissue away \(suction\)/.test(await hint()));
    const { grip, active } = session.got.filter(({ type }) => type === 'tool').at(-1);
    assert.deepEqual({ grip, active }, { grip: 1, active: true });
    await page.mouse.up();
    await until('the pedal is up', () => session.got.at(-1).grip === 0 && !session.got.at(-1).active);
    session.text({ type: 'event', kind: 'remove', text: "tool 9: 4 cells of body 'ball' removed, 171.5 mm3, 0.18 g",
        body: 'ball', step: 1, utime: 1 });
    await until('it is told what came of it', async () =>
        (await hint()) === 'Removed: ball: 171.5 mm³ (0.18 g)');
    session.text({ type: 'event', kind: 'reset', text: '', body: '', step: 1, utime: 1 });
    await until('what is undone is no longer told', async () => /^Drag on tissue/.test(await hint()));
    await page.keyboard.press('1');
});

test('no_daemon_is_said_to_be_gone_that_was_not_there', options, async () => {
    const link = (daemon) => session.text({ type: 'link', daemon, age: 0 });
    scene = { type: 'something else' };
    await page.goto(server.url);
    await until('the page waits', async () => { link(false); return (await page.locator('#link').textContent()) === 'no daemon yet'; });
    assert.equal(await page.locator('#foot').isVisible(), false, 'there is nothing to press');
    session.text(SCENE);
    link(true);
    link(false);
    await until('now it is gone', async () => (await page.locator('#link').textContent()) === 'daemon gone');
});

// Fingers at points of the page: [[x, y], ...]; as many as before move, others come or go.
async function fingers(client, points, type = 'touchStart') {
    await client.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
}

test('on_a_phone_fingers_press_turn_and_zoom_and_nothing_covers_the_body', options, async () => {
    const phone = await openBrowser({ width: 390, height: 844, touch: true }), mouse = page;
    try {
        page = phone.page;
        await open({ what: { ...SCENE, tools: [PROBE] } });
        await page.screenshot({ path: join(out, '22-phone.png') });
        assert.match(await hint(), /^Touch tissue and hold/);
        const button = page.locator('#panel-button');
        for (const opened of ['true', 'false']) {
            // The body is between the bars, and its middle in the middle of what they leave.
            const [high, low] = await page.evaluate(() => [...pliant.bodies[0].position.keys()].filter((i) => i % 3 === 0)
                .map((i) => pliant.stage.center.clone().fromArray(pliant.bodies[0].position, i))
                .map((point) => pliant.stage.onScreen(point, point) && point.y)
                .reduce(([least, most], y) => [Math.min(least, y), Math.max(most, y)], [Infinity, -Infinity]));
            const header = await page.locator('header').boundingBox(), foot = await page.locator('#foot').boundingBox();
            assert(high > header.y + header.height && low < foot.y, `${high} to ${low}`);
            // By symmetry; the perspective moves the outline of a ball by some hundredths of its height.
            assert(Math.abs(high + low - header.height - foot.y) < 0.1 * (low - high));
            await button.tap({ timeout: PATIENCE }); // fails where something lies over it
            assert.equal(await button.getAttribute('aria-expanded'), opened);
            await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
        }
        for (const id of ['pause', 'reset', 'home', 'record', 'panel-button'])
            assert((await page.locator(`#${id}`).evaluate((node) => node.hidden ? 44 : node.offsetHeight)) >= 44, id);
        const client = await page.context().newCDPSession(page), m = await middle(page);
        const view = () => page.evaluate(() => pliant.stage.camera.position.distanceTo(pliant.stage.controls.target));
        const poses = () => session.got.filter(({ type }) => type === 'tool');
        const before = await view();
        await fingers(client, [[m.x, m.y]]);
        await until('it presses', () => poses().some(({ active }) => active));
        assert.match(await hint(), /depth: in the panel$/);
        await fingers(client, [[m.x, m.y], [m.x + 40, m.y]]);
        await until('a second finger ends that', () => poses().at(-1).active === false);
        for (const way of [60, 90, 120]) await fingers(client, [[m.x - way / 2, m.y], [m.x + way, m.y]], 'touchMove');
        await until('they zoom', async () => (await view()) < 0.8 * before);
        await fingers(client, [], 'touchEnd');
        assert.deepEqual(phone.errors, []);
    } finally {
        page = mouse;
        await phone.close();
    }
});

test('the_ledger_shows_amounts_and_regions_that_were_not_kept', options, async () => {
    const ledger = { type: 'ledger', step: 1, time: 0.1, body: [{ name: 'ball', solid: true, cut: 2e-4, torn: 0 }],
        tissue: [{ body: 'ball', name: 'liver', density: 1060, at_load: 1e-4, attached: 8e-5, cut_off: 1.95e-5, removed: 5e-7,
            coagulated: 0 }],
        region: [{ name: 'tumour', keep: false, touched: false, margin: 0.005, distance: 0.003, time: 0, body: 'ball', by: 'cut' },
            { name: '<b>vessel', keep: true, touched: false, margin: 0, distance: -1, time: 0, body: '', by: '' }] };
    await open();
    assert(await page.locator('#ledger').evaluate((node) => node.hidden));
    session.text(ledger);
    await session.round();
    const rows = (id) => page.locator(`#${id} tr`).evaluateAll((lines) => lines.map((line) =>
        [...line.children].map(({ textContent }) => textContent).join(' | ') + (line.className ? ` ${line.className}` : '')));
    assert.deepEqual(await rows('ledger-tissues'), ['liver | 80.00 | 19.50 | 0.500']);
    assert.equal(await page.locator('#ledger-unit').textContent(), 'tissue, cm³');
    assert.deepEqual(await rows('ledger-regions'),
        ['tumour | 3.00 mm, cut | ≥ 5.00 mm bad', '<b>vessel | nothing cut | keep']);
    assert.equal(await page.locator('#ledger-sections').textContent(), '2.00 cm² cut');
    Object.assign(ledger.region[1], { touched: true, distance: 0, by: 'removal' });
    session.text(ledger);
    await session.round();
    assert.equal((await rows('ledger-regions'))[1], '<b>vessel | removal inside | keep bad');
    session.text({ ...SCENE, name: 'another' });
    await session.round();
    assert(await page.locator('#ledger').evaluate((node) => node.hidden));
});

test('errors_are_figures_in_the_panel_and_bars_beside_the_forces', options, async () => {
    const probe = { id: 4, kind: 'probe', max_force: 2, capsules: [{ from: [0, 0, 0], to: [0, 0, 0], radius: 0.005 }] };
    const errors = { type: 'errors', step: 9, time: 0.009,
        body: [{ name: 'ball', space: 1.2e-4, steps: 1e-6, total: 1.21e-4, relative: 0.034, age: 24 },
            { name: '<b>skin', space: -1, steps: -1, total: -1, relative: -1, age: -1 }],
        tool: [{ tool: 4, force: 0.5, error: 0.06, share: 0.12 }] };
    const contact = { type: 'contact', tools: [{ tool: 4, contact: true, position: [0, -0.052, 0], force: [0, -0.5, 0],
        torque: [0, 0, 0], point: [0, -0.05, 0], normal: [0, -1, 0], depth: 0.003, pose_utime: 1, utime: 1 }] };
    await open({ what: { ...SCENE, tools: [probe] } });
    assert(await page.locator('#errors').evaluate((node) => node.hidden));
    const rows = (id) => page.locator(`#${id} tr`).evaluateAll((lines) => lines.map((line) =>
        [...line.children].map(({ textContent }) => textContent).join(' | ')));
    session.text(errors);
    session.text(contact);
    await session.round();
    assert.deepEqual(await rows('errors-bodies'), ['ball | 0.12 mm | 3.4 %', '<b>skin | ? | ?']);
    assert.deepEqual(await rows('errors-tools'), ['probe 4 | 0.50 N |  | ± 0.060 N, 12 %']);
    const bar = page.locator('#errors-tools .error-bar');
    assert.equal(await bar.evaluate((node) => node.style.getPropertyValue('--error')), '12.0%');
    assert(await bar.evaluate((node) => node.classList.contains('warm')));
    const label = page.locator('.newtons');
    await until('the label has it', async () => (await label.textContent()) === '0.50 N ± 0.060 N, 12 %');
    assert(await label.locator('.error-bar').isVisible());
    await page.screenshot({ path: join(out, 'errors.png') });
    // What is not known has no bar; a tool that is not listed has no error.
    Object.assign(errors.tool[0], { error: -1, share: -1 });
    session.text(errors);
    contact.tools[0].force = [0, -0.6, 0];
    contact.tools[0].utime = 2;
    session.text(contact);
    await session.round();
    assert.deepEqual(await rows('errors-tools'), ['probe 4 | 0.50 N |  | ?']);
    await until('the label has none', async () => (await label.textContent()) === '0.60 N');
    assert(!await label.locator('.error-bar').isVisible());
    session.text({ ...SCENE, name: 'another' });
    await session.round();
    assert(await page.locator('#errors').evaluate((node) => node.hidden));
});

test('a_body_is_coloured_by_its_error_where_that_is_told', options, async () => {
    await open();
    const option = page.locator('#error-colours');
    assert(await option.evaluate((node) => node.hidden && node.disabled));
    const before = await picture(page);
    // The upper half errs.
    const share = Uint8Array.from({ length: COUNT }, (_, i) => (ball.position[3 * i + 2] > 0 ? 255 : 0));
    session.binary(errorMapMessage(0, 1, share));
    session.binary(errorMapMessage(0, 1, share).slice(0, 40)); // cut off
    await session.round();
    assert.equal(await page.evaluate(() => window.pliant.link.refused), 1);
    assert(!await option.evaluate((node) => node.hidden));
    assert(change(await picture(page), before) < 1, 'only if it is chosen');
    await page.selectOption('#colouring', '3');
    const coloured = await picture(page);
    assert(change(coloured, before) > SEEN);
    assert(await page.locator('#error-legend').isVisible());
    await page.screenshot({ path: join(out, 'error-map.png') });
    // Another map is another picture, one of another mesh is not; the mesh may change before the next map comes.
    session.binary(errorMapMessage(0, 1, share.map((value) => 255 - value)));
    await session.round();
    const turned = await picture(page);
    assert(change(turned, coloured) > SEEN);
    session.binary(meshMessage(0, 2, ball));
    session.binary(nodesMessage(0, 2, ball.position));
    await session.round();
    assert(change(await picture(page), turned) < 1, 'nodes keep their share');
    // Of a scene that tells none the choice goes.
    session.text({ ...SCENE, name: 'another' });
    await session.round();
    assert.equal(await page.locator('#colouring').inputValue(), '0');
    assert(await option.evaluate((node) => node.hidden));
});

test('elements_are_drawn_where_they_are_told', options, async () => {
    await open();
    const option = page.locator('#element-colours');
    assert(await option.evaluate((node) => node.hidden && node.disabled));
    const before = await picture(page);
    // One element everywhere, then each square its own on the upper half.
    const squares = ball.triangle.length / 6;
    const one = elementsMessage(0, 1, [0, 0, 1], new Uint16Array(squares).fill(7), new Uint8Array(squares).fill(2));
    const upper = Array.from({ length: squares }, (_, q) => ball.position[3 * ball.triangle[6 * q] + 2] > 0);
    const fine = elementsMessage(0, 1, [300, 0, 1], upper.map((up, q) => (up ? 100 + q : 7)), upper.map((up) => (up ? 0 : 2)));
    session.binary(one);
    session.binary(one.slice(0, 60)); // cut off
    await session.round();
    assert.equal(await page.evaluate(() => window.pliant.link.refused), 1);
    assert(!await option.evaluate((node) => node.hidden));
    assert(change(await picture(page), before) < 1, 'only if it is chosen');
    await page.selectOption('#colouring', '4');
    const drawn = () => page.evaluate(() => pliant.bodies[0].elements.lines.geometry.drawRange.count);
    const large = await picture(page);
    assert(change(large, before) > SEEN);
    assert.equal(await drawn(), 0, 'one element has no borders');
    const legend = () => page.locator('#elements-legend span').allTextContents();
    assert.deepEqual(await legend(), ['1 cell: 0', '2 cells: 0', '4 cells: 1']);
    session.binary(fine);
    await session.round();
    const divided = await picture(page);
    assert(change(divided, large) > SEEN);
    assert.deepEqual(await legend(), ['1 cell: 300', '2 cells: 0', '4 cells: 1']);
    // A border is drawn once, between squares of different elements, and no square's diagonal is.
    const sides = new Map();
    for (let i = 0; i < ball.triangle.length; i++) {
        const a = ball.triangle[i], b = ball.triangle[i % 3 === 2 ? i - 2 : i + 1], q = Math.floor(i / 6);
        const key = `${Math.min(a, b)} ${Math.max(a, b)}`;
        sides.set(key, [...sides.get(key) ?? [], q]);
    }
    const borders = [...sides.values()].filter(([p, q]) => p !== q && (upper[p] || upper[q])).length;
    assert.equal(await drawn(), 2 * borders);
    await page.screenshot({ path: join(out, 'elements.png') });
    // Elements stay when the mesh changes, until the next message.
    session.binary(meshMessage(0, 2, ball));
    session.binary(nodesMessage(0, 2, ball.position));
    await session.round();
    assert(change(await picture(page), divided) < 1);
    // Of a scene that tells none the choice goes.
    session.text({ ...SCENE, name: 'another' });
    await session.round();
    assert.equal(await page.locator('#colouring').inputValue(), '0');
    assert(await option.evaluate((node) => node.hidden));
});

test('nothing_failed_in_the_page', options, () => {
    assert.deepEqual(browser.errors, []);
});
