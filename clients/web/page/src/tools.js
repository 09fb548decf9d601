// SPDX-License-Identifier: MIT
// Tools at their positions, and the forces on them.

import { Group, Quaternion, Vector3 } from 'three';
import { drawBar, forceError } from './errors.js';
import { buildInstrument, forceArrow } from './instruments.js';
import { shadeTissue } from './tissue.js';

const STALE = 1000; // [ms] after which a contact or pose without repeat is hidden

const vector = (list) => new Vector3(...(list ?? [0, 0, 0]));
const UP = new Vector3(0, 1, 0);

/** One tool of the scene. */
class Tool {
    constructor(described) {
        this.id = described.id;
        this.kind = described.kind;
        this.maxForce = described.max_force > 0 && Number.isFinite(described.max_force)
            ? described.max_force : 3.3;
        this.capsules = (described.capsules ?? []).map(({ from, to, radius }) =>
            ({ from: vector(from), to: vector(to ?? from), radius: radius ?? 0.001 }));
        this.edge = described.edge?.map(vector) ?? null;
        this.removes = described.removes_by ?? '';
        this.mouth = described.mouth ? { from: vector(described.mouth.from), to: vector(described.mouth.to),
            radius: described.mouth.radius } : null;
        this.group = new Group();
        this.group.visible = described.kind === 'static';
        this.position = new Vector3(); // of the pose
        this.poseAt = -Infinity;       // [ms]
        this.active = false;
        this.contact = null;
        this.contactAt = -Infinity;
        this.force = 0;                // [N] last reported
        this.error = null;             // of it, as forceError says; null: not known
        this.shownForce = 0;           // [N] of the last frame
        this.touching = false;
        this.grip = 0;
        this.showGrip = buildInstrument(this, this.group);
    }

    /** What a hand says of it: "grasper 3". */
    get title() { return `${this.kind} ${this.id}`; }

    /**
     * The nearest end of what works, a blade's edge, a mouth or the first capsule, to the tool's origin; where the shaft
     * goes from it, the radius, and the length to the other end.
     */
    tip() {
        const first = this.edge ? { from: this.edge[0], to: this.edge[1], radius: 0 } : this.mouth ?? this.capsules[0];
        if (!first) return { at: new Vector3(), axis: new Vector3(0, 0, 1), radius: 0.002, length: 0, stick: false };
        const flip = first.from.length() > first.to.length();
        const at = flip ? first.to : first.from, other = flip ? first.from : first.to;
        const axis = other.clone().sub(at), length = axis.length();
        // Grasped in the middle: a stick that stands upright, not one that points.
        const stick = length > 0 && at.length() > 0.25 * length;
        return { at, axis: length > 0 ? axis.normalize() : new Vector3(0, 0, 1), length,
            radius: first.radius, stick: stick && !this.edge };
    }
}

export class Tools {
    /** `labels`: the element that carries the newtons. */
    constructor(stage, labels) {
        this.stage = stage;
        this.labels = labels;
        this.list = [];
        this.byId = new Map();
        this.group = new Group();
        stage.scene.add(this.group);
        this.screen = new Vector3();
        this.direction = new Vector3();
        this.origin = new Vector3();
    }

    take(described) {
        this.group.clear();
        this.labels.replaceChildren();
        this.byId.clear();
        this.list = described.map((one) => new Tool(one));
        for (const tool of this.list) {
            this.byId.set(tool.id, tool);
            tool.arrow = forceArrow();
            tool.label = document.createElement('span');
            tool.label.className = 'newtons';
            tool.label.hidden = true;
            tool.label.append(tool.newtons = document.createElement('span'), tool.bar = document.createElement('span'));
            this.labels.append(tool.label);
            this.group.add(tool.group, tool.arrow);
        }
    }

    /** True if the picture changes; so does takeContact. */
    takePose(pose, now) {
        const tool = this.byId.get(pose.tool);
        if (!tool) return false;
        const [w, x, y, z] = pose.orientation, turn = tool.group.quaternion;
        const same = tool.active === pose.active && now - tool.poseAt < STALE && turn.w === w && turn.x === x &&
            turn.y === y && turn.z === z && this.isNear(tool.position, pose.position);
        const seen = (tool.active || pose.active) && (!same || tool.grip !== pose.grip);
        tool.active = pose.active;
        tool.ours = pose.ours;
        tool.poseAt = now;
        tool.position.fromArray(pose.position);
        turn.set(x, y, z, w);
        tool.grip = pose.grip;
        return seen;
    }

