// SPDX-License-Identifier: MIT
// What was found in a mesh or label volume that was dropped, and what can be made of it: one chooses a label, a way and
// whether it can be cut, and gets the scene for that. Names come from files of strangers: they are texts, never markup.

export const element = (id) => document.getElementById(id);

/** An element with a class and a text. */
export function make(tag, className, text = '') {
    const node = document.createElement(tag);
    if (className) node.className = className;
    node.textContent = text;
    return node;
}

const EVEN = /-even(-\d+)?\.off$/; // what the server calls an even mesh of another one
const NAME_SHOWN = 48;
const WAYS = { surface: 'a wall, empty', filled: 'a wall, full of fluid', voxel: 'a solid' };

// What to do where no way is fast enough, and nothing can be made of it here.
const OPEN = (found) => (!found || found.closed || found.models[0].usable ? ''
    : ' Its surface is open, so no even skin can be made of it here: MeshLab can (Filters, Remeshing, Isotropic Explicit Remeshing).');

/** A name without what is not printed or turns the line around. */
export const plain = (text) => String(text ?? '').replace(/\p{C}/gu, '').slice(0, NAME_SHOWN);

/** "76 x 120 x 76 mm" */
export const sizeText = (mm) => `${mm.map((x) => (x >= 10 ? x.toFixed(0) : String(Number(x.toPrecision(2))))).join(' x ')} mm`;

/** "228 cm³" */
export const volumeText = (cm3) => `${cm3 >= 10 ? cm3.toFixed(0) : Number(cm3.toPrecision(2))} cm³`;

/** The colour that the file gives a label, or one that is far from those of its neighbours in the list. */
export function colourOf({ colour }, index) {
    const share = (x) => Math.round(255 * Math.min(Math.max(Number(x) || 0, 0), 1));
    return colour ? `rgb(${colour.map(share).join(', ')})` : `hsl(${Math.round(137.5 * index) % 360}, 60%, 60%)`;
}

/** What was found out about a mesh: pairs of a name and a sentence, in the order in which one reads them. */
export function explain(check, found, sceneText) {
    const line = (name) => check.match(new RegExp(`^ +${name}: (.*)$`, 'm'))?.[1];
    const material = sceneText.match(/material = \{([^}]*)\}/)?.[1]?.replace(/;/g, ',').trim().replace(/,$/, '');
    return [
        ['units', line('scale')?.replace(/ \(else --units.*\)/, '; choose below if that is wrong')],
        ['size', found && sizeText(found.size_mm)],
        ['repaired', line('repairs')],
        ['assumed', line('assumed')],
        ['material', material && `${material} (SI units). That of soft tissue: no file says it; change it in the scene`],
    ].filter(([, text]) => text);
}

/** A radio button with a title and smaller text, as a row of a list. */
function choiceRow(name, { title, lines, chosen, disabled, colour }, act) {
    const row = make('li'), label = make('label'), input = make('input');
    Object.assign(input, { type: 'radio', name, checked: chosen, disabled });
    input.addEventListener('change', act);
    label.append(input);
    if (colour) label.append(Object.assign(make('i', 'swatch'), { style: `background: ${colour}` }));
    label.append(make('b', '', title), ...lines.filter(Boolean).map((line) => make('small', '', line)));
    row.append(label);
    row.classList.toggle('current', chosen);
    return row;
}

export class Proposal {
    /** `on`: {ask(message), start(scene), say(text)}. */
    constructor(on) {
        this.on = on;
        this.mesh = null;  // name of the file
        this.choice = {};  // what the user has said of it, as the message has it
        this.shown = '';   // what the lists show,
        this.filled = '';  // and of which file, once all is known of it
        element('units').addEventListener('change', ({ target }) => this.choose({ units: target.value || undefined }));
        element('cuttable').addEventListener('change', ({ target }) =>
            this.choose({ cuttable: target.checked ? 'yes' : 'no' }));
        element('proposal-start').addEventListener('click', () => this.on.start(this.scene));
    }

    /** Another file: nothing is known of it. */
    open(mesh) {
        this.mesh = mesh;
        this.choice = {};
        element('units').value = '';
        this.propose();
    }

    /** `choice` is for the file that is shown, which another page may have opened. */
    choose(choice) {
        if (this.file && this.file !== this.mesh) {
            this.mesh = this.file;
            this.choice = {};
        }
        Object.assign(this.choice, { even: undefined }, choice);
        this.propose();
    }

    /** The server has made it, and goes on with it. */
    takeEven(file) {
        this.mesh = file;
        this.choice = { model: this.choice.model };
    }

    /** Asks for a scene, once the one that is being made is there. */
    propose() {
        this.waits = this.runs;
        if (!this.waits) this.on.ask({ type: 'propose', name: this.mesh, ...this.choice });
    }

