// SPDX-License-Identifier: MIT
// Writes the page into a folder: `npm run build -- FOLDER`.
import { build } from 'esbuild';
import { mkdir, copyFile, readFile, writeFile } from 'node:fs/promises';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
if (process.argv.length !== 3) {
    console.error('usage: npm run build -- FOLDER');
    process.exit(2);
}
// npm runs this in its own folder, and says in INIT_CWD where it was called.
const folder = resolve(process.env.INIT_CWD ?? '.', process.argv[2]);
await mkdir(folder, { recursive: true });
const { metafile } = await build({
    entryPoints: [join(here, 'src/main.js')],
    outfile: join(folder, 'page.js'),
    bundle: true,
    format: 'esm',
    target: 'es2022',
    minify: true,
    metafile: true,
    legalComments: 'none',
    banner: { js: '/* Contains three.js, Copyright 2010-2026 three.js authors, MIT License: see LICENSES.txt. */' },
});
// The licence of each package of which something is in the page.
const packages = Object.keys(metafile.inputs).map((path) => /node_modules\/((?:@[^/]+\/)?[^/]+)/.exec(path)?.[1]);
let licenses = '';
for (const name of [...new Set(packages.filter(Boolean))].sort()) {
    const text = await readFile(join(here, 'node_modules', name, 'LICENSE'), 'utf8');
    licenses += `page.js contains ${name}, whose licence is:\n\n${text.trim()}\n\n`;
}
await writeFile(join(folder, 'LICENSES.txt'), licenses);
await copyFile(join(here, 'index.html'), join(folder, 'index.html'));
await copyFile(join(here, 'page.css'), join(folder, 'page.css'));
