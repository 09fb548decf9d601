// SPDX-License-Identifier: MIT
// The switches, the figures and the list of events: everything on the page but the picture.

import { lateAdvice, newRefusals } from './advice.js';
import { Chart } from './charts.js';
import { COLOUR, ERRORS, LEVELS } from './tissue.js';
import { figure, lengthText, timesText } from './units.js';

const EVENTS_SHOWN = 60;
const ADVICE_MS = 5000; // after the last late tick
const element = (id) => document.getElementById(id);
const set = (id, text) => {
    const node = typeof id === 'string' ? element(id) : id;
    if (node.textContent !== text) node.textContent = text;
};
export class Panel {
    /** `on`: {command(kind), mode(mode), look(settings), home()}. */
    constructor(on) {
        this.on = on;
        this.state = '';
        this.live = false;
        this.late = null;
        this.reasons = null;
        this.lateAt = -Infinity;
        this.size = 0.2;
        this.settings = { depth: 0.1, speed: 0.25, shallow: false };
        this.stepChart = new Chart(element('step-chart'), { log: true,
            lines: [{ colour: '#6d7880' }, { colour: '#f0b429' }, { colour: '#7cc4f0' }] });
        this.lateChart = new Chart(element('late-chart'), { lines: [{ colour: '#e0655f', bars: true }] });
        this.errorChart = new Chart(element('error-chart'), { log: true, lines: [{ colour: '#6fc28b' }] });
        for (const id of ['colouring', 'wireframe', 'springs', 'lips', 'red', 'threshold', 'depth', 'speed',
            'shallow'])
            element(id).addEventListener('input', () => this.changed());
        for (const input of document.querySelectorAll('input[name=mode]'))
            input.addEventListener('change', () => this.on.mode(input.value));
        for (const kind of ['pause', 'resume', 'step', 'reset'])
            element(kind).addEventListener('click', () => this.on.command(kind));
        element('home').addEventListener('click', () => this.on.home());
        element('panel-button').addEventListener('click', () => this.fold());
        document.addEventListener('keydown', (event) => this.key(event));
        this.fold(innerWidth >= 820 && innerHeight >= 480);
        element('error-legend').style.setProperty('--colours',
            ERRORS.map((hex) => `#${hex.toString(16).padStart(6, '0')}`).join(', '));
        this.takeLevels(0);
    }

    fold(open = !document.body.classList.contains('panelled')) {
        document.body.classList.toggle('panelled', open);
        element('panel-button').setAttribute('aria-expanded', String(open));
    }

    /** True if the panel lies over the picture. */
    get covers() { return innerWidth < 560; }

    /** The levels that bodies have now: 0 to `finest`. */
    takeLevels(finest) {
        if (finest === this.finest) return;
        this.finest = finest;
        element('legend').replaceChildren(...LEVELS.slice(0, finest + 1).map((hex, level) => {
            const field = document.createElement('span');
            field.textContent = finest ? String(level) : '0: nothing is refined now';
            field.style.background = `#${hex.toString(16).padStart(6, '0')}`;
            return field;
        }));
    }

    /** Whether bodies tell what a colouring shows: then it can be chosen. */
    offer(colouring, known) {
        const option = element('colouring').querySelector(`[value="${colouring}"]`);
        if (option.hidden !== known) return;
        option.hidden = option.disabled = !known;
        if (known || Number(element('colouring').value) !== colouring) return;
        element('colouring').value = String(COLOUR.TISSUE);
        this.changed();
    }

    key(event) {
        if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
        if (/^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== 'radio' &&
            event.target.type !== 'checkbox') return;
        const mode = { 1: 'press', 2: 'pull', 3: 'cut', 4: 'tie', 5: 'remove' }[event.key];
        if (mode) {
            document.querySelector(`input[name=mode][value=${mode}]`).checked = true;
            this.on.mode(mode);
        }
        const key = event.key.toLowerCase();
        if (key === 'h') this.on.home();
        const kind = { p: this.state === 'running' ? 'pause' : 'resume', s: 'step', r: 'reset' }[key];
        if (kind && !document.body.classList.contains('read-only') && !element(kind).disabled) this.on.command(kind);
    }

    /** What the switches say; tells the page. */
    changed() {
        const checked = (id) => element(id).checked;
        const number = (id) => Number(element(id).value);
        const { settings } = this;
        settings.depth = number('depth') / 100;
        settings.speed = number('speed') / 100;
        settings.shallow = checked('shallow');
        // Finer for small displacements: the square of the slider, up to a quarter of the size.
        const threshold = 0.25 * this.size * (number('threshold') / 100) ** 2;
        set('threshold-text', lengthText(threshold));
        set('depth-text', lengthText(settings.depth * this.size));
        set('speed-text', `${figure(1000 * settings.speed * this.size, 0)} mm/s`);
        const colouring = number('colouring');
        element('legend').hidden = colouring !== COLOUR.LEVEL;
        element('error-legend').hidden = colouring !== COLOUR.ERROR;
        element('elements-legend').hidden = colouring !== COLOUR.ELEMENT;
        this.on.look({ colouring, wireframe: checked('wireframe'), springs: checked('springs'),
            lips: checked('lips'), threshold: checked('red') ? Math.max(threshold, 1e-9) : 0 });
    }

    sized(size) {
        this.size = size;
        this.changed();
    }

