// SPDX-License-Identifier: MIT
// The page: connects the link, the bodies, the tools, the hand and the panel.

import { NoColorSpace, TextureLoader } from 'three';
import { Body } from './body.js';
import { Capture } from './capture.js';
import { showElements } from './elements.js';
import { Errors } from './errors.js';
import { Forces } from './forces.js';
import { Hand } from './hand.js';
import { isIdleCut } from './knife.js';
import { Link } from './link.js';
import { Ledger } from './ledger.js';
import { Panel } from './panel.js';
import { Workbench } from './scenes.js';
import { SecondHand } from './second.js';
import { Settings } from './settings.js';
import { Stage, boxOfAll } from './stage.js';
import { Timeline } from './timeline.js';
import { Tools } from './tools.js';
import { applyLook, COLOUR, drawnTissue, look } from './tissue.js';

const HINTS = {
    press: 'Drag on tissue: press (wheel: depth) · Shift: cut · Ctrl: pull · empty space or right button: turn',
    pull: 'Drag on tissue: pull (wheel: nearer, farther) · Shift: cut · empty space or right button: turn',
    cut: 'Drag across tissue: cut, by the scene’s blade if it has one · right button: turn',
    tie: 'Click on tissue: pin · drag to another body: tie, to the same one: clip · empty space or right button: turn',
    remove: 'Drag on tissue: take it away (wheel: depth) · empty space or right button: turn',
};
const TOUCH_HINTS = {
    press: 'Touch tissue and hold: press · one finger beside it: turn · two: turn and zoom',
    pull: 'Touch tissue and drag: pull · one finger beside it: turn · two: turn and zoom',
    cut: 'Drag across tissue: cut · two fingers: turn and zoom',
    tie: 'Tap tissue: pin · drag to another body: tie, to the same one: clip · two fingers: turn and zoom',
    remove: 'Touch tissue and drag: take it away · one finger beside it: turn · two: turn and zoom',
};
// A recording has so many bytes of a frame for each node, and of a body for its columns and the sidecar. What stands still
// takes less.
const NODE_BYTES = 12, BODY_BYTES = 960;
// What clients may send many times a second: not shown in the list.
const QUIET = new Set(['load', 'tool']);

const element = (id) => document.getElementById(id);
let bodies = [], textures = [], switches = { wireframe: false, springs: false };
let round = null, fitted = false, daemon = false, silence = 0, connected = false, drawnAt = 0, figuresAt = 0;
let colours = null, offered = false, published = 0; // [Hz] frames of nodes
let started = false; // everything below exists

function loadImage(path, loaded) {
    const image = new TextureLoader().load(path + location.search, loaded);
    image.colorSpace = NoColorSpace; // the shader squares it
    return image;
}

const images = {
    get drawn() { return colours ??= drawnTissue(stage.software); },
    get plain() { return stage.software; },
    /** Null: the body has none. */
    of(name) {
        if (!textures.includes(name)) return null;
        return loadImage(`/texture/${encodeURIComponent(name)}`, () => stage.invalidate());
    },
    /** Calls `there` with an image beside the scene, once it is loaded. */
    beside(name, there) {
        const image = loadImage(`/images/${encodeURIComponent(name)}`, () => { there(image); stage.invalidate(); });
    },
};

const stage = new Stage(element('picture'), beforeDraw,
    { above: document.querySelector('header'), below: element('foot') });
const tools = new Tools(stage, element('labels'));
const ledger = new Ledger();
const errors = new Errors();
const panel = new Panel({
    command: (kind) => link.request({ type: 'command', kind, value: kind === 'step' ? 1 : 0, argument: '' }),
    mode: (mode) => {
        hand.mode = mode;
        panel.hint(whatDragsDo());
        stage.canvas.style.cursor = hand.cursor();
        showTool();
    },
    look: takeLook,
    home: () => stage.home(),
});
const scheme = location.protocol === 'https:' ? 'wss:' : 'ws:';
const link = new Link(`${scheme}//${location.host}/live${location.search}`,
    { text: takeText, binary: takeBinary, state: takeState });
