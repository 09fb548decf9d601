// SPDX-License-Identifier: MIT
// Starts Debian's chromium without a screen, drawing by the processor.

import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

export const CHROMIUM = process.env.CHROMIUM ?? '/usr/bin/chromium';
// As Chromium draws where there is no graphics processor: WebGL by SwiftShader, the page around it without GL.
const OPTIONS = ['--no-sandbox', '--disable-gpu', '--enable-unsafe-swiftshader',
    '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update',
    '--disable-sync', '--disable-dev-shm-usage'];

/** Resolves to {page, errors (of the page, as they come), close()}; `touch`: as a phone, without a mouse. */
export async function openBrowser({ width = 1280, height = 800, touch = false, options = [] } = {}) {
    const folder = mkdtempSync(join(tmpdir(), 'pliant-web-'));
    const context = await chromium.launchPersistentContext(folder, { executablePath: CHROMIUM, headless: true,
        args: [...OPTIONS, ...options], viewport: { width, height }, hasTouch: touch, isMobile: touch });
    const page = context.pages()[0] ?? await context.newPage();
    const errors = [];
    page.on('pageerror', (error) => errors.push(String(error)));
    page.on('console', (message) => { if (message.type() === 'error') errors.push(message.text()); });
    return {
        page, errors,
        async close() {
            await context.close();
            rmSync(folder, { recursive: true, force: true });
        },
    };
}
