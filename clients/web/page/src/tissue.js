// SPDX-License-Identifier: MIT
// The look of tissue: one small shader, cheap enough for software rendering, and the texture of bodies without image.

import { CanvasTexture, Color, DoubleSide, LinearFilter, NoColorSpace, RepeatWrapping,
    ShaderMaterial, SRGBColorSpace, Vector4 } from 'three';

export const COLOUR = { TISSUE: 0, LEVEL: 1, PIECE: 2, ERROR: 3, ELEMENT: 4 };
/** Level 0, 1, ...: from calm to warm; also the legend's. */
export const LEVELS = [0x4f7cac, 0x4fa69a, 0x9cc06a, 0xe3c451, 0xe58a45, 0xd65353, 0xb0479b, 0x6f4bb3];
/** What a wall of tissue is: in the fourth number of a node's `info`. */
export const KIND = { OUTER: 0, INNER: 1, CUT: 2 };
/** The third one at a cut; 0 elsewhere, and between them at middles of edges. */
export const AT_CUT = 4;
// The drawn texture is a little darker than white.
const GRAIN = 1.35;
const CAPSULES = 4; // of tools that shade tissue
/** From no error to the largest of the body. */
export const ERRORS = [0x31447a, 0x35608c, 0x3f8190, 0x66a07c, 0xb0b45c, 0xe3a83f, 0xe0703a, 0xcf3434];
/** Elements of one cell, two cells, ... across. */
export const ELEMENTS = [0xe0935a, 0xcdb375, 0x84a8a0, 0x6d8db0, 0x6a78a3, 0x73689a, 0x73689a, 0x73689a];
const PIECES = [0xc4695c, 0x5c93c4, 0x7db56a, 0xd9b44a, 0x9a78c4, 0x4fb0a8, 0xd07fa8, 0x9c8f7a];

// What both shaders know. LIT_AT_NODES, for software rendering of fine meshes: light is computed at nodes, and a fragment
// is one look at the texture and little else. PLAIN omits the grain from three sides, the exact view direction and the rim.
const COMMON = /* glsl */ `
uniform vec3 inside;
varying vec3 vColour; // of the node, linear; lit if LIT_AT_NODES, and the root of that
#ifdef LIT_AT_NODES
varying float vShine;
#ifdef DOUBLE_SIDED
varying vec4 vBack; // the same of the other side
#endif
#else
varying vec3 vNormal;
varying vec2 vShade; // part of the light that reaches the node; 1: the image lies here
#endif
#if defined(RED) || defined(LIPS) || defined(RIM)
varying vec2 vShiftLip;
#endif
#ifndef PLAIN
varying vec3 vEye;
#endif
#ifdef THREE_SIDES
varying vec3 vRest, vRestNormal;
#else
varying vec2 vUv;
#endif
const vec3 KEY = vec3(-0.42, 0.62, 0.66);
const vec3 HALF = vec3(-0.2305, 0.3403, 0.9116); // between the key light and the eye
const vec3 FILL = vec3(0.72, -0.18, 0.67);
// Light wraps around the edge of soft tissue, red farther than blue.
vec3 lightOn(vec3 n) {
    const vec3 reach = vec3(0.42, 0.22, 0.16);
    vec3 light = max(dot(n, KEY) * (1.18 / (1.0 + reach)) + reach * (1.18 / (1.0 + reach)), 0.0);
    light += max(dot(n, FILL), 0.0) * vec3(0.20, 0.25, 0.32);
    return light + vec3(0.14, 0.14, 0.145) + n.y * vec3(0.045, 0.065, 0.075);
}
float shineOf(vec3 n, vec3 middle) {
    float shine = max(dot(n, middle), 0.0);
    float s4 = shine * shine;
    s4 *= s4;
    float s16 = s4 * s4;
    s16 *= s16;
    float s64 = s16 * s16;
    s64 *= s64;
    return 0.07 * s16 + 0.26 * s64 * s16;
}
// The other side of a wall, and inner walls.
vec3 innerColour(vec3 base) { return mix(base, inside, 0.75); }
`;

