// A point material that shows normals: three's own PointsMaterial is unlit, and flat clouds hide what normals tell.
import { Color, type ColorRepresentation, ShaderMaterial, Vector2, type WebGLRenderer } from 'three';

/**
 * `shaded`: `color`, lit from the camera on both sides, so that the signs of normals do not matter; `normals`: x, y, z
 * as red, green, blue, with their signs; `colors`: the attribute `color`, unlit; `plain`: `color`, unlit.
 */
export type Shading = 'shaded' | 'normals' | 'colors' | 'plain';

/** `srgb`: as files have them, and `PointCloud.colors`; `srgb-linear`: as three's own loaders give them. */
export type ColorSpace = 'srgb' | 'srgb-linear';

export interface PointMaterialOptions {
  /** Default `'shaded'`. */
  shading?: Shading;
  /** Default a light grey. */
  color?: ColorRepresentation;
  /** Diameter in world units, smaller with distance. Default 0: `pixels` alone decides. */
  size?: number;
  /** Diameter in CSS pixels that no point falls below. Default 2. */
  pixels?: number;
  /** Discs instead of squares. Default true. */
  round?: boolean;
  /** Brightness, 0 to 1, of a surface seen edge on. Default 0.15. */
  ambient?: number;
  /**
   * Of points whose normals point away from the camera: with any shading they are lit in this colour. Default `null`:
   * both sides look the same.
   */
  backColor?: ColorRepresentation | null;
  /** What the attribute `color` holds. Default `'srgb'`. */
  colorSpace?: ColorSpace;
}

const shadings: readonly Shading[] = ['shaded', 'normals', 'colors', 'plain'];

const vertexShader = /* glsl */ `
uniform float size;
uniform float pixels;
uniform float pixelRatio;
uniform float viewportHeight;
// Where \`vertexColors\` is set, three declares it.
#if !defined(USE_COLOR) && !defined(USE_COLOR_ALPHA)
attribute vec4 color;
#endif
varying vec3 vNormal;
varying vec3 vColor;
varying vec3 vToCamera;
#include <common>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>

void main() {
  vNormal = normal;
  vColor = color.rgb;
  vec4 mvPosition = modelViewMatrix * vec4(position, 1.0);
  // In the space of the normals, so that the fragment needs no matrix; zero normals stay zero.
  vToCamera = (isOrthographic ? vec3(0.0, 0.0, 1.0) : -mvPosition.xyz) * normalMatrix;
  // Whatever the unit is, the fragment can square it.
  vec3 along = abs(vToCamera);
  vToCamera /= max(max(along.x, along.y), max(along.z, 1e-37));
  gl_Position = projectionMatrix * mvPosition;
  gl_PointSize = max(size * 0.5 * viewportHeight * projectionMatrix[1][1] / gl_Position.w, pixels * pixelRatio);
  #include <logdepthbuf_vertex>
  #include <clipping_planes_vertex>
}
`;

const fragmentShader = /* glsl */ `
uniform int shading;
uniform vec3 base;
uniform vec3 back;
uniform bool hasBack;
uniform float ambient;
uniform bool isRound;
uniform bool isLinear;
varying vec3 vNormal;
varying vec3 vColor;
varying vec3 vToCamera;
#include <common>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>

// Colours of files, and of normals, are meant as they stand: sRGB. Three's loaders have made them linear.
vec3 linear(vec3 srgb) {
  return mix(srgb / 12.92, pow((srgb + 0.055) / 1.055, vec3(2.4)), step(0.04045, srgb));
}

void main() {
  #include <clipping_planes_fragment>
  #include <logdepthbuf_fragment>
  vec2 offset = gl_PointCoord - 0.5;
  if (isRound && dot(offset, offset) > 0.25) discard;
  // A point without a normal is neither lit nor dark, and has no back.
  float facing = vNormal == vec3(0.0) ? 0.5 : dot(normalize(vNormal), normalize(vToCamera));
  float light = mix(ambient, 1.0, abs(facing));
  vec3 shown = base;
  if (hasBack && facing < 0.0) {
    shown = back * light;
  } else if (shading == 0) {
    shown *= light;
  } else if (shading == 1) {
    shown = linear(0.5 + 0.5 * vNormal);
  } else if (shading == 2) {
    shown = isLinear ? vColor : linear(vColor);
  }
  gl_FragColor = vec4(shown, 1.0);
  #include <colorspace_fragment>
}
`;

