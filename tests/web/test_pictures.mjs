// SPDX-License-Identifier: MIT
// What tissue looks like: colours of its sides, light, texture and outlines, through cuts and levels. With a stand-in for
// pliant-web, and at the end with a real one.

import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { openBrowser } from './browser.mjs';
import { change, figureOf, PATIENCE, picture, setting, startDaemon, startWeb, until, untilShown } from './live.mjs';
import { icoSphere, lookMessage, meshMessage, nodesMessage, restMessage, serve, statusMessage } from './mock.mjs';

const paths = setting();
const options = { timeout: 3 * PATIENCE };
const RADIUS = 0.05;
const EYE = [0.55, -1, 0.48].map((x) => x / Math.hypot(0.55, -1, 0.48)); // where the page looks from at first
const CHECKER = '<svg xmlns="http://www.w3.org/2000/svg" width="64" height="64"><rect width="64" height="64" fill="#26c"/>' +
    '<rect width="32" height="32" fill="#ea3"/><rect x="32" y="32" width="32" height="32" fill="#ea3"/></svg>';

let server, browser, page, session, sessions = 0, scene, textures = [];

before(async () => {
    server = await serve(paths.page, (opened) => {
        sessions++;
        session = opened;
        session.text({ type: 'hello', version: '0', prefix: 'PLIANT', read_only: false, rate_hz: 60, textures });
        session.text(scene);
        session.text({ type: 'link', daemon: true, age: 0 });
    });
    browser = await openBrowser({ width: 900, height: 600 });
    page = browser.page;
    await page.route('**/texture/*', (route) => route.fulfill({ contentType: 'image/svg+xml', body: CHECKER }));
}, options);

after(async () => {
    await browser?.close();
    await server?.close();
});

async function open(mesh, model = 'surface', { uv, images = [] } = {}) {
    scene = { type: 'scene', name: 'pictures', bodies: [{ name: 'ball', model }], tools: [], describe: '' };
    textures = images;
    const seen = sessions;
    await page.goto(server.url);
    await until('the page connects', () => sessions > seen);
    session.text(statusMessage(scene));
    session.binary(meshMessage(0, 1, mesh));
    if (uv) session.binary(restMessage(0, 1, mesh.position, uv));
    session.binary(nodesMessage(0, 1, mesh.position));
    await session.round();
    await untilShown(page);
}

