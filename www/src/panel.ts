// Draws the state into the document. What was drawn last is kept only to leave alone what is the same, and to tell changes.
import type { Report } from 'bilinormal';
import type { Comparison } from './compare';
import { count, duration, measure, percent, phaseName, plural } from './format';
import { METHODS, askedBy, hasSurfaces, parseOptions } from './options';
import type { State, Store } from './state';

export function element<T extends HTMLElement>(selector: string): T {
  const found = document.querySelector<T>(selector);
  if (!found) throw new Error(`index.html has no ${selector}`);
  return found;
}

const make = (tag: string, text: string, className = '') =>
  Object.assign(document.createElement(tag), { textContent: text, className });

/** `about` is told to those who point at it. */
function fact(value: string, name: string, about = ''): HTMLElement {
  const item = make('li', ` ${name}`);
  item.prepend(make('b', value));
  if (about) item.title = about;
  return item;
}

const counted = (value: number, noun: string, about = '') => fact(count(value), plural(value, noun), about);

export function showState(store: Store): void {
  const start = element('#start');
  const canvas = element('#canvas');
  const panel = element<HTMLDetailsElement>('#panel');
  const notice = element('#notice');
  const title = document.title;
  let drawn: State | undefined;

  store.listen((state) => {
    const before = drawn;
    drawn = state;
    const { scan, report, job, error } = state;
    const busy = job !== undefined;
    const focused = document.activeElement;

    start.hidden = busy || scan !== undefined;
    panel.hidden = scan === undefined;
    // Nothing to see takes no focus.
    canvas.inert = scan === undefined;
    // Near the buttons as long as there is nothing else to see.
    const trouble = state.unsupported ?? (start.hidden ? undefined : error);
    notice.hidden = trouble === undefined;
    write('#notice', trouble ?? '');
    notice.scrollIntoView({ block: 'nearest' });
    for (const button of document.querySelectorAll<HTMLButtonElement>('[data-do=choose], [data-do=sample]')) {
      button.disabled = !state.ready;
    }

    element('#lost').hidden = !state.lost;
    const name = element('#name');
    name.textContent = name.title = scan?.name ?? 'bilinormal';
    document.title = scan ? `${scan.name}, bilinormal` : title;
    check('shading', state.shading);
    check('source', state.source);
    element('#source').hidden = !scan?.hadNormals;
    element<HTMLFieldSetElement>('#source').disabled = !scan?.hasNormals;
    element<HTMLSelectElement>('#up').value = state.up;
    radio('shading', 'colors').disabled = !scan?.hasColors;
    radio('shading', 'shaded').disabled = radio('shading', 'normals').disabled = !scan?.hasNormals && !busy;
    // To choose it may start a job, which must not end the one that runs.
    const wait = !scan?.hasNormals || busy;
    radio('shading', 'curvature').disabled = wait && state.shading !== 'curvature';
    const backs = element<HTMLInputElement>('#backs');
    backs.checked = state.backs;
    backs.disabled = !scan?.hasNormals && !busy;
    const flip = element<HTMLButtonElement>('[data-do=flip]');
    flip.disabled = !scan?.hasNormals;
    rest(flip, busy);
    flip.setAttribute('aria-pressed', String(state.flipped));
    const turn = element<HTMLButtonElement>('[data-do=turn]');
    turn.disabled = !hasSurfaces(state.used?.orient);
    rest(turn, busy);
    turn.setAttribute('aria-pressed', String(state.turning));
    const turning = state.turning && !turn.disabled && !busy;
    document.documentElement.classList.toggle('turning', turning);
    element('#hint').hidden = !turning;
    element<HTMLButtonElement>('[data-do=undo]').disabled = !state.flipped && state.turnedSurfaces.size === 0;
    const save = element<HTMLButtonElement>('[data-do=save]');
    save.disabled = !scan?.hasNormals;
    // Not what is shown then.
    save.textContent = state.source === 'file' ? 'Save computed normals' : 'Save as PLY';
    rest(save, busy);

    showOptions(state, busy);
    showError(start.hidden ? error : undefined);
    showNote(state, busy);
    showJob(state);
    const same =
      before?.scan === scan &&
      before?.report === report &&
      before?.flipped === state.flipped &&
      before?.turnedSurfaces === state.turnedSurfaces;
    if (!same) showResult(state);
    tell(state, before);
    if (focused?.closest('[hidden]')) moveFocus(state);
  });
}

/** What had the focus of the keyboard is gone. */
function moveFocus({ scan, job }: State): void {
  const next = job ? '[data-do=cancel]' : scan ? '#canvas' : '#start [data-do=choose]';
  element(next).focus();
}

/** For those who hear the page: what begins, what a flip has done, and what else there is to know. */
function tell(state: State, before: State | undefined): void {
  const { job, flipped, turnedSurfaces } = state;
  const told = element('#told');
  // A note comes with a job, and is told when that no longer speaks.
  if (before?.job?.title !== job?.title) told.textContent = job?.title ?? notesOf(state);
  else if (!before || job) return;
  else if (before.flipped !== flipped) told.textContent = flipped ? 'All flipped' : 'All flipped back';
  else if (before.turnedSurfaces !== turnedSurfaces) {
    told.textContent = `${count(turnedSurfaces.size)} ${plural(turnedSurfaces.size, 'surface')} flipped by hand`;
  }
}

