// The picture of a cloud: it grows out of sight, and is put on the canvas with eye-dome lighting. What lies behind the edge
// of something nearer is darker there, as if light came from the eye and did not reach round edges. So leaves, walls and
// limbs stand out from each other whatever their normals, and before these are known. After Boucheny and Ribes, "Eye-Dome
// Lighting: a non-photorealistic shading technique", Kitware Source 17 (2011).
import {
  DepthTexture,
  HalfFloatType,
  NearestFilter,
  ShaderMaterial,
  UnsignedByteType,
  Vector2,
  WebGLRenderTarget,
  type PerspectiveCamera,
  type Scene,
  type WebGLRenderer,
} from 'three';
import { FullScreenQuad } from 'three/examples/jsm/postprocessing/Pass.js';

export interface Picture {
  /** In pixels of the screen, of which there are `ratio` to one of the page. */
  setSize(width: number, height: number, ratio: number): void;
  /** Draws the scene into the picture, over what it has, or if it begins `anew` alone. */
  add(scene: Scene, camera: PerspectiveCamera, anew: boolean): void;
  /** Whether the graphics card has drawn what was added last. */
  isDrawn(): boolean;
  /** Puts it on the canvas, with eye-dome lighting if it is told how large the discs of the points are. */
  show(camera: PerspectiveCamera, discs?: Discs): void;
}

export interface Discs {
  /** In units of the world. */
  diameter: number;
  /** Under which, in radians, they are seen at least. */
  angle: number;
}

/** How much darker it gets: so many octaves for each octave that a place is farther away than those round it. */
const STRENGTH = 200;
/** What is darkest still has this much of its light. */
const LEAST = 0.3;
/** How far away, in pixels of the page, places are looked at; in whole ones of the screen, as far on both sides. */
const REACH = 1.5;
/** Discs lie across the view, so that those of one surface are as far behind each other, in diameters. */
const THICKNESS = 0.8;

const vertexShader = /* glsl */ `
varying vec2 place;
void main() {
  place = uv;
  gl_Position = vec4(position.xy, 0.0, 1.0);
}
`;

const fragmentShader = /* glsl */ `
uniform sampler2D picture;
uniform sampler2D depths;
uniform vec2 reach;
uniform float near;
uniform float far;
uniform float strength;
uniform float thickness;
uniform float leastThickness;
varying vec2 place;

// In octaves, so that the same step is as dark from afar.
float away(float depth) {
  return log2(near * far / (far - depth * (far - near)));
}

// How much nearer than a place those on both sides of it are, on a slope nothing. Where one of them is empty, or not in
// the picture, that cannot be told.
float nearer(vec2 aside, float own) {
  vec2 depth = vec2(texture2D(depths, place + aside).x, texture2D(depths, place - aside).x);
  vec2 inside = step(abs(place - 0.5) + abs(aside), vec2(0.5));
  return max(depth.x, depth.y) == 1.0 ? 0.0 : inside.x * inside.y * (2.0 * own - away(depth.x) - away(depth.y));
}

void main() {
  vec4 shown = texture2D(picture, place);
  if (strength > 0.0 && shown.a > 0.0) {
    float own = away(texture2D(depths, place).x);
    float behind = 0.0;
    float same = max(thickness * exp2(-own), leastThickness);
    for (int i = 0; i < 4; i++) {
      float turn = float(i) * 0.7853982;
      behind += max(0.0, nearer(reach * vec2(cos(turn), sin(turn)), own) - same);
    }
    shown.rgb *= mix(${LEAST}, 1.0, exp2(-strength * behind / 8.0));
  }
  gl_FragColor = shown;
  #include <colorspace_fragment>
}
`;

export function createPicture(renderer: WebGLRenderer): Picture {
  const { extensions } = renderer;
  const isFine = extensions.has('EXT_color_buffer_float') || extensions.has('EXT_color_buffer_half_float');
  const target = new WebGLRenderTarget(1, 1, {
    // It is linear: of eight bits dark shades show steps.
    type: isFine ? HalfFloatType : UnsignedByteType,
    minFilter: NearestFilter,
    magFilter: NearestFilter,
    depthTexture: new DepthTexture(1, 1),
  });
  const reach = new Vector2();
  const material = new ShaderMaterial({
    vertexShader,
    fragmentShader,
    depthTest: false,
    depthWrite: false,
    uniforms: {
      picture: { value: target.texture },
      depths: { value: target.depthTexture },
      reach: { value: reach },
      near: { value: 0 },
      far: { value: 0 },
      strength: { value: 0 },
      thickness: { value: 0 },
      leastThickness: { value: 0 },
    },
  });
  const quad = new FullScreenQuad(material);
  const context = renderer.getContext() as WebGL2RenderingContext;
  let fence: WebGLSync | null = null;
  return {
    setSize(width, height, ratio) {
      target.setSize(width, height);
      const pixels = Math.round(REACH * ratio);
      reach.set(pixels / width, pixels / height);
    },
    add(scene, camera, anew) {
      renderer.autoClear = anew;
      renderer.setRenderTarget(target);
      renderer.render(scene, camera);
      renderer.setRenderTarget(null);
      context.deleteSync(fence);
      fence = context.fenceSync(context.SYNC_GPU_COMMANDS_COMPLETE, 0);
      // Or some browsers never come to it.
      context.flush();
    },
    isDrawn: () => !fence || context.getSyncParameter(fence, context.SYNC_STATUS) !== context.UNSIGNALED,
    show(camera, discs) {
      const { near, far, strength, thickness, leastThickness } = material.uniforms;
      near!.value = camera.near;
      far!.value = camera.far;
      strength!.value = discs ? STRENGTH : 0;
      // Of the distance, in octaves.
      thickness!.value = (THICKNESS / Math.LN2) * (discs?.diameter ?? 0);
      leastThickness!.value = (THICKNESS / Math.LN2) * (discs?.angle ?? 0);
      renderer.autoClear = true;
      quad.render(renderer);
    },
  };
}
