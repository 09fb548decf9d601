// What to do about late ticks and refused inputs.

import { timesText } from './units.js';

const LATE = 0.001; // part of the ticks: fewer are the system's own hiccups
const KEPT_MS = 10000; // advice stays that long after the last late tick

const STAGES = {
    forces: 'fewer nodes or levels, larger cells, or threads = 2 in the scene',
    contacts: 'fewer faces where tools and bodies touch: a lower finest level, fewer pairs in touch',
    adapt: 'fewer levels, or larger adapt_* thresholds',
    cut: 'shorter strokes, or a coarser body where it is cut',
    check: 'fewer nodes',
};

const REASONS = {
    wrong_size: 'a message of another version of Pliant, or damaged',
    wrong_type: 'a message of another version of Pliant, or of another type than its channel\'s',
    bad_string: 'a text that is too long or not ended',
    not_finite: 'a number that is infinite or none',
    not_unit_quaternion: 'an orientation whose length is not 1',
    unknown_tool: 'a tool that the scene does not have',
    unknown_body: 'a body that the scene does not have',
    out_of_range: 'a number beyond its limits',
    unknown_command: 'a command that there is not',
    tool_owned_by_other: 'another program moves this tool; it is free when that one is silent for tool_timeout_s',
    overtaken: 'a pose that came after a newer one',
    stale: 'a message that is too old: do the clocks of both machines agree?',
    queue_full: 'more requests at once than the server keeps',
    not_possible: 'what the scene does not allow: the event says what',
    not_a_packet: 'a packet that is none of LCM\'s',
    fragment: 'a message in several packets: none of Pliant\'s is',
    other_host: 'another machine: a scene permits them with remote = true',
    switched_off: 'a command that the scene has switched off',
};

/** Why ticks are late, and what to do about it; `late`: of `ticks`. '': nothing to say. */
export function adviceOf({ step_us: [, p99, , most], wake_us: [, wake99] = [0, 0], rate_hz: rate, stages = {} },
    late, ticks) {
    if (!(late > LATE * ticks)) return '';
    const deadline = 1e6 / rate;
    const share = `${late} of ${ticks} ticks late.`;
    if (p99 > 0.9 * deadline || wake99 < 0.5 * deadline && most > deadline) {
        const [stage] = Object.entries(stages).sort(([, a], [, b]) => b - a)[0] ?? [''];
        return `${share} A step takes ${timesText([p99], p99)} (99th percentile) of ${timesText([deadline], deadline)}${
            stage ? `, most of it for ${stage}` : ''}. Try ${STAGES[stage] ?? STAGES.forces}; or a lower rate_hz. ` +
            'pliantd --check SCENE says what fits.';
    }
    return `${share} Steps fit (${timesText([p99], p99)} of ${timesText([deadline], deadline)}), but the server wakes ${
        timesText([wake99], wake99)} late: it needs real-time scheduling and locked memory (config/SERVICE.md), or a ` +
        'machine with less to do.';
}

/** The refusals that there are, the most frequent first. */
export const refusalsOf = (reasons) => Object.entries(reasons ?? {}).filter(([, count]) => count > 0)
    .sort(([, a], [, b]) => b - a)
    .map(([reason, count]) => `${count}× ${reason}${REASONS[reason] ? `: ${REASONS[reason]}` : ''}`);

export class Advice {
    constructor() { this.last = null; }

    clear() {
        this.last = null;
        this.show('advice', '');
        this.show('refusals', '');
    }

    show(id, text) {
        const node = document.getElementById(id);
        node.hidden = !text;
        if (node.textContent !== text) node.textContent = text;
    }

    take(status) {
        const { last } = this, now = performance.now();
        this.last = status;
        this.show('refusals', refusalsOf(status.reasons).join('\n'));
        if (!last || status.step < last.step) return;
        const late = status.late_ticks - last.late_ticks;
        const advice = adviceOf(status, late, status.step - last.step + late);
        if (advice) this.until = now + KEPT_MS;
        if (advice || now > this.until) this.show('advice', advice);
    }
}
