// SPDX-License-Identifier: MIT
// The workbench: scenes to start, meshes to drop, recordings. What a program says when it fails is
// shown where it was started.

const MESH = /\.(obj|stl|ply|off|nrrd|nii|nii\.gz)$/i;
const element = (id) => document.getElementById(id);

/** An element with a class and a text. */
function make(tag, className, text = '') {
    const node = document.createElement(tag);
    if (className) node.className = className;
    node.textContent = text;
    return node;
}

function button(text, title, act) {
    const node = make('button', '', text);
    node.type = 'button';
    node.title = title;
    node.addEventListener('click', act);
    return node;
}

/** "1.2 MB" */
export function bytesText(bytes) {
    for (const [unit, size] of [['GB', 1e9], ['MB', 1e6], ['kB', 1e3]])
        if (bytes >= size) return `${(bytes / size).toFixed(bytes < 10 * size ? 1 : 0)} ${unit}`;
    return `${bytes} bytes`;
}

/** What was found out about a mesh: pairs of a name and a sentence, in the order in which one reads them. */
export function explain(check, sceneText) {
    const line = (name) => check.match(new RegExp(`^ +${name}: (.*)$`, 'm'))?.[1];
    const material = sceneText.match(/material = \{([^}]*)\}/)?.[1]?.replace(/;/g, ',').trim().replace(/,$/, '');
    const model = sceneText.match(/model = "(\w+)"/)?.[1];
    return [
        ['units', line('scale')?.replace(/ \(else --units.*\)/, '; choose below if that is wrong')],
        ['size', line('box')],
        ['repaired', line('repairs')],
        ['as a wall', line('as a wall')],
        ['as a solid', line('as a solid')],
        ['model', model && `${model}: ${model === 'surface' ? 'a wall of springs, hollow inside' : 'a solid of elements'}`],
        ['material', material && `${material} (SI units). That of soft tissue: no file says it; change it in the scene`],
    ].filter(([, text]) => text);
}

export class Workbench {
    /** `changed`: called after each message. */
    constructor(link, changed) {
        this.link = link;
        this.changed = changed;
        this.state = null; // the newest message; null: this server has no workbench
        this.live = false; // some daemon runs
        this.filled = new Map(); // id of a list -> what it shows
        this.places = new Map(); // id of a request -> where its refusal is shown
        element('record').addEventListener('click', () => this.record());
        element('scene-end').addEventListener('click', () => this.ask('scene-error', { type: 'end' }));
        element('propose').addEventListener('click', () => this.propose());
        element('proposal-start').addEventListener('click', () => this.start('uploads', this.state.prepare.scene));
        element('mesh').addEventListener('change', ({ target }) => {
            if (target.files[0]) this.send(target.files[0]);
            target.value = ''; // the same file may be chosen again
        });
        for (const kind of ['dragenter', 'dragover', 'dragleave', 'drop'])
            document.addEventListener(kind, (event) => this.drag(kind, event));
    }

    ask(place, message) {
        this.say(place, '');
        const id = this.link.request(message);
        if (id) this.places.set(id, place);
        else this.say(place, 'pliant-web does not answer');
    }

    say(place, text) {
        element(place).textContent = text;
        element(place).hidden = !text;
    }

    start(folder, name) { this.ask('scene-error', { type: 'start', folder, name }); }

    record() { this.ask('record-error', { type: 'record', on: this.state.recorder.state !== 'running' }); }

    /** True if it was the answer to a request from here. */
    takeError({ id, text }) {
        const place = this.places.get(id);
        if (!place) return false;
        this.places.delete(id);
        this.say(place, text);
        return true;
    }

    // --- meshes ---

    drag(kind, event) {
        if (!this.state || document.body.classList.contains('read-only') || !event.dataTransfer?.types.includes('Files')) return;
        event.preventDefault(); // else the browser opens the file
        document.body.classList.toggle('dropping', kind === 'dragenter' || kind === 'dragover');
        if (kind === 'drop' && event.dataTransfer.files[0]) this.send(event.dataTransfer.files[0]);
    }

    /** Sends a mesh, and asks for a scene for it. */
    async send(file) {
        const { upload_bytes: most } = this.state;
        element('workbench').open = element('proposal').open = true;
        element('proposal').hidden = false;
        if (!MESH.test(file.name))
            return this.say('mesh-error', `${file.name}: expected OBJ, STL, PLY, OFF, NRRD or NIfTI (.nii, .nii.gz)`);
        if (file.size > most)
            return this.say('mesh-error', `${file.name}: ${bytesText(file.size)}, more than ${bytesText(most)}`);
        this.say('mesh-error', `sending ${file.name} …`);
        try {
            const answer = await fetch(`/mesh?name=${encodeURIComponent(file.name)}`,
                { method: 'POST', headers: { 'Content-Type': 'application/octet-stream' }, body: file });
            const text = (await answer.text()).trim();
            if (answer.status !== 201) return this.say('mesh-error', `${file.name}: ${text}`);
            this.mesh = text;
            return this.propose();
        } catch {
            return this.say('mesh-error', `${file.name} could not be sent: the connection ended`);
        }
    }

    propose() {
        const message = { type: 'propose', name: this.mesh };
        for (const choice of ['units', 'model']) if (element(choice).value) message[choice] = element(choice).value;
        this.ask('mesh-error', message);
    }