/** The mean colour of 5 x 5 pixels around points of the world: [[r, g, b]]; with the first body's triangles of `level`. */
const coloursAt = (points, level = null) => page.evaluate(([points, level]) => {
    const { stage, bodies: [body] } = window.pliant;
    if (level !== null) body.levelFor = () => body.levels.at(level);
    stage.draw(); // reading is only right in the same task
    delete body.levelFor;
    const gl = stage.renderer.getContext(), at = stage.center.clone(), pixels = new Uint8Array(100);
    return points.map((point) => {
        stage.onScreen(at.fromArray(point), at);
        const { clientHeight } = stage.canvas;
        gl.readPixels(Math.round(at.x) - 2, Math.round(clientHeight - at.y) - 2, 5, 5, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        return [0, 1, 2].map((c) => pixels.reduce((sum, x, i) => sum + (i % 4 === c ? x : 0), 0) / 25);
    });
}, [points, level]);

// How far the colours differ, whatever the light: of 1, the sum of their parts.
function hueDistance(a, b) {
    const part = (c) => c.map((x) => x / (c[0] + c[1] + c[2]));
    return Math.hypot(...part(a).map((x, i) => x - part(b)[i]));
}
// One tissue in different light, with its grain, differs by 0.03; walls by 0.06 and more.
const OTHER = 0.05;

const ball = icoSphere(4, RADIUS);
const COUNT = ball.position.length / 3;
const along = (p, i) => (p[3 * i] * EYE[0] + p[3 * i + 1] * EYE[1] + p[3 * i + 2] * EYE[2]) / RADIUS;
const kept = (mesh, keep) => ({ ...mesh, triangle: mesh.triangle.filter((_, i) =>
    [0, 1, 2].every((k) => keep(mesh.triangle[i - i % 3 + k]))) });
// A point of the ball so far above its middle as it is seen [rad].
const above = (angle) => EYE.map((x, k) => RADIUS *
    (x * Math.cos(angle) + ((k === 2 ? 1 : 0) - EYE[2] * x) / Math.sqrt(1 - EYE[2] ** 2) * Math.sin(angle)));

test('the_other_side_of_a_thin_wall_has_another_colour', options, async () => {
    // A ball whose side towards the eye is missing.
    await open(kept(ball, (i) => along(ball.position, i) < 0.75));
    const [inner, outer] = await coloursAt([[0, 0, 0], above(1.05)]);
    await page.screenshot({ path: join(paths.out, '30-inner-side.png') });
    assert(hueDistance(inner, outer) > OTHER, `${inner} and ${outer}`);
});

test('the_inner_wall_of_a_solid_organ_has_another_colour', options, async () => {
    const turned = ball.triangle.slice();
    for (let i = 0; i < turned.length; i += 3) [turned[i], turned[i + 1]] = [turned[i + 1], turned[i]];
    const position = new Float32Array([...ball.position, ...ball.position.map((x) => 0.6 * x)]);
    const triangle = new Int32Array([...ball.triangle, ...turned.map((i) => i + COUNT)]);
    await open(kept({ position, triangle }, (i) => along(ball.position, i % COUNT) < 0.75), 'voxel');
    const [inner, outer] = await coloursAt([[0, 0, 0], above(1.05)]);
    await page.screenshot({ path: join(paths.out, '31-inner-wall.png') });
    assert(hueDistance(inner, outer) > OTHER, `${inner} and ${outer}`);
});

// A solid ball without the cap towards the eye: a wall of a cut closes it.
function capped() {
    const { position, triangle } = kept(ball, (i) => along(ball.position, i) < 0.6);
    const sides = new Map();
    for (let i = 0; i < triangle.length; i++) {
        const a = triangle[i], b = triangle[i - i % 3 + (i + 1) % 3];
        if (!sides.delete(`${b} ${a}`)) sides.set(`${a} ${b}`, [a, b]);
    }
    const rim = [...sides.values()], middle = [0, 0, 0];
    for (const [a] of rim) for (let k = 0; k < 3; k++) middle[k] += position[3 * a + k] / rim.length;
    const wall = rim.flatMap(([a, b]) => [b, a, COUNT]);
    return { middle, rim: rim.map(([a]) => a), mesh: { position: new Float32Array([...position, ...middle]),
        triangle: new Int32Array([...triangle, ...wall]), firstWall: triangle.length / 3 } };
}

test('walls_of_cuts_have_a_colour_and_normals_of_their_own', options, async () => {
    const { mesh, middle, rim } = capped();
    await open(mesh, 'voxel');
    const [wall, outer] = await coloursAt([middle, above(1.15)]);
    await page.screenshot({ path: join(paths.out, '32-cut-wall.png') });
    assert(hueDistance(wall, outer) > OTHER, `${wall} and ${outer}`);
    // To its rim the wall has the light of a plane, and the outer surface that of the ball.
    const normals = await page.evaluate((rim) => {
        const { normal, n, twin } = window.pliant.bodies[0];
        const unit = (i) => {
            const v = normal.slice(3 * i, 3 * i + 3), length = Math.hypot(...v);
            return Array.from(v, (x) => x / length);
        };
        return rim.map((node) => ({ outer: unit(node), wall: unit(n + twin.indexOf(node)) }));
    }, rim);
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    normals.forEach(({ outer: of, wall: flat }, k) => {
        const radial = Array.from(mesh.position.subarray(3 * rim[k], 3 * rim[k] + 3), (x) => x / RADIUS);
        // The rim follows edges of triangles, not the plane: the wall's triangles tilt by up to half a radian. With normals
        // in common both would be half of 53 degrees off.
        assert(dot(flat, EYE) > Math.cos(0.5), `${flat}`);
        assert(dot(of, radial) > Math.cos(0.1), `${of}`);
    });
});

test('a_look_colours_the_outside_and_walls_of_cuts_of_a_body_and_of_its_nodes', options, async () => {
    const { mesh, middle } = capped(), n = mesh.position.length / 3;
    const GREEN = [60, 150, 70], BLUE = [70, 90, 200], YELLOW = [200, 180, 60], GREY = [130, 130, 130];
    const look = async (message) => {
        session.binary(message);
        await session.round();
        return coloursAt([middle, above(1.15)]);
    };
    await open(mesh, 'voxel');
    // Light is not white, and the grain of the outside is reddish: less than half of what these differ by.
    const near = (a, b) => assert(hueDistance(a, b) < 0.12, `${a} and ${b}`);
    const [wall, outer] = await look(lookMessage(0, 1, n, GREEN, BLUE));
    near(wall, BLUE);
    near(outer, GREEN);
    const all = (color) => Array.from({ length: 3 * n }, (_, i) => color[i % 3]);
    const [grey, yellow] = await look(lookMessage(0, 1, n, GREEN, BLUE, { outer: all(YELLOW), inner: all(GREY) }));
    await page.screenshot({ path: join(paths.out, '33-look.png') });
    near(yellow, YELLOW);
    near(grey, GREY);
    // One of the next mesh, which has not come, keeps what its nodes have.
    const [kept, same] = await look(lookMessage(0, 2, n + 1, GREEN, BLUE,
        { outer: [...all(BLUE), 0, 0, 0], inner: [...all(BLUE), 0, 0, 0] }));
    near(kept, GREY);
    near(same, YELLOW);
});

test('a_body_without_a_look_has_the_colour_of_its_name_in_any_order', options, async () => {
    const of = (names) => page.evaluate((names) => names.map((name) => {
        const body = new window.pliant.bodies[0].constructor(7, { name, model: 'surface' }, {});
        return body.tint;
    }), names);
    await open(ball);
    const names = ['liver', 'kidney', 'ball', 'organ', 'stomach', 'bladder'], tints = await of(names);
    assert.deepEqual(await of([...names].reverse()), [...tints].reverse());
    assert(new Set(tints).size > 2, `${tints}`);
});

// A mesh parted along x = 0: the left nodes of triangles that reach to the right are split. {triangle, id, origin}.
function parted(position, triangle) {
    const n = position.length / 3, right = (node) => position[3 * node] > 1e-9;
    const parts = Int32Array.from(triangle, (node, i) =>
        (!right(node) && [0, 1, 2].some((k) => right(triangle[i - i % 3 + k])) ? node + n : node));
    const used = new Set(parts);
    return { triangle: parts, origin: Int32Array.from({ length: 2 * n }, (_, i) => i % n),
        id: Int32Array.from({ length: 2 * n }, (_, i) => (used.has(i) ? i : -1)) };
}

test('light_ends_at_a_cut_of_a_thin_wall', options, async () => {
    const position = new Float32Array([...ball.position, ...ball.position]);
    await open({ position, ...parted(ball.position, ball.triangle) });
    const apart = await page.evaluate((COUNT) => {
        const { normal, index, m } = window.pliant.bodies[0];
        const used = new Set(index.subarray(0, m));
        let shared = 0, sum = 0;
        for (let i = 0; i < COUNT; i++)
            if (used.has(i) && used.has(i + COUNT)) {
                shared++;
                sum += normal[3 * i] - normal[3 * (i + COUNT)];
            }
        return { shared, sum };
    }, COUNT);
    assert(apart.shared > 20);
    assert(apart.sum !== 0, 'each lip has the normals of its own triangles');
    // The cut is a red line; beside it, in the same light, is tissue.
    const { triangle } = parted(ball.position, ball.triangle), lips = new Set(triangle.filter((node) => node >= COUNT));
    const points = [...lips].map((i) => i - COUNT).filter((i) => along(ball.position, i) > 0.6)
        .map((i) => Array.from(ball.position.subarray(3 * i, 3 * i + 3)));
    const mean = (colours) => [0, 1, 2].map((c) => colours.reduce((sum, colour) => sum + colour[c], 0) / colours.length);
    const [lip, left, right] = [0, -0.15, 0.15].map((x) => points.map((p) => [p[0] + x * RADIUS, p[1], p[2]]));
    const seen = await coloursAt([...lip, ...left, ...right]), count = points.length;
    const [cut, ...beside] = [0, 1, 2].map((k) => mean(seen.slice(k * count, (k + 1) * count)));
    await page.screenshot({ path: join(paths.out, '33-lips.png') });
    const red = ([r, g, b]) => r / (r + g + b);
    assert(count > 5 && beside.every((colour) => red(cut) > red(colour) + 0.03), `${cut}, ${beside}`);
});

const uvOf = (p) => Float32Array.from({ length: p.length / 3 * 2 }, (_, i) => 0.5 + 10 * p[3 * (i >> 1) + 2 * (i & 1)]);

test('texture_stays_where_it_was_through_a_cut_and_a_level', options, async () => {
    await open(ball, 'surface', { uv: uvOf(ball.position), images: ['ball'] });
    await until('the image is there', async () => (await picture(page)).tiles.some((x, i, all) => i % 3 === 2 && x - all[i - 2] > 60));
    const before = await picture(page);
    // Each triangle divided in four, and all right of x = 0 split from the rest: no message tells of their texture.
    const middle = new Map(), points = Array.from(ball.position), parent = Array.from({ length: 2 * COUNT }, (_, i) => i >> 1);
    const between = (a, b) => {
        const key = a < b ? `${a} ${b}` : `${b} ${a}`;
        if (!middle.has(key)) {
            middle.set(key, points.length / 3);
            for (let k = 0; k < 3; k++) points.push(0.5 * (points[3 * a + k] + points[3 * b + k]));
            parent.push(a, b);
        }
        return middle.get(key);
    };
    const finer = [];
    for (let i = 0; i < ball.triangle.length; i += 3) {
        const [a, b, c] = ball.triangle.subarray(i, i + 3), ab = between(a, b), bc = between(b, c), ca = between(c, a);
        finer.push(a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca);
    }
    session.binary(meshMessage(0, 2, { position: new Float32Array(2 * points.length), ...parted(points, finer),
        parent: Int32Array.from([...parent, ...parent.map((_, i) => points.length / 3 + (i >> 1))]) }));
    session.binary(nodesMessage(0, 2, new Float32Array([...points, ...points])));
    await session.round();
    const worst = await page.evaluate(() => {
        const { uv, rest, id, n } = window.pliant.bodies[0];
        let most = 0;
        for (let i = 0; i < n; i++)
            for (let k = 0; k < 2 && id[i] >= 0; k++) most = Math.max(most, Math.abs(uv[2 * i + k] - 0.5 - 10 * rest[3 * i + 2 * k]));
        return most;
    });
    assert(worst < 1e-5, `${worst}`);
    await page.screenshot({ path: join(paths.out, '34-texture.png') });
    // Only the line of the cut is new: a field is 28 pixels wide, and the line a few.
    const { tiles } = await picture(page), off = tiles.filter((x, i) => Math.abs(x - before.tiles[i]) > 12).length;
    assert(off < 0.05 * tiles.length, `${off} of ${tiles.length} differ`);
});

test('coarser_and_finer_meshes_draw_the_same_picture', options, async () => {
    await open(ball);
    await until('coarser meshes are there', () => page.evaluate(() => {
        pliant.stage.draw();
        return pliant.bodies[0].levels.length > 3;
    }));
    const points = [];
    for (let i = 0; i < COUNT; i += 5)
        if (along(ball.position, i) > 0.5) points.push(Array.from(ball.position.subarray(3 * i, 3 * i + 3)));
    const finest = await coloursAt(points, 0), coarser = await coloursAt(points, 3);
    const off = points.map((_, i) => Math.max(...[0, 1, 2].map((c) => Math.abs(finest[i][c] - coarser[i][c]))));
    // Light between normals that are 10 degrees apart; a vessel of the texture may move by a pixel.
    assert(off.filter((x) => x > 12).length < 0.1 * off.length, `${off.map(Math.round)}`);
});

test('a_coarse_ball_has_a_round_outline', options, async () => {
    const parts = {};
    for (const times of [1, 4]) {
        await open(icoSphere(times, RADIUS));
        // Both from one place: a whole view is as near as the nodes allow.
        await page.evaluate((radius) => {
            pliant.stage.camera.position.set(0, -6 * radius, 0);
            pliant.stage.controls.update();
        }, RADIUS);
        parts[times] = (await picture(page)).covered;
    }
    await page.screenshot({ path: join(paths.out, '35-outline.png') });
    // A polygon of ten sides has 6 % less than its circle.
    assert(Math.abs(parts[1] / parts[4] - 1) < 0.02, `${parts[1]} and ${parts[4]}`);
});

test('what_stands_still_is_drawn_once_more_and_finer', options, async () => {
    await open(ball);
    const now = () => page.evaluate(() => ({ width: pliant.stage.canvas.width, frames: pliant.stage.frames,
        triangles: pliant.bodies[0].level === pliant.bodies[0].levels[0], css: pliant.stage.canvas.clientWidth }));
    const still = await until('it is drawn finer', async () => {
        const found = await now();
        return found.width === 2 * found.css && found;
    });
    assert(still.triangles);
    // A movement that nobody can see, of a thousandth of a pixel, draws nothing; one of a pixel does.
    for (let k = 0; k < 5; k++) {
        session.binary(nodesMessage(0, 1, ball.position.map((x) => x * (1 + 1e-6 * (k % 2)))));
        await session.round();
    }
    assert.deepEqual(await now(), still);
    session.binary(nodesMessage(0, 1, ball.position.map((x) => x * 1.01)));
    await session.round();
    await until('it is drawn', async () => (await now()).frames > still.frames);
});

test('image_stays_on_the_nodes_of_a_real_body_that_is_cut', options, async () => {
    // An OBJ file with the texture coordinates of above, cut through by a message to a real daemon.
    const coarse = icoSphere(2, RADIUS), lines = [];
    for (let i = 0; i < coarse.position.length; i += 3) {
        const [x, y, z] = coarse.position.subarray(i, i + 3);
        lines.push(`v ${x} ${y} ${z}`, `vt ${0.5 + 10 * x} ${0.5 + 10 * z}`);
    }
    for (let i = 0; i < coarse.triangle.length; i += 3)
        lines.push(`f ${Array.from(coarse.triangle.subarray(i, i + 3), (node) => `${node + 1}/${node + 1}`).join(' ')}`);
    writeFileSync(join(paths.out, 'ball.obj'), lines.join('\n'));
    const image = await page.evaluate(async (svg) => {
        const picture = new Image(), canvas = document.createElement('canvas');
        picture.src = `data:image/svg+xml,${encodeURIComponent(svg)}`;
        await picture.decode();
        canvas.width = canvas.height = 64;
        canvas.getContext('2d').drawImage(picture, 0, 0);
        return canvas.toDataURL('image/png').split(',')[1];
    }, CHECKER);
    writeFileSync(join(paths.out, 'checker.png'), Buffer.from(image, 'base64'));
    await page.unroute('**/texture/*');
    writeFileSync(join(paths.out, 'textured.cfg'), `name = "textured"; rate_hz = 100.0; publish = { rest = true; };
bodies = ( { name = "ball"; mesh = { file = "ball.obj"; }; levels = 1; start_level = 0; cuttable = true;
  material = { youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4; };
  shape = { angular_frequency = 50.0; damping_ratio = 0.3; };
  fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.025]); } ); } );`);
    const daemon = startDaemon(paths, join(paths.out, 'textured.cfg'));
    let web = null;
    try {
        web = await startWeb(paths, '--texture', `ball=${join(paths.out, 'checker.png')}`);
        await page.goto(web.url);
        await untilShown(page);
        const nodes = await until('the body is told', () => figureOf(page, 'ball', 'nodes'));
        await page.evaluate(() => window.pliant.link.request({ type: 'cut', body: 'ball',
            before: [[-0.1, -0.1, 0.011], [-0.1, 0.1, 0.011]], after: [[0.1, -0.1, 0.011], [0.1, 0.1, 0.011]] }));
        await until('it is cut', async () => (await figureOf(page, 'ball', 'pieces')) === 2);
        assert((await figureOf(page, 'ball', 'nodes')) > nodes);
        await until('new nodes are shown', () => page.evaluate((n) => window.pliant.bodies[0].lips > 0 &&
            window.pliant.bodies[0].n > n, nodes));
        const { worst, points } = await page.evaluate((EYE) => {
            const { uv, rest, n, id, position, normal, info } = window.pliant.bodies[0];
            let worst = 0;
            const points = [];
            for (let i = 0; i < n; i++) {
                if (id[i] < 0) continue;
                for (let k = 0; k < 2; k++)
                    worst = Math.max(worst, Math.abs(uv[2 * i + k] - 0.5 - 10 * rest[3 * i + 2 * k]));
                // Nodes that are seen, not on a line of the pattern, nor of the cut.
                const faces = EYE.reduce((sum, x, k) => sum + x * normal[3 * i + k], 0) /
                    Math.hypot(...normal.subarray(3 * i, 3 * i + 3));
                const inside = [0, 1].map((k) => Math.abs(((2 * uv[2 * i + k] % 1) + 1) % 1 - 0.5));
                if (faces > 0.5 && inside.every((x) => x < 0.3) && info[4 * i + 2] === 0)
                    points.push({ at: Array.from(position.subarray(3 * i, 3 * i + 3)),
                        even: (Math.floor(2 * uv[2 * i]) + Math.floor(2 * uv[2 * i + 1])) % 2 === 0 });
            }
            return { worst, points };
        }, EYE);
        // Middles of edges have the mean of their ends, off by what the rest shape is curved: 8 mm^2 / 8 / 50 mm.
        assert(worst < 0.1, `${worst}`);
        assert(points.length > 10, `${points.length} nodes are compared`);
        const seen = await until('the image is there', async () => {
            const found = await coloursAt(points.map(({ at }) => at));
            return found.some(([r, , b]) => b > r) && found;
        });
        await page.screenshot({ path: join(paths.out, '36-textured-cut.png') });
        const blue = seen.map(([r, , b]) => b > r), wrong = points.filter(({ even }, i) => even === blue[i]).length;
        assert(Math.min(wrong, points.length - wrong) <= 0.05 * points.length, `${wrong} of ${points.length}`);
    } finally {
        await web?.program.stop();
        await daemon.stop();
    }
});

test('nothing_failed_in_the_page', options, () => {
    assert.deepEqual(browser.errors.filter((text) => !/WebSocket connection|ERR_CONNECTION/.test(text)), []);
});
