// SPDX-License-Identifier: MIT
// The mouse as a hand: presses with a probe, pulls with a grasper, cuts with a blade (or with cut messages). Sends poses at
// the pointer's events, and every few milliseconds while a tool is in use, independent of drawing.

import { Plane, Vector3 } from 'three';
import { pickTriangle } from './normals.js';
import { Knife } from './knife.js';
import { Ties } from './ties.js';
import { lengthText } from './units.js';
import { Pose, hold, turnHeld } from './pose.js';

const TICK = 10, REPEAT = 40;     // [ms]
const NEXT = 4;                   // [css pixels] between places of the pointer at one time
const SLOWEST_TICK = 100;         // [ms] that count of a longer time between two
const APART = 0.03;               // of the scene's size: from where a tool approaches
const LONG = 0.5;                 // of the scene's size: the edge of a blade that can go through all of it
const STEEPEST = 2;               // a blade goes deeper by so much of the way along the picture
const TURNS_WITHIN = 0.04;         // of the scene's size: the way in which a blade's back turns after a corner
const TURNS = 12;                  // [rad/s] no faster: the server would doubt it
const HELD_AFTER = 300;           // [ms] until jaws that report no force are said to hold nothing
const TELL_EVERY = 100;           // [ms]
const SILENT = 1000;               // [ms] after which the server has withdrawn a tool of a page that sent nothing
const STROKE_ENDS = 1000;         // [ms] after the blade's withdrawal; what no event has reported by then cut nothing
const STROKE_WAITS = 8;           // so often, for a blade that is still on its way

// Why nothing is pressed or pulled: the scene has no tool of that kind, and this line adds one; or the other hand has it.
function withoutTool(kind, tools, size) {
    if (tools.some((tool) => tool.kind === kind)) return `The other hand has the ${kind}.`;
    let id = 1;
    while (tools.some((tool) => tool.id === id)) id++;
    const figure = (metres) => Number(metres.toPrecision(2));
    const shaft = kind === 'probe' ? `to = [0.0, 0.0, ${figure(size / 2)}];  ` : '';
    const line = `{ id = ${id};  kind = "${kind}";  capsules = ( { ${shaft}radius = ${figure(size / 20)}; } ); }`;
    return `This scene has no ${kind}. ${tools.length ? `Add to its tools: ${line}` : `Add to it: tools = ( ${line} );`}`;
}

/** What an event says of a body, for people: "liver: 1158 mm³ (1.227 g)". */
export const plainly = (said) => said.replace('mm3', 'mm³').replace('mm3', 'mm³')
    .replace(/^body '(.*?)': (\d+) links severed(?:, \d+ nodes added)?(?:, (\d+) pieces?)?/, (_, name, links, pieces) =>
        `${name}: ${links} links${pieces > 1 ? `, in ${pieces} pieces now` : ''}`)
    .replace(/^\d+ \w+ of body '(.*?)' removed, (.*?), (\S+ g)/, '$1: $2 ($3)')
    .replace(/^(\S+ J) heated body '(.*?)', \d+ \w+ removed, (.*?), (\S+ g)/, '$2: $3 ($4) boiled away with $1')
    .replace(/^begins anew at a pose: no hand goes there so fast/, 'a part was faster than any hand');

const slipped = ({ title }) => `The tissue slipped out of ${title}: pull less, or take hold where more is between its jaws`;

export class Hand {
    /**
     * `world`: {stage, tools, bodies(), link, settings, told(text), refused() (why nothing can be done now,
     * or ''), list (of ties)}.
     */
    constructor(world, trail) {
        this.world = world;
        this.mode = 'press';
        this.drag = null;
        this.allowed = false;
        this.hit = { distance: 0, triangle: -1 };
        this.plane = new Plane();
        this.forward = new Vector3();
        this.at = new Vector3();     // the pointer's position on the plane
        this.place = new Vector3();  // of the tool
        this.knife = new Knife(world, trail);
        this.ties = new Ties(world, trail);
        this.timer = 0;
        this.chosen = null; // id of the tool that its kind of drag uses; null: the first
        this.stroke = null; // the newest of a blade or remover: {tool, done (what was reported), why (it was not), over}
        this.touch = matchMedia('(pointer: coarse)').matches; // a finger, until a mouse is used
        this.pick = this.pick.bind(this);
        this.pose = new Pose(world.link);
        const { canvas } = world.stage;
        // Before the camera's own listeners, which check whether they are enabled.
        canvas.addEventListener('pointerdown', (event) => this.down(event), { capture: true });
        // Raw events arrive immediately, others with the next frame; older browsers have only the latter.
        const moves = 'onpointerrawupdate' in window ? 'pointerrawupdate' : 'pointermove';
        canvas.addEventListener(moves, (event) => this.move(event));
        for (const kind of ['pointerup', 'pointercancel', 'lostpointercapture'])
            canvas.addEventListener(kind, (event) => this.up(event));
        window.addEventListener('blur', () => this.end());
        canvas.addEventListener('wheel', (event) => this.wheel(event), { capture: true, passive: false });
        canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    }