/**
 * A material for `Points` whose geometry has the attributes `position`, `normal` (three floats; missing or zero is
 * neither lit nor dark) and `color` (three or four numbers; `PointCloud.colors` fits as
 * `new BufferAttribute(colors, 4, true)`; those of three's loaders with `colorSpace`; missing is white). For `WebGLRenderer`.
 */
export class PointMaterial extends ShaderMaterial {
  constructor(options: PointMaterialOptions = {}) {
    const { shading = 'shaded', color = '#d8d8d4', size = 0, pixels = 2, round = true, ambient = 0.15 } = options;
    super({
      name: 'PointMaterial',
      vertexShader,
      fragmentShader,
      clipping: true,
      uniforms: {
        shading: { value: 0 },
        base: { value: new Color(color) },
        back: { value: new Color() },
        hasBack: { value: false },
        ambient: { value: ambient },
        size: { value: size },
        pixels: { value: pixels },
        pixelRatio: { value: 1 },
        isRound: { value: round },
        isLinear: { value: false },
        viewportHeight: { value: 1 },
      },
    });
    this.shading = shading;
    this.backColor = options.backColor ?? null;
    this.colorSpace = options.colorSpace ?? 'srgb';
  }

  get shading(): Shading {
    return shadings[this.uniforms.shading!.value]!;
  }
  set shading(shading: Shading) {
    const index = shadings.indexOf(shading);
    if (index < 0) throw new RangeError(`shading is ${shading}; wanted one of ${shadings.join(', ')}`);
    this.uniforms.shading!.value = index;
  }

  get color(): Color {
    return this.uniforms.base!.value;
  }
  set color(color: ColorRepresentation) {
    this.uniforms.base!.value.set(color);
  }

  get backColor(): Color | null {
    return this.uniforms.hasBack!.value ? this.uniforms.back!.value : null;
  }
  set backColor(color: ColorRepresentation | null) {
    this.uniforms.hasBack!.value = color !== null;
    if (color !== null) this.uniforms.back!.value.set(color);
  }

  get colorSpace(): ColorSpace {
    return this.uniforms.isLinear!.value ? 'srgb-linear' : 'srgb';
  }
  set colorSpace(space: ColorSpace) {
    this.uniforms.isLinear!.value = space === 'srgb-linear';
  }

  get size(): number {
    return this.uniforms.size!.value;
  }
  set size(size: number) {
    this.uniforms.size!.value = size;
  }

  get pixels(): number {
    return this.uniforms.pixels!.value;
  }
  set pixels(pixels: number) {
    this.uniforms.pixels!.value = pixels;
  }

  get round(): boolean {
    return this.uniforms.isRound!.value;
  }
  set round(round: boolean) {
    this.uniforms.isRound!.value = round;
  }

  get ambient(): number {
    return this.uniforms.ambient!.value;
  }
  set ambient(ambient: number) {
    this.uniforms.ambient!.value = ambient;
  }

  /** Called by the renderer: sizes in pixels depend on what is drawn into. */
  override onBeforeRender(renderer: WebGLRenderer): void {
    const target = renderer.getRenderTarget();
    this.uniforms.viewportHeight!.value = target ? target.height : renderer.getDrawingBufferSize(drawingBuffer).y;
    this.uniforms.pixelRatio!.value = target ? 1 : renderer.getPixelRatio();
    this.uniformsNeedUpdate = true;
  }
}

const drawingBuffer = new Vector2();

/** A lit point material; all options are properties that can be changed later. */
export function createPointMaterial(options?: PointMaterialOptions): PointMaterial {
  return new PointMaterial(options);
}
