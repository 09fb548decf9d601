// SPDX-License-Identifier: MIT
// What tools look like: a scalpel, jaws on a shaft, a tube, a burr, an electrode. Their working parts have the size of the
// scene's shapes; shafts and handles are drawn only, and push nothing.

import { BufferGeometry, CapsuleGeometry, Color, CylinderGeometry, Float32BufferAttribute, FrontSide, Group,
    LatheGeometry, Mesh, Quaternion, ShaderMaterial, SphereGeometry, Vector2, Vector3, DoubleSide } from 'three';

const UP = new Vector3(0, 1, 0);
const SHAFT = 26;    // radii of the working part: the length of what is drawn behind it
const OPEN = 0.42;   // [rad] of one jaw
const HOT = new Color(0xff8a3c);

export const steel = (colour, side = FrontSide) => new ShaderMaterial({
    uniforms: { colour: { value: new Color(colour) }, glow: { value: 0 } },
    side,
    vertexShader: /* glsl */ `
varying vec3 vNormal;
void main() {
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    vNormal = normalMatrix * normal;
}`,
    // A dark room with a soft light above and a lamp: cheap, and bright as an instrument.
    fragmentShader: /* glsl */ `
uniform vec3 colour;
uniform float glow;
varying vec3 vNormal;
void main() {
    vec3 n = vNormal * inversesqrt(dot(vNormal, vNormal));
    n.z = abs(n.z);
    vec3 r = 2.0 * n.z * n - vec3(0.0, 0.0, 1.0); // the reflected line of sight, seen from afar
    float lamp = max(dot(r, vec3(-0.42, 0.62, 0.66)), 0.0);
    lamp *= lamp;
    lamp *= lamp;
    lamp *= lamp;
    vec3 c = colour * (0.36 + 0.26 * r.y + 0.20 * n.z) + 0.55 * lamp * lamp;
    gl_FragColor = vec4(sqrt(mix(c, vec3(${HOT.r.toFixed(3)}, ${HOT.g.toFixed(3)}, ${HOT.b.toFixed(3)}), glow)), 1.0);
}`,
});

const STEEL = 0xdfe5ea, BLADE = 0xe4e9ed, JAWS = 0xc9d2da, FIXED = 0x6d757c, GRIP = 0x39424b, DARK = 0x14181c,
    BRASS = 0xd8b46a;

// A shape of revolution about +y from [[radius, height], ...].
const turned = (profile, sides = 20) => new LatheGeometry(profile.map(([r, y]) => new Vector2(Math.max(r, 1e-9), y)), sides);

// A shaft along +y from 0 on: steel, then a dark grip, of some length behind. `real`: the capsule that the scene gives it,
// {radius, from, to} along +y; before that it is `thin`, and so it is without one.
function shaft(thin, length, real = null) {
    const group = new Group(), radius = real?.radius ?? thin, end = real?.to ?? length, wider = real ? 1 : 1.5;
    const neck = real ? [[thin, 0], [thin, Math.max(real.from - radius, 0)], [radius, Math.max(real.from, 1e-6)]] : [[thin, 0]];
    group.add(new Mesh(turned([...neck, [radius, 0.72 * end]]), steel(STEEL)),
        new Mesh(turned([[radius, 0.72 * end], [wider * radius, 0.74 * end], [wider * radius, end], [0, end]]),
            steel(GRIP, DoubleSide)));
    return group;
}

// Of `capsules` the first that lies along `axis` behind `at`, as {radius, from, to, capsule}; null: none.
function shaftOf(capsules, at, axis) {
    for (const capsule of capsules) {
        const ends = [capsule.from, capsule.to].map((end) => end.clone().sub(at));
        const [from, to] = ends.map((end) => end.dot(axis)).sort((a, b) => a - b);
        const off = Math.max(...ends.map((end) => end.cross(axis).length()));
        if (off < 0.1 * capsule.radius && from >= 0 && to > 4 * capsule.radius) return { radius: capsule.radius, from, to, capsule };
    }
    return null;
}

export function capsuleShape({ from, to, radius }, material) {
    const length = from.distanceTo(to);
    const part = new Mesh(length > 0 ? new CapsuleGeometry(radius, length, 8, 20) : new SphereGeometry(radius, 24, 16),
        material);
    part.position.addVectors(from, to).multiplyScalar(0.5);
    if (length > 0) part.quaternion.setFromUnitVectors(UP, to.clone().sub(from).normalize());
    return part;
}

/** The side of a blade on which its back is, in the tool's frame: unit, across the edge from its tip along `axis`. */
export function backOf(axis) {
    return (Math.abs(axis.y) > 0.9 ? new Vector3(1, 0, 0) : new Vector3(0, 1, 0)).cross(axis).normalize();
}

// Flat facets from quadrilaterals and triangles of points.
function facets(list) {
    const points = list.flatMap((face) => face.slice(2).flatMap((_, k) => [face[0], face[k + 1], face[k + 2]]));
    const shape = new BufferGeometry();
    shape.setAttribute('position', new Float32BufferAttribute(points.flat(), 3));
    shape.computeVertexNormals();
    return shape;
}

