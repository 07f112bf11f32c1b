import type { Track } from "../store/track";
import { decimal } from "../view/format";
import { hatch, ink, label, prepared, ticks } from "./canvas";

/** The width of the scale at the left of a strip [px]. */
export const GUTTER = 38;

/** A mark on a strip at a time: a beat, a response, a breath. */
export interface Tick {
  t: number;
  kind: string;
  value: number | null;
  duration: number | null;
}

/** What a strip shows. */
export interface Strip {
  track: Track;
  from: number;
  to: number;
  low: number;
  high: number;
  colour: string;
  ticks: readonly Tick[];
  /** The times of markers and phases. */
  markers: readonly number[];
  band?: { mean: number; sd: number } | undefined;
  cursor?: number | undefined;
  selection?: readonly [number, number] | undefined;
  /** How far back the newest point may be before that is a gap [s]. */
  patienceSecs: number;
  /** Since when the signal is too poor, and why: hatched. */
  poor?: { from: number; word: string } | undefined;
  /** Lines hold their value until the next one, as of numbers that come now and then. */
  steps?: boolean;
}

/** Draws a strip; nothing is ever drawn across a gap. */
export function drawStrip(canvas: HTMLCanvasElement, strip: Strip): void {
  const prepare = prepared(canvas, "panel");
  if (!prepare) return;
  const { x, w, h } = prepare;
  const colours = ink();
  const [top, bottom] = [9, h - 4];
  const [left, width] = [GUTTER, w - GUTTER];
  const at = (t: number) => left + ((t - strip.from) / (strip.to - strip.from)) * width;
  const y = (v: number) => bottom - ((v - strip.low) / (strip.high - strip.low)) * (bottom - top);
  x.fillStyle = colours.of("sunk");
  x.fillRect(0, 0, left, h);
  scale(x, strip, y, left, w);
  if (strip.selection) {
    x.fillStyle = colours.of("accent-wash");
    x.fillRect(at(strip.selection[0]), 0, at(strip.selection[1]) - at(strip.selection[0]), h);
  }
  x.save();
  x.beginPath();
  x.rect(left, 0, width, h);
  x.clip();
  if (strip.band) band(x, strip.band, y, left, w);
  lines(x, strip.markers.map(at), h);
  bands(x, strip, at, y);
  const gapAt = trace(x, strip, at, y, width);
  if (strip.poor) {
    const from = Math.max(left, at(strip.poor.from));
    hatch(x, from, w, 0, h, colours.of("hatch"));
    x.fillStyle = colours.of("degraded");
    x.fillRect(from, 0, w - from, 2);
    label(x, strip.poor.word, from + x.measureText(strip.poor.word).width / 2 + 8, 13, colours.of("ink"), colours.of("panel"));
  }
  if (gapAt !== undefined) silence(x, strip, at(gapAt), w, h);
  body(x, strip, at, y, h);
  if (strip.cursor !== undefined) cursor(x, strip, strip.cursor, at, y, h);
  x.restore();
}

function scale(x: CanvasRenderingContext2D, strip: Strip, y: (v: number) => number, left: number, w: number): void {
  const colours = ink();
  x.strokeStyle = colours.of("grid");
  x.fillStyle = colours.of("ink-3");
  x.lineWidth = 1;
  x.textAlign = "right";
  for (const tick of ticks(strip.low, strip.high, 2.4)) {
    const line = Math.round(y(tick)) + 0.5;
    x.beginPath();
    x.moveTo(left, line);
    x.lineTo(w, line);
    x.stroke();
    const step = strip.high - strip.low;
    x.fillText(decimal(tick, step < 0.5 ? 2 : step < 5 ? 1 : 0), left - 5, Math.max(8, line));
  }
  x.textAlign = "left";
}

function band(x: CanvasRenderingContext2D, { mean, sd }: { mean: number; sd: number }, y: (v: number) => number, left: number, w: number): void {
  const colours = ink();
  x.fillStyle = colours.of("band");
  x.fillRect(left, y(mean + sd), w - left, y(mean - sd) - y(mean + sd));
  x.strokeStyle = colours.of("ink-3");
  x.setLineDash([2, 3]);
  x.beginPath();
  x.moveTo(left, y(mean));
  x.lineTo(w, y(mean));
  x.stroke();
  x.setLineDash([]);
}