const vertexShader = /* glsl */ `
attribute vec3 rest;
attribute vec4 look; // colour of the node, sRGB, and its share of the error, or level of elements
attribute vec4 info; // level, piece, at a cut, kind of wall: KIND
uniform vec3 tissue, flesh, palette[8];
uniform float grain, sink; // sink: of walls of cuts [m], body.js
uniform vec4 capsule[${2 * CAPSULES}]; // of tools: one end and the radius, the other end
${COMMON}
#ifdef THREE_SIDES
attribute vec3 restNormal;
#endif
// The part of the light that tools take away: of each that of a ball at its axis' nearest point.
float shadeAt(vec3 n) {
    float shade = 1.0;
    for (int i = 0; i < ${2 * CAPSULES}; i += 2) {
        if (capsule[i].w == 0.0) break;
        vec3 a = capsule[i].xyz - position, along = capsule[i + 1].xyz - capsule[i].xyz;
        a -= along * clamp(dot(a, along) / max(dot(along, along), 1e-12), -1.0, 0.0);
        float d2 = max(dot(a, a), 1e-12), r2 = capsule[i].w * capsule[i].w;
        shade *= 1.0 - 0.75 * max(0.4 + 0.6 * dot(n, a) * inversesqrt(d2), 0.0) * min(r2 / d2, 1.0);
    }
    return shade;
}
void main() {
    vec4 eye = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * eye;
#ifndef PLAIN
    vEye = eye.xyz;
#endif
    // As long as the light that reaches a fold; zero without triangles.
    float open = length(normal);
    vec3 outward = normal / max(open, 1e-15);
    vec3 n = normalMatrix * outward;
    float shade = shadeAt(outward) * open, kind = info.w;
    if (kind > 1.5) {
        float deeper = eye.z - sink;
        gl_Position.z = (projectionMatrix[2].z * deeper + projectionMatrix[3].z) / -deeper * gl_Position.w;
    }
#ifdef COLOURED
#if COLOURED >= 3
    float at = 7.0 * look.w;
    int below = min(int(at), 6);
    vColour = mix(palette[below], palette[below + 1], at - float(below));
#else
    vColour = palette[COLOURED == 1 ? min(int(info.x), 7) : int(info.y) & 7];
#endif
#elif defined(NODE_COLOURS)
    vec3 own = look.rgb * look.rgb; // approximately linear
    vColour = kind < 0.5 ? ${GRAIN} * own : kind < 1.5 ? innerColour(${GRAIN} * own) : own;
#ifdef LIT_AT_NODES
    if (kind > 1.5) vColour /= vec3(0.74, 0.66, 0.64); // the mean of the grain
#endif
#else
    vColour = kind < 0.5 ? tissue : kind < 1.5 ? innerColour(tissue) : flesh;
#endif
#ifdef LIT_AT_NODES
#ifdef DOUBLE_SIDED
    vBack = vec4(sqrt(innerColour(vColour) * lightOn(-n)), 0.6 * shineOf(-n, HALF));
#endif
    vColour = sqrt(vColour * lightOn(n) * shade);
    vShine = shade * shineOf(n, HALF);
#else
    vNormal = n;
    vShade = vec2(shade, kind < 0.5 ? 1.0 : 0.0);
#endif
#if defined(RED) || defined(LIPS) || defined(RIM)
    vShiftLip = vec2(distance(position, rest), info.z / ${AT_CUT}.0);
#endif
#ifdef THREE_SIDES
    vRest = rest * grain;
    vRestNormal = abs(restNormal) * inversesqrt(max(dot(restNormal, restNormal), 1e-30));
#elif defined(OWN_IMAGE)
    vUv = uv;
#else
    vUv = grain * (rest.xz + vec2(0.83, -0.55) * rest.y);
#endif
}`;