// The edge along +y from the tip at 0, the back towards +x; thin at the edge, with a grind that catches the light.
function blade(length) {
    const group = new Group();
    const wide = 0.26 * length, thick = 0.016 * length, grind = 0.09 * length;
    // [height, where the back is]: pointed at the tip, straight behind, a tang into the handle.
    const outline = [[0, 0], [0.10, 0.34], [0.28, 0.72], [0.5, 0.95], [0.8, 1], [1, 1]];
    const at = outline.map(([y, x]) => ({ y: y * length, back: x * wide, mid: Math.min(grind, 0.5 * x * wide) }));
    const bevels = [], cheeks = [];
    for (let k = 0; k + 1 < at.length; k++)
        for (const z of [-thick, thick]) {
            const a = at[k], b = at[k + 1];
            bevels.push([[0, a.y, 0], [a.mid, a.y, k ? z : 0], [b.mid, b.y, z], [0, b.y, 0]]);
            cheeks.push([[a.mid, a.y, k ? z : 0], [a.back, a.y, k ? 0.8 * z : 0], [b.back, b.y, 0.8 * z], [b.mid, b.y, z]]);
        }
    for (let k = 0; k + 1 < at.length; k++) {
        const a = at[k], b = at[k + 1], t = 0.8 * thick;
        cheeks.push([[a.back, a.y, k ? t : 0], [a.back, a.y, k ? -t : 0], [b.back, b.y, -t], [b.back, b.y, t]]);
    }
    // It leans back, so that it hides nothing of the way before the edge.
    const handle = shaft(0.045 * length, 1.6 * length);
    handle.position.set(0.7 * wide, 0.93 * length, 0);
    handle.rotation.z = -0.95;
    group.add(new Mesh(facets(bevels), steel(0xffffff, DoubleSide)), new Mesh(facets(cheeks), steel(0xa9b3bb, DoubleSide)),
        handle);
    return group;
}

// Two jaws along -y from their hinge at 0: half a spoon each, with teeth.
function jaw(length, radius, side) {
    const half = new Group();
    const wide = Math.min(0.42 * radius, 0.2 * length), teeth = 6, inner = [], outer = [];
    const profile = (s) => wide * (0.75 + 0.25 * Math.sin(Math.PI * Math.min(1.6 * s, 1))) * (s > 0.85 ? 1 - 2.6 * (s - 0.85) : 1);
    for (let k = 0; k < 2 * teeth; k++) {
        const s = k / (2 * teeth), t = (k + 1) / (2 * teeth), a = profile(s), b = profile(t);
        const tooth = (j) => (j % 2 ? 0.12 : 0) * wide;
        inner.push([[tooth(k), -s * length, -a], [tooth(k), -s * length, a], [tooth(k + 1), -t * length, b],
            [tooth(k + 1), -t * length, -b]]);
        const ring = (w, u) => [-1, -0.5, 0.5, 1].map((z, i) => [[0, 0.85, 0.85, 0][i] * w, -u * length, z * w]);
        const p = ring(a, s), q = ring(b, t);
        for (let i = 0; i < 3; i++) outer.push([p[i], p[i + 1], q[i + 1], q[i]]);
    }
    const end = profile(1);
    outer.push([[0, -length, -end], [0.85 * end, -length, -0.5 * end], [0.85 * end, -length, 0.5 * end], [0, -length, end]]);
    half.add(new Mesh(facets(outer), steel(JAWS, DoubleSide)), new Mesh(facets(inner), steel(0x8d979f, DoubleSide)));
    if (side < 0) half.rotation.y = Math.PI;
    const hinged = new Group();
    hinged.add(half);
    return hinged;
}

// A group whose +y is `axis` at `at`; `side`: where its +x points.
function frame(at, axis, side = null) {
    const group = new Group();
    group.position.copy(at);
    if (side) {
        const z = new Vector3().crossVectors(side, axis);
        group.matrix.makeBasis(side, axis, z);
        group.quaternion.setFromRotationMatrix(group.matrix);
    } else group.quaternion.setFromUnitVectors(UP, axis);
    return group;
}

function grasper({ at, axis, radius, length }, group) {
    const reach = length + 2 * radius, hinge = frame(at.clone().addScaledVector(axis, length + radius), axis);
    const jaws = [1, -1].map((side) => jaw(reach, radius, side));
    hinge.add(...jaws, shaft(0.3 * radius, SHAFT * radius));
    hinge.add(new Mesh(turned([[0, -0.28 * radius], [0.36 * radius, -0.1 * radius], [0.36 * radius, 0.3 * radius],
        [0.3 * radius, 0.5 * radius]]), steel(JAWS)));
    group.add(hinge);
    return (grip) => jaws.forEach((half, k) => { half.rotation.z = (k ? -1 : 1) * OPEN * (1 - grip); });
}

