// What a person can have done, as one flow: file -> readPointCloud -> estimateNormals, meanwhile viewer.show ->
// viewer.setNormals -> report. One job runs at a time; a new one cancels it. Curvature is computed while it is shown.
import { BilinormalError, estimateNormals, writePly, type EstimateOptions } from 'bilinormal';
import { scannerOf } from '../../src/js/scanner';
import { boundsOf } from './bounds';
import { compare } from './compare';
import { checkRoom, download, makeSample, onlyScans, read, unpacked } from './files';
import { foreign } from './foreign';
import { count } from './format';
import { createJobs, messageOf, type Step } from './jobs';
import { METHODS, askedBy, hasSurfaces, orientOf, parseOptions, type OptionsForm } from './options';
import { colorsOf } from './ramp';
import { UNTURNED, addNote, type NormalSource, type State, type Store, type Turned } from './state';
import { guessUp } from './upright';
import type { Viewer } from './viewer';
import { warmingCloud } from './warming';

export interface Session {
  /** Starts the workers and lets the browser compile them for speed, so that the first file need not wait for that. */
  warm(): void;
  /** The first scan of these files. */
  open(files: File[]): Promise<void>;
  openSample(): Promise<void>;
  /** Computes the normals of the cloud on the screen again, with the options that are set now. */
  estimate(): Promise<void>;
  /** Sees to it that the curvature is there, if the normals are: of the same neighbourhoods. */
  addCurvature(): Promise<void>;
  /** Shows these normals, until the computed ones change. */
  showNormals(source: NormalSource): void;
  /** Turns all normals round, those on the screen and so those that are saved. */
  flip(): void;
  /** Turns those of the surface round that a point belongs to; answers whether it belongs to one. */
  flipSurface(point: number): boolean;
  /** Takes back the last of these two that was not taken back. */
  undoFlip(): void;
  /** Computes the result again whose flips by hand went with it, and flips it so. */
  bringBack(): Promise<void>;
  save(): Promise<void>;
  cancel(): void;
}

/** The surface of a point without a normal. */
const NO_SURFACE = 0xffff_ffff;

/** The cloud on the screen, and what was computed for it. */
interface Shown {
  file: File;
  positions: Float32Array;
  /** Those that the file brought. */
  normals: Float32Array | undefined;
  /** Settled when its points are on the screen. */
  drawn: Promise<void>;
  result?: { normals: Float32Array; curvature?: Float32Array; components?: Uint32Array };
  /** What the result was computed with, and the controls then. */
  options?: EstimateOptions;
  form?: Form;
}

type Form = OptionsForm & Pick<State, 'up'>;
/** A surface, or undefined for all, and whether it brought back faces. */
type Flip = { surface: number | undefined; broughtBacks: boolean };

/** A result that was flipped by hand: the same options compute the same again. */
interface Flipped {
  file: File;
  options: EstimateOptions;
  form: Form;
  turned: Turned;
  flips: Flip[];
}