/** What has to wait for a job does nothing meanwhile, but keeps the focus of the keyboard. */
const rest = (button: HTMLElement, busy: boolean) => button.setAttribute('aria-disabled', String(busy));

const radio = (name: string, value: string) => element<HTMLInputElement>(`input[name="${name}"][value="${value}"]`);

function check(name: string, value: string): void {
  radio(name, value).checked = true;
}

function showOptions(state: State, busy: boolean): void {
  const { method, cellKind, cellText, kText, scan } = state;
  check('method', method);
  check('orient', state.orientKind);
  radio('orient', 'scanner').closest('label')!.hidden = !scan?.scanner;
  check('cell', cellKind);
  const parsed = parseOptions(state);
  const problem = 'problem' in parsed ? parsed.problem : '';

  element('#cell').hidden = method !== 'bilinear';
  const cell = element<HTMLInputElement>('#cell-value');
  cell.hidden = method !== 'bilinear' || cellKind === 'auto';
  const label =
    cellKind === 'scale' ? 'Edge of the cubes in multiples of L' : 'Edge of the cubes in the unit of the file';
  cell.setAttribute('aria-label', label);
  element('#k').hidden = method === 'bilinear';
  for (const [input, text] of [
    [cell, cellText],
    [element<HTMLInputElement>('#k-value'), kText],
  ] as const) {
    if (input.value !== text) input.value = text;
    input.setAttribute('aria-invalid', String(problem !== ''));
  }
  const note = element('#problem');
  note.hidden = problem === '';
  if (note.textContent !== problem) {
    note.textContent = problem;
    // On a small screen it would be out of sight.
    note.scrollIntoView({ block: 'nearest' });
  }
  const again = element<HTMLButtonElement>('#again');
  const compute = element<HTMLButtonElement>('#compute');
  again.disabled = compute.disabled = problem !== '';
  rest(again, busy);
  again.textContent = scan?.hasNormals ? 'Re-run' : 'Compute';
  compute.hidden = busy || !scan || scan.hasNormals;
  const pending = !busy && state.used !== undefined && state.used.asked !== askedBy(state, state.up);
  element('#pending').hidden = !pending || problem !== '';
  if (pending) again.setAttribute('aria-describedby', 'pending');
  else again.removeAttribute('aria-describedby');
  const isNext = pending || (!busy && scan !== undefined && !scan.hasNormals);
  again.classList.toggle('primary', isNext);
  element('[data-do=save]').classList.toggle('primary', !isNext);
}

function showError(error: string | undefined): void {
  const box = element('#error');
  box.hidden = error === undefined;
  write('#error p', error ?? '');
}

/** What there is to know, if nothing went wrong. */
function notesOf({ note, drawn }: State): string {
  const part =
    drawn !== undefined &&
    `The graphics card has no memory for all points: ${count(drawn)} of them are drawn. Normals are computed and saved for all.`;
  return [note?.text, part].filter(Boolean).join(' ');
}

function showNote(state: State, busy: boolean): void {
  const { note } = state;
  const text = notesOf(state);
  element('#note').hidden = text === '';
  write('#note p', text);
  const back = element('#note [data-do=back]');
  back.hidden = !note?.isOfFlips;
  rest(back, busy);
}

function showJob({ job }: State): void {
  element('#job').hidden = job === undefined;
  if (!job) return;
  element('#job-title').textContent = job.title;
  element('#job-phase').textContent = phaseName(job.phase);
  const bar = element<HTMLProgressElement>('#job progress');
  if (job.fraction === undefined) bar.removeAttribute('value');
  else bar.value = job.fraction;
}

/** What the method tells of itself. */
function factsOf(report: Report, used: State['used']): HTMLElement[] {
  if (used && used.method !== 'bilinear') return [fact(METHODS[used.method].name, `k = ${count(used.k)}`)];
  if (report.noise !== undefined) {
    // Without a surface no size was chosen.
    const edges = (report.scales ?? []).map(({ cellSize }) => measure(cellSize));
    const range = [...new Set([edges[0]!, edges.at(-1)!])].join(' to ');
    return [
      counted(report.cells, 'cube', 'Those that hold points, in the smallest sizes that were needed'),
      ...(edges.length ? [fact(range, 'edge', 'Of the cubes that were chosen, in the unit of the file')] : []),
      fact(
        measure(report.noise),
        'noise',
        'Distance from the surface, in the unit of the file: half of the points are nearer',
      ),
    ];
  }
  return [
    counted(report.cells, 'cube'),
    counted(report.nodes, 'node'),
    fact(measure(report.cellSize), `edge, ${measure(report.scale)} L`),
  ];
}

type Largest = NonNullable<Report['components']>['largest'][number];

/** Where the normals of a surface point to, and where they do once they are flipped. */
const WAYS = {
  air: ['outwards', 'inwards'],
  volume: ['away from the middle', 'towards the middle'],
  touch: ['as what it touches', 'not as what it touches'],
  sight: ['to what stands before it', 'from what stands before it'],
  view: ['to the scanner', 'from the scanner'],
} as const;