    showProposal({ state, file, check, scene, scene_text: text, text: said, how }) {
        this.mesh ??= file || null;
        element('proposal').hidden = !file && !this.mesh;
        element('proposal-name').textContent = file || this.mesh || '';
        const runs = state === 'running';
        element('propose').disabled = runs || !this.mesh;
        element('proposal-start').disabled = runs || !scene;
        element('proposal-start').textContent = scene ? `Start ${scene}` : 'Start';
        element('explained').replaceChildren(...explain(check, text).flatMap(([name, sentence]) =>
            [make('dt', '', name), make('dd', '', sentence)]));
        element('proposal-text').textContent = [check, said, text].filter(Boolean).join('\n');
        if (runs) this.say('mesh-error', 'pliant-prepare looks at it …');
        else if (state === 'failed') this.say('mesh-error', `no scene can be made of it (${how}): ${said.trim() ||
            (how.startsWith('signal') ? 'it takes more than two minutes or 4 GB' : '')}`);
        else if (element('mesh-error').textContent.startsWith('pliant-prepare looks')) this.say('mesh-error', '');
    }

    // --- the lists ---

    /** Rows are made again only if they change: a click that began on one must end on it. */
    fill(id, made, row) {
        const key = JSON.stringify(made);
        if (this.filled.get(id) === key) return;
        this.filled.set(id, key);
        element(id).replaceChildren(...made.files.map(row));
        element(id).querySelector('.failure')?.scrollIntoView({ block: 'nearest' });
    }

    showScenes({ scenes, uploads, recordings, daemon, recorder, plays, more, foreign }) {
        const runs = daemon.state === 'running' || daemon.state === 'ending';
        const of = (folder, files) => files.map((file) => ({ folder, ...file }));
        const row = ({ folder, name, about, bytes }) => {
            const item = make('li');
            const ours = daemon.folder === folder && daemon.file === name;
            if (folder !== 'recordings' || plays) {
                const start = button(folder === 'recordings' ? 'Play' : name, foreign
                    ? 'a pliantd that was not started here runs' : 'start it', () => this.start(folder, name));
                start.dataset.start = name;
                start.disabled = foreign || (ours && runs);
                item.append(start);
            }
            if (folder === 'recordings') {
                const save = make('a', '', name);
                save.href = `/recordings/${encodeURIComponent(name)}`;
                save.download = name;
                item.append(save, make('small', '', ` ${bytesText(bytes)}`));
            } else if (about) {
                item.append(make('small', '', about));
            }
            item.classList.toggle('current', ours && runs);
            if (ours && daemon.state === 'failed')
                item.append(make('pre', 'failure', `${daemon.how}\n${daemon.text}`.trim()));
            return item;
        };
        const finished = recordings.filter(({ name }) => recorder.state !== 'running' || name !== recorder.file);
        this.fill('scene-list', { daemon, foreign, files: [...of('uploads', uploads), ...of('scenes', scenes)] }, row);
        this.fill('recording-list', { daemon, foreign, plays, files: of('recordings', finished) }, row);
        element('more').hidden = !more;
        element('more').textContent = `${more} more files are not listed`;
        element('scene-end').hidden = !runs;
        element('scene-end').disabled = daemon.state === 'ending';
        element('scene-end').textContent = daemon.state === 'ending' ? `${daemon.file} ends …` : `Stop ${daemon.file}`;
        element('foreign').hidden = !foreign;
    }

    showRecorder({ recorder, recordings }) {
        const runs = recorder.state === 'running';
        const size = recordings.find(({ name }) => name === recorder.file)?.bytes ?? 0;
        const frames = [...(recorder.text ?? '').matchAll(/^body (\S+): frames (\d+)/gm)];
        element('record').hidden = false;
        element('record').textContent = runs ? `Stop recording (${bytesText(size)})` : 'Record';
        element('record').classList.toggle('recording', runs);
        element('record').disabled = recorder.state === 'ending' || (!runs && !this.live);
        const text = runs ? `recording ${recorder.file}, ${bytesText(size)}`
            : recorder.state === 'failed' ? `${recorder.file} (${recorder.how}): ${recorder.text.trim()}`
                : recorder.state === 'ended' ? `${recorder.file}, ${bytesText(size)}: ${
                    frames.map(([, body, count]) => `${count} frames of ${body}`).join(', ') || 'nothing came'}` : '';
        this.say('recorder', text);
        element('recorder').classList.toggle('failure', recorder.state === 'failed');
    }

    /** The newest state of the server's workbench. */
    take(message) {
        this.state = message;
        element('workbench').hidden = false;
        this.show();
        this.changed();
    }

    show() {
        if (!this.state) return;
        this.showScenes(this.state);
        this.showRecorder(this.state);
        this.showProposal(this.state.prepare);
    }

    /** Whether a daemon runs, whoever has started it. */
    takeLink(live) {
        if (this.live === live) return;
        this.live = live;
        this.show();
    }

    /** Why nothing is to be seen, as far as it is known here; ''. */
    get notice() {
        const { daemon } = this.state ?? {};
        if (!daemon) return '';
        if (daemon.state === 'failed')
            return `${daemon.file} has ended (${daemon.how}): ${daemon.text.trim().split('\n').slice(-3).join(' · ')}`;
        return daemon.state === 'running' ? `${daemon.file} starts …` : 'Nothing runs: choose a scene, or drop a mesh.';
    }
}
