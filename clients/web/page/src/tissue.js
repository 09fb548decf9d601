// How tissue looks: one small shader, cheap enough for a processor that draws in software, and the
// texture of bodies that bring no image.

import { CanvasTexture, Color, DoubleSide, RepeatWrapping, ShaderMaterial, SRGBColorSpace } from 'three';

export const COLOUR = { TISSUE: 0, LEVEL: 1, PIECE: 2 };
const TISSUES = [0xc4695c, 0xa8503f, 0xd29a78, 0xb5607a, 0xc58a52, 0x9a6a8c];
/** Level 0, 1, ...: from calm to warm; also the legend's. */
export const LEVELS = [0x4f7cac, 0x4fa69a, 0x9cc06a, 0xe3c451, 0xe58a45, 0xd65353, 0xb0479b, 0x6f4bb3];
const PIECES = [0xc4695c, 0x5c93c4, 0x7db56a, 0xd9b44a, 0x9a78c4, 0x4fb0a8, 0xd07fa8, 0x9c8f7a];

const vertexShader = /* glsl */ `
attribute vec3 rest;
attribute vec3 restNormal;
attribute vec4 info; // level, piece, beside a cut
uniform int colouring;
uniform vec3 levels[8];
uniform vec3 pieces[8];
varying vec3 vNormal, vEye, vColour;
varying float vShift, vLip;
#ifdef TEXTURED
varying vec2 vUv;
#else
varying vec3 vRest, vRestNormal;
uniform float grain;
#endif
void main() {
    vec4 eye = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * eye;
    vEye = eye.xyz;
    // Summed triangle normals: long where triangles are large, zero where there are none.
    vec3 n = normalMatrix * normal;
    vNormal = n * inversesqrt(max(dot(n, n), 1e-30));
    vColour = colouring == 1 ? levels[min(int(info.x), 7)] : pieces[int(info.y) & 7];
    vShift = distance(position, rest);
    vLip = info.z;
#ifdef TEXTURED
    vUv = uv;
#else
    vRest = rest * grain;
    vRestNormal = abs(restNormal) * inversesqrt(max(dot(restNormal, restNormal), 1e-30));
#endif
}`;

const fragmentShader = /* glsl */ `
uniform int colouring;
uniform vec3 tissue, inside, lipColour;
uniform float threshold; // [m]; 0: no red
uniform vec2 lipEdge;    // where a face begins to count as one of a cut, and does wholly
uniform bool showLips;
uniform float alive;     // 0: greyed, the daemon is silent
uniform sampler2D image;
varying vec3 vNormal, vEye, vColour;
varying float vShift, vLip;
#ifdef TEXTURED
varying vec2 vUv;
#else
varying vec3 vRest, vRestNormal;
#endif
const vec3 KEY = vec3(-0.42, 0.62, 0.66);
const vec3 FILL = vec3(0.72, -0.18, 0.67);
void main() {
#ifdef TEXTURED
    vec3 grainColour = texture2D(image, vUv).rgb;
    vec3 base = grainColour;
#else
    // The grain from three sides, mixed by where the rest shape faces.
    vec3 w = vRestNormal * vRestNormal;
    w *= w;
    vec3 grainColour = (texture2D(image, vRest.yz).rgb * w.x + texture2D(image, vRest.zx).rgb * w.y +
        texture2D(image, vRest.xy).rgb * w.z) / (w.x + w.y + w.z + 1e-6);
    vec3 base = tissue * grainColour * 1.65;
#endif
    if (colouring != 0) base = mix(base, vColour * (0.6 + 0.8 * grainColour.g), 0.88);
    float wet = colouring == 0 ? 1.0 : 0.45;
    vec3 n = normalize(vNormal);
    if (!gl_FrontFacing) {
        n = -n;
        if (colouring == 0) base = mix(base, inside, 0.75);
        wet *= 0.6;
    }
    if (showLips) base = mix(base, lipColour, 0.9 * smoothstep(lipEdge.x, lipEdge.y, vLip));
    if (threshold > 0.0)
        base = mix(base, vec3(0.86, 0.02, 0.015), 0.94 * smoothstep(0.985, 1.015, vShift / threshold));
    vec3 v = normalize(-vEye);
    float key = dot(n, KEY);
    // Light goes round the edge of soft tissue, red farther than blue.
    vec3 reach = vec3(0.42, 0.22, 0.16);
    vec3 light = max((vec3(key) + reach) / (1.0 + reach), 0.0) * 1.25;
    light += max(dot(n, FILL), 0.0) * vec3(0.22, 0.27, 0.34);
    light += mix(vec3(0.10, 0.075, 0.07), vec3(0.20, 0.22, 0.24), 0.5 + 0.5 * n.y);
    float shine = max(dot(n, normalize(KEY + v)), 0.0);
    float shine2 = shine * shine, shine4 = shine2 * shine2, shine16 = shine4 * shine4;
    shine16 *= shine16;
    float shine64 = shine16 * shine16;
    shine64 *= shine64;
    float rim = 1.0 - max(dot(n, v), 0.0);
    rim *= rim * rim;
    vec3 colour = base * light + wet * (0.10 * shine16 + 0.34 * shine64) + wet * rim * vec3(0.12, 0.10, 0.10);
    colour = mix(vec3(dot(colour, vec3(0.21, 0.72, 0.07))) * 0.55 + 0.02, colour, alive);
    gl_FragColor = vec4(sqrt(min(colour, 1.0)), 1.0);
}`;

const colours = (list) => list.map((hex) => new Color(hex));
const levelColours = colours(LEVELS), pieceColours = colours(PIECES);

/** Shared by all bodies: what the switches and the link say. */
export const look = {
    colouring: { value: COLOUR.TISSUE }, threshold: { value: 0 }, showLips: { value: false },
    alive: { value: 1 },
};

/** `grain` [1/m]: repeats of the drawn texture a metre. `uv`: the body has texture coordinates. */
export function tissueMaterial(number, model, grain, image, uv) {
    return new ShaderMaterial({
        vertexShader, fragmentShader, side: DoubleSide, defines: uv ? { TEXTURED: 1 } : {},
        polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
        uniforms: {
            ...look,
            levels: { value: levelColours }, pieces: { value: pieceColours },
            tissue: { value: new Color(TISSUES[number % TISSUES.length]) },
            inside: { value: new Color(0x6e1f20) },
            lipColour: { value: new Color(0xf2c230) },
            // A solid shows faces of its inside, all of whose nodes lie at the cut; a wall has a rim.
            lipEdge: { value: model === 'voxel' ? { x: 0.9, y: 0.999 } : { x: 0.35, y: 0.75 } },
            grain: { value: grain }, image: { value: image },
        },
    });
}

/** A square of tissue that repeats without seams: soft mottles and fine vessels, near white. */
export function drawnTissue(size = 256) {
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
    texture.colorSpace = SRGBColorSpace;
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

// A wandering line, drawn nine times so that what leaves on one side comes in on the other.
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