const fragmentShader = /* glsl */ `
uniform vec3 lipColour, flesh;
uniform float threshold; // [m]
uniform vec2 lipEdge;    // where a face begins to count as part of a cut, and where it fully does
uniform sampler2D image;
${COMMON}
void main() {
#ifdef THREE_SIDES
    // The grain from three sides, blended by the orientation of the rest shape.
    vec3 w = vRestNormal * vRestNormal;
    w *= w;
    vec3 grainColour = (texture2D(image, vRest.yz).rgb * w.x + texture2D(image, vRest.zx).rgb * w.y +
        texture2D(image, vRest.xy).rgb * w.z) / (w.x + w.y + w.z + 1e-6);
#else
    vec3 grainColour = texture2D(image, vUv).rgb;
#endif
#ifdef LIT_AT_NODES
    vec4 lit = vec4(vColour, vShine);
#ifdef DOUBLE_SIDED
    if (!gl_FrontFacing) lit = vBack;
#endif
    gl_FragColor = vec4(lit.rgb * grainColour + lit.a, 1.0);
#else
    grainColour *= grainColour; // approximately linear
#ifdef OWN_IMAGE
    grainColour = mix(vec3(0.7), grainColour, vShade.y);
#endif
#ifdef COLOURED
    vec3 base = vColour * (0.5 + 0.9 * grainColour.g);
    float wet = 0.5;
#else
#ifdef NODE_COLOURS
    grainColour = mix(vec3(1.0), grainColour, vShade.y); // an image of the inside is shown as it is
#endif
    vec3 base = vColour * grainColour;
    float wet = 1.0;
#endif
    vec3 n = vNormal * inversesqrt(dot(vNormal, vNormal));
    float shade = vShade.x;
    if (!gl_FrontFacing) {
        n = -n;
        shade = 1.0;
#ifndef COLOURED
        base = innerColour(base);
#endif
        wet *= 0.6;
    }
#ifdef RIM
    // A wall without thickness shows its cut as a line.
    base = mix(base, flesh, 0.9 * smoothstep(0.78, 0.92, vShiftLip.y));
#endif
#ifdef LIPS
    base = mix(base, lipColour, 0.9 * smoothstep(lipEdge.x, lipEdge.y, vShiftLip.y));
#endif
#ifdef RED
    base = mix(base, vec3(0.86, 0.02, 0.015), 0.94 * smoothstep(0.985, 1.015, vShiftLip.x / threshold));
#endif
#ifdef PLAIN
    vec3 colour = shade * (base * lightOn(n) + wet * shineOf(n, HALF));
#else
    vec3 v = normalize(-vEye);
    vec3 colour = shade * (base * lightOn(n) + wet * shineOf(n, normalize(KEY + v)));
    float rim = 1.0 - max(dot(n, v), 0.0);
    colour += wet * rim * rim * rim * vec3(0.12, 0.10, 0.10);
#endif
#ifdef SILENT
    colour = vec3(dot(colour, vec3(0.21, 0.72, 0.07))) * 0.55 + 0.02;
#endif
    gl_FragColor = vec4(sqrt(colour), 1.0);
#endif
}`;

const colours = (list) => list.map((hex) => new Color(hex));
const palettes = { [COLOUR.LEVEL]: colours(LEVELS), [COLOUR.PIECE]: colours(PIECES), [COLOUR.ERROR]: colours(ERRORS),
    [COLOUR.ELEMENT]: colours(ELEMENTS) };

/** What the switches and the link say, for all bodies. */
export const look = { colouring: COLOUR.TISSUE, threshold: 0, lips: false, silent: false };
const threshold = { value: 0 };
const capsule = { value: Array.from({ length: 2 * CAPSULES }, () => new Vector4()) };

/** Capsules that shade tissue, the first ones: [{from, to (Vector3), radius}] in the world frame [m]. */
export function shadeTissue(list) {
    for (let i = 0; i < CAPSULES; i++) {
        const one = list[i];
        capsule.value[2 * i].w = one ? one.radius : 0;
        if (!one) continue;
        capsule.value[2 * i].set(one.from.x, one.from.y, one.from.z, one.radius);
        capsule.value[2 * i + 1].set(one.to.x, one.to.y, one.to.z, 0);
    }
}


/** Brings a body's material in line with `look`. What is switched off is not in the shader at all. */
export function applyLook(material) {
    threshold.value = look.threshold;
    const { defines } = material;
    const set = (name, value) => {
        if (defines[name] === value) return;
        if (value === undefined) delete defines[name];
        else defines[name] = value;
        material.needsUpdate = true;
    };
    set('COLOURED', look.colouring || undefined);
    set('RED', look.threshold > 0 ? 1 : undefined);
    set('LIPS', look.lips ? 1 : undefined);
    set('SILENT', look.silent ? 1 : undefined);
    set('NODE_COLOURS', material.userData.colours && !look.colouring ? 1 : undefined);
    const simple = !look.colouring && !(look.threshold > 0) && !look.lips && !look.silent;
    set('RIM', simple && material.userData.rim ? 1 : undefined);
    set('LIT_AT_NODES', simple && !material.userData.rim && material.userData.fine ? 1 : undefined);
    material.uniforms.palette.value = palettes[look.colouring] ?? palettes[COLOUR.LEVEL];
}

/**
 * `grain` [1/m]: repeats of the drawn texture a metre. `own`: the image lies on the body by its
 * texture coordinates. `plain`: for processors that draw in software; `fine`: nodes are close enough to compute the
 * light at them.
 */