function suction({ at, axis, radius, real }, group) {
    const tube = frame(at, axis), r = radius, length = real?.to ?? SHAFT * radius;
    const wide = real ? Math.max(r, real.radius) : 1.35 * r;
    tube.add(new Mesh(turned([[0.86 * r, 0.12 * r], [0.92 * r, 0], [r, 0.06 * r], [r, 0.5 * length]], 28), steel(STEEL)),
        new Mesh(turned([[0.86 * r, 0], [0.8 * r, 2.5 * r], [0, 2.5 * r]], 28), steel(DARK, DoubleSide)),
        new Mesh(turned([[r, 0.5 * length], [wide, 0.53 * length], [wide, length], [0, length]], 28), steel(GRIP)));
    group.add(tube);
    return () => {};
}

function drill({ at, axis, radius, real }, group) {
    const burr = frame(at, axis), shape = new SphereGeometry(radius, 32, 16);
    // Twisted flutes, within the ball that removes.
    const { position } = shape.attributes, p = new Vector3();
    for (let i = 0; i < position.count; i++) {
        p.fromBufferAttribute(position, i);
        const around = Math.atan2(p.z, p.x), up = p.y / radius;
        p.multiplyScalar(1 - 0.22 * (0.5 + 0.5 * Math.cos(8 * around + 4 * up)) * (1 - up * up));
        position.setXYZ(i, p.x, p.y, p.z);
    }
    shape.computeVertexNormals();
    const head = new Mesh(shape, steel(0xc9b98e)), rod = shaft(0.34 * radius, SHAFT * radius, real);
    burr.add(head, rod);
    group.add(burr);
    return (grip, now) => { if (grip >= 0.5) head.rotation.y = 0.03 * now; };
}

function electrode({ at, axis, radius, length, real }, group) {
    const rod = frame(at, axis), tip = steel(BRASS);
    rod.add(capsuleShape({ from: new Vector3(), to: new Vector3(0, length, 0), radius }, tip));
    const wide = real?.radius ?? 1.7 * radius, from = real ? Math.max(real.from - length, radius) : 6 * radius;
    const to = real ? real.to - length : SHAFT * radius;
    const behind = new Mesh(turned([[0.8 * radius, 0], [0.8 * radius, 0.8 * from], [wide, from], [wide, to], [0, to]]),
        steel(0x2b4a63));
    behind.position.y = length;
    rod.add(behind);
    group.add(rod);
    return (grip) => { tip.uniforms.glow.value = grip >= 0.5 ? 0.75 : 0; };
}

/**
 * Fills `group` with the shape of a tool (its `kind`, `removes`, `capsules`, `edge` and `mouth`, all in its frame), and
 * returns what shows its grip: (grip, now [ms]) => {}.
 */
export function buildInstrument(tool, group) {
    const { at, axis, radius, length } = tool.tip(), drills = tool.removes === 'drill';
    let shown = () => {}, rest = drills ? tool.capsules.slice(0, -1) : tool.capsules; // the last one is the burr again
    const real = tool.mouth ? shaftOf(rest, at, axis) : null, working = { at, axis, radius, length, real };
    if (tool.edge) {
        const holder = frame(at, axis, backOf(axis));
        holder.add(blade(length));
        group.add(holder);
    } else if (tool.kind === 'grasper') {
        shown = grasper(working, group);
        rest = rest.slice(1);
    } else if (tool.mouth) {
        shown = ({ suction, drill, diathermy: electrode }[tool.removes] ?? suction)(working, group);
        rest = rest.filter((capsule) => capsule !== real?.capsule);
    } else if (tool.kind === 'probe' && rest.length === 1 && length === 0) {
        const behind = frame(at, axis);
        behind.add(shaft(0.4 * radius, SHAFT * radius));
        group.add(behind);
    }
    const material = steel({ blade: BLADE, static: FIXED }[tool.kind] ?? STEEL);
    for (const capsule of rest) group.add(capsuleShape(capsule, material));
    return shown;
}

// Along +y, of length one; its width is a small part of the scene, set by its scale.
export function forceArrow() {
    const material = steel(0xf0b429);
    material.transparent = true; // drawn after the lines of cuts, which else were seen through what lies before them
    const group = new Group();
    const stem = new Mesh(new CylinderGeometry(0.006, 0.006, 0.8, 12).translate(0, 0.4, 0), material);
    const head = new Mesh(new CylinderGeometry(0, 0.018, 0.26, 16).translate(0, 0.87, 0), material);
    // On top of everything else: its information matters more than what it covers.
    for (const part of [stem, head]) part.renderOrder = 10;
    stem.onBeforeRender = (renderer) => renderer.clearDepth();
    group.add(stem, head);
    group.visible = false;
    return group;
}

/**
 * The turn that brings a blade's edge to `back` (unit, from its tip) and its back to the side `trail` (any length, not
 * along `back`).
 */
export function turnBlade(axis, back, trail) {
    const basis = (y, x) => {
        const across = x.clone().addScaledVector(y, -x.dot(y)).normalize();
        const group = frame(new Vector3(), y, across);
        return group.quaternion;
    };
    return new Quaternion().copy(basis(back, trail)).multiply(basis(axis, backOf(axis)).invert());
}
