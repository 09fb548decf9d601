// SPDX-License-Identifier: MIT
// Draws the pictures of documents with the page, into the folder OUT: draw.mjs PLIANTD PLIANT-WEB PAGE-FOLDER OUT, run
// by run.sh in a private network. PICTURES=a,b draws only these. Look at them, then copy them to where they are shown:
// config/manual/pictures, tests/accuracy (fig5, fig7, fig13).

import { execFile } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { openBrowser } from './browser.mjs';
import { setting, startDaemon, startWeb, untilShown } from './live.mjs';

const paths = setting();
const config = join(dirname(fileURLToPath(import.meta.url)), '../../config');
const wait = (seconds) => new Promise((resolve) => setTimeout(resolve, 1000 * seconds));
const call = (name, ...args) => new Promise((resolve) => {
    execFile(join(dirname(paths.daemon), name), args, (error, out, err) => resolve(error ? console.log(name, err) : out));
});

const stomach = (more) => `name = "stomach"; rate_hz = 200.0; publish = { rest = true; };
bodies = ( { name = "stomach"; mesh = { generator = "stomach"; nodes = 188; length = 0.25; };
  material = { youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4; };
  shape = { angular_frequency = 50.0; damping_ratio = 0.1; }; ${more}
  fixed = ( { box = ([-1.0, -1.0, 0.08], [1.0, 1.0, 1.0]); } ); } );
tools = ( { id = 1; kind = "probe"; max_force = 3.3;
  capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.0, 0.0, 0.1]; radius = 0.008; } ); } );`;
const liver = `name = "liver"; rate_hz = 200.0; gravity = [0.0, 0.0, -2.7];
bodies = ( { name = "liver"; model = "voxel"; voxels = { file = "${config}/liver.nrrd"; label = [1, 2]; };
  material = { youngs_modulus = 5000.0; poisson_ratio = 0.3; density = 1050.0; }; cuttable = true; split_budget = 4096;
  look = { color = [0.58, 0.24, 0.20]; };
  fixed = ( { box = ([-0.2, -0.2, -0.2], [0.2, 0.2, -0.018]); } ); } );
tools = ( { id = 1; kind = "probe"; max_force = 3.3;
  capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.0, 0.0, 0.1]; radius = 0.006; } ); },
  { id = 3; kind = "grasper"; max_force = 3.3; capsules = ( { radius = 0.006; } ); } );`;
const near = { eye: [0.22, -0.32, 0.1], at: [0.01, 0, 0.01], press: ['--auto', '--direction', '1,1,0', '--depth', '0.025'] };

// scene: a text, or a file of config/; before, press: what clients do; pull: from where to where the page does; look: switches of the panel.
const PICTURES = {
    liver: { scene: liver, eye: [0.05, -0.25, 0.21], at: [-0.008, 0, 0.012],
        before: [['pliant-cut', '--body', 'liver', '--before', '0,-0.1,0.1,0,0.1,0.1',
            '--after', '-0.012,-0.1,-0.012,-0.012,0.1,-0.012']],
        press: ['--press', '-0.045,-0.015,0.1', '--depth', '0.065', '--speed', '0.03'], pull: [[575, 430], [665, 350]] },
    bladder: { scene: 'bladder.cfg', eye: [0.12, -0.16, 0.14], at: [0, 0, 0.005],
        before: [['pliant-cut', '--body', 'bladder', '--before', '-0.025,-0.05,0.03,0.025,-0.05,0.03',
            '--after', '-0.025,0.05,0.03,0.025,0.05,0.03']] },
    gallbladder: { scene: 'gallbladder.cfg', eye: [0.1, -0.1, 0.12], at: [0, 0, 0.01],
        before: [['pliant-tie', '--make', 'pin', '--body', 'gall', '--at', '0,-0.025,0.026', '--radius', '0.008'],
            ['pliant-tie', '--make', 'clip', '--body', 'gall', '--at', '0.008,0.022,0.026', '--radius', '0.012']] },
    rest: { scene: 'rest.cfg', eye: [0.08, -0.14, 0.09], at: [0, 0, 0.015] },
    grasp: { scene: 'grasp-sphere.cfg', eye: [0.12, -0.22, 0.12], at: [0, 0, 0.01],
        press: ['--tool', '3', '--press', '0,0,0.05', '--direction', '0,0,1', '--speed', '0.05', '--depth', '0.02', '--grip', '1'] },
    fig5: { ...near, eye: [-0.09, -0.26, 0.06], at: [-0.055, 0, 0.0], scene: stomach('levels = 1; adapt = { };'), look: { colouring: '1', wireframe: true } },
    fig7: { ...near, scene: stomach(''), look: { wireframe: true, springs: true } },
    'fig13-coarse': { ...near, scene: stomach('') },
    'fig13-refined': { ...near, scene: stomach('levels = 1; start_level = 1;') },
    'fig13-adaptive': { ...near, scene: stomach('levels = 1; adapt = { };') },
};
const BARE = 'header,#foot,#panel{display:none!important} #view{position:fixed!important;inset:0!important;' +
    'width:100vw!important;height:100vh!important}';

const isFigure = (name) => name.startsWith('fig');
const wanted = process.env.PICTURES?.split(',') ?? Object.keys(PICTURES);
const browser = await openBrowser({ width: 900, height: 560 });
for (const name of wanted) {
    const { scene, eye, at, before = [], press, pull, look = {} } = PICTURES[name];
    const file = scene.endsWith('.cfg') ? join(config, scene) : join(paths.out, `${name}.cfg`);
    if (!scene.endsWith('.cfg')) writeFileSync(file, scene);
    await browser.page.setViewportSize(isFigure(name) ? { width: 420, height: 420 } : { width: 900, height: 560 });
    const daemon = startDaemon(paths, file), web = await startWeb(paths), { page } = browser;
    await page.goto(web.url);
    await untilShown(page);
    await page.addStyleTag({ content: BARE + (isFigure(name) ? ' #labels,#overlay{display:none}' : '') });
    await page.evaluate(([eye, at, look]) => {
        for (const [id, value] of Object.entries(look)) {
            const input = document.getElementById(id);
            if (value === true) input.click(); else input.value = value;
            if (value !== true) input.dispatchEvent(new Event('change', { bubbles: true }));
        }
        const { stage } = window.pliant;
        window.dispatchEvent(new Event('resize'));
        stage.camera.position.set(...eye);
        stage.controls.target.set(...at);
        stage.controls.update();
        stage.invalidate();
    }, [eye, at, look]);
    for (const [program, ...args] of before) await call(program, ...args);
    await wait(4);
    const pressed = press && call('pliant-probe', ...press, '--hold', pull ? '12' : '4');
    if (pull) { // by the page's hand
        await page.keyboard.down('Control');
        await page.mouse.move(...pull[0]);
        await page.mouse.down();
        await page.mouse.move(...pull[1], { steps: 15 });
    }
    if (press) await wait(5);
    await page.screenshot({ path: join(paths.out, `${name}.png`) });
    if (pull) {
        await page.mouse.up();
        await page.keyboard.up('Control');
    }
    await pressed;
    await web.program.stop();
    await daemon.stop();
    console.log(`${name}.png`);
}
await browser.close();