    /** The newest state of the server's pliant-prepare. */
    show({ state, file, check, found: any, scene, scene_text: text, text: said, how }) {
        const found = any?.file === file ? any : null;
        const runs = this.runs = state === 'running';
        if (this.waits && !runs) this.propose();
        if (this.choice.even && file !== this.mesh && EVEN.test(file)) this.takeEven(file);
        this.mesh ??= file || null;
        this.file = file;
        this.scene = scene;
        element('proposal').hidden = !file && !this.mesh;
        element('proposal-name').textContent = file || this.mesh || '';
        element('choices').disabled = runs;
        element('proposal-start').disabled = runs || !scene;
        element('proposal-start').textContent = scene ? `Start ${scene}` : 'Start';
        // While another choice for the same file is looked at, the lists show what was chosen.
        const key = JSON.stringify([file, found, text]);
        if (key !== this.shown && !(runs && file === this.filled)) {
            this.fill(check, found, text);
            this.shown = key;
            if (!runs && this.filled !== file) element('proposal').scrollIntoView({ block: 'start' }); // it has grown
            if (!runs) this.filled = file;
        }
        element('proposal-text').textContent = [check, said, text].filter(Boolean).join('\n');
        if (runs) this.on.say('pliant-prepare looks at it …');
        else if (state === 'failed') this.on.say(`no scene can be made of it (${how}): ${said.trim() ||
            (how.startsWith('signal') ? 'it takes more than two minutes or 4 GB' : '')}`);
        else if (element('mesh-error').textContent.startsWith('pliant-prepare looks')) this.on.say('');
    }

    fill(check, found, text) {
        element('explained').replaceChildren(...explain(check, found, text).flatMap(([name, sentence]) =>
            [make('dt', '', name), make('dd', '', sentence)]));
        this.fillLabels(found);
        this.fillWays(found, text);
        element('cuttable').checked = /^ *cuttable = true/m.test(text);
        element('cuttable-row').hidden = !text;
    }

    fillLabels(found) {
        const labels = found?.labels ?? [], layered = found?.layers > 1;
        const word = /\.nii(\.gz)?$/i.test(this.mesh ?? '') ? 'frame' : 'layer';
        const isTaken = ({ label, layer }) => label === found.label && (!layered || layer === found.layer);
        const title = (one) => plain(one.name) || `label ${one.label}`;
        const taken = labels.findIndex(isTaken);
        element('label-said').hidden = !labels.length;
        const together = found?.label === 0, choose = (choice) => this.choose({ label: undefined, layer: undefined,
            together: undefined, model: undefined, cuttable: undefined, ...choice });
        element('label-said').textContent = together ? 'All labels were taken, as one body.' : taken < 0 ? '' : `${labels.length + found.unlisted} label${
            labels.length > 1 ? 's' : ''}: “${title(labels[taken])}”${
            layered ? ` of ${word} ${labels[taken].layer}` : ''} was taken${taken ? '' : ', the largest'}.${
            labels.length > 1 ? ' Choose another one here.' : ''}${
            found.unlisted ? ` The ${found.unlisted} smallest are not listed.` : ''}`;
        const inLayer = labels.filter(({ layer, volume_cm3: volume }) => volume && layer === labels[0].layer);
        const all = inLayer.length < 2 || layered ? [] : [choiceRow('label', { title: 'all, as one body', chosen: together,
            lines: ['each with its colour and its line in the ledger'] }, () => choose({ together: true }))];
        element('label-list').replaceChildren(...labels.map((one, index) => choiceRow('label', {
            title: title(one),
            colour: colourOf(one, index),
            chosen: index === taken,
            disabled: !one.volume_cm3,
            lines: [[`label ${one.label}`, layered && `${word} ${one.layer}`, volumeText(one.volume_cm3),
                one.volume_cm3 && sizeText(one.size_mm), one.pieces > 1 && `${one.pieces} pieces`].filter(Boolean).join(' · ')],
        }, () => choose({ label: one.label, layer: layered ? one.layer : undefined }))), ...all);
    }

    fillWays(found, text) {
        const solid = /model = "voxel"/.test(text), fluid = /^ *cavity = /m.test(text);
        const made = !text ? '' : solid ? 'voxel' : fluid ? 'filled' : 'surface';
        // Of what is closed an even mesh can be made, which nearly always is fast enough.
        const even = !EVEN.test(this.mesh ?? '') && found?.closed && !found.models.some(({ model, usable }) =>
            usable && model === 'surface');
        element('way-list').replaceChildren(...(found?.models ?? []).map(({ model, usable, verdict, use }) => {
            const madeFirst = even && model !== 'voxel';
            return choiceRow('model', {
                title: WAYS[model],
                chosen: model === made,
                disabled: !usable && !madeFirst,
                lines: [`${use[0].toUpperCase()}${use.slice(1)}.`, usable ? verdict.replace(/^yes, /, '')
                    : madeFirst ? `An even skin of about 1000 corners is made first, ${found.labels ? 'from the label'
                        : 'since its triangles are too small for a wall in real time'}.` : verdict],
            }, () => this.choose({ model, cuttable: undefined, even: madeFirst || undefined }));
        }));
        element('way-said').hidden = !made;
        element('way-said').textContent = !made ? '' : `${made === found?.model && !this.choice.model ? `Proposed as ${WAYS[made]}, ${found.why}.`
            : `As you chose: ${WAYS[made]}.`}${found?.hollow && solid ? ` But ${found.hollow}: is it hollow? Then choose ${
            WAYS.surface}, or ${WAYS.filled}.` : ''}${OPEN(found)}`;
    }
}