function lines(x: CanvasRenderingContext2D, places: number[], h: number): void {
  x.strokeStyle = ink().of("ink-3");
  x.lineWidth = 1;
  x.setLineDash([3, 3]);
  x.beginPath();
  for (const place of places) {
    x.moveTo(Math.round(place) + 0.5, 0);
    x.lineTo(Math.round(place) + 0.5, h);
  }
  x.stroke();
  x.setLineDash([]);
}

/** What was before the first point, as bands from the smallest to the largest number. */
function bands(x: CanvasRenderingContext2D, strip: Strip, at: (t: number) => number, y: (v: number) => number): void {
  const { coarse, times } = strip.track;
  if (!coarse) return;
  const until = times[0] ?? strip.to;
  x.fillStyle = ink().of(strip.colour);
  x.globalAlpha = 0.28;
  coarse.min.forEach((min, k) => {
    const [from, max] = [coarse.from + k * coarse.step, coarse.max[k] ?? null];
    if (min === null || max === null || from >= until || from + coarse.step < strip.from) return;
    const [left, right] = [at(from), at(Math.min(until, from + coarse.step))];
    x.fillRect(left, y(max), right - left, Math.max(1, y(min) - y(max)));
  });
  x.globalAlpha = 1;
}

/** How many points are stroked at once: without a GPU a browser takes ever longer for longer paths. */
const STROKED = 48;

/** Draws what is in view; returns where data stop before the end. */
function trace(x: CanvasRenderingContext2D, strip: Strip, at: (t: number) => number, y: (v: number) => number, width: number): number | undefined {
  const first = Math.max(0, strip.track.indexAt(strip.from) - 1);
  const last = Math.min(strip.track.length, strip.track.indexAt(strip.to) + 1);
  const isDense = last - first > width;
  if (isDense) columns(x, strip, first, last, at, y);
  else line(x, strip, first, last, at, y);
  outside(x, strip, first, last, at);
  const newest = strip.track.values.at(-1) === undefined ? undefined : strip.track.newest;
  if (newest === undefined) return strip.from;
  return strip.to - newest > strip.patienceSecs ? newest : undefined;
}

/** Few points: a line through them, or steps. */
function line(x: CanvasRenderingContext2D, strip: Strip, first: number, last: number, at: (t: number) => number, y: (v: number) => number): void {
  const { times, values } = strip.track;
  x.strokeStyle = ink().of(strip.colour);
  x.lineWidth = 1.4;
  x.lineJoin = "bevel";
  x.beginPath();
  let [pen, stroked, held] = [false, 0, 0];
  for (let k = first; k < last; k += 1) {
    const v = values[k] ?? Number.NaN;
    if (Number.isNaN(v)) {
      pen = false;
      continue;
    }
    const [place, level] = [at(times[k] ?? 0), y(v)];
    if (!pen) x.moveTo(place, level);
    else {
      if (strip.steps) x.lineTo(place, held);
      x.lineTo(place, level);
    }
    [pen, stroked, held] = [true, stroked + 1, level];
    if (stroked % STROKED === 0) {
      x.stroke();
      x.beginPath();
      x.moveTo(place, level);
    }
  }
  x.stroke();
}

/** Many points: in each column of pixels from the smallest to the largest, joined with the column before. */
function columns(x: CanvasRenderingContext2D, strip: Strip, first: number, last: number, at: (t: number) => number, y: (v: number) => number): void {
  const { times, values } = strip.track;
  x.fillStyle = ink().of(strip.colour);
  let [column, top, bottom, held] = [-1, 0, 0, Number.NaN];
  const fill = () => {
    if (column >= 0) x.fillRect(column, top - 0.6, 1, bottom - top + 1.2);
  };
  for (let k = first; k < last; k += 1) {
    const level = y(values[k] ?? Number.NaN);
    if (Number.isNaN(level)) {
      held = Number.NaN;
      continue;
    }
    const place = Math.floor(at(times[k] ?? 0));
    if (place === column) {
      top = Math.min(top, level);
      bottom = Math.max(bottom, level);
    } else {
      fill();
      // Where there are fewer points than pixels for a while, the line goes on.
      for (let c = column + 1; c < place && !Number.isNaN(held); c += 1) {
        x.fillRect(c, held + ((level - held) * (c - column)) / (place - column) - 0.6, 1, 1.2);
      }
      const joined = Number.isNaN(held) ? level : held;
      [column, top, bottom] = [place, Math.min(level, joined), Math.max(level, joined)];
    }
    held = level;
  }
  fill();
}

