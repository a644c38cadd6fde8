// Puts the page together: what a person does goes to the session and the state, what the state says goes to the view.
import { measure } from './format';
import { drawHero } from './hero';
import { element, showState } from './panel';
import { createSession, type Session } from './session';
import { METHODS, type CellKind, type Method, type OrientKind } from './options';
import { createStore, type NormalSource, type Store } from './state';
import { missing } from './support';
import { createViewer, type Margins, type Shading, type Up, type Viewer } from './viewer';

const store = createStore();
drawHero(element('#hero'));
showState(store);

// For a file that is dropped and not taken the browser leaves the page, also where the page can show nothing.
for (const kind of ['dragover', 'drop']) addEventListener(kind, (event) => event.preventDefault());

let unsupported = await missing();
let viewer: Viewer | undefined;
try {
  if (!unsupported) viewer = createViewer(element('#canvas'), { onPart: (drawn) => store.set({ drawn }) });
} catch {
  unsupported = 'This page draws with WebGL 2, which did not start. It may after a restart of the browser.';
}
if (viewer) start(viewer);
store.set({ unsupported, ready: viewer !== undefined });

function start(viewer: Viewer): void {
  const session = createSession(store, viewer);
  const input = element<HTMLInputElement>('#file');
  const panel = element<HTMLDetailsElement>('#panel');
  const canvas = element('#canvas');
  const help = element<HTMLDialogElement>('#help');
  const small = matchMedia('(max-width: 640px)');
  const low = matchMedia('(max-height: 520px)');
  const makeRoom = () => viewer.setMargins(marginsOf(small.matches, low.matches));
  const turnSurfaces = (turning: boolean) => {
    // Without back faces both sides look the same, and on a small screen the panel takes half of the room.
    store.set(turning ? { turning, backs: true } : { turning });
    if (!turning) return;
    if (small.matches) panel.open = false;
    // Which hears Enter.
    canvas.focus();
  };

  const openHelp = () => {
    help.showModal();
    // The button that gets the focus is at its end.
    help.scrollTop = 0;
  };

  const actions: Record<string, () => void> = {
    choose: () => input.click(),
    sample: () => void session.openSample(),
    fit: () => viewer.fit(),
    help: openHelp,
    flip: () => {
      if (!store.state.job) session.flip();
    },
    turn: () => {
      if (!store.state.job) turnSurfaces(!store.state.turning);
    },
    undo: () => session.undoFlip(),
    done: () => turnSurfaces(false),
    save: () => {
      if (!store.state.job) void session.save();
    },
    cancel: () => session.cancel(),
    dismiss: () => store.set({ error: undefined }),
    back: () => {
      if (!store.state.job) void session.bringBack();
    },
    read: () => store.set({ note: undefined, drawn: undefined }),
  };
  for (const button of document.querySelectorAll<HTMLButtonElement>('[data-do]')) {
    button.addEventListener('click', actions[button.dataset['do']!]!);
  }
  input.addEventListener('change', () => {
    void session.open([...(input.files ?? [])]);
    // The same file chosen again is a change again.
    input.value = '';
  });
  // Anywhere, also beside it.
  help.addEventListener('click', () => help.close());
  addEventListener('keydown', (event) => {
    // The browser closes it by Escape.
    if (help.open) return;
    // A key that is held long must not press what takes the focus next.
    if (event.repeat && event.key === 'Enter' && event.target instanceof HTMLButtonElement) event.preventDefault();
    if (event.key === 'Escape') {
      if (store.state.job) session.cancel();
      else store.set({ turning: false, error: undefined });
    }
    const typing = event.target instanceof HTMLInputElement && event.target.type === 'text';
    if (typing || event.altKey) return;
    const key = event.key.toLowerCase();
    if (event.ctrlKey || event.metaKey) {
      if (key === 'z' && !event.shiftKey && !store.state.job) session.undoFlip();
      return;
    }
    if (key === '?') openHelp();
    if (key === 'f') viewer.fit();
    // The box does nothing while it is disabled.
    if (key === 'b') element('#backs').click();
  });

  canvas.addEventListener('webglcontextlost', () => store.set({ lost: true }));
  canvas.addEventListener('webglcontextrestored', () => store.set({ lost: false }));

  takeDrops(session);
  takeControls(session, viewer);
  takeTurns(session, viewer);

  // On a small screen the panel would take half of the room: it starts closed there.
  panel.open = !small.matches;
  small.addEventListener('change', () => {
    const focused = panel.contains(document.activeElement);
    panel.open = !small.matches;
    if (focused && small.matches) element('#panel > summary').focus();
    makeRoom();
  });
  low.addEventListener('change', makeRoom);
  panel.addEventListener('toggle', makeRoom);
  let named: string | undefined;
  store.listen(({ scan }) => {
    if (scan?.name === named) return;
    named = scan?.name;
    // The panel takes its place with the first scan, and the view makes room for it.
    makeRoom();
  });

  if (new URLSearchParams(location.search).has('sample')) void session.openSample();
  else session.warm();
}

/**
 * What the status line takes, in pixels (style.css), with the facts of most scans; a low window does without these, and
 * below the open panel of a small screen there is the headline only.
 */
const STATUS = { width: 396, height: 212, low: 120, least: 76 };

/**
 * What the panel and the status line cover, for a cloud beside that line or above it; on a small screen for one between the
 * panel and that line.
 */
