// SPDX-License-Identifier: MIT
// How hard the page pulls, of each scene. Needs no browser.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { mostLoad } from '../../clients/web/page/src/load.js';

const GRAVITY = 9.81; // [m/s2]

test('without_tools_a_body_is_pulled_by_its_weight', () => {
    for (const mass of [1e-4, 0.1, 1.5, 40])
        assert.equal(mostLoad([], mass), mass * GRAVITY);
});

test('the_strongest_tool_that_moves_says_how_hard', () => {
    const probe = { kind: 'probe', maxForce: 0.5 }, blade = { kind: 'blade', maxForce: 7 };
    const table = { kind: 'static', maxForce: 3.3 };
    assert.equal(mostLoad([probe], 1.5), 0.5);
    assert.equal(mostLoad([probe, blade], 1.5), 7);
    assert.equal(mostLoad([table, probe], 1.5), 0.5);
    assert.equal(mostLoad([table], 1.5), 1.5 * GRAVITY);
});

test('what_is_not_known_yet_or_makes_no_sense_gives_a_force_all_the_same', () => {
    for (const mass of [undefined, NaN, 0, -1, Infinity])
        assert.equal(mostLoad([], mass), 2);
    assert.equal(mostLoad([{ kind: 'probe', maxForce: NaN }], 0.1), 0.1 * GRAVITY);
});