const command = (kind, argument) => link.request({ type: 'command', kind, value: 0, argument });
const timeline = new Timeline(element('timeline'),
    { set: (argument) => command('set', argument), command: (kind) => command(kind, '') });
const hand = new Hand({ stage, tools, link, settings: panel.settings, bodies: () => bodies,
    told: (text) => panel.hint(text || whatDragsDo()), refused: whyNothing, list: element('ties'),
    taken: () => second.tool?.id }, element('trail'));
const second = new SecondHand({ stage, tools, link, settings: panel.settings, refused: whyNothing, mouse: hand,
    allowed: () => hand.allowed }, element('second'), element('second-text'));
const workbench = new Workbench(link, takeWorkbench);
const settings = new Settings(element('settings'), link, whyNothing);
const forces = new Forces({ time: element('force-time'), depth: element('force-depth'), pause: element('force-pause'),
    save: element('force-save'), legend: element('force-legend') });
const capture = new Capture(stage, { picture: element('shoot'), video: element('video'),
    told: (text) => panel.hint(text), scene: () => element('scene-name').textContent });
element('tool').addEventListener('change', chooseTool);
element('second').addEventListener('change', showTool);
panel.hint(whatDragsDo());
started = true;
// For tests and measurements.
window.pliant = { stage, tools, panel, hand, second, settings, forces, capture, link, look, timeline,
    workbench, get bodies() { return bodies; } };

function whatDragsDo() { return (hand.touch ? TOUCH_HINTS : HINTS)[hand.mode]; }

// The mouse's tools by name: choosing one chooses what a drag does, and the other way round.
const MODES = { probe: 'press', grasper: 'pull', blade: 'cut', remover: 'remove' };
function chooseTool() {
    const tool = tools.list.find(({ id }) => String(id) === element('tool').value);
    hand.chosen = tool?.id ?? null;
    if (tool) document.querySelector(`input[name=mode][value=${MODES[tool.kind]}]`).click();
    stage.canvas.focus(); // keys are for the hand now, not for the list
}

function showTool() {
    const kind = Object.keys(MODES).find((one) => MODES[one] === hand.mode);
    element('tool').value = String((kind && hand.toolOf(kind)?.id) ?? '');
}

function listTools() {
    element('tool').replaceChildren(...[{ id: '', title: 'none' }, ...tools.list.filter(({ kind }) => MODES[kind])]
        .map(({ id, title }) => Object.assign(document.createElement('option'), { value: String(id), textContent: title })));
    hand.chosen = null;
    element('remove-mode').hidden = !tools.list.some(({ kind }) => kind === 'remover');
    showTool();
}

function takeLook(settings) {
    switches = settings;
    const { colouring, threshold, lips } = settings;
    Object.assign(look, { colouring, threshold, lips });
    changeLook();
}

function changeLook() {
    for (const body of bodies) {
        Object.assign(body.show, switches);
        if (body.dressed) applyLook(body.surface.material);
    }
    stage.invalidate();
}

function takeBinary(message) {
    const body = bodies[message.body];
    if (!body) return;
    if (message.kind === 'mesh') body.takeMesh(message);
    else if (message.kind === 'rest') body.takeRest(message);
    else if (message.kind === 'error map') takeErrorMap(body, message);
    else if (message.kind === 'elements') takeElements(body, message);
    else if (message.kind === 'look') toolsChanged = body.takeLook(message) || toolsChanged;
    else body.takeNodes(message);
}

function takeErrorMap(body, message) {
    body.takeErrorMap(message);
    panel.offer(COLOUR.ERROR, true);
    toolsChanged ||= look.colouring === COLOUR.ERROR;
}

function takeElements(body, message) {
    body.takeElements(message);
    panel.offer(COLOUR.ELEMENT, true);
    showElements(bodies);
    toolsChanged ||= look.colouring === COLOUR.ELEMENT;
}

function takeErrors(message) {
    errors.take(message, new Map(tools.list.map(({ id, title }) => [id, title])));
    tools.takeErrors(message.tool);
    changed();
}

