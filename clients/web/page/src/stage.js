// SPDX-License-Identifier: MIT
// The camera, the renderer and the ground: draws only when something changed. Where the processor draws, moving tissue
// gets coarser meshes and one sample a pixel; what has stood still for a moment is drawn once more, with all its triangles
// and four samples a pixel.

import { Box3, Color, MOUSE, PerspectiveCamera, Plane, Raycaster, Scene, TOUCH, Vector2, Vector3,
    WebGLRenderer } from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { Ground } from './ground.js';

const BACKGROUND = 0x171b1f;
const STILL_MS = 300;       // without a frame, before that
const STILL_PIXELS = 4e6;   // most that are drawn then: a large window gets fewer samples a pixel
const MARGIN = 0.94;        // of the free part of the picture: what a whole view fills
const EDGE = 4, EDGE_SOFTWARE = 14; // [pixels]: shorter edges of triangles are not worth their time

// Software rendering: without antialiasing, at one pixel per CSS pixel.
function drawsInSoftware() {
    const context = document.createElement('canvas').getContext('webgl2');
    const info = context?.getExtension('WEBGL_debug_renderer_info');
    const name = info ? context.getParameter(info.UNMASKED_RENDERER_WEBGL) : '';
    context?.getExtension('WEBGL_lose_context')?.loseContext();
    return /swiftshader|llvmpipe|software/i.test(name);
}

export class Stage {
    /**
     * `beforeDraw(view)` is called before each frame: view = {eye, edge, turned, still}, see findView. `above`, `below`:
     * what covers the top and the bottom of the picture; the scene is in the middle of the rest.
     */
    constructor(canvas, beforeDraw, { above, below }) {
        this.canvas = canvas;
        this.above = above;
        this.below = below;
        this.beforeDraw = beforeDraw;
        this.software = drawsInSoftware();
        // Opaque: a picture that could be seen through is mixed with the page behind it for every frame.
        const context = canvas.getContext('webgl2', { alpha: false, stencil: false, antialias: !this.software,
            powerPreference: 'high-performance' });
        this.renderer = new WebGLRenderer({ canvas, context });
        this.ratio = this.software ? 1 : Math.min(devicePixelRatio, 2); // of moving pictures
        this.renderer.setPixelRatio(this.ratio);
        this.renderer.setClearColor(new Color(BACKGROUND));
        this.scene = new Scene();
        this.ground = new Ground(BACKGROUND);
        this.camera = new PerspectiveCamera(34, 1, 0.001, 10);
        this.camera.up.set(0, 0, 1);
        this.camera.position.set(0.3, -0.6, 0.3);
        this.controls = new OrbitControls(this.camera, canvas);
        this.controls.mouseButtons = { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.PAN, RIGHT: MOUSE.ROTATE };
        this.controls.touches = { ONE: TOUCH.ROTATE, TWO: TOUCH.DOLLY_ROTATE };
        this.controls.rotateSpeed = 0.8;
        this.controls.addEventListener('change', () => this.invalidate());
        this.size = 0.2; // size of the visible scene [m]
        this.center = new Vector3();
        this.frames = 0;
        this.wanted = false;
        this.view = { eye: new Vector3(NaN), edge: 0, turned: true, still: false };
        this.ray = new Raycaster();
        this.point = new Vector2();
        this.plane = new Plane();
        this.draw = this.draw.bind(this);
        const sizes = new ResizeObserver(() => this.resize());
        for (const part of [canvas.parentElement, above, below]) sizes.observe(part);
        canvas.addEventListener('keydown', (event) => this.key(event));
        this.resize();
    }

    resize() {
        const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
        if (width === 0 || height === 0) return;
        const { top, bottom } = this.canvas.getBoundingClientRect();
        const hidden = (part, from, to) => (part.offsetHeight ? Math.min(Math.max(to - from, 0), 0.4 * height) : 0);
        const up = hidden(this.above, top, this.above.getBoundingClientRect().bottom);
        const down = hidden(this.below, this.below.getBoundingClientRect().top, bottom);
        this.renderer.setSize(width, height, false);
        this.free = { x: width / height, y: 1 - (up + down) / height }; // of the picture's height
        this.camera.setViewOffset(width, height, 0, 0.5 * (down - up), width, height);
        // A view that nobody has turned follows.
        if (this.points && this.camera.position.equals(this.homeAt)) this.home();
        this.invalidate();
    }

    invalidate() {
        if (this.wanted) return;
        this.wanted = true;
        requestAnimationFrame(this.draw);
    }

    draw() {
        this.wanted = false;
        this.render(false);
        if (!this.software) return;
        clearTimeout(this.stillLater);
        this.stillLater = setTimeout(() => { if (!this.wanted) this.render(true); }, STILL_MS);
    }

