// SPDX-License-Identifier: MIT
// The workbench: scenes are chosen, started and stopped, meshes become scenes, sessions are recorded, and what is
// refused says why where it was asked for.

import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { copyFileSync, mkdirSync, readdirSync, readFileSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { openBrowser } from './browser.mjs';
import { drag, figureOf, middle, newtons, onPage, PATIENCE, setting, startDaemon, startWeb, until, untilShown } from './live.mjs';

const paths = setting();
const BALL = fileURLToPath(new URL('scenes/ball.cfg', import.meta.url));
const FOLDER = join(paths.out, 'workbench');
const options = { timeout: 3 * PATIENCE };

// A corner of a box, of 40 x 30 x 50 millimetres.
const CORNERS = [[0, 0, 0], [40, 0, 0], [0, 30, 0], [0, 0, 50]];
const FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
const STL = `solid corner\n${FACES.map((face) => `facet normal 0 0 0\nouter loop\n${face.map((corner) =>
    `vertex ${CORNERS[corner].join(' ')}`).join('\n')}\nendloop\nendfacet`).join('\n')}\nendsolid corner\n`;

// Two layers of 20 x 10 x 10 voxels of 2 mm: label 1 in two pieces; label 1 and 2. The last is nowhere, and turns
// the line around.
const LABELS = Buffer.concat([Buffer.from(`NRRD0005\ntype: uchar\ndimension: 4\nsizes: 2 20 10 10
kinds: list domain domain domain\nspace: LPS\nspace directions: none (2,0,0) (0,2,0) (0,0,2)\nencoding: raw
Segment0_Name:=liver\nSegment0_LabelValue:=1\nSegment0_Layer:=1
Segment1_Name:=<b>spleen\nSegment1_LabelValue:=2\nSegment1_Layer:=1\nSegment1_Color:=0.5 0.25 1
Segment2_Name:=\u202e${'x'.repeat(60)}\nSegment2_LabelValue:=9\nSegment2_Layer:=0\n\n`),
Buffer.from(Array.from({ length: 2000 }, (_, v) => v % 20).flatMap((x) => [Number(x < 5 || x >= 15),
    x < 14 ? 1 : x >= 15 ? 2 : 0]))]);

let web, browser, page;
const shot = (name) => page.screenshot({ path: join(paths.out, `scenes-${name}.png`) });
const textOf = (id) => page.locator(`#${id}`).textContent();
const way = (title) => page.locator(`#way-list li:has(b:text-is("${title}")) input`);
const start = (name) => page.locator(`[data-start="${name}"]`).click();
const shows = (what, id, pattern) => until(what, async () => pattern.test(await textOf(id)));
const daemonIs = (state) => until(`the daemon is ${state}`, () => page.evaluate((state) =>
    window.pliant.workbench.state?.daemon.state === state, state));

before(async () => {
    rmSync(FOLDER, { recursive: true, force: true });
    mkdirSync(FOLDER, { recursive: true });
    copyFileSync(BALL, join(FOLDER, 'ball.cfg'));
    // Without tools.
    writeFileSync(join(FOLDER, 'other.cfg'),
        readFileSync(BALL, 'utf8').replace('name = "ball";', 'name = "other";').replace(/^tools = [^]*/m, ''));
    writeFileSync(join(FOLDER, 'wrong.cfg'), '# Not right.\nbodies = (\n  { name = "a"; meshh = 3; } );\n');
    symlinkSync('/etc/passwd', join(FOLDER, 'away.cfg'));
    web = await startWeb(paths, '--scenes', FOLDER, '--pliantd', paths.daemon);
    browser = await openBrowser({ width: 1000, height: 700 });
    page = browser.page;
    await page.goto(web.url);
    await page.waitForSelector('[data-start]', { timeout: PATIENCE });
}, options);

after(async () => {
    await browser?.close();
    await web?.program.stop();
});

test('the_scenes_of_the_folder_are_listed_with_what_they_are', options, async () => {
    const names = await page.locator('#scene-list [data-start]').allTextContents();
    assert.deepEqual(names, ['ball.cfg', 'other.cfg', 'wrong.cfg']); // no link
    assert.match(await page.locator('#scene-list').textContent(), /A hollow ball whose lower part is held/);
    assert.match(await textOf('notice'), /choose a scene/);
});

test('a_scene_that_is_refused_shows_its_error_with_the_line', options, async () => {
    await start('wrong.cfg');
    await shows('the error', 'scene-list', /exit status 2\s*wrong\.cfg:3: unknown key meshh/);
    assert.match(await textOf('notice'), /wrong\.cfg:3: unknown key meshh/);
    await shot('1-refused');
});

test('a_click_starts_a_scene_and_another_click_another_one', options, async () => {
    await start('ball.cfg');
    await untilShown(page);
    assert.equal(await textOf('scene-name'), 'ball');
    await start('other.cfg');
    await shows('the other scene', 'scene-name', /^other$/);
    await untilShown(page);
    await shot('2-started');
});

test('the_line_that_a_scene_without_grasper_is_told_to_add_is_one', options, async () => {
    const m = await middle(page);
    await page.keyboard.down('Control');
    await drag(page, m, { x: m.x + 10, y: m.y }, 2);
    await page.mouse.up();
    await page.keyboard.up('Control');
    const [, line] = (await textOf('hint')).match(/^This scene has no grasper\. Add to it: (.*)$/);
    const whole = join(paths.out, 'whole.cfg');
    writeFileSync(whole, readFileSync(join(FOLDER, 'other.cfg'), 'utf8') + line);
    const { stdout, stderr } = spawnSync(paths.daemon, ['--check', whole], { encoding: 'utf8' });
    assert.match(stdout, /^tool 1: grasper, 1 capsules/m, stderr);
});

test('a_session_is_recorded_and_saved', options, async () => {
    // 30 frames a second of 162 nodes, 12 bytes each, and 960 bytes of a frame.
    await shows('what it takes is told before', 'record', /^Record \(≤ 5\.2 MB\/min\)$/);
    await page.locator('#record').click();
    await shows('something is recorded', 'recorder', /recording other-[\d-]+\.h5, \d.* kB/);
    await page.locator('#record').click();
    await shows('what was recorded', 'recorder', /[1-9]\d* frames of ball/);
    const coming = page.waitForEvent('download', { timeout: PATIENCE });
    await page.locator('#recording-list a').click();
    const file = readFileSync(await (await coming).path());
    assert.equal(file.subarray(0, 8).toString('latin1'), '\x89HDF\r\n\x1a\n');
});

test('what_was_started_is_stopped', options, async () => {
    await page.locator('#scene-end').click();
    await daemonIs('ended');
    await shows('that it is gone', 'notice', /pliantd is gone.*choose a scene/);
});

test('a_dropped_mesh_becomes_a_scene_that_is_explained_and_started', options, async () => {
    await page.evaluate((stl) => {
        const dataTransfer = new DataTransfer();
        dataTransfer.items.add(new File([stl], 'my corner.stl'));
        for (const kind of ['dragenter', 'drop'])
            document.getElementById('view').dispatchEvent(new DragEvent(kind, { dataTransfer, bubbles: true }));
    }, STL);
    await until('a scene is proposed', () => page.locator('#proposal-start').isEnabled());
    assert.equal(await textOf('proposal-start'), 'Start my_corner.cfg');
    assert.match(await textOf('explained'), /unitsnot given, taken as mm.*size40 x 30 x 50 mm.*material/s);
    assert.match(await textOf('way-said'), /^Proposed as a wall, empty, since /);
    assert.match(await textOf('way-list'), /a wall, empty.*a wall, full of fluid.*a solid/s);
    await shot('3-proposed');
    // Chosen instead of guessed; the last in the scene.
    await page.locator('#units').selectOption('cm');
    await shows('the other size', 'explained', /size400 x 300 x 500 mm/);
    await page.locator('#cuttable').uncheck();
    await shows('the scene says so', 'proposal-text', /^ *cuttable = false;/m);
    // Another model is judged anew.
    await way('a solid').check();
    await shows('the other model', 'way-said', /^As you chose: a solid\./);
    await shows('the scene says so', 'proposal-text', /^ *cuttable = true;/m);
    await until('it is proposed', () => page.locator('#proposal-start').isEnabled());
    await page.locator('#proposal-start').click();
    await shows('it runs', 'scene-end', /Stop my_corner\.cfg/);
    await until('its bodies come', () => page.evaluate(() => window.pliant.bodies.length === 1));
    await untilShown(page);
    await shot('4-own');
});

test('the_proposed_scene_is_pulled_and_cut', options, async () => {
    const events = () => textOf('events');
    // Halfway up the corner.
    const m = await onPage(page, [0.1, 0.05, 0.25]);
    await page.keyboard.down('Control');
    await drag(page, m, { x: m.x + 60, y: m.y });
    await until('the jaws hold', async () => /grasp/.test(await events()));
    await until('the force is shown', async () => (await newtons(page)) > 0);
    await shot('5-pulled');
    await page.mouse.up();
    await page.keyboard.up('Control');
    await until('they let go', async () => /release/.test(await events()));
    await page.keyboard.down('Shift');
    await drag(page, { x: m.x - 200, y: m.y }, { x: m.x + 200, y: m.y }, 12);
    await page.mouse.up();
    await page.keyboard.up('Shift');
    await until('it is cut in two', async () => (await figureOf(page, 'organ', 'pieces')) > 1);
    await shot('6-cut');
    await page.locator('button:text-is("Undo all")').click();
    await until('it is whole again', async () => (await figureOf(page, 'organ', 'pieces')) === 1);
    await page.locator('#scene-end').click();
    await daemonIs('ended');
});

test('labels_of_a_volume_are_listed_and_one_is_chosen', options, async () => {
    await page.locator('#mesh').setInputFiles({ name: 'two.seg.nrrd', mimeType: '', buffer: LABELS });
    await shows('the largest is taken', 'label-said', /^4 labels: “liver” of layer 2 was taken, the largest\./);
    // Each with name, number, layer, volume, size and pieces: 8 mm3 a voxel.
    assert.deepEqual(await page.locator('#label-list li').evaluateAll((rows) =>
        rows.map((row) => row.innerText.split('\n'))), [
        ['liver', 'label 1 · layer 2 · 11 cm³ · 28 x 20 x 20 mm'],
        ['label 1', 'label 1 · layer 1 · 8 cm³ · 40 x 20 x 20 mm · 2 pieces'],
        ['<b>spleen', 'label 2 · layer 2 · 4 cm³ · 10 x 20 x 20 mm'],
        ['x'.repeat(48), 'label 9 · layer 1 · 0 cm³']]);
    const colours = await page.locator('.swatch').evaluateAll((all) => all.map(({ style }) => style.background));
    assert.equal(colours[2], 'rgb(128, 64, 255)'); // the file's
    assert.equal(new Set(colours).size, 4);
    assert.equal(await page.locator('#label-list b b').count(), 0, 'a name is no markup');
    assert(await page.locator('#label-list input').nth(3).isDisabled(), 'an empty label is none to choose');
    await page.locator('#label-list input').nth(2).check();
    await shows('the other one is taken', 'label-said', /“<b>spleen” of layer 2 was taken\. Choose/);
    await until('it is proposed', () => page.locator('#proposal-start').isEnabled());
    assert.match(await textOf('proposal-text'), /label = 2; {2}layer = 2;/);
    await shot('7-labels');
    // A wall of a label is one of its even skin, which is a mesh beside it.
    await way('a wall, full of fluid').check();
    await shows('its even skin', 'proposal-name', /^two\.seg-even\.off$/);
    await until('it is proposed', () => page.locator('#proposal-start').isEnabled());
    assert.match(await textOf('way-said'), /^As you chose: a wall, full of fluid\./);
    assert.match(await textOf('proposal-text'), /cavity = \{ fluid = true; \};/);
    await page.locator('#mesh-list').selectOption('two.seg.nrrd');
    await shows('its labels again', 'label-said', /“liver” of layer 2 was taken/);
    await until('it is proposed', () => page.locator('#proposal-start').isEnabled());
});

test('a_scene_that_was_shown_has_a_picture', options, async () => {
    const src = (name) => page.locator(`li:has([data-start="${name}"]) img`).getAttribute('src');
    assert.match(await src('ball.cfg'), /^data:image\/jpeg/);
    assert.notEqual(await src('ball.cfg'), await src('my_corner.cfg'));
    assert.equal(await page.locator('li:has([data-start="wrong.cfg"]) img').count(), 0);
});

test('each_scene_of_config_has_a_picture_by_its_name_and_first_sentence', options, () => {
    const config = fileURLToPath(new URL('../../config', import.meta.url));
    const pictures = JSON.parse(readFileSync(new URL('../../clients/web/page/src/pictures.json', import.meta.url)));
    const names = readdirSync(config).filter((name) => name.endsWith('.cfg')).sort();
    assert.deepEqual(Object.keys(pictures).map((key) => key.split(': ')[0]).sort(), names);
    for (const key of Object.keys(pictures)) {
        const [name] = key.split(': ', 1), head = readFileSync(join(config, name), 'utf8').replace(/\n# ?/g, ' ');
        assert(head.startsWith(`# ${key.slice(name.length + 2)}`), `${key}: run scene_pictures.mjs again`);
    }
});

test('a_mesh_that_is_none_is_refused_with_the_reason', options, async () => {
    const give = (name, text) => page.locator('#mesh').setInputFiles({ name, mimeType: '', buffer: Buffer.from(text) });
    await give('letter.doc', 'dear');
    await shows('its ending', 'mesh-error', /letter\.doc: expected OBJ/);
    await give('letter.stl', 'dear');
    await shows('what is wrong', 'mesh-error', /no scene can be made of it \(exit status 2\): letter\.stl/);
});

test('a_daemon_of_others_is_not_replaced', options, async () => {
    const daemon = startDaemon(paths, BALL);
    await page.waitForSelector('#foreign:visible', { timeout: PATIENCE });
    assert(await page.locator('[data-start="other.cfg"]').isDisabled());
    await page.evaluate(() => window.pliant.workbench.start('scenes', 'other.cfg')); // as if it could
    await shows('why not', 'scene-error', /was not started here/);
    await daemon.stop();
    await page.waitForSelector('#foreign', { state: 'hidden', timeout: PATIENCE });
});

test('the_page_had_no_errors', options, async () => {
    assert.deepEqual(browser.errors, []);
});
