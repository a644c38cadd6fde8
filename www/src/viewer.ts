// The view: plain arrays in, pixels on one canvas. It knows nothing of files, wasm or the rest of the page, and it draws
// only when something has changed.
import { Group, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { createPointMaterial, type Shading as MaterialShading } from 'bilinormal/three';
import type { Bounds } from './bounds';
import { SPARSE_FROM, SPARSE_MOST, createChunks, type Chunks } from './chunks';
import { pickPoint } from './pick';
import { createPicture } from './picture';
import { spacingOf } from './spacing';

export type Shading = MaterialShading | 'curvature';
/** An axis of the file, or the opposite of one. */
export type Up = 'x' | '-x' | 'y' | '-y' | 'z' | '-z';

export interface Cloud {
  /** x0 y0 z0 x1 ...; points that are not finite are not drawn. */
  positions: Float32Array;
  /** RGBA. */
  colors?: Uint8Array | undefined;
}

export interface Viewer {
  /** Replaces the cloud; it stays unlit until its normals arrive. */
  show(cloud: Cloud, bounds: Bounds, up: Up): void;
  /** `curvatureColors` (RGBA) are what the shading of that name shows; without them it shows the normals. */
  setNormals(normals: Float32Array, curvatureColors?: Uint8Array): void;
  /** Draws other normals of the same cloud, or the same ones because their values have changed. */
  refreshNormals(normals: Float32Array): void;
  setShading(shading: Shading): void;
  /** Whether what points away from the eye has a colour of its own, or looks as from the front. */
  setBacks(shown: boolean): void;
  /** 1 is the size at which the points of a surface just about close it. */
  setPointSize(size: number): void;
  setUp(up: Up): void;
  /** Frames the whole cloud from the first point of view. */
  fit(): void;
  /** Number of the point of the cloud at a place of the window, or in the middle of the view; -1 where there is none. */
  pick(at?: { x: number; y: number }): number;
  /** Where the camera is, in the coordinates of the cloud's positions. */
  eye(): [number, number, number];
  /** What is covered, at least one choice: from then on the cloud is framed in the rest, where that makes it largest. */
  setMargins(choices: Margins[]): void;
}

/** Pixels at the edges. */
export interface Margins {
  top: number;
  right: number;
  bottom: number;
  left: number;
}

/** No scan has this colour, nor has the ramp of the curvature. In style.css, too. */
const BACK = '#ff3d8b';

/** While the camera moves, clouds may be drawn in part, if whole frames take too long. */
const SPARSE_LEAST = 60_000;
/** A still cloud of more than `SPARSE_MOST` is drawn by many frames, of so many points: slow machines answer between them. */
const FILL_LEAST = 100_000;
const FILL_MOST = 8_000_000;
const FAST_FILL = 100;
const SLOW_FILL = 250;
/** The card is not waited for longer than so, in milliseconds. */
const LONGEST_FILL = 2000;
/** Frame times between these two, in milliseconds, leave the number of points as it is. */
const FAST_FRAME = 20;
const SLOW_FRAME = 36;
/** Time without movement after which the whole cloud is drawn. */
const STILL = 140;
/** Points without order need this many times the spacing of an even pattern to close a surface. */
const CLOSING = 2.8;
/** Least that a point measures, in pixels of the page. */
const LEAST_PIXELS = 1.5;
/** Most that a point measures without a choice of its size, where the bulk of the cloud has radius 1: a few are dots. */
const LARGEST = 0.2;
/** What the graphics card had no memory for is tried again with this share of the points. */
const FEWER = 0.25;

interface Settings {
  /** Whether what lies behind an edge is darker there. */
  edges?: boolean;
  /** Told how many points are drawn from now on, if the graphics card has no memory for all. */
  onPart?: (points: number) => void;
}

export function createViewer(canvas: HTMLCanvasElement, { edges = true, onPart }: Settings = {}): Viewer {
  const calm = matchMedia('(prefers-reduced-motion: reduce)').matches;
  const powerPreference = 'high-performance';
  const renderer = new WebGLRenderer({ canvas, alpha: true, antialias: false, depth: false, powerPreference });
  const picture = createPicture(renderer);
  const camera = new PerspectiveCamera(38, 1, 0.01, 100);
  camera.position.set(0, 0, 3);
  const controls = new OrbitControls(camera, canvas);
  controls.enableDamping = !calm;
  controls.dampingFactor = 0.12;
  controls.zoomToCursor = true;
  controls.listenToKeyEvents(canvas);

  const scene = new Scene();
  // The world is y-up, with the middle of the cloud at its origin and its bulk in the unit ball, because OrbitControls
  // takes no notice of movements below a length of its own; this turns and scales the cloud into it.
  const turned = new Group();
  scene.add(turned);
  // Warm and with little light on edges, so that form stands out against both backgrounds.
  const material = createPointMaterial({ color: '#ebe2d3', ambient: 0.02 });

  let cloud: Cloud | undefined;
  let bounds: Bounds | undefined;
  /** How far the cloud reaches in the world. */
  let reach = 1;
  /** What a point of it measures there to close its surface. */
  let closing = 0;
  let chunks: Chunks | undefined;
  /** Whether the graphics card has got something of the cloud that it may have no memory for. */
  let isUnproven = false;
  let hasCurvature = false;
  let shading: Shading = 'shaded';
  let pointSize = 1;
  let margins: Margins = { top: 0, right: 0, bottom: 0, left: 0 };
  let choices = [margins];
  /** Whether the view is still as `fit` left it: then it follows the window. */
  let framed = false;

  let frame = 0;
  let lastFrame = 0;
  let lastMove = -Infinity;
  let wasMoving = false;
  let affordable = SPARSE_MOST;
  /** How many points the picture of a still cloud has, and gets by the next frame. */
  let filled = 0;
  let filling = SPARSE_MOST / 4;

  /** Draws anew. */
  function request(): void {
    filled = 0;
    canvas.ariaBusy = 'true';
    proceed();
  }

  function proceed(): void {
    if (frame === 0) frame = requestAnimationFrame(draw);
  }

  function draw(now: number): void {
    frame = 0;
    // When it is back, everything is drawn anew.
    if (renderer.getContext().isContextLost()) return;
    controls.update();
    const moving = now - lastMove < STILL;
    // What is asked of the card before it is done with the last would hold up the page, and later frames.
    const isWaiting = filled > 0 && !picture.isDrawn() && now - lastFrame < LONGEST_FILL;
    if (!moving && isWaiting) return proceed();
    const elapsed = now - lastFrame;
    // Before the first frame of a movement lies a gap, which says nothing.
    if (moving && wasMoving) adapt(elapsed);
    wasMoving = moving;
    lastFrame = now;
    setDepthRange();
    if (!moving) return fill(elapsed);
    drawPart(affordable);
    request();
  }

  function drawPart(most: number): void {
    if (chunks) setSize(chunks.drawSpread(Math.floor(most)));
    picture.add(scene, camera, true);
    show();
  }

  function show(): void {
    // Colours that stand for something stay what they are.
    const isScale = isBent() || material.shading === 'normals';
    picture.show(camera, edges && !isScale ? { diameter: material.size, angle: LEAST_PIXELS * pixel() } : undefined);
  }

  /** What a pixel of the page spans, at a distance of 1. */
  const pixel = () => (2 * Math.tan((camera.fov * Math.PI) / 360)) / canvas.clientHeight;

  /** Draws the next points of a still cloud. Until it is whole, what is drawn in motion stays on the canvas. */
  function fill(elapsed: number): void {
    const all = chunks?.count ?? 0;
    const isLarge = all > SPARSE_MOST;
    if (filled > 0 && elapsed > SLOW_FILL) filling = Math.max(FILL_LEAST, filling / 2);
    else if (filled > 0 && elapsed < FAST_FILL) filling = Math.min(FILL_MOST, filling * 2);
    if (isLarge && filled === 0) {
      settle();
      // Or it would begin again, for less than can be seen.
      lastMove = -Infinity;
      drawPart(Math.min(affordable, filling));
    }
    if (filled < all || filled === 0) {
      const end = isLarge ? Math.min(all, Math.floor(filled + filling)) : all;
      setSize(all);
      chunks?.drawRange(filled, end);
      picture.add(scene, camera, filled === 0);
      filled = end;
      if (isLarge) return proceed();
    }
    if (isUnproven && isOutOfMemory() && all > SPARSE_FROM) return drawFewer();
    isUnproven &&= renderer.getContext().isContextLost();
    show();
    canvas.ariaBusy = 'false';
  }

  function isOutOfMemory(): boolean {
    const context = renderer.getContext();
    let found = false;
    for (let error = context.getError(); error !== context.NO_ERROR; error = context.getError()) {
      found ||= error === context.OUT_OF_MEMORY;
    }
    return found;
  }

  function drawFewer(): void {
    if (!chunks) return;
    chunks.limit(Math.floor(FEWER * chunks.count));
    onPart?.(chunks.count);
    request();
  }

  /** Learns from the time since the last frame how many points this machine draws smoothly. */
  function adapt(elapsed: number): void {
    if (!chunks || chunks.count <= SPARSE_FROM) return;
    const share = Math.min(0.75, Math.max(0.1, SLOW_FRAME / elapsed));
    if (elapsed > SLOW_FRAME) affordable = Math.max(SPARSE_LEAST, affordable * share);
    else if (elapsed < FAST_FRAME) affordable = Math.min(SPARSE_MOST, affordable * 1.08);
  }

  function setDepthRange(): void {
    const away = camera.position.length();
    const focus = camera.position.distanceTo(controls.target);
    camera.near = Math.max(away - reach, focus * 0.01, 1e-4);
    camera.far = Math.max(away + reach * 1.01, camera.near * 2);
    camera.updateProjectionMatrix();
  }

  /** Size of a point in world units, and larger where a part of the cloud, so many points, has to stand for the whole. */
  function setSize(drawn: number): void {
    if (!cloud) return;
    material.size = pointSize * closing * Math.min(2, Math.sqrt(cloud.positions.length / 3 / drawn));
  }

  /** Whether it is the curvature that is shown. */
  const isBent = () => shading === 'curvature' && hasCurvature;

  function chooseShading(): void {
    const bent = isBent();
    const colors = bent ? 'curvature' : cloud?.colors && 'fileColor';
    chunks?.colorBy(colors);
    const possible = shading === 'curvature' ? (bent ? 'colors' : 'shaded') : shading;
    const wanted = chunks?.has('normal') || possible === 'plain' ? possible : 'colors';
    material.shading = wanted === 'colors' && !colors ? 'plain' : wanted;
  }

  /** Turns the axis of the file upwards. */
  function turn(up: Up): void {
    const right = Math.PI / 2;
    turned.rotation.x = { x: 0, '-x': 0, y: 0, '-y': Math.PI, z: -right, '-z': right }[up];
    turned.rotation.z = up === 'x' ? right : up === '-x' ? -right : 0;
  }

  /** Spends what is left of a movement, as an update without damping does. */
  function settle(): void {
    controls.enableDamping = false;
    controls.update();
    controls.enableDamping = !calm;
  }

  function fit(): void {
    if (!bounds) return;
    // A window without a size is framed when it gets one.
    framed = true;
    if (canvas.clientWidth === 0 || canvas.clientHeight === 0) return;
    settle();
    const [x, y, z] = bounds.extent;
    const box = new Vector3(x, y, z).applyEuler(turned.rotation);
    const flat = 1 - Math.min(1, Math.abs(box.y) / Math.max(Math.abs(box.x), Math.abs(box.z), Number.MIN_VALUE));
    const direction = new Vector3(0.5, 0.36 + 0.45 * flat, 1).normalize();
    const half = box.multiplyScalar(0.5 / bounds.radius);
    const distances = choices.map((choice) => framingDistance(direction, half, choice));
    const least = Math.min(...distances);
    margins = choices[distances.indexOf(least)]!;
    centre();
    const distance = 1.06 * least;
    controls.target.set(0, 0, 0);
    camera.position.copy(direction).multiplyScalar(distance);
    controls.minDistance = 1e-3;
    controls.maxDistance = Math.max(reach, distance) * 20;
    controls.update();
    // A jump, not a movement: draw all of it at once.
    lastMove = -Infinity;
    // The updates above told of a change.
    framed = true;
    request();
  }

  /**
   * How far away, looking along `direction`, the discs of the points in the box (half edges) or in the unit ball just fill
   * what is not covered.
   */
  function framingDistance(direction: Vector3, half: Vector3, { top, right: end, bottom, left }: Margins): number {
    const { clientWidth: width, clientHeight: height } = canvas;
    const slope = pixel() / 2;
    // Where there is nothing else to choose, what is left may be too little; where there is, it loses.
    const share = choices.length > 1 ? 0.01 : 0.25;
    const across = slope * Math.max(width - left - end, share * width);
    const upright = slope * Math.max(height - top - bottom, share * height);
    const right = new Vector3(0, 1, 0).cross(direction).normalize();
    const above = new Vector3().crossVectors(direction, right);
    const disc = (pointSize * closing) / 2;
    let distance = half.lengthSq() > 0 ? 0 : Infinity;
    for (let corner = 0; corner < 8; corner++) {
      const at = half.clone().multiply(new Vector3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1));
      const beside = Math.max((Math.abs(at.dot(right)) + disc) / across, (Math.abs(at.dot(above)) + disc) / upright);
      distance = Math.max(distance, beside + at.dot(direction));
    }
    return Math.min(distance, (1 + disc) / Math.sin(Math.atan(Math.min(across, upright))));
  }

  function resize(): void {
    const { clientWidth: width, clientHeight: height } = canvas;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    renderer.setPixelRatio(ratio);
    renderer.setSize(width, height, false);
    picture.setSize(canvas.width, canvas.height, ratio);
    material.pixels = LEAST_PIXELS * ratio;
    // Five degrees for a press of a key, whatever the size of the window.
    controls.keyRotateSpeed = height / 72;
    reframe();
    // Before the browser paints: a canvas of another size is empty.
    cancelAnimationFrame(frame);
    draw(performance.now());
  }

  function reframe(): void {
    if (framed) fit();
    else centre();
  }

  /** The middle of what is not covered is the middle of the view. */
  function centre(): void {
    const { clientWidth: width, clientHeight: height } = canvas;
    if (width === 0 || height === 0) return;
    const { top, right, bottom, left } = margins;
    camera.setViewOffset(width, height, (right - left) / 2, (bottom - top) / 2, width, height);
    request();
  }

  /** The window was zoomed, or moved to a screen of other pixels: its size may stay the same. */
  function followPixelRatio(): void {
    const same = matchMedia(`(resolution: ${devicePixelRatio}dppx)`);
    const change = () => {
      resize();
      followPixelRatio();
    };
    same.addEventListener('change', change, { once: true });
  }

  function pick(at?: { x: number; y: number }): number {
    if (!cloud || !chunks) return -1;
    const box = canvas.getBoundingClientRect();
    const behind = controls.target.clone();
    if (at) {
      const x = ((at.x - box.left) / box.width) * 2 - 1;
      const y = 1 - ((at.y - box.top) / box.height) * 2;
      behind.set(x, y, 0.5).unproject(camera);
    }
    const eye = new Vector3(...viewer.eye());
    const along = chunks.group.worldToLocal(behind).sub(eye).normalize();
    const radius = material.size / 2 / turned.scale.x;
    return pickPoint(cloud.positions, eye.toArray(), along.toArray(), 6 * pixel(), radius);
  }

  function focus(event: MouseEvent): void {
    const index = pick({ x: event.clientX, y: event.clientY });
    if (!cloud || !chunks || index < 0) return;
    controls.target.copy(chunks.group.localToWorld(new Vector3().fromArray(cloud.positions, index * 3)));
    request();
  }

  controls.addEventListener('change', () => {
    framed = false;
    lastMove = performance.now();
    request();
  });
  canvas.addEventListener('dblclick', focus);
  canvas.addEventListener('keydown', (event) => {
    // These zoom the page.
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    // Against its documentation, dollyIn multiplies the distance.
    if (event.key === '+' || event.key === '=') controls.dollyIn(1 / 1.1);
    if (event.key === '-') controls.dollyOut(1 / 1.1);
  });
  // A card without memory may take away what it has.
  canvas.addEventListener('webglcontextlost', () => {
    if (isUnproven && chunks && chunks.count > SPARSE_MOST) drawFewer();
  });
  canvas.addEventListener('webglcontextrestored', () => {
    isUnproven = true;
    request();
  });
  new ResizeObserver(resize).observe(canvas);
  followPixelRatio();

  const viewer: Viewer = {
    show(next, nextBounds, up) {
      chunks?.group.removeFromParent();
      chunks?.dispose();
      cloud = next;
      bounds = nextBounds;
      chunks = createChunks(next.positions, material, bounds);
      chunks.group.position.set(...bounds.centre).negate();
      turned.add(chunks.group);
      if (next.colors) chunks.set('fileColor', next.colors, 4);
      isUnproven = true;
      hasCurvature = false;
      turned.scale.setScalar(1 / bounds.radius);
      reach = bounds.reach / bounds.radius;
      closing = Math.min((CLOSING * spacingOf(next.positions)) / bounds.radius, LARGEST);
      chooseShading();
      turn(up);
      fit();
    },
    setNormals(normals, curvatureColors) {
      hasCurvature = curvatureColors !== undefined;
      if (curvatureColors) chunks?.set('curvature', curvatureColors, 4);
      chunks?.set('normal', normals, 3);
      isUnproven = true;
      chooseShading();
      request();
    },
    refreshNormals(normals) {
      chunks?.set('normal', normals, 3);
      request();
    },
    setBacks(shown) {
      material.backColor = shown ? BACK : null;
      request();
    },
    setShading(next) {
      shading = next;
      chooseShading();
      request();
    },
    setPointSize(next) {
      pointSize = next;
      request();
    },
    setUp(up) {
      turn(up);
      reframe();
    },
    fit,
    pick,
    eye() {
      if (!chunks) return [0, 0, 0];
      chunks.group.updateWorldMatrix(true, false);
      return chunks.group.worldToLocal(camera.position.clone()).toArray();
    },
    setMargins(next) {
      // A view that was moved stays beside or above what it was.
      margins = next[choices.indexOf(margins)] ?? next[0]!;
      choices = next;
      reframe();
    },
  };
  return viewer;
}