    // On the screen they are at the same place.
    isNear(position, list) { return position.distanceTo(this.origin.fromArray(list)) < 1e-4 * this.stage.size; }

    takeContact(contact, now) {
        const tool = this.byId.get(contact.tool);
        if (!tool) return false;
        const seen = this.looksOther(tool, contact);
        tool.contact = contact;
        tool.contactAt = now;
        tool.force = contact.contact ? Math.hypot(...contact.force) : 0;
        return seen;
    }

    looksOther(tool, contact) {
        if (!contact.contact) return tool.touching;
        return !tool.touching || Math.abs(Math.hypot(...contact.force) - tool.shownForce) > 0.005 * tool.maxForce ||
            (tool.kind !== 'static' && !this.isNear(tool.group.position, contact.position));
    }

    /** Errors of forces; those of tools that are not listed are not known. */
    takeErrors(list) {
        for (const tool of this.list) {
            const of = list.find(({ tool: id }) => id === tool.id);
            tool.error = of ? forceError(of) : null;
        }
    }

    /** Before a frame; `figures`: also what the labels say. */
    prepare(now, figures) {
        for (const tool of this.list) {
            const touches = Boolean(tool.contact?.contact) && now - tool.contactAt < STALE;
            tool.touching = touches;
            if (tool.kind !== 'static') {
                tool.group.visible = tool.active && now - tool.poseAt < STALE;
                // A tool in contact is drawn where it feels the force: the proxy may differ from the pose.
                if (touches) tool.group.position.fromArray(tool.contact.position);
                else tool.group.position.copy(tool.position);
                if (tool.group.visible) tool.showGrip(tool.grip, now);
            }
            this.drawForce(tool, touches && tool.force > 1e-4, figures);
        }
        this.shade();
    }

    // Tissue near tools that are shown gets less light.
    shade() {
        const shown = this.list.filter((tool) => tool.group.visible && tool.kind !== 'grasper')
            .sort((a, b) => (a.kind === 'static') - (b.kind === 'static'));
        shadeTissue(shown.flatMap(({ group, mouth, capsules }) => (mouth ? [mouth] : []).concat(capsules).map(({ from, to, radius }) => ({ radius,
            from: from.clone().applyQuaternion(group.quaternion).add(group.position),
            to: to.clone().applyQuaternion(group.quaternion).add(group.position) }))));
    }

    drawForce(tool, shown, figures) {
        tool.arrow.visible = shown;
        tool.shownForce = tool.force;
        if (tool.label.hidden === shown) tool.label.hidden = !shown;
        if (!shown) return;
        const { contact, arrow, label } = tool; // the label has the newtons and the bar of their error
        const length = this.stage.size * (0.09 + 0.30 * Math.min(tool.force / tool.maxForce, 1));
        this.direction.fromArray(contact.force).normalize();
        const held = Math.hypot(...contact.point) === 0 && Math.hypot(...contact.normal) === 0;
        this.origin.fromArray(held ? contact.position : contact.point);
        arrow.position.copy(this.origin);
        arrow.quaternion.setFromUnitVectors(UP, this.direction);
        arrow.scale.set(this.stage.size, length, this.stage.size);
        this.origin.addScaledVector(this.direction, length);
        this.stage.onScreen(this.origin, this.screen);
        label.style.transform =
            `translate(${Math.round(this.screen.x + 8)}px, ${Math.round(this.screen.y - 10)}px)`;
        if (!figures && tool.newtons.textContent) return;
        const text = `${tool.force.toFixed(2)} N${tool.error ? ` ${tool.error.text}` : ''}`;
        if (tool.newtons.textContent === text) return;
        tool.newtons.textContent = text;
        drawBar(tool.bar, tool.error);
    }

    /** True if something is shown of a tool that has fallen silent: then another frame is due. */
    fallsSilent(now) {
        return this.list.some((tool) => (tool.kind !== 'static' && tool.group.visible && now - tool.poseAt >= STALE) ||
            (tool.touching && now - tool.contactAt >= STALE));
    }
}

/** The turn that brings the tool's `axis` to the direction `to`. */
export const turned = (axis, to) => new Quaternion().setFromUnitVectors(axis, to);