    render(still) {
        const { clientWidth, clientHeight } = this.canvas;
        const finest = Math.sqrt(STILL_PIXELS / Math.max(clientWidth * clientHeight, 1));
        const ratio = this.software && still ? Math.min(Math.max(finest, 1), 2) : this.ratio;
        if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
        this.beforeDraw(this.findView(still));
        this.renderer.render(this.scene, this.camera);
        this.frames++;
    }

    // The eye [m], the length of an edge [m] that is short enough for this picture, whether either differs from the last
    // frame's, and whether everything stands still.
    findView(still) {
        const { view, camera } = this;
        const distance = camera.position.distanceTo(this.controls.target);
        const pixel = 2 * distance * Math.tan(0.5 * camera.fov * Math.PI / 180) / this.canvas.height;
        const edge = still ? 0 : pixel * (this.software ? EDGE_SOFTWARE : EDGE);
        view.turned = edge !== view.edge || !view.eye.equals(camera.position);
        view.edge = edge;
        view.still = still;
        view.eye.copy(camera.position);
        return view;
    }

    /** Looks at all of a box, and of the points in it ([[x, y, z, ...], ...]); `flat`: from above. */
    fit(box, flat, points) {
        this.size = Math.max(box.getSize(new Vector3()).length(), 1e-3);
        box.getCenter(this.center);
        this.points = points;
        this.flat = flat;
        this.home();
        this.ground.lay(this.scene, box, this.center, this.size, flat);
    }

    home() {
        const away = this.flat ? new Vector3(0, -0.02, 1) : new Vector3(0.55, -1, 0.48);
        const distance = this.distanceOf(away.normalize());
        this.camera.position.copy(this.center).addScaledVector(away, distance);
        this.camera.near = 0.02 * distance;
        this.camera.far = 12 * distance;
        this.camera.updateProjectionMatrix();
        this.controls.target.copy(this.center);
        this.controls.minDistance = 0.1 * distance;
        this.controls.maxDistance = 8 * distance;
        this.controls.update();
        this.homeAt = this.camera.position.clone();
        this.invalidate();
    }

    // From where, along `away`, all points are in the free part of the picture.
    distanceOf(away) {
        const half = MARGIN * Math.tan(0.5 * this.camera.fov * Math.PI / 180);
        const right = new Vector3().crossVectors(this.camera.up, away).normalize();
        const up = new Vector3().crossVectors(away, right), point = new Vector3();
        let distance = 0.5 * this.size;
        for (const list of this.points)
            for (let i = 0; i < list.length; i += 3) {
                point.fromArray(list, i).sub(this.center);
                distance = Math.max(distance, point.dot(away) + Math.max(Math.abs(point.dot(right)) / this.free.x,
                    Math.abs(point.dot(up)) / this.free.y) / half);
            }
        return distance;
    }

    /** The ray through a point of the page: {origin, direction}; valid until the next call. */
    rayThrough(clientX, clientY) {
        const frame = this.canvas.getBoundingClientRect();
        this.point.set(2 * (clientX - frame.left) / frame.width - 1,
            1 - 2 * (clientY - frame.top) / frame.height);
        this.camera.updateMatrixWorld();
        this.ray.setFromCamera(this.point, this.camera);
        return this.ray.ray;
    }

    viewDirection(out) { return this.camera.getWorldDirection(out); }

    /** Where a point of the world is on the canvas [css pixels], into {x, y}; false: behind. */
    onScreen(point, out) {
        out.copy(point).project(this.camera);
        const { clientWidth, clientHeight } = this.canvas;
        out.x = (0.5 + 0.5 * out.x) * clientWidth;
        out.y = (0.5 - 0.5 * out.y) * clientHeight;
        return out.z < 1;
    }

    // Keys control the camera while the picture has the focus.
    key(event) {
        const turn = 0.12;
        const by = { ArrowLeft: [-turn, 0, 1], ArrowRight: [turn, 0, 1], ArrowUp: [0, -turn, 1],
            ArrowDown: [0, turn, 1], '+': [0, 0, 0.88], '=': [0, 0, 0.88], '-': [0, 0, 1.14] }[event.key];
        if (!by) return;
        event.preventDefault();
        const offset = this.camera.position.clone().sub(this.controls.target);
        const radius = Math.min(Math.max(offset.length() * by[2], this.controls.minDistance),
            this.controls.maxDistance);
        const azimuth = Math.atan2(offset.y, offset.x) + by[0];
        const polar = Math.min(Math.max(Math.acos(offset.z / offset.length()) + by[1], 0.02), 3.12);
        offset.set(Math.sin(polar) * Math.cos(azimuth), Math.sin(polar) * Math.sin(azimuth),
            Math.cos(polar)).multiplyScalar(radius);
        this.camera.position.copy(this.controls.target).add(offset);
        this.controls.update();
        this.invalidate();
    }
}

/** The box of all bodies; empty: there is none. */
export function boxOfAll(bodies) {
    const box = new Box3();
    for (const { box: [x, y, z, ...most] } of bodies)
        box.expandByPoint(new Vector3(x, y, z)).expandByPoint(new Vector3(...most));
    return box;
}
