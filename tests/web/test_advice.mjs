// SPDX-License-Identifier: MIT
// What the page says of late ticks and refused inputs, and the sliders of settings: alone, without a browser.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { lateAdvice, newRefusals } from '../../clients/web/page/src/advice.js';
import { Span, keysOf } from '../../clients/web/page/src/settings.js';

test('the_advice_is_for_the_stage_that_takes_most', () => {
    assert.match(lateAdvice({ forces: 300, contact: 900 }, 1000), /“contact” takes 900 of 1000 µs/);
    assert.match(lateAdvice({ forces: 300, adapt: 500, contact: 10 }, 1000), /adapt_force/);
    assert.match(lateAdvice({ forces: 900, later: 2000 }, 1000), /“later” takes 2000 of 1000 µs: a lower rate_hz/);
    // A tick that does not take long is late because the processor did something else.
    assert.match(lateAdvice({ forces: 100, contact: 20 }, 1000), /stages take 120 of 1000 µs: give the server/);
    assert.match(lateAdvice({}, 1000), /give the server/);
    assert.match(lateAdvice({ forces: NaN }, 1000), /give the server/);
});

test('only_refused_inputs_that_are_new_are_told', () => {
    const told = newRefusals({ stale: 3, not_possible: 2, governor_actions: 9, rest_shapes: 1 }, { stale: 3 });
    assert.deepEqual(told.map(({ reason, count }) => [reason, count]), [['not_possible', 2]]);
    assert.deepEqual(newRefusals({}, { stale: 3 }), []);
});

test('settings_are_those_that_the_description_lists', () => {
    assert.deepEqual(keysOf('scene x: 100 Hz\nsettings of a b: friction\n'), []);
    assert.deepEqual(keysOf('x\nsettings of ball: stiffness_scale, adapt_scale, pressure\nsettings of in.ner: friction\n'),
        ['gravity_x', 'gravity_y', 'gravity_z', 'ball.stiffness_scale', 'ball.pressure', 'in.ner.friction']);
    assert.deepEqual(keysOf('of an older server'), []);
});

test('a_slider_reaches_its_ends_and_what_the_value_is', () => {
    for (const [kind, value, low, high] of [['stiffness_scale', 1, 0, 1], ['friction', 0.3, 0, 10], ['friction', 9, 0, 10],
        ['gravity_z', -100, -1e4, 1e4], ['pressure', 500, 0, 900], ['adapt_force', 0, 0, 1e6], ['volume', 1e-5, 0, 2e-5]]) {
        const span = new Span(kind, value, low, high);
        const near = (a, b) => assert(Math.abs(a - b) <= 1e-9 * Math.max(Math.abs(a), Math.abs(b)), `${kind}: ${a}, ${b}`);
        near(span.value(0), span.low);
        near(span.value(1), span.high);
        if (value > 0 || !span.log) near(span.value(span.place(value)), value);
        assert(span.place(NaN) >= 0 || Number.isNaN(span.place(NaN)));
    }
    assert(new Span('pressure', 500, 0, 900).high > 900, 'it goes beyond the limit, to show the reason');
});