export function tissueMaterial({ model, grain, image, own, plain, fine }) {
    const defines = {};
    if (plain) defines.PLAIN = 1;
    if (own) defines.OWN_IMAGE = 1;
    else if (!plain) defines.THREE_SIDES = 1;
    const material = new ShaderMaterial({
        vertexShader, fragmentShader, side: DoubleSide, defines,
        polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
        uniforms: {
            threshold, capsule, palette: { value: palettes[COLOUR.LEVEL] },
            tissue: { value: new Color(1, 1, 1) }, // an image has its own colours
            inside: { value: new Color(0x9a6a48) },
            flesh: { value: new Color(0xb3261f) },
            lipColour: { value: new Color(0xf2c230) },
            // A solid shows inner faces, all of whose nodes are at the cut; a wall has a rim.
            lipEdge: { value: model === 'voxel' ? { x: 0.9, y: 0.999 } : { x: 0.35, y: 0.75 } },
            grain: { value: grain }, image: { value: image }, sink: { value: 0 },
        },
    });
    material.userData.fine = plain && fine && !own;
    applyLook(material);
    return material;
}

/**
 * Gives a body its colours: `outside` a number, or three bytes with those of walls, `inside`; `vary`: nodes have their
 * own.
 */
export function colourTissue(material, { outside, inside, vary, own, model }) {
    const { uniforms } = material;
    const bytes = (colour, [r, g, b]) => colour.setRGB(r / 255, g / 255, b / 255, SRGBColorSpace);
    if (own) uniforms.tissue.value.set(1, 1, 1);
    else if (typeof outside === 'number') uniforms.tissue.value.set(outside).multiplyScalar(GRAIN);
    else bytes(uniforms.tissue.value, outside).multiplyScalar(GRAIN);
    if (inside) bytes(uniforms[model === 'voxel' ? 'flesh' : 'inside'].value, inside);
    material.userData.colours = vary && !own;
    applyLook(material);
}

/** A square of tissue that repeats without seams: soft mottles and fine vessels, near white. */
export function drawnTissue(plain, size = 256) {
    const canvas = document.createElement('canvas');
    canvas.width = canvas.height = size;
    const context = canvas.getContext('2d');
    const random = generator(7);
    const pixels = context.createImageData(size, size);
    const noise = [[4, 0.5], [9, 0.28], [21, 0.16], [64, 0.10]].map(([cells, weight]) =>
        ({ cells, weight, value: Float32Array.from({ length: cells * cells }, random) }));
    for (let y = 0, at = 0; y < size; y++)
        for (let x = 0; x < size; x++, at += 4) {
            let sum = 0;
            for (const layer of noise)
                sum += layer.weight * smoothNoise(layer, x / size, y / size);
            pixels.data[at] = 202 + 34 * sum;
            pixels.data[at + 1] = 176 + 62 * sum;
            pixels.data[at + 2] = 172 + 62 * sum;
            pixels.data[at + 3] = 255;
        }
    context.putImageData(pixels, 0, 0);
    for (let i = 0; i < 9; i++) vessel(context, size, random);
    const texture = new CanvasTexture(canvas);
    texture.wrapS = texture.wrapT = RepeatWrapping;
    texture.colorSpace = NoColorSpace; // the shader squares it: cheaper
    if (plain) {
        texture.generateMipmaps = false;
        texture.minFilter = LinearFilter;
    }
    return texture;
}

function generator(seed) {
    let state = seed;
    return () => {
        state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
        return state / 4294967296;
    };
}

function smoothNoise({ cells, value }, u, v) {
    const x = u * cells, y = v * cells;
    const i = Math.floor(x), j = Math.floor(y);
    const fade = (t) => t * t * (3 - 2 * t);
    const a = fade(x - i), b = fade(y - j);
    const at = (p, q) => value[(q % cells) * cells + (p % cells)];
    return (at(i, j) * (1 - a) + at(i + 1, j) * a) * (1 - b) +
        (at(i, j + 1) * (1 - a) + at(i + 1, j + 1) * a) * b;
}

// A wandering line, drawn nine times so that it wraps around the edges.
function vessel(context, size, random) {
    const points = [[random() * size, random() * size]];
    let angle = random() * 2 * Math.PI;
    for (let i = 0; i < 40; i++) {
        const [x, y] = points[points.length - 1];
        angle += (random() - 0.5) * 0.9;
        points.push([x + Math.cos(angle) * size / 50, y + Math.sin(angle) * size / 50]);
    }
    context.lineJoin = context.lineCap = 'round';
    for (let k = 0; k < 9; k++) {
        context.setTransform(1, 0, 0, 1, ((k % 3) - 1) * size, (Math.floor(k / 3) - 1) * size);
        for (const [width, alpha] of [[3.4, 0.10], [1.5, 0.22]]) {
            context.strokeStyle = `rgba(140, 24, 34, ${alpha})`;
            context.lineWidth = width;
            context.beginPath();
            points.forEach(([x, y], i) => i ? context.lineTo(x, y) : context.moveTo(x, y));
            context.stroke();
        }
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
}

