import { ink, prepared } from "./canvas";
import { GUTTER } from "./strip";

/** A marker's name and time. */
export interface Tag {
  t: number;
  label: string;
  /** The duration of an annotated span [s]. */
  duration?: number | null;
}

/** Draws the labels of annotated spans above the strips, each over its span. */
export function drawSpans(canvas: HTMLCanvasElement, spans: readonly Tag[], from: number, to: number): void {
  const x = canvas.getContext("2d");
  if (!x) return;
  const [w, h] = [canvas.clientWidth, canvas.clientHeight];
  const colours = ink();
  const at = (t: number) => GUTTER + ((t - from) / (to - from)) * (w - GUTTER);
  for (const { t, label, duration } of spans) {
    const [left, right] = [Math.max(GUTTER, at(t)), Math.min(w, at(t + (duration ?? 0)))];
    x.save();
    x.beginPath();
    x.rect(left, 0, Math.max(2, right - left), h);
    x.clip();
    x.fillStyle = colours.of("panel");
    x.fillRect(left, 0, right - left, h);
    x.fillStyle = colours.of("accent");
    x.globalAlpha = 0.18;
    x.fillRect(left, 0, right - left, h);
    x.globalAlpha = 1;
    x.fillRect(left, h - 2, Math.max(2, right - left), 2);
    x.fillStyle = colours.of("ink");
    x.fillText(label, left + 5, h / 2);
    x.restore();
  }
}

/** Draws the names of markers above the strips; names that would collide are left out, but their ticks are always drawn. */
export function drawTags(canvas: HTMLCanvasElement, tags: readonly Tag[], from: number, to: number): void {
  const prepare = prepared(canvas);
  if (!prepare) return;
  const { x, w, h } = prepare;
  const colours = ink();
  x.fillStyle = colours.of("sunk");
  x.fillRect(0, 0, GUTTER, h);
  let used = -1;
  for (const { t, label } of tags) {
    const place = Math.round(GUTTER + ((t - from) / (to - from)) * (w - GUTTER)) + 0.5;
    const width = x.measureText(label).width;
    x.strokeStyle = colours.of("ink-3");
    x.beginPath();
    x.moveTo(place, 2);
    x.lineTo(place, h);
    x.stroke();
    const left = place + width + 4 > w ? place - width - 4 : place + 4;
    if (left < used + 6) continue;
    used = left + width;
    x.fillStyle = colours.of("ink-2");
    x.fillText(label, left, h / 2);
  }
}

/** Draws the time of day below the strips, and the time at the cursor. */
export function drawAxis(canvas: HTMLCanvasElement, from: number, to: number, cursor: number | undefined, selection: readonly [number, number] | undefined, words: (t: number, decimals: number) => string): void {
  const prepare = prepared(canvas);
  if (!prepare) return;
  const { x, w, h } = prepare;
  const colours = ink();
  const at = (t: number) => GUTTER + ((t - from) / (to - from)) * (w - GUTTER);
  x.fillStyle = colours.of("sunk");
  x.fillRect(0, 0, GUTTER, h);
  const step = [1, 2, 5, 10, 20, 30, 60, 120].find((each) => ((w - GUTTER) * each) / (to - from) > 90) ?? 300;
  const place = cursor === undefined ? -1000 : at(cursor);
  x.textAlign = "center";
  x.fillStyle = colours.of("ink-3");
  for (let t = Math.ceil(from / step) * step; t <= to; t += step) {
    const text = words(t, 0);
    const half = x.measureText(text).width / 2;
    x.fillRect(at(t), 0, 1, 4);
    if (at(t) - half > GUTTER && at(t) + half < w && Math.abs(at(t) - place) > 2 * half + 8) x.fillText(text, at(t), h / 2 + 2);
  }
  x.fillStyle = colours.of("accent");
  if (selection) x.fillRect(at(selection[0]), 0, at(selection[1]) - at(selection[0]), 3);
  if (cursor !== undefined) {
    const text = words(cursor, 3);
    const width = x.measureText(text).width + 12;
    const left = Math.min(w - width, Math.max(GUTTER, place - width / 2));
    x.beginPath();
    x.roundRect(left, 3, width, h - 5, 4);
    x.fill();
    x.fillStyle = colours.of("panel");
    x.fillText(text, left + width / 2, h / 2 + 1);
  }
  x.textAlign = "left";
}