function marginsOf(small: boolean, low: boolean): Margins[] {
  const { offsetWidth: width, offsetHeight: height, offsetTop: gap, open } = element<HTMLDetailsElement>('#panel');
  const bottom = low ? STATUS.low : STATUS.height;
  if (small) return [{ top: height + gap, right: 0, bottom: open ? STATUS.least : bottom, left: 0 }];
  // Closed, it is as wide, and leaves what is below it.
  const [top, right] = open ? [0, width + gap] : [height + gap, 0];
  return [
    { top, right, bottom: 0, left: STATUS.width },
    { top, right, bottom, left: 0 },
  ];
}

/** Files dropped anywhere on the window. */
function takeDrops(session: Session): void {
  const carriesFiles = (event: DragEvent) => event.dataTransfer?.types.includes('Files') ?? false;
  const target = document.documentElement;
  addEventListener('dragover', (event) => {
    const carries = carriesFiles(event);
    target.classList.toggle('dropping', carries);
    // It would lie over all that is shown.
    if (carries) element<HTMLDialogElement>('#help').close();
  });
  addEventListener('dragleave', (event) => {
    if (event.relatedTarget === null) target.classList.remove('dropping');
  });
  addEventListener('drop', (event) => {
    target.classList.remove('dropping');
    const items = [...(event.dataTransfer?.items ?? [])].filter(({ kind }) => kind === 'file');
    const files = items.filter((item) => !item.webkitGetAsEntry()?.isDirectory).map((item) => item.getAsFile()!);
    if (files.length > 0) void session.open(files);
    else if (items.length > 0) store.set({ error: 'Folders are not taken: drop a .ply file from it.' });
    else store.set({ error: 'That was not a file: drop a .ply file from a folder of this machine.' });
  });
}

/** Clicks on a surface, and Enter for the one in the middle of the window, while surfaces are being turned. */
function takeTurns(session: Session, viewer: Viewer): void {
  /** A press that moves further, in pixels, moves the camera instead: a finger is less steady. */
  const still = (pointer: string) => (pointer === 'touch' ? 12 : 4);
  const canvas = element('#canvas');
  const turn = (at?: { x: number; y: number }) => {
    const { turning, job } = store.state;
    const point = turning && !job ? viewer.pick(at) : -1;
    return point >= 0 && session.flipSurface(point);
  };
  let turned = false;
  let pressed = { x: NaN, y: NaN, by: '' };
  let moved = 0;
  canvas.addEventListener('pointerdown', ({ clientX: x, clientY: y, pointerType: by }) => {
    pressed = { x, y, by };
    moved = 0;
  });
  canvas.addEventListener('pointermove', ({ clientX: x, clientY: y }) => {
    moved = Math.max(moved, Math.hypot(x - pressed.x, y - pressed.y));
  });
  canvas.addEventListener('click', ({ clientX: x, clientY: y, detail }) => {
    if (detail < 2) turned = moved <= still(pressed.by) && turn({ x, y });
  });
  canvas.addEventListener('dblclick', () => {
    // Two clicks centre the view: what the first has turned is turned back.
    if (turned) session.undoFlip();
    turned = false;
  });
  canvas.addEventListener('keydown', ({ key, repeat }) => {
    if (key === 'Enter' && !repeat) turn();
  });
}

/** The panel's controls: each writes the state, and the viewer follows the state. */
function takeControls(session: Session, viewer: Viewer): void {
  const choose = (name: string, take: (value: string) => void) => {
    for (const input of document.querySelectorAll<HTMLInputElement>(`input[name="${name}"]`)) {
      input.addEventListener('change', () => take(input.value));
    }
  };
  choose('shading', (value) => {
    store.set({ shading: value as Shading });
    if (value === 'curvature') void session.addCurvature();
  });
  choose('source', (value) => session.showNormals(value as NormalSource));
  choose('orient', (value) => store.set({ orientKind: value as OrientKind }));
  choose('method', (value) => store.set({ method: value as Method, kText: String(METHODS[value as Method].k) }));
  choose('cell', (value) => chooseCell(store, value as CellKind));

  const backs = element<HTMLInputElement>('#backs');
  backs.addEventListener('change', () => store.set({ backs: backs.checked }));
  const up = element<HTMLSelectElement>('#up');
  up.addEventListener('change', () => store.set({ up: up.value as Up }));
  const size = element<HTMLInputElement>('#point-size');
  size.addEventListener('input', () => {
    const pointSize = 2 ** size.valueAsNumber;
    size.setAttribute('aria-valuetext', `${measure(pointSize)} times`);
    store.set({ pointSize });
  });
  const cell = element<HTMLInputElement>('#cell-value');
  cell.addEventListener('input', () => store.set({ cellText: cell.value }));
  const k = element<HTMLInputElement>('#k-value');
  k.addEventListener('input', () => store.set({ kText: k.value }));
  element<HTMLFormElement>('#options').addEventListener('submit', (event) => {
    event.preventDefault();
    if (!store.state.job) void session.estimate();
  });

  let before = store.state;
  store.listen((state) => {
    if (state.shading !== before.shading) viewer.setShading(state.shading);
    if (state.backs !== before.backs) viewer.setBacks(state.backs);
    if (state.up !== before.up) viewer.setUp(state.up);
    if (state.pointSize !== before.pointSize) viewer.setPointSize(state.pointSize);
    before = state;
  });
}

/** A new way to give the cell starts from the one that was just used. */
function chooseCell(to: Store, cellKind: CellKind): void {
  const { report } = to.state;
  // The baselines, which have no cubes, report zero.
  const used = cellKind === 'scale' ? report?.scale || 1 : report?.cellSize;
  to.set({ cellKind, cellText: used ? String(Number(used.toPrecision(3))) : '' });
}