/** Below it, the side is little more than a guess. */
const SURE = 0.3;

function facing({ side, confidence }: Largest, isTurned: boolean): HTMLElement[] {
  const advice = fact('Upwards or Camera', 'may be surer');
  if (side === 'convention') return [fact('no outside', 'found for it'), advice];
  const [way, opposite] = WAYS[side];
  const about = 'Which way the largest surface faces, and how sure that is, from 0 to 1';
  const isSure = confidence >= SURE;
  const told = fact(isTurned ? opposite : way, `${isSure ? 'confidence' : 'unsure,'} ${confidence.toFixed(2)}`, about);
  return isSure ? [told] : [told, advice];
}

/** How the signs were chosen: for surfaces, the largest one and which way it faces. */
function signsOf({ components, points }: Report, { scan, used, flipped, turnedSurfaces }: State): HTMLElement[] {
  if (components) {
    const [largest] = components.largest;
    const facts = [counted(components.count, 'surface')];
    if (!largest) return facts;
    const turned = turnedSurfaces.size;
    return [
      ...facts,
      fact(percent(largest.points, points), 'in the largest'),
      ...facing(largest, flipped !== turnedSurfaces.has(0)),
      ...(turned ? [fact(count(turned), 'flipped by hand')] : []),
    ];
  }
  if (used?.lacksSigns) {
    const about = 'Signs take more memory than there is: any normal may point to the other side of its surface';
    return [fact('as found', 'no memory for signs', about)];
  }
  if (typeof used?.orient !== 'object') return [];
  if ('up' in used.orient) {
    const { up } = used.orient;
    const axis = up.findIndex((value) => value !== 0);
    return [fact(flipped ? 'downwards' : 'upwards', `along ${up[axis]! < 0 ? '−' : ''}${'XYZ'[axis]}`)];
  }
  const way = flipped ? 'away from' : 'towards';
  if (String(used.orient.viewpoint) === String(scan?.scanner)) return [fact(`${way} the scanner`, 'as the file says')];
  return [fact(`${way} the camera`, 'as it was')];
}

/** Between the computed normals and those that the file brought. */
function differences({ degrees, opposite, compared }: Comparison): HTMLElement[] {
  if (compared === 0) return [];
  const about = 'The mean angle between the computed normals and those that the file brought, whatever their signs';
  return [
    fact(`${measure(Math.round(10 * degrees) / 10)}°`, "from the file's normals", about),
    fact(percent(opposite, compared), 'of these opposite', 'Pointing to the other side of the surface'),
  ];
}

/** What is the same is left alone, or it would be read out again. */
function write(selector: string, text: string): void {
  const to = element(selector);
  if (to.textContent !== text) to.textContent = text;
}

function showResult(state: State): void {
  const { scan, report, used, comparison } = state;
  element('#status').hidden = scan === undefined;
  if (!scan) return;
  const { total = 0, ...inside } = report?.milliseconds ?? {};
  const phases = Object.entries(inside);
  const computing = phases.reduce((sum, [, milliseconds]) => sum + milliseconds, 0);
  write('#total', report ? duration(computing) : count(scan.points));
  const points = plural(scan.points, 'point');
  const remedy = report && report.cellSize > 0 && report.noise === undefined ? ', try the size Auto' : '';
  const none = report?.unresolved === scan.points ? `: no normal was found${remedy}` : '';
  const label = report ? `for ${count(scan.points)} ${points}${none}` : `${points}, without normals`;
  write('#total-label', label);

  const facts = element('#facts');
  facts.replaceChildren();
  const fallback = element('#fallback');
  fallback.hidden = !report?.fallbackReason;
  fallback.title = report?.fallbackReason ?? '';
  element('#status details').hidden = report === undefined;
  if (!report) return;

  facts.append(
    ...factsOf(report, used),
    ...signsOf(report, state),
    fact(count(report.unresolved), 'without a normal'),
    counted(report.threads, 'thread'),
    ...(comparison ? differences(comparison) : []),
  );
  facts.dataset['mode'] = report.mode;

  const bar = element('#status .bar');
  const list = element('#phases');
  bar.replaceChildren();
  list.replaceChildren();
  for (const [i, [phase, milliseconds]] of phases.entries()) {
    const part = make('span', '');
    part.style.flexGrow = String(milliseconds);
    part.title = `${phaseName(phase)}: ${duration(milliseconds)}`;
    const name = make('dt', phaseName(phase));
    for (const colored of [part, name]) colored.style.setProperty('--phase', String(i));
    bar.append(part);
    list.append(name, make('dd', duration(milliseconds)));
  }
  // The page draws the bare points meanwhile, and has the result only then.
  const apart = { 'start, copies, drawing meanwhile': total - computing, 'reading the file': scan.readMilliseconds };
  for (const [name, milliseconds] of Object.entries(apart)) {
    list.append(make('dt', name, 'apart'), make('dd', duration(Math.max(0, milliseconds)), 'apart'));
  }
}
