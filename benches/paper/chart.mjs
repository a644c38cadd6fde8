// Line charts as SVG text: axes, ticks, a legend. The background is part of it, for light and dark pages.

const [WIDTH, HEIGHT] = [760, 420];
const PLOT = { left: 76, top: 44, right: 560, bottom: 364 };
const COLORS = ['#1f5fc4', '#d1541d', '#2a8a4a', '#8a4bb3', '#6b6b6b', '#a8861a'];

/**
 * A chart. `x` and `y`: `{ label, log, ticks }`, where `ticks` (values) are optional. `series`: `{ name, points: [[x, y],
 * ...], style, color }`, where `style` is nothing, 'dashed' or 'dots', and the number of a colour is optional. `band`:
 * `{ from, to, label }`, a part of the x axis. Logarithmic axes take positive values only.
 */
export function chart({ title, x, y, series, band }) {
  const axes = [x, y].map((axis, i) => ({
    ...axis,
    ...scale(
      axis,
      series.flatMap(({ points }) => points.map((p) => p[i])),
    ),
  }));
  const across = (value) => PLOT.left + axes[0].place(value) * (PLOT.right - PLOT.left);
  const upright = (value) => PLOT.bottom - axes[1].place(value) * (PLOT.bottom - PLOT.top);
  const at = ([x, y]) => `${round(across(x))},${round(upright(y))}`;
  const middle = (PLOT.top + PLOT.bottom) / 2;

  const grid = [
    ...axes[0].ticks.map((tick) => {
      const place = round(across(tick));
      return `${line(place, PLOT.top, place, PLOT.bottom)}${text(place, PLOT.bottom + 18, show(tick), 'middle')}`;
    }),
    ...axes[1].ticks.map((tick) => {
      const place = round(upright(tick));
      return `${line(PLOT.left, place, PLOT.right, place)}${text(PLOT.left - 8, place + 4, show(tick), 'end')}`;
    }),
  ];
  const lines = series.map(({ name, points, style, color }, i) => {
    const stroke = `stroke="${COLORS[color ?? i]}" stroke-width="2"${style === 'dashed' ? ' stroke-dasharray="6 4"' : ''}`;
    const fill = style === 'dashed' ? '#fff' : COLORS[color ?? i];
    const dot = ([cx, cy]) =>
      `<circle cx="${cx}" cy="${cy}" r="3.4" fill="${fill}" stroke="${COLORS[color ?? i]}" stroke-width="1.4"/>`;
    const path = `<polyline points="${points.map(at).join(' ')}" fill="none" ${stroke}/>`;
    const row = PLOT.top + 10 + 24 * i;
    const sample = `<path d="M${PLOT.right + 16} ${row}h26" ${stroke}/>`;
    return [
      ...(style === 'dots' ? [] : [path, sample]),
      ...points.map((point) => dot(at(point).split(','))),
      dot([PLOT.right + 29, row]),
      text(PLOT.right + 50, row + 4, name),
    ].join('');
  });
  const [from, to] = band ? [round(across(band.from)), round(across(band.to))] : [];
  const shade = `<rect x="${from}" y="${PLOT.top}" width="${to - from}" height="${PLOT.bottom - PLOT.top}" fill="#f1ead8"/>`;
  const area = band ? [shade, text((from + to) / 2, PLOT.top + 18, band.label, 'middle')] : [];
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${WIDTH} ${HEIGHT}" width="${WIDTH}" height="${HEIGHT}" role="img" font-family="system-ui, sans-serif" font-size="13" fill="#222">
<title>${escape(title)}</title>
<rect width="${WIDTH}" height="${HEIGHT}" rx="8" fill="#fff"/>
<text x="${PLOT.left}" y="26" font-size="15" font-weight="600">${escape(title)}</text>
${[...area.slice(0, 1), ...grid, ...lines, ...area.slice(1)].join('\n')}
<rect x="${PLOT.left}" y="${PLOT.top}" width="${PLOT.right - PLOT.left}" height="${PLOT.bottom - PLOT.top}" fill="none" stroke="#888"/>
${text((PLOT.left + PLOT.right) / 2, HEIGHT - 14, x.label, 'middle')}
<text transform="translate(20 ${middle}) rotate(-90)" text-anchor="middle">${escape(y.label)}</text>
</svg>
`;
}

/** Where a value lies on an axis, 0 to 1, and the ticks. */
function scale({ log, ticks }, values) {
  if (log) {
    const [low, high] = [Math.log(Math.min(...values)), Math.log(Math.max(...values))];
    // A line needs room, also where all values are one.
    const room = Math.max(0.06 * (high - low), 0.05);
    const [from, to] = [low - room, high + room];
    const place = (value) => (Math.log(value) - from) / (to - from);
    return { place, ticks: (ticks ?? decades(from, to)).filter((tick) => place(tick) >= 0 && place(tick) <= 1) };
  }
  const to = 1.06 * Math.max(...values);
  const step = 10 ** Math.floor(Math.log10(to / 4));
  const wide = [1, 2, 5, 10].map((factor) => factor * step).find((width) => to / width <= 7);
  const even = Array.from({ length: Math.floor(to / wide) + 1 }, (_, i) => i * wide);
  return { place: (value) => value / to, ticks: (ticks ?? even).filter((tick) => tick <= to) };
}

/** 1, 2 and 5 times the powers of ten between two natural logarithms; only the powers where these are many. */
function decades(from, to) {
  const steps = to - from > 4.5 * Math.LN10 ? [1] : [1, 2, 5];
  const first = Math.floor(from / Math.LN10);
  const count = Math.ceil(to / Math.LN10) - first + 1;
  return Array.from({ length: count }, (_, i) => steps.map((step) => step * 10 ** (first + i))).flat();
}

const round = (value) => Math.round(value * 10) / 10;
const show = (value) =>
  value >= 1e6
    ? `${Number((value / 1e6).toPrecision(3))} M`
    : Number(value.toPrecision(3)).toLocaleString('en', { maximumFractionDigits: 6 });
const escape = (text) => text.replace(/&/g, '&amp;').replace(/</g, '&lt;');
const line = (x1, y1, x2, y2) => `<path d="M${x1} ${y1}L${x2} ${y2}" stroke="#e2e2e2"/>`;
const text = (x, y, content, anchor = 'start') =>
  `<text x="${x}" y="${y}" text-anchor="${anchor}">${escape(content)}</text>`;
