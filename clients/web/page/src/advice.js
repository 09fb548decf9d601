// SPDX-License-Identifier: MIT
// What the figures of a status mean: why inputs are refused, and what helps against late ticks.

const REASONS = {
    wrong_size: 'the message has another length than its type', wrong_type: 'the message is of another version',
    bad_string: 'a text in it has no end', not_finite: 'a number in it is not finite',
    not_unit_quaternion: 'an orientation in it is no rotation', unknown_tool: 'the scene has no such tool, or it is static',
    unknown_body: 'the scene has no such body', out_of_range: 'a value is outside its range',
    unknown_command: 'no such command, or it lacks its argument',
    tool_owned_by_other: 'another program moves the tool', overtaken: 'a newer pose came first',
    stale: 'it had waited for too long', queue_full: 'too many requests were waiting',
    not_possible: 'the scene cannot do it', not_a_packet: 'no LCM packet', fragment: 'longer than one packet',
    other_host: 'it came from another machine', switched_off: 'the scene has switched it off',
};
// By the words of status_t.stage.
const STAGES = {
    forces: 'fewer nodes or larger cells, a softer material (fewer substeps), or more threads',
    contact: 'fewer or simpler tools, larger faces at the surface, or less contact.stiffness (fewer substeps)',
    'find contacts': 'fewer capsules of tools, or larger faces at the surface',
    touch: 'fewer touches between bodies, or larger faces where they touch',
    cut: 'a shorter or slower stroke', reconstruct: 'a smaller split_budget, or fewer levels around cuts',
    adapt: 'fewer levels, or higher thresholds (adapt_force, adapt_speed, adapt_curvature)',
    grasp: 'a smaller ball of jaws', stiffness: 'contact_stiffness = false',
    estimate: 'without the error estimate (estimate_error = false)', error: 'without errors (publish.error_hz = 0)', snapshot: 'a lower publish.nodes_hz',
};
const ELSEWHERE = 'give the server a quiet processor and real-time priority (config/SERVICE.md)';
const MUCH = 0.5; // of the time that a tick has, in its stages: less cannot make it late

/** Refused inputs that are new since the last counts: [{reason, count (in all), meaning}]. */
export function newRefusals(reasons, before) {
    return Object.entries(reasons).filter(([reason, count]) => REASONS[reason] && count > (before[reason] ?? 0))
        .map(([reason, count]) => ({ reason, count, meaning: REASONS[reason] }));
}

/** What to do about late ticks, by the stage that takes most of a tick; `stages` [us]. */
export function lateAdvice(stages, rate) {
    const tick = 1e6 / rate;
    const all = Object.entries(stages).filter(([, us]) => Number.isFinite(us));
    const sum = all.reduce((total, [, us]) => total + us, 0);
    if (all.length === 0 || sum < MUCH * tick)
        return `Ticks are late although their stages take ${Math.round(sum)} of ${Math.round(tick)} µs: ${ELSEWHERE}.`;
    const [stage, us] = all.reduce((most, one) => (one[1] > most[1] ? one : most));
    return `Ticks are late, and “${stage}” takes ${Math.round(us)} of ${Math.round(tick)} µs: ` +
        `${STAGES[stage] ?? 'a lower rate_hz'}, or a lower rate_hz.`;
}