    /** What a pointer with these keys does on tissue. */
    intent(event) {
        if (event.shiftKey) return 'cut';
        if (event.ctrlKey || event.altKey || event.metaKey) return 'pull';
        return this.mode;
    }

    /** The tool of a kind that this hand uses: never one that the other hand holds. */
    toolOf(kind) {
        const free = this.world.tools.list.filter((tool) => tool.kind === kind && tool.id !== this.world.taken?.());
        return free.find(({ id }) => id === this.chosen) ?? free[0];
    }

    /** What draws where the pointer is. */
    cursor(intent = this.mode) {
        return { press: 'default', pull: this.drag ? 'grabbing' : 'grab', cut: 'crosshair', tie: 'copy', remove: 'cell' }[intent];
    }

    /** The nearest point of any body under the pointer; fills `hit`. */
    pick(ray) {
        let found = null, nearest = Infinity;
        for (const body of this.world.bodies()) {
            if (!body.shown) continue;
            if (!pickTriangle(body.index, body.m, body.position, ray.origin, ray.direction, 1e-6, this.hit))
                continue;
            if (this.hit.distance < nearest) {
                nearest = this.hit.distance;
                found = { body, distance: nearest, triangle: this.hit.triangle };
            }
        }
        return found;
    }

    // A second finger: the drag ends, and both turn and zoom. The camera has not seen the first one yet.
    lend() {
        const { pointer: pointerId, x: clientX, y: clientY } = this.drag;
        this.end();
        this.lends = true;
        this.world.stage.canvas.dispatchEvent(new PointerEvent('pointerdown',
            { pointerId, clientX, clientY, pointerType: 'touch', button: 0, cancelable: true }));
        this.lends = false;
    }

    down(event) {
        if (!this.allowed || this.lends || event.button !== 0) return;
        this.touch = event.pointerType === 'touch';
        if (this.drag) {
            if (this.touch) this.lend();
            return;
        }
        const { stage } = this.world;
        const ray = stage.rayThrough(event.clientX, event.clientY);
        const intent = this.intent(event);
        const found = this.pick(ray);
        const why = this.world.refused();
        if (why) {
            if (found) this.world.told(why);
            return; // the camera's
        }
        if (intent === 'cut') this.drag = this.takeBlade(ray, found) ?? this.knife.begin(found, event);
        else if (intent === 'remove' && found) this.drag = this.takeRemover(ray, found);
        else if (intent === 'remove') return; // the camera's
        else if (intent === 'tie' && found)
            this.drag = this.ties.begin(found, ray.at(found.distance, new Vector3()), event);
        else if (intent === 'tie') return; // the camera's
        else if (found) this.drag = this.take(intent, ray, found);
        else if (stage.flat && intent === 'press') this.drag = this.takeStick(ray);
        if (!this.drag) return; // the camera's
        stage.controls.enabled = false;
        this.drag.pointer = event.pointerId;
        this.stroke = /^(blade|remove)$/.test(this.drag.kind) ? { tool: this.drag.tool, done: [], why: '', over: false } : null;
        stage.canvas.setPointerCapture(event.pointerId);
        stage.canvas.style.cursor = this.cursor(intent);
        this.world.told('');
        this.follow(event);
        this.tell();
        this.timer = setInterval(() => this.tick(), TICK);
    }