function takeText(message) {
    const now = performance.now();
    switch (message.type) {
    case 'hello': return takeHello(message);
    case 'scene': return takeScene(message);
    case 'link': return takeLink(message);
    case 'status':
        for (const { name, mass } of message.body ?? [])
            for (const body of bodies) if (body.name === name) body.mass = mass;
        timeline.takeStatus(message);
        workbench.takeRate(60 * published * bodies.reduce((sum, { n }) => sum + NODE_BYTES * n + BODY_BYTES, 0));
        return panel.takeStatus(message);
    case 'ledger': return ledger.take(message);
    case 'errors': return takeErrors(message);
    case 'recording': return timeline.takeRecording(message);
    case 'playback': return takePlayback(message);
    case 'pose': for (const pose of message.tools) if (tools.takePose(pose, now)) changed(); return undefined;
    case 'contact':
        for (const contact of message.tools) {
            if (tools.takeContact(contact, now)) changed();
            if (contact.contact) timeline.takeForce(Math.hypot(...contact.force));
        }
        forces.takeContacts(message.tools, now);
        return undefined;
    case 'event':
        hand.takeEvent(message.kind, message.text);
        hand.ties.takeEvent(message.kind, message.text);
        settings.takeEvent(message.kind, message.text);
        if (QUIET.has(message.kind) || isIdleCut(message.text)) return undefined;
        timeline.takeEvent(message.kind, message.text);
        panel.takeEvent(message.kind, message.text, /refused|restored|withdrawn|reset/.test(message.kind));
        return undefined;
    case 'reply':
        hand.answered(message);
        timeline.answered(message);
        if (settings.answered(message)) return undefined;
        if (!message.ok && !isIdleCut(message.text)) panel.takeEvent('refused', message.text, true);
        return undefined;
    case 'workbench': return workbench.take(message);
    case 'error':
        if (workbench.takeError(message)) return undefined;
        hand.answered({ id: message.id, ok: false, text: message.text });
        settings.answered({ id: message.id, ok: false, text: message.text });
        timeline.answered(message);
        return panel.takeEvent('error', message.text, true);
    case 'round': return takeRound(message.round);
    default: return undefined;
    }
}

let toolsChanged = false, shadowOld = true;
function changed() { toolsChanged = true; }

// All of a round has arrived: draw it if it is new, and request the next.
function takeRound(number) {
    round = number;
    if (toolsChanged || bodies.some((body) => body.moved)) stage.invalidate();
    else if (!stage.wanted) askForMore();
}

const COLOURED_MS = 400; // colours come soon after the mesh
const FIGURES_MS = 100;
let figuresLater = null; // timer
function showFigures() {
    figuresLater = null;
    stage.invalidate();
}

function beforeDraw(view) {
    drawnAt = performance.now();
    toolsChanged = false;
    if (bodies.some((body) => body.moved)) shadowOld = true;
    for (const body of bodies) body.prepare(view);
    if (shadowOld) shadowOld = stage.ground.shade(bodies, drawnAt);
    if (!fitted && bodies.length && bodies.every((body) => body.shown)) {
        fitted = shadowOld = true;
        const box = boxOfAll(bodies);
        stage.fit(box, box.max.z - box.min.z < 1e-3 * (box.max.x - box.min.x), bodies.map((body) => body.livePoints()));
        panel.sized(stage.size);
        stage.firstBodies ??= drawnAt; // since the navigation began [ms]
        // Once this one is drawn, and again once its colours are there.
        const scene = workbench.state?.daemon?.file;
        setTimeout(() => workbench.picture(stage));
        setTimeout(() => { if (fitted && workbench.state?.daemon?.file === scene) workbench.picture(stage); }, COLOURED_MS);
    }
    // Update figures ten times per second: more is unreadable, and each new text costs layout and compositing. The
    // last ones before a standstill appear a little later.
    const figures = drawnAt - figuresAt >= FIGURES_MS;
    if (figures) figuresAt = drawnAt;
    else figuresLater ??= setTimeout(showFigures, FIGURES_MS - (drawnAt - figuresAt));
    tools.prepare(drawnAt, figures);
    panel.takeLevels(Math.max(0, ...bodies.map((body) => body.finest)));
    if (figures) panel.takeForces(tools.list);
    askForMore();
}