    takeScene(scene) {
        set('scene-name', scene.name || 'Pliant');
        document.title = scene.name ? `${scene.name} · Pliant` : 'Pliant';
        set('describe', scene.describe ?? '');
        this.late = this.reasons = null;
        this.lateAt = -Infinity;
        this.state = '';
        this.showState();
        element('events').replaceChildren();
        element('advice').hidden = true;
        for (const id of ['clock', 'step-text', 'late-text', 'error-text', 'counts']) set(id, '');
        for (const chart of [this.stepChart, this.lateChart, this.errorChart]) chart.clear();
        element('bodies').replaceChildren(...scene.bodies.map(({ name }) => {
            const row = document.createElement('tr');
            row.dataset.body = name;
            row.append(...['name', 'nodes', 'pieces', 'moved'].map((field) => {
                const cell = document.createElement('td');
                cell.dataset.field = field;
                cell.textContent = field === 'name' ? name : '–';
                return cell;
            }));
            return row;
        }));
    }

    takeStatus(status) {
        this.state = status.state;
        this.showState();
        // A status that follows another immediately reports no steps: the earlier figures stay valid.
        const measured = status.step_us[3] > 0 || status.state !== 'running';
        if (measured) this.factor = status.real_time_factor;
        set('clock', `${figure(status.time, 1)} s · ${figure(this.factor, 2)}× real time`);
        if (measured) this.drawTiming(status);
        for (const row of element('bodies').children) {
            const body = status.body.find(({ name }) => name === row.dataset.body);
            if (!body) continue;
            const [, nodes, pieces, moved] = row.children;
            row.title = `${body.model}, ${body.integrator}: ${body.springs} springs, ${body.elements} elements, ` +
                `finest level ${body.finest_level}, time step ${timesText([1e6 * body.time_step], 1e6 * body.time_step)}`;
            set(nodes, String(body.nodes));
            set(pieces, String(body.pieces));
            set(moved, lengthText(body.max_displacement));
            moved.dataset.metres = body.max_displacement;
        }
    }

    // The state of a silent daemon is unknown: do not show its last one as current.
    showState() {
        const pill = element('state'), { state } = this;
        pill.hidden = !this.live; // the other pill says why
        set(pill, state || '–');
        pill.className = `pill ${state === 'running' ? 'good' : 'warm'}`;
        element('pause').disabled = !this.live || state === 'paused';
        element('resume').disabled = !this.live || state === 'running';
        element('step').disabled = element('reset').disabled = !this.live;
    }

    drawTiming(status) {
        const [p50, p99, , most] = status.step_us;
        const deadline = 1e6 / status.rate_hz;
        this.stepChart.limit = deadline;
        this.stepChart.add([most, p99, p50]);
        set('step-text', `${timesText([p50, p99, most], most)} of ${timesText([deadline], deadline)}`);
        element('step-text').title = 'time of a step: median, 99th percentile and longest, of what there is';
        const late = this.late === null ? 0 : Math.max(status.late_ticks - this.late, 0);
        this.late = status.late_ticks;
        this.lateChart.add([late]);
        set('late-text', `${status.late_ticks}${late ? ` (+${late})` : ''}`);
        this.advise(status, late);
        const error = Math.max(0, ...status.body.map((body) => body.estimated_error));
        this.errorChart.add([error]);
        set('error-text', error > 0 ? error.toExponential(1) : 'not estimated');
        set('counts', `resets ${status.resets} · refused ${status.rejected}`);
    }

    // What to do about late ticks, as long as some were late lately; and which inputs were refused, why.
    advise(status, late) {
        const now = performance.now();
        if (late > 0) {
            this.lateAt = now;
            set('advice', lateAdvice(status.stages ?? {}, status.rate_hz));
        }
        element('advice').hidden = now - this.lateAt > ADVICE_MS;
        const reasons = status.reasons ?? {};
        for (const { reason, count, meaning } of newRefusals(reasons, this.reasons ?? reasons)) {
            // One line of each reason: a program that sends a thousand a second leaves room for other events.
            element('events').querySelector(`[data-reason="${reason}"]`)?.remove();
            this.takeEvent('refused', `${count} input${count > 1 ? 's' : ''} so far, ${reason}: ${meaning}`, true);
            element('events').firstChild.dataset.reason = reason;
        }
        this.reasons = reasons;
    }

    takeEvent(kind, text, bad) {
        const list = element('events'), last = list.firstChild;
        // Repeats of a line become one line with a count.
        if (last?.dataset.what === `${kind} ${text}`) {
            last.dataset.times = String(Number(last.dataset.times) + 1);
            last.lastChild.textContent = ` ×${last.dataset.times}`;
            return;
        }
        const item = document.createElement('li');
        const name = document.createElement('b');
        name.textContent = kind;
        item.append(name, ` ${text}`, document.createElement('i'));
        item.dataset.what = `${kind} ${text}`;
        item.dataset.times = '1';
        item.classList.toggle('bad', bad);
        list.prepend(item);
        while (list.children.length > EVENTS_SHOWN) list.lastChild.remove();
    }

    /** The link: what is seen, or, with a notice, why there is nothing to see; `lost`: although there was. */
    takeLink(short, notice, lost) {
        this.live = !notice;
        this.showState();
        const pill = element('link');
        set(pill, short);
        pill.className = `pill ${this.live ? 'good' : lost ? 'bad' : 'warm'}`;
        document.body.classList.toggle('silent', !this.live);
        element('notice').hidden = !notice;
        set('notice', notice);
    }

    takeForces(tools) {
        let text = '', newtons = 0;
        for (const tool of tools)
            if (tool.touching) {
                newtons += tool.force;
                text += `${text ? ', ' : ''}${tool.kind} ${tool.id}: ${figure(tool.force)} N` +
                    (tool.contact.depth > 0 ? `, ${lengthText(tool.contact.depth)} deep` : '');
            }
        const output = element('force');
        set(output, `${figure(newtons)} N`);
        output.title = text;
        output.classList.toggle('idle', newtons === 0);
    }

    hint(text) { set('hint', text); }

    readOnly(on) { document.body.classList.toggle('read-only', on); }
}