    take(intent, ray, found) {
        const { stage } = this.world;
        const point = ray.at(found.distance, new Vector3());
        const direction = ray.direction.clone();
        this.plane.setFromNormalAndCoplanarPoint(stage.viewDirection(this.forward), point);
        const kind = intent === 'press' ? 'probe' : 'grasper', tool = this.toolOf(kind);
        if (!tool) {
            this.world.told(withoutTool(kind, this.world.tools.list, stage.size));
            return null;
        }
        // Jaws are closed from the first moment: open ones would push away what they are to take.
        return { ...hold(stage, tool, direction), kind: intent, direction, point, started: performance.now(), sent: -Infinity,
            ...(intent === 'pull' ? { advance: 0, depth: 0, grip: 1 }
                : { advance: -APART * stage.size, depth: this.world.settings.depth * stage.size, grip: 0 }) };
    }

    // A blade whose edge lies along the line of sight, and whose end follows the surface under the pointer. From beside the
    // tissue a long one goes through all of it, its middle at the depth of the scene's middle.
    takeBlade(ray, found) {
        const { stage, settings } = this.world;
        const blade = this.toolOf('blade');
        if (!blade) return null;
        const direction = stage.viewDirection(new Vector3());
        const length = blade.edge[0].distanceTo(blade.edge[1]);
        const through = !found && length > LONG * stage.size;
        const point = found ? ray.at(found.distance, new Vector3()) : stage.center.clone();
        this.plane.setFromNormalAndCoplanarPoint(direction, point);
        const depth = through ? 0.5 * length : Math.min(settings.depth * stage.size, length);
        return { kind: 'blade', direction, point, started: performance.now(), sent: -Infinity, depth, through,
            met: Boolean(found), advance: found ? -APART * stage.size : depth, ...hold(stage, blade, direction),
            trail: new Vector3(-1, 0, 0).transformDirection(stage.camera.matrixWorld) };
    }

    // A remover at the surface under the pointer, its pedal down while the button is held.
    takeRemover(ray, found) {
        const { stage } = this.world;
        const tool = this.toolOf('remover');
        if (!tool) {
            this.world.told(this.world.tools.list.some(({ kind }) => kind === 'remover') ? 'The other hand has the remover.'
                : 'This scene has no tool of the kind "remover".');
            return null;
        }
        const direction = ray.direction.clone(), point = ray.at(found.distance, new Vector3());
        this.plane.setFromNormalAndCoplanarPoint(stage.viewDirection(this.forward), point);
        return { kind: 'remove', direction, point, started: performance.now(), sent: -Infinity, depth: 0, grip: 1, met: true,
            advance: -APART * stage.size, ...hold(stage, tool, direction) };
    }

    // Puts the plane of a blade at the surface; no steeper than STEEPEST, so that a look into an open cut is no way down.
    followSurface(ray) {
        const { drag, plane } = this;
        const found = this.pick(ray);
        if (!found || !ray.intersectPlane(plane, this.at)) return;
        const most = drag.met ? STEEPEST * this.at.distanceTo(drag.last ?? this.at) : Infinity;
        drag.met = true;
        const deeper = plane.distanceToPoint(ray.at(found.distance, this.forward));
        plane.constant -= Math.min(Math.max(deeper, -most), most);
    }

    // The edge leads and the back trails, as far as the pointer's way says in which direction.
    turnBlade(passed) {
        const { drag, at } = this;
        const way = new Vector3().subVectors(at, drag.last ?? at), length = way.length();
        drag.last = (drag.last ?? new Vector3()).copy(at);
        if (drag.kind !== 'blade' || length === 0) return;
        const memory = TURNS_WITHIN * this.world.stage.size;
        drag.trail.multiplyScalar(memory / (memory + length)).addScaledVector(way, -1 / (memory + length));
        turnHeld(drag, drag.trail, TURNS * Math.min(passed, SLOWEST_TICK) / 1000);
    }

    // A stick in the plane of a flat body pushes it from the side.
    takeStick(ray) {
        const { stage } = this.world;
        const probe = this.toolOf('probe');
        if (!probe?.tip().stick) return null;
        this.plane.setFromNormalAndCoplanarPoint(new Vector3(0, 0, 1), new Vector3(0, 0, stage.center.z));
        return { kind: 'press', direction: new Vector3(0, 0, 0), point: stage.center.clone(), advance: 0,
            depth: 0, started: performance.now(), sent: -Infinity, ...hold(stage, probe, ray.direction) };
    }

