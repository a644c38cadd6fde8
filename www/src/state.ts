// Everything the page shows besides the cloud itself, in one place. The session and the controls write it, `set` tells
// the listeners, and the panel draws it: nothing reads the document to find out what is going on.
import type { Report } from 'bilinormal';
import type { Comparison } from './compare';
import type { Method, OptionsForm, Orient } from './options';
import type { Shading, Up } from './viewer';

/** The cloud on the screen. */
export interface Scan {
  name: string;
  points: number;
  hasColors: boolean;
  hasNormals: boolean;
  hasCurvature: boolean;
  /** Where it was scanned from, if the file says so. */
  scanner: [number, number, number] | undefined;
  readMilliseconds: number;
  /** Whether the file brought normals. */
  hadNormals: boolean;
}

/** The work under way. `fraction` is undefined where the work cannot tell how far it is. */
export interface Job {
  title: string;
  phase: string;
  fraction: number | undefined;
}

/** Whose normals are shown; what is flipped and saved are the computed ones. */
export type NormalSource = 'computed' | 'file';

/** What was turned by hand, so that it points the other way than the report says. */
export interface Turned {
  /** All normals. */
  flipped: boolean;
  /** Those of single surfaces, besides. */
  turnedSurfaces: ReadonlySet<number>;
}

export const UNTURNED: Turned = { flipped: false, turnedSurfaces: new Set() };

export interface Note {
  text: string;
  /** Whether it is of flips by hand that can be brought back. */
  isOfFlips?: boolean;
}

export interface State extends OptionsForm, Turned {
  /** Whether files can be taken: false until the browser has been looked at. */
  ready: boolean;
  /** Why this browser cannot run the page at all. */
  unsupported: string | undefined;
  /** Whether the browser has taken WebGL away, which it may give back. */
  lost: boolean;
  scan: Scan | undefined;
  report: Report | undefined;
  /** What the report is about, and what the form asked for then; `lacksSigns`, if there was no memory for those it asked for. */
  used: { method: Method; k: number; orient: Orient; lacksSigns: boolean; asked: string } | undefined;
  /** Of the computed normals with those of the file. */
  comparison: Comparison | undefined;
  job: Job | undefined;
  error: string | undefined;
  /** What else there is to know: nothing went wrong. */
  note: Note | undefined;
  /** How many of the points are drawn, if the graphics card has no memory for all. */
  drawn: number | undefined;
  shading: Shading;
  source: NormalSource;
  /** Whether what points away from the camera has a colour of its own. */
  backs: boolean;
  /** Whether a click turns the surface that it meets. */
  turning: boolean;
  pointSize: number;
  up: Up;
}

export interface Store {
  readonly state: Readonly<State>;
  set(change: Partial<State>): void;
  listen(listener: (state: Readonly<State>) => void): void;
}

export function createStore(): Store {
  let state: State = {
    ready: false,
    unsupported: undefined,
    lost: false,
    scan: undefined,
    report: undefined,
    used: undefined,
    ...UNTURNED,
    comparison: undefined,
    job: undefined,
    error: undefined,
    note: undefined,
    drawn: undefined,
    shading: 'shaded',
    source: 'computed',
    backs: false,
    turning: false,
    pointSize: 1,
    up: 'y',
    method: 'bilinear',
    cellKind: 'auto',
    cellText: '',
    kText: '',
    orientKind: 'consistent',
  };
  const listeners: ((state: Readonly<State>) => void)[] = [];
  return {
    get state() {
      return state;
    },
    set(change) {
      state = { ...state, ...change };
      for (const listener of listeners) listener(state);
    },
    listen(listener) {
      listeners.push(listener);
      listener(state);
    },
  };
}

/** Tells it beside what else there is to know. */
export function addNote(store: Store, text: string): void {
  const { note } = store.state;
  if (!note?.text.includes(text)) store.set({ note: { ...note, text: note ? `${note.text} ${text}` : text } });
}