/** Ticks where the trace leaves the scale, and how far it goes: never a silent autoscale. */
function outside(x: CanvasRenderingContext2D, strip: Strip, first: number, last: number, at: (t: number) => number): void {
  const { times, values } = strip.track;
  const colours = ink();
  let most = strip.high;
  x.fillStyle = colours.of("degraded");
  for (let k = first; k < last; k += 1) {
    const v = values[k] ?? 0;
    if (v > strip.high) {
      x.fillRect(at(times[k] ?? 0) - 1, 0, 2, 3);
      most = Math.max(most, v);
    }
  }
  if (most > strip.high) {
    const text = `goes to ${decimal(most, most < 10 ? 1 : 0)}: fit (⇧F)`;
    const right = x.canvas.clientWidth - x.measureText(text).width / 2 - 8;
    label(x, text, right, 11, colours.of("ink"), colours.of("panel"));
  }
}

function silence(x: CanvasRenderingContext2D, strip: Strip, from: number, w: number, h: number): void {
  const colours = ink();
  const newest = strip.track.newest;
  hatch(x, from, w, 0, h, colours.of("gap"));
  x.strokeStyle = colours.of("line-strong");
  x.beginPath();
  x.moveTo(Math.round(from) + 0.5, 0);
  x.lineTo(Math.round(from) + 0.5, h);
  x.stroke();
  const text = newest === undefined ? "no sample yet" : `silent for ${decimal(strip.to - newest, 1)} s`;
  const half = x.measureText(text).width / 2 + 6;
  label(x, text, Math.min(w - half, Math.max(GUTTER + half, (from + w) / 2)), h / 2, colours.of("ink"), colours.of("panel"));
}

/** Beats, responses, breaths, bursts and blinks. */
function body(x: CanvasRenderingContext2D, strip: Strip, at: (t: number) => number, y: (v: number) => number, h: number): void {
  const colours = ink();
  let free = -100;
  for (const tick of strip.ticks) {
    const place = at(tick.t);
    x.fillStyle = colours.of("ink-2");
    x.beginPath();
    if (tick.kind === "beat") {
      x.moveTo(place - 3, 1.5);
      x.lineTo(place + 3, 1.5);
      x.lineTo(place, 6.5);
      x.fill();
    } else if (tick.kind === "breath") x.fillRect(place - 0.5, h - 6, 1.2, 5);
    else if (tick.kind === "blink") {
      x.arc(place, 4.5, 2, 0, 7);
      x.fill();
    } else if (tick.kind === "burst") x.fillRect(place, h - 3.5, Math.max(2, at(tick.t + (tick.duration ?? 0)) - place), 2);
    else if (tick.kind === "response") {
      const level = strip.track.at(tick.t, 2);
      if (level === undefined) continue;
      x.fillStyle = colours.of("panel");
      x.strokeStyle = colours.of("ink-2");
      x.lineWidth = 1.2;
      x.arc(place, y(level), 2.6, 0, 7);
      x.fill();
      x.stroke();
      if (tick.value === null || place < Math.max(free, GUTTER)) continue;
      const text = `+${decimal(tick.value, 2)}`;
      if (place + 8 + x.measureText(text).width > x.canvas.clientWidth) continue;
      x.fillStyle = colours.of("ink-2");
      x.fillText(text, place + 5, Math.max(8, y(level) - 9));
      free = place + x.measureText(text).width + 12;
    }
  }
}

function cursor(x: CanvasRenderingContext2D, strip: Strip, t: number, at: (t: number) => number, y: (v: number) => number, h: number): void {
  const colours = ink();
  const place = Math.round(at(t)) + 0.5;
  x.strokeStyle = colours.of("accent");
  x.lineWidth = 1;
  x.beginPath();
  x.moveTo(place, 0);
  x.lineTo(place, h);
  x.stroke();
  const value = strip.track.at(t, Math.max(2, strip.patienceSecs));
  if (value === undefined) return;
  x.fillStyle = colours.of("accent");
  x.strokeStyle = colours.of("panel");
  x.lineWidth = 1.5;
  x.beginPath();
  x.arc(place, y(value), 3.5, 0, 7);
  x.fill();
  x.stroke();
}
