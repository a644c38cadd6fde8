// The picture of the start screen: a sphere of points that turns from flat grey into shaded, left to right.
import { onSphere } from './spiral';

const POINTS = 4800;

export function drawHero(canvas: HTMLCanvasElement): void {
  const context = canvas.getContext('2d');
  if (!context) return;
  const { width, height } = canvas;
  const radius = height * 0.46;
  for (let i = 0; i < POINTS; i++) {
    // Tilted towards the eye.
    const [x, z0, y0] = onSphere(i, POINTS);
    const y = 0.88 * y0 - 0.475 * z0;
    const z = 0.475 * y0 + 0.88 * z0;
    if (z < 0) continue;
    const ready = Math.min(1, Math.max(0, (x + 0.28) / 0.5));
    const light = 0.35 + 0.65 * Math.max(0, 0.35 * x + 0.45 * y + 0.82 * z);
    const channel = (normal: number) => 128 + (255 * (0.5 + 0.5 * normal) * light - 128) * ready;
    context.fillStyle = `rgb(${channel(x)} ${channel(y)} ${channel(z)} / ${0.65 + 0.35 * ready})`;
    context.beginPath();
    context.arc(width / 2 + radius * x, height / 2 - radius * y, (1.6 + 1.4 * ready) * (0.55 + 0.45 * z), 0, 7);
    context.fill();
  }
}
