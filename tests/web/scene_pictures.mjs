// SPDX-License-Identifier: MIT
// Writes the small pictures of the scenes in config/ that the page has from the start, as it would take them itself:
// run.sh scene_pictures.mjs PLIANTD PLIANT-WEB PAGE-FOLDER OUTPUT-FOLDER, in a private network, after a change of a
// scene's look, name or first sentence.

import { writeFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { join } from 'node:path';
import { openBrowser } from './browser.mjs';
import { setting, startWeb, until } from './live.mjs';

const paths = setting();
const at = (path) => fileURLToPath(new URL(path, import.meta.url));
const { program, url } = await startWeb(paths, '--scenes', at('../../config'), '--pliantd', paths.daemon,
    '--uploads', join(paths.out, 'uploads'), '--recordings', join(paths.out, 'recordings'));
const { page, close } = await openBrowser();
await page.goto(url);
await page.waitForSelector('[data-start]');
const pictures = {};
for (const { name, about, bytes } of await page.evaluate(() => pliant.workbench.state.scenes)) {
    await page.evaluate((name) => pliant.workbench.start('scenes', name), name);
    const found = await until(`${name} is shown`, () => page.evaluate(([name, bytes]) => {
        const { state: { daemon }, thumbs } = pliant.workbench;
        return daemon.file !== name ? null : daemon.state === 'failed' ? { none: daemon.text }
            : { url: thumbs.of('scenes', name, bytes) };
    }, [name, bytes]).then((one) => (one?.none || one?.url ? one : null)));
    if (found.url) { // the second picture has its colours
        await page.waitForTimeout(1000);
        found.url = await page.evaluate(([name, bytes]) => pliant.workbench.thumbs.of('scenes', name, bytes), [name, bytes]);
    }
    console.log(name, found.url?.length ?? found.none);
    if (found.url) pictures[`${name}: ${about}`] = found.url;
}
writeFileSync(at('../../clients/web/page/src/pictures.json'), `${JSON.stringify(pictures, null, 1)}\n`);
await close();
await program.stop();