// Confirm a round when it is taken over, not when it is on the screen: the next one is in transit meanwhile.
function askForMore() {
    if (round !== null) link.send({ type: 'drawn', round });
    round = null;
}

function takeHello(hello) {
    textures = hello.textures ?? [];
    panel.readOnly(hello.read_only);
    hand.allowed = !hello.read_only;
}

// Nothing can be pressed in a recording.
function takePlayback(message) {
    const first = !timeline.recorded;
    timeline.takePlayback(message);
    if (!first) return;
    panel.hint('A recording: drag in the bar of time, step with the arrow keys, press P to play or pause.');
    showLink();
}

function takeScene(scene) {
    timeline.clear();
    showLink();
    for (const body of bodies) {
        stage.scene.remove(body.group);
        body.dispose();
    }
    bodies = scene.bodies.map((described, number) => new Body(number, described, images));
    for (const body of bodies) {
        Object.assign(body.show, switches);
        stage.scene.add(body.group);
    }
    hand.forget();
    // The daemon reports those that there are as events when it is asked to describe itself.
    if (/^ties by message/m.test(scene.describe ?? ''))
        link.request({ type: 'command', kind: 'describe', value: 0, argument: '' });
    tools.take(scene.tools ?? []);
    listTools();
    second.take(tools.list);
    forces.takeScene(tools.list);
    settings.takeScene(scene.describe ?? '');
    published = Number(/^publish on .*: nodes (\S+) Hz/m.exec(scene.describe)?.[1] ?? 0);
    panel.takeScene(scene);
    ledger.clear();
    errors.clear();
    panel.offer(COLOUR.ERROR, false);
    panel.offer(COLOUR.ELEMENT, false);
    panel.hint(whatDragsDo());
    fitted = false;
    document.body.classList.remove('empty');
    if (panel.covers) panel.fold(false); // where one looks for a scene it hides the picture
    stage.invalidate();
}

function takeState(state) {
    connected = state === 'open';
    if (!connected) {
        round = null;
        if (started) {
            hand.end();
            second.withdraw('no connection');
        }
    }
    showLink();
}

function takeLink(message) {
    daemon = message.daemon;
    silence = message.age;
    showLink();
}

// The reason why pressing, pulling, cutting and commands are disabled; '': enabled.
function whyNothing() {
    if (timeline.recorded) return 'This is a recording: nothing can be moved in it.';
    if (!connected) return 'pliant-web does not answer: nothing can be moved.';
    return daemon ? '' : 'pliantd is silent: nothing can be moved before it runs again.';
}

function showLink(age = silence) {
    const old = bodies.length > 0, why = started ? workbench.notice : '';
    if (started) workbench.takeLink(connected && daemon);
    if (!connected) panel.takeLink('no connection', `pliant-web does not answer, so the state of pliantd is unknown. ${
        old ? 'What you see is old. ' : ''}The page keeps trying.`, true);
    else if (!daemon) panel.takeLink(old ? 'daemon gone' : 'no daemon yet', old
        ? `pliantd is gone: no message from it${age > 0 ? ` for ${Math.round(age)} s` : ''}. What you see is ` +
            `old. ${why || 'The page continues as soon as one runs again.'}`
        : why || 'Waiting for pliantd …', old);
    else panel.takeLink(timeline.recorded ? 'recording' : 'live', '');
    if (started && whyNothing()) hand.end();
    const silent = !(connected && daemon);
    if (silent === look.silent) return;
    look.silent = silent;
    changeLook();
}

// Where there is no room for both, what can be started is shown as long as nothing was.
function takeWorkbench() {
    if (!offered && bodies.length === 0) panel.fold(true);
    offered = true;
    showLink();
}

// A silent tool, or a force that is not repeated, disappears without a round.
setInterval(() => {
    panel.takeForces(tools.list);
    if (tools.fallsSilent(performance.now())) stage.invalidate();
}, 250);