    // While the page was busy the browser has kept the pointer's way: a blade cuts along all of it.
    move(event) {
        if (this.drag?.pointer !== event.pointerId) return;
        const { drag } = this;
        for (const one of event.getCoalescedEvents?.() ?? [])
            if (one.timeStamp >= drag.followed + TICK || Math.hypot(one.clientX - drag.x, one.clientY - drag.y) >= NEXT)
                this.follow(one);
        this.follow(event);
    }

    follow(event) {
        const { drag } = this;
        drag.x = event.clientX;
        drag.y = event.clientY;
        const passed = event.timeStamp - (drag.followed ?? event.timeStamp);
        drag.followed = event.timeStamp;
        if (drag.kind === 'cut') return this.knife.follow(event, this.pick);
        if (drag.kind === 'tie') return this.ties.follow(event);
        const ray = this.world.stage.rayThrough(event.clientX, event.clientY);
        const follows = drag.kind === 'blade' || drag.kind === 'remove';
        if (follows && !drag.through) this.followSurface(ray);
        if (!ray.intersectPlane(this.plane, this.at)) return;
        if (follows) this.turnBlade(passed);
        if (drag.tool) this.send(event.timeStamp);
    }

    // Deeper with time, up to the chosen depth; repeats poses before they expire.
    tick() {
        const { drag } = this;
        if (!drag || drag.kind === 'cut' || drag.kind === 'tie') return;
        const now = performance.now();
        const { stage, settings } = this.world;
        const passed = now - (drag.ticked ?? now - TICK);
        const step = settings.speed * stage.size * Math.min(passed, SLOWEST_TICK) / 1000;
        drag.ticked = now;
        const before = drag.advance;
        this.tell();
        drag.advance += Math.min(Math.max(drag.depth - drag.advance, -2 * step), step);
        if (passed > SLOWEST_TICK) return; // the pointer's way since then comes first
        if (drag.advance !== before || now - drag.sent >= REPEAT) this.send();
    }

    send(time) {
        const { drag, place } = this, now = performance.now(), silent = now - drag.sent;
        if (this.stroke && silent > SILENT && silent < Infinity)
            this.stroke.why = `this browser was too busy to say where ${drag.tool.title} was for ${(silent / 1000).toFixed(1)} s`;
        drag.sent = now;
        // The surface of a probe's tip touches the point; the middle of jaws does.
        const back = drag.kind === 'press' ? drag.radius : 0;
        place.copy(this.at).addScaledVector(drag.direction, drag.advance - back).sub(drag.tip);
        this.pose.send(drag, place, drag.grip ?? 0, time);
    }

    /** A reply to a request, or that none will come (`{id, ok: false, text}`). */
    answered(message) {
        this.knife.answered(message);
        this.ties.answered(message);
    }

    /** An event; of the tool that this hand moves: "tool 3 ...", "tool 4: ..." or "tool 4, stroke ended: ...". */
    takeEvent(kind, text) {
        const [, id, said] = /^tool (\d+)(?:, stroke ended)?:? (.*)$/s.exec(text) ?? [];
        const { drag, stroke } = this;
        if (drag?.kind === 'pull' && drag.tool.id === Number(id) && /^(grasp|slipped)$/.test(kind))
            drag.slipped = kind === 'slipped';
        if (kind === 'reset' && !drag) {
            this.stroke = this.knife.stroke = null;
            this.world.told('');
        }
        if (stroke && kind === 'stopped') stroke.why = `the server stood still ${text}`;
        else if (stroke?.tool.id !== Number(id) || !/^((cut|remove)(_refused)?|jump|withdrawn)$/.test(kind)) return;
        else if (/^ignored/.test(said)) return; // one pose of many
        else if (kind === 'cut' || kind === 'remove') stroke.done.push(plainly(said));
        else stroke.why = plainly(said);
        if (stroke.over) this.tellStroke(stroke);
    }

