// The page with a stand-in for pliant-web: what a real one cannot be made to send at will.

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { openBrowser } from './browser.mjs';
import { change, middle, PATIENCE, picture, setting, until, untilShown } from './live.mjs';
import { icoSphere, meshMessage, nodesMessage, restMessage, serve, statusMessage } from './mock.mjs';

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

test('without_grasper_pulling_sends_loads', options, async () => {
    await open();
    const m = await middle(page);
    await page.keyboard.press('2');
    await page.mouse.move(m.x, m.y);
    await page.mouse.down();
    await page.mouse.move(m.x + 60, m.y, { steps: 4 });
    const load = await until('a load is sent', () => session.got.findLast(({ type }) => type === 'load'));
    await page.mouse.up();
    assert.equal(load.body, 'ball');
    assert(Math.hypot(...load.force) > 0 && Math.hypot(...load.force) <= 2 + 1e-9, `${load.force} N`);
    // Where it takes hold the ball's surface is.
    assert(Math.abs(Math.hypot(...load.center) - 0.05) < 5e-3);
    await page.keyboard.press('1');
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

test('nothing_failed_in_the_page', options, () => {
    assert.deepEqual(browser.errors, []);
});