export function createSession(store: Store, viewer: Viewer): Session {
  const jobs = createJobs(store, () => {
    const { scan, shading } = store.state;
    // Curvature that did not come, because of an error or a cancel, is not what is shown.
    return { shading: shading === 'curvature' && !scan?.hasCurvature ? 'shaded' : shading };
  });
  let shown: Shown | undefined;
  /** What was flipped by hand, the last at the end. */
  let flips: Flip[] = [];
  let areSaved = false;
  /** What can be brought back. */
  let gone: Flipped | undefined;

  async function show(given: File, step: Step): Promise<void> {
    const started = performance.now();
    const file = await unpacked(given, step);
    const cloud = await read(file, step);
    step.signal.throwIfAborted();
    if (cloud.count === 0) throw new Error('the file holds no points');
    const readMilliseconds = performance.now() - started;
    const bounds = boundsOf(cloud.positions);
    if (!bounds) throw new Error('no point of the file has finite coordinates');
    const scanner = scannerOf(cloud);
    const up = guessUp(cloud.positions, bounds, cloud.origin, scanner);
    const hasColors = cloud.colors !== undefined;
    const shading = store.state.shading === 'colors' && !hasColors ? 'shaded' : store.state.shading;
    // Gaussian splats bring zeros.
    const normals = cloud.normals?.some((value) => value !== 0) ? cloud.normals : undefined;
    // In a task of its own: by then the worker has begun with the normals, and what is brought back has its own way up.
    const drawn = new Promise((resolve) => setTimeout(resolve)).then(() => viewer.show(cloud, bounds, store.state.up));
    const before = areSaved ? undefined : flippedNow();
    const name = shown?.file.name;
    shown = { file, positions: cloud.positions, normals, drawn };
    flips = [];
    const scan = {
      name: file.name,
      points: cloud.count,
      hasColors,
      hasNormals: false,
      hasCurvature: false,
      scanner,
      readMilliseconds,
      hadNormals: normals !== undefined,
    };
    const { orientKind } = store.state;
    // Where the camera or the scanner was belongs to the file before, and so does an edge length, in its unit.
    const isPast = orientKind === 'camera' || (orientKind === 'scanner' && !scan.scanner);
    store.set({
      scan,
      report: undefined,
      used: undefined,
      ...UNTURNED,
      comparison: undefined,
      drawn: undefined,
      source: 'computed',
      turning: false,
      up,
      shading,
      cellKind: 'auto',
      cellText: '',
      orientKind: isPast ? 'consistent' : orientKind,
    });
    leave(before, `Your flips of ${name} were not saved.`);
  }

  /** What is shown, if it is flipped by hand. */
  function flippedNow(): Flipped | undefined {
    const { file, options, form } = shown ?? {};
    const { flipped, turnedSurfaces } = store.state;
    if (!file || !options || !form || (!flipped && turnedSurfaces.size === 0)) return undefined;
    return { file, options, form, turned: { flipped, turnedSurfaces }, flips };
  }

  /** What is flipped by hand has just gone from the screen, or nothing has. */
  function leave(before: Flipped | undefined, text: string): void {
    gone = before;
    store.set({ note: before && { text, isOfFlips: true } });
  }

  async function shade(step: Step): Promise<void> {
    const parsed = parseOptions(store.state);
    if ('problem' in parsed) throw new Error(parsed.problem);
    const { method, cellKind, cellText, kText, orientKind, up, scan } = store.state;
    const form = { method, cellKind, cellText, kText, orientKind, up };
    const orient = orientOf(orientKind, up, viewer.eye(), scan?.scanner);
    try {
      await compute({ ...parsed.options, orient }, form, UNTURNED, [], step);
    } catch (error) {
      // Of surfaces they take more memory than all else.
      if (!isOfMemory(error) || !hasSurfaces(orient)) throw error;
      await compute({ ...parsed.options, orient: 'none' }, form, UNTURNED, [], step);
    }
  }

  /** A result of its own, in place of one that may be flipped by hand. */
  async function compute(options: EstimateOptions, form: Form, turned: Turned, itsFlips: Flip[], step: Step) {
    const before = flippedNow();
    await shadeBy(options, form, turned, step);
    flips = itsFlips;
    areSaved = false;
    // A file that was just opened has none, and keeps what was told then.
    if (before) leave(before, 'Re-run undid your flips.');
  }

  /** `form` is what asked for it, `turned` what a person turned by hand since it was computed last. */
  async function shadeBy(options: EstimateOptions, form: Form, turned: Turned, step: Step): Promise<void> {
    const { scan, shading } = store.state;
    if (!shown || !scan) return;
    const { method = 'bilinear', k = 0, orient = 'none' } = options;
    const curvature = shading === 'curvature';
    const what = `normals${curvature ? ' and curvature' : ''}${method === 'bilinear' ? '' : `, ${METHODS[method].name}`}`;
    const estimate = estimateNormals(shown.positions, {
      ...options,
      curvature,
      components: hasSurfaces(orient),
      signal: step.signal,
      onProgress: step.begin(`Computing ${what}`),
    });
    const [{ report, ...result }] = await Promise.all([estimate, shown.drawn]);
    step.signal.throwIfAborted();
    const { flipped, turnedSurfaces } = turned;
    if (flipped) negate(result.normals);
    for (const surface of turnedSurfaces) negate(result.normals, result.components, surface);
    shown = { ...shown, result, options, form };
    viewer.setNormals(result.normals, result.curvature && colorsOf(result.curvature));
    const hasCurvature = result.curvature !== undefined;
    const lacksSigns = orient === 'none' && form.orientKind !== 'none';
    const used = { method, k, orient, lacksSigns, asked: askedBy(form, form.up) };
    store.set({ scan: { ...scan, hasNormals: true, hasCurvature }, report, used, ...turned, ...compared(shown) });
  }

  /** Flips one surface, or all, in a way that can be taken back. */
  function flip(surface?: number): void {
    if (!shown?.result) return;
    const { backs, shading } = store.state;
    // Without back faces both sides look the same when shaded; normals as colours do not.
    const broughtBacks = !backs && shading === 'shaded';
    flips.push({ surface, broughtBacks });
    turnRound(surface, backs || broughtBacks);
  }

  /** Turns round the computed normals of one surface, or all. */
  function turnRound(surface: number | undefined, backs: boolean): void {
    if (!shown?.result) return;
    const { normals, components } = shown.result;
    negate(normals, surface === undefined ? undefined : components, surface);
    areSaved = false;
    viewer.refreshNormals(normals);
    const { flipped } = store.state;
    const turnedSurfaces = new Set(store.state.turnedSurfaces);
    if (surface !== undefined && !turnedSurfaces.delete(surface)) turnedSurfaces.add(surface);
    store.set({
      flipped: flipped !== (surface === undefined),
      turnedSurfaces,
      backs,
      ...compared(shown),
    });
  }

  async function bringBack(): Promise<void> {
    const back = gone;
    if (!back) return;
    await jobs.run(back.file.name, async (step) => {
      const { note } = store.state;
      if (shown?.file !== back.file) await show(back.file, step);
      // What is cancelled now can be tried again, unless the other file had flips, too.
      if (!gone) {
        gone = back;
        store.set({ note });
      }
      store.set(back.form);
      await compute(back.options, back.form, back.turned, back.flips, step);
      if (gone === back) leave(undefined, '');
    });
  }

  return {
    warm() {
      // What goes wrong here goes wrong again with a file, and is told then.
      const ignore = () => {};
      // One worker for files and plain normals, one for signs, which are what the page asks for by itself.
      estimateNormals(new Float32Array()).catch(ignore);
      estimateNormals(warmingCloud(), { orient: 'consistent', components: true }).catch(ignore);
    },

    async open(files) {
      const scans = files.length > 1 ? await onlyScans(files) : files;
      const file = scans[0] ?? files[0];
      if (!file) return;
      // What was dropped by mistake stops no work, unless that ends meanwhile.
      const reason = jobs.areRunning && (await foreign(file));
      if (reason && jobs.areRunning) {
        store.set({ error: `${messageOf(file.name, reason)} The work goes on.` });
        return;
      }
      await jobs.run(file.name, async (step) => {
        await show(file, step);
        if (scans.length > 1) addNote(store, `The first of ${count(scans.length)} scans is shown.`);
        await shade(step);
      });
    },

    openSample: () =>
      jobs.run('The sample', async (step) => {
        step.begin('Making the sample');
        await show(await makeSample(step.signal), step);
        await shade(step);
      }),

    estimate: () => jobs.run('Computing normals', shade),

    async addCurvature() {
      const { result, options, form } = shown ?? {};
      if (!result || !options || !form || result.curvature) return;
      const { flipped, turnedSurfaces } = store.state;
      await jobs.run('Computing curvature', (step) => shadeBy(options, form, { flipped, turnedSurfaces }, step));
    },

    showNormals(source) {
      const normals = source === 'file' ? shown?.normals : shown?.result?.normals;
      if (!normals) return;
      viewer.refreshNormals(normals);
      store.set({ source });
    },

    flip: () => flip(),

    flipSurface(point) {
      const surface = shown?.result?.components?.[point];
      if (surface === undefined || surface === NO_SURFACE) return false;
      flip(surface);
      return true;
    },

    undoFlip() {
      const last = flips.pop();
      if (last) turnRound(last.surface, store.state.backs && !last.broughtBacks);
      else if (gone && gone.file === shown?.file) void bringBack();
    },

    bringBack,

    save: () =>
      jobs.run('Saving', async (step) => {
        if (!shown?.result) return;
        const { file, result } = shown;
        const { normals, curvature } = result;
        const ply = await writePly(
          file,
          { normals, ...(curvature && { curvature }) },
          { signal: step.signal, onProgress: step.begin('Saving') },
        );
        await checkRoom(ply);
        step.signal.throwIfAborted();
        download(ply, `${file.name.replace(/(-normals)?\.[^.]*$/, '')}-normals.ply`);
        areSaved = true;
      }),

    cancel: () => jobs.cancel(),
  };
}

const isOfMemory = (error: unknown) => error instanceof BilinormalError && error.code === 'limit';

/** What to tell of computed normals once they are shown. */
function compared({ normals, result }: Shown): Pick<State, 'comparison' | 'source'> {
  return { comparison: normals && result && compare(result.normals, normals), source: 'computed' };
}

/** In place: all, or those of one surface. A zero stays as it is, without a sign. */
function negate(normals: Float32Array, components?: Uint32Array, surface?: number): void {
  for (let i = 0; i < normals.length; i++) {
    if (components?.[Math.floor(i / 3)] === surface) normals[i] = 0 - normals[i]!;
  }
}