    // What came of a blade's stroke or of a remover: what was done, by body, and why not more.
    tellStroke(stroke) {
        if (stroke !== this.stroke || this.drag) return; // another one follows
        const { tool, done, why } = stroke, [did, nothing] = tool.kind === 'blade'
            ? ['Cut', `Nothing was cut: ${why || `${tool.title} met no tissue that is cuttable`}`]
            : ['Removed', `Nothing was removed: ${why || `${tool.title} met no tissue that it can take`}`];
        this.world.told(done.length ? `${did}: ${done.join('; ')}${why ? `. Not on all of the way: ${why}` : ''}` : nothing);
    }

    awaitStroke(stroke, waits = STROKE_WAITS) {
        setTimeout(() => {
            if (stroke.tool.active && waits > 1) this.awaitStroke(stroke, waits - 1);
            else if (!stroke.done.length) this.tellStroke(stroke);
        }, STROKE_ENDS);
    }

    /** For another scene: what is still to come belongs to the last one. */
    forget() {
        this.end();
        this.stroke = this.knife.stroke = this.ties.open = null;
        this.ties.clear();
    }

    // Describes the drag: its action, and how deep it is.
    tell() {
        const { drag } = this;
        if (!drag || drag.kind === 'cut' || drag.kind === 'tie' || drag.stick) return;
        const now = performance.now();
        if (now - (drag.toldAt ?? -Infinity) < TELL_EVERY) return; // more often than anyone can read
        drag.toldAt = now;
        const { size } = this.world.stage;
        const depth = this.touch ? 'depth: in the panel' : 'wheel: deeper, less deep (and “depth” of the panel)';
        if (drag.kind === 'press') {
            const deep = lengthText(Math.max(drag.advance, 0)), most = lengthText(Math.max(drag.depth, 0));
            this.world.told(`Pressing: ${deep} of ${most} past the first touch${drag.advance > 0 && !drag.tool.touching
                ? ', but the probe touches nothing' : ''} · ${depth}`);
        } else if (drag.kind === 'blade') {
            this.world.told(drag.tool.active && !drag.tool.ours ? `Another client moves ${drag.tool.title}`
                : `Cutting with ${drag.tool.title}, ${lengthText(Math.max(drag.advance, 0))} deep · ${depth}`);
        } else if (drag.kind === 'remove') {
            this.world.told(`${drag.tool.title} takes tissue away (${drag.tool.removes}), ${
                lengthText(Math.max(drag.advance, 0))} deep · ${depth}`);
        } else if (drag.slipped) {
            this.world.told(slipped(drag.tool));
        } else if (!drag.tool.touching && now - drag.started > HELD_AFTER) {
            this.world.told(`${drag.tool.title} closed on nothing that it can hold: release it and try again`);
        } else {
            const away = lengthText(Math.abs(drag.advance));
            this.world.told(`Pulling by ${drag.tool.title}${Math.abs(drag.advance) > 1e-3 * size
                ? `, ${away} ${drag.advance > 0 ? 'farther' : 'nearer'}` : ''}${this.touch ? '' : ' · wheel: nearer, farther'}`);
        }
    }

    wheel(event) {
        if (!this.drag || this.drag.kind === 'cut' || this.drag.kind === 'tie') return;
        event.preventDefault();
        event.stopPropagation();
        const step = -Math.sign(event.deltaY) * 0.02 * this.world.stage.size;
        this.drag.depth = Math.max(this.drag.depth + step, -this.world.stage.size);
    }

    up(event) {
        if (this.drag?.pointer !== event.pointerId) return;
        if (event.type === 'pointerup') this.move(event); // it may have gone on since the last move
        this.end(event.type === 'pointercancel');
    }

    /** `givenUp`: not by the pointer that went up. */
    end(givenUp = true) {
        const { drag } = this;
        if (!drag) return;
        clearInterval(this.timer);
        this.drag = null;
        this.world.stage.controls.enabled = true;
        this.world.stage.canvas.style.cursor = this.cursor();
        if (drag.kind === 'cut') return this.knife.end();
        if (drag.kind === 'tie') return this.ties.end(this.pick, givenUp);
        if (drag.tool) this.pose.withdraw();
        this.world.told(drag.slipped ? slipped(drag.tool) : '');
        const { stroke } = this;
        if (!stroke) return;
        stroke.over = true;
        if (stroke.done.length || stroke.why) this.tellStroke(stroke);
        this.awaitStroke(stroke);
    }
}
