// SPDX-License-Identifier: MIT
// The workbench: scenes to start, meshes to drop, recordings. What a program says when it fails is
// shown where it was started.

import { Proposal, element, make } from './proposal.js';
import { Thumbs } from './thumbs.js';

const MESH = /\.(obj|stl|ply|off|vt[kpu]|msh|nrrd|nii|nii\.gz)$/i;

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

export class Workbench {
    /** `changed`: called after each message. */
    constructor(link, changed) {
        this.link = link;
        this.changed = changed;
        this.state = null; // the newest message; null: this server has no workbench
        this.live = false; // some daemon runs
        this.perMinute = ''; // what a recording takes
        this.filled = new Map(); // id of a list -> what it shows
        this.places = new Map(); // id of a request -> where its refusal is shown
        this.thumbs = new Thumbs();
        this.proposal = new Proposal({ ask: (message) => this.ask('mesh-error', message),
            start: (name) => this.start('uploads', name), say: (text) => this.say('mesh-error', text) });
        element('record').addEventListener('click', () => this.record());
        element('scene-end').addEventListener('click', () => this.ask('scene-error', { type: 'end' }));
        element('mesh').addEventListener('change', ({ target }) => {
            if (target.files[0]) this.send(target.files[0]);
            target.value = ''; // the same file may be chosen again
        });
        element('mesh-list').addEventListener('change', ({ target }) => this.proposal.open(target.value));
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
            return this.say('mesh-error', `${file.name}: expected OBJ, STL, PLY, OFF, VTK, VTP, VTU, MSH, NRRD or NIfTI (.nii, .nii.gz)`);
        if (file.size > most)
            return this.say('mesh-error', `${file.name}: ${bytesText(file.size)}, more than ${bytesText(most)}`);
        this.say('mesh-error', `sending ${file.name} …`);
        try {
            const answer = await fetch(`/mesh?name=${encodeURIComponent(file.name)}`,
                { method: 'POST', headers: { 'Content-Type': 'application/octet-stream' }, body: file });
            const text = (await answer.text()).trim();
            if (answer.status !== 201) return this.say('mesh-error', `${file.name}: ${text}`);
            return this.proposal.open(text);
        } catch {
            return this.say('mesh-error', `${file.name} could not be sent: the connection ended`);
        }
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
            const item = make('li'), picture = this.thumbs.of(folder, name, bytes, about);
            if (picture) item.append(Object.assign(make('img'), { src: picture, alt: '' }));
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
        this.fill('scene-list', { daemon, foreign, pictures: this.thumbs.count, files: [...of('uploads', uploads), ...of('scenes', scenes)] }, row);
        this.fill('recording-list', { daemon, foreign, plays, pictures: this.thumbs.count, files: of('recordings', finished) }, row);
        element('more').hidden = !more;
        element('more').textContent = `${more} more files are not listed`;
        element('scene-end').hidden = !runs;
        element('scene-end').disabled = daemon.state === 'ending';
        element('scene-end').textContent = daemon.state === 'ending' ? `${daemon.file} ends …` : `Stop ${daemon.file}`;
        element('foreign').hidden = !foreign;
    }

    /** Meshes that were sent before: what was made of one of them is made again. */
    showMeshes({ meshes, prepare: { file } }) {
        element('mesh-row').hidden = !meshes.length;
        this.fill('mesh-list', { files: meshes.map(({ name }) => name) }, (name) => make('option', '', name));
        element('mesh-list').value = file || this.proposal.mesh || '';
    }

    showRecorder({ recorder, recordings }) {
        const runs = recorder.state === 'running';
        const size = recordings.find(({ name }) => name === recorder.file)?.bytes ?? 0;
        const frames = [...(recorder.text ?? '').matchAll(/^body (\S+): frames (\d+)/gm)];
        element('record').hidden = false;
        element('record').textContent = runs ? `Stop recording (${bytesText(size)})` : `Record${this.perMinute}`;
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
        this.showMeshes(this.state);
        this.proposal.show(this.state.prepare);
    }

    /** The first picture of the scene that runs becomes that of its row. */
    picture(stage) {
        const { daemon, ...lists } = this.state ?? {};
        const files = lists[daemon?.folder] ?? [], file = files.find(({ name }) => name === daemon.file);
        if (daemon?.state !== 'running' || lists.foreign || !file) return;
        this.thumbs.keep(daemon.folder, file.name, file.bytes, stage);
        this.show();
    }

    /** What a minute of recording takes at most [bytes]; 0: not known. */
    takeRate(bytes) {
        const text = bytes ? ` (≤ ${bytesText(bytes)}/min)` : '';
        if (text === this.perMinute) return;
        this.perMinute = text;
        this.show();
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
