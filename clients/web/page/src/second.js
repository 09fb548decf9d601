// SPDX-License-Identifier: MIT
// The second hand: moves another tool than the mouse does, by keys or by a gamepad, in the directions of the view.

import { Vector3 } from 'three';
import { Pose, hold } from './pose.js';
import { lengthText } from './units.js';

const TICK = 10, REPEAT = 40;     // [ms]
const DEAD = 0.15;                // of a stick's way: sticks do not return to zero
const TRIGGER_DEAD = 0.05;
const REACH = 1.5;                // of the scene's size: as far as the tool goes from its middle
const SLOWEST_TICK = 100;         // [ms] a longer pause of the page moves the tool no farther
// Right, up and into the picture.
const KEYS = { KeyD: [1, 0, 0], KeyA: [-1, 0, 0], KeyW: [0, 1, 0], KeyS: [0, -1, 0], KeyE: [0, 0, 1], KeyQ: [0, 0, -1] };

/** A stick's way outside its dead zone, from -1 to 1; 0 for what is no number. */
export function beyondDead(way, dead = DEAD) {
    const size = Math.min(Math.abs(way), 1);
    return size > dead ? Math.sign(way) * (size - dead) / (1 - dead) : 0;
}

/** What a gamepad says: {move: [right, up, in] from -1 to 1, grip from 0 to 1}. */
export function readPad({ axes, buttons }) {
    const value = (k) => Number(buttons[k]?.value ?? 0);
    const trigger = Math.max(value(6), value(7));
    return { move: [beyondDead(axes[0]), -beyondDead(axes[1]), -beyondDead(axes[3])],
        grip: Math.max(beyondDead(trigger, TRIGGER_DEAD), 0) };
}

export class SecondHand {
    /** `world` as of the hand, with `list`: the select that chooses the tool, and `text`: where it says what it does. */
    constructor(world, list, text) {
        this.world = world;
        this.list = list;
        this.text = text;
        this.pose = new Pose(world.link);
        this.tool = null;      // chosen
        this.held = null;      // how it is held; null: it is withdrawn
        this.keys = new Set();
        this.pad = null;       // index of the gamepad that moves it
        this.tip = new Vector3();
        this.axis = [new Vector3(), new Vector3(), new Vector3()];
        list.addEventListener('change', () => this.choose());
        // Before the page's own keys, of which S is one.
        window.addEventListener('keydown', (event) => this.key(event, true), { capture: true });
        window.addEventListener('keyup', (event) => this.key(event, false), { capture: true });
        window.addEventListener('blur', () => this.withdraw('the window lost the keyboard'));
        window.addEventListener('gamepaddisconnected', ({ gamepad }) => this.lost(gamepad.index));
    }

    /** The tools of a new scene. */
    take(tools) {
        this.withdraw('');
        const option = (value, title) => Object.assign(document.createElement('option'), { value, textContent: title });
        this.list.replaceChildren(option('', 'none'), ...tools.filter(({ kind }) => kind !== 'static')
            .map(({ id, title }) => option(String(id), title)));
        this.choose();
    }

    choose() {
        this.withdraw('');
        this.tool = this.world.tools.list.find(({ id }) => String(id) === this.list.value) ?? null;
        clearInterval(this.timer);
        if (!this.tool) return this.tell('');
        this.timer = setInterval(() => this.tick(), TICK);
        // Keys are for the tool now, not for the list.
        if (document.activeElement === this.list) this.world.stage.canvas.focus();
        return this.tell('W A S D: move · E, Q: into the picture, out of it · Space: grip · X: withdraw · or a gamepad');
    }

    key(event, down) {
        if (!this.tool || (event.code !== 'Space' && event.code !== 'KeyX' && !KEYS[event.code])) return;
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        const { tagName, type } = event.target;
        if (/^(SELECT|TEXTAREA)$/.test(tagName) || (tagName === 'INPUT' && !/^(radio|checkbox|range)$/.test(type))) return;
        event.preventDefault();
        event.stopPropagation();
        if (!down) this.keys.delete(event.code);
        else if (event.code === 'KeyX') this.withdraw('');
        else this.keys.add(event.code);
    }

    // The gamepad that moves the tool, or the first that is touched.
    findPad() {
        const pads = navigator.getGamepads?.() ?? [];
        if (this.pad !== null) {
            if (pads[this.pad]?.connected) return readPad(pads[this.pad]);
            this.lost(this.pad);
        }
        for (const pad of pads) {
            if (!pad?.connected) continue;
            const said = readPad(pad);
            if (!said.grip && !said.move.some(Boolean)) continue;
            this.pad = pad.index;
            return said;
        }
        return null;
    }

    lost(index) {
        if (this.pad !== index) return;
        this.pad = null;
        this.withdraw('the gamepad is gone');
    }

    tick() {
        const now = performance.now(), { world, keys } = this;
        const seconds = Math.min(now - (this.ticked ?? now), SLOWEST_TICK) / 1000;
        this.ticked = now;
        const pad = this.findPad();
        const move = [0, 1, 2].map((k) => (pad?.move[k] ?? 0) +
            Array.from(keys).reduce((sum, code) => sum + (KEYS[code]?.[k] ?? 0), 0));
        const grip = Math.max(pad?.grip ?? 0, keys.has('Space') ? 1 : 0);
        const still = grip === 0 && !move.some(Boolean);
        const why = world.refused() || (world.allowed() ? '' : 'this page may only watch');
        if (why) return this.withdraw(why);
        if (!this.held && still) return undefined;
        if (!this.held && !this.begin()) return undefined;
        const { stage, settings } = world;
        const [right, up, into] = this.axis;
        stage.camera.matrixWorld.extractBasis(right, up, into);
        into.negate();
        const step = settings.speed * stage.size * seconds;
        const before = this.tip.clone();
        move.forEach((way, k) => this.tip.addScaledVector(this.axis[k], Math.max(-1, Math.min(way, 1)) * step));
        this.tip.sub(stage.center).clampLength(0, REACH * stage.size).add(stage.center);
        if (!before.equals(this.tip) || grip !== this.grip || now - this.sent >= REPEAT) this.send(now, grip);
        return undefined;
    }

    // In front of the middle of the scene, towards the viewer.
    begin() {
        const { world, tool } = this;
        if (world.mouse.drag?.tool?.id === tool.id) return this.tell(`the mouse holds ${tool.title}`);
        const direction = world.stage.viewDirection(new Vector3());
        this.held = hold(world.stage, tool, direction);
        this.tip.copy(world.stage.center).addScaledVector(direction, -0.6 * world.stage.size);
        return true;
    }

    send(now, grip) {
        this.sent = now;
        this.grip = grip;
        this.pose.send(this.held, this.tip.clone().sub(this.held.tip), grip);
        const { stage } = this.world;
        const deep = this.tip.clone().sub(stage.center).dot(stage.viewDirection(new Vector3()));
        this.tell(`${this.tool.title}: ${lengthText(Math.abs(deep))} ${deep < 0 ? 'before' : 'behind'} the middle` +
            `${grip > 0 ? ', closed' : ''}`);
    }

    /** Withdraws the tool, as when it is put down; `why`: what is said, '' if it was wanted. */
    withdraw(why) {
        this.keys.clear();
        if (!this.held) return;
        this.held = null;
        this.pose.withdraw();
        this.tell(why ? `${this.tool.title} was withdrawn: ${why}` : `${this.tool.title} was withdrawn`);
    }

    tell(text) {
        if (this.text.textContent !== text) this.text.textContent = text;
        return false;
    }
}
