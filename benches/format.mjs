// Numbers and tables as text.

export const count = (value) => value.toLocaleString('en');
export const millions = (value) => (value / 1e6).toFixed(3);
export const milliseconds = (value) => (value < 10 ? value.toFixed(1) : count(Math.round(value)));
export const ratio = (value) => value.toFixed(1);
export const error = (value) => (value < 0.001 ? Number(value.toPrecision(2)).toString() : value.toFixed(4));
export const degrees = (value) => `${value.toFixed(value < 10 ? 1 : 0)}°`;

/** A share, with a digit more close to nothing and to all, so that these are told from nothing and from all. */
export function percent(share) {
  const value = 100 * share;
  if (value === 0 || value === 100) return `${value} %`;
  if (value < 0.005) return 'below 0.01 %';
  const digits = value < 0.095 ? 2 : value < 9.95 || Math.abs(value - 100) <= 0.5 ? 1 : 0;
  return `${value.toFixed(digits)} %`;
}

/** From the smallest to the largest, or one of them if they look alike. */
export function range(values, show) {
  const [low, high] = [show(Math.min(...values)), show(Math.max(...values))];
  if (low === high) return low;
  const unit = low.match(/ %$/)?.[0] ?? '';
  return `${high.endsWith(unit) && unit ? low.slice(0, -unit.length) : low} to ${high}`;
}

/** A Markdown table; the first column is text, the others are numbers. */
export function table(head, rows) {
  const line = (cells) => `| ${cells.join(' | ')} |`;
  return [line(head), line(head.map((_, i) => (i === 0 ? '---' : '--:'))), ...rows.map(line)].join('\n');
}

/** Parts of a Markdown text; what is empty is left out. */
export const paragraphs = (...parts) => parts.filter(Boolean).join('\n\n');

/** What is known of each input, by name, and which files were not measured. */
export function sources(title, about, skipped) {
  const credits = [...about].filter(([, text]) => text).map(([name, text]) => `- ${name}: ${text}`);
  const others = skipped.map(({ name, reason }) => `- ${name}: ${reason}`);
  return paragraphs(
    credits.length > 0 && title,
    credits.join('\n'),
    others.length > 0 && 'Files of the folder that were not measured:',
    others.join('\n'),
  );
}

export const verdict = (isMet) => (isMet ? 'met' : '**missed**');
