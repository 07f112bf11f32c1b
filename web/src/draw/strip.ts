import type { Track } from "../store/track";
import { decimal } from "../view/format";
import { fitted, hatch, ink, label, ticks } from "./canvas";
import { Roll } from "./roll";
import { bands, trace, type Plot } from "./trace";

/** The width of the scale on the left of a strip [px]. */
export const GUTTER = 38;

/** A mark on a strip at a time: a beat, a response, a breath. */
export interface Tick {
  t: number;
  kind: string;
  value: number | null;
  duration: number | null;
}

/** The content of a strip. */
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
  /** Annotated spans. */
  spans: readonly Pick<Tick, "t" | "duration">[];
  cursor?: number | undefined;
  selection?: readonly [number, number] | undefined;
  /** The age of the newest point above which there is a gap [s]. */
  patienceSecs: number;
  /** The time from which the signal is too poor, and why: hatched. */
  poor?: { from: number; word: string } | undefined;
  /** Whether values are held until the next one, for irregular streams. */
  steps?: boolean;
}

/** A strip on its canvas: the moving part is kept, and only its new columns are drawn. */
export class StripCanvas {
  private readonly roll = new Roll();
  private shown = "";
  private isDense = false;

  constructor(private readonly canvas: HTMLCanvasElement) {}

  /** Draws the current state of a strip; nothing is ever drawn across a gap. */
  draw(asked: Strip): void {
    const sized = fitted(this.canvas, "panel");
    if (!sized) return;
    const { x, w, h, scale } = sized;
    const [width, left] = [Math.round((w - GUTTER) * scale), Math.round(GUTTER * scale)];
    if (width <= 0) return;
    // A column of pixels always has the same time span: once drawn, it is only shifted.
    const secs = Math.round(1e6 * (asked.to - asked.from)) / 1e6 / width;
    const end = Math.floor(asked.to / secs + 1e-3);
    const strip = { ...asked, from: (end - width) * secs, to: end * secs };
    const [top, bottom] = [9, h - 4];
    const y = (v: number) => bottom - ((v - strip.low) / (strip.high - strip.low)) * (bottom - top);
    const at = (t: number) => GUTTER + ((t - strip.from) / (strip.to - strip.from)) * (w - GUTTER);
    this.isDense = dense(strip, w - GUTTER, this.isDense);
    const key = [w, h, scale, secs, strip.low, strip.high, strip.track.revision, this.isDense, strip.selection, ink().theme].join(" ");
    const frame = { width, height: Math.round(h * scale), secs, end, key, y: (v: number) => scale * y(v) };
    const isNew = this.roll.update(strip, frame, (onto, whole, place, level, from, to) => this.paint(onto, whole, { at: place, y: level, left: from, right: to, scale }, frame.height));
    const over = [key, strip.cursor, strip.ticks.length, strip.ticks.at(-1)?.t, strip.markers.join(), strip.spans.map((each) => [each.t, each.duration]).join(), strip.poor?.from, strip.poor?.word].join(" ");
    if (!isNew && over === this.shown) return;
    x.setTransform(1, 0, 0, 1, 0, 0);
    this.roll.show(x, left, frame);
    x.setTransform(scale, 0, 0, scale, 0, 0);
    if (!this.shown.startsWith(key)) gutter(x, strip, y, h);
    this.shown = over;
    this.above(x, strip, at, y, w, h);
  }

  /** A part of the moving content: the background and everything on it. */
  private paint(x: CanvasRenderingContext2D, strip: Strip, plot: Plot, height: number): void {
    const colours = ink();
    const { at, y, left, right, scale } = plot;
    x.fillStyle = colours.of("panel");
    x.fillRect(left, 0, right - left, height);
    x.fillStyle = colours.of("grid");
    for (const tick of levels(strip)) x.fillRect(left, Math.round(y(tick)), right - left, Math.max(1, Math.round(scale)));
    if (strip.selection) {
      x.fillStyle = colours.of("accent-wash");
      x.fillRect(at(strip.selection[0]), 0, at(strip.selection[1]) - at(strip.selection[0]), height);
    }
    bands(x, strip, plot);
    trace(x, strip, this.isDense, plot);
  }

  /** The transient elements above the trace. */
  private above(x: CanvasRenderingContext2D, strip: Strip, at: (t: number) => number, y: (v: number) => number, w: number, h: number): void {
    const colours = ink();
    x.save();
    x.beginPath();
    x.rect(GUTTER, 0, w - GUTTER, h);
    x.clip();
    annotated(x, strip.spans, at, h);
    lines(x, strip.markers.map(at), h);
    farthest(x, strip, w);
    if (strip.poor) {
      const from = Math.max(GUTTER, at(strip.poor.from));
      hatch(x, from, w, 0, h, colours.of("hatch"));
      x.fillStyle = colours.of("degraded");
      x.fillRect(from, 0, w - from, 2);
      label(x, strip.poor.word, from + x.measureText(strip.poor.word).width / 2 + 8, 13, colours.of("ink"), colours.of("panel"));
    }
    const newest = strip.track.newest ?? strip.from;
    if (strip.track.newest === undefined || strip.to - newest > strip.patienceSecs) silence(x, strip, at(newest), w, h);
    body(x, strip, at, y, h);
    if (strip.cursor !== undefined) cursor(x, strip, strip.cursor, at, y, h);
    x.restore();
  }
}

/** Whether there are more points than columns, with hysteresis. */
function dense({ track, from, to }: Strip, width: number, was: boolean): boolean {
  const points = track.indexAt(to) - track.indexAt(from);
  return points > (was ? 0.9 : 1) * width;
}

/** The grid lines. */
function levels({ low, high }: Strip): number[] {
  return ticks(low, high, 2.4);
}

/** The scale, on the left. */
function gutter(x: CanvasRenderingContext2D, strip: Strip, y: (v: number) => number, h: number): void {
  const colours = ink();
  x.fillStyle = colours.of("sunk");
  x.fillRect(0, 0, GUTTER, h);
  x.fillStyle = colours.of("ink-3");
  x.textAlign = "right";
  const span = strip.high - strip.low;
  for (const level of levels(strip)) x.fillText(decimal(level, span < 0.5 ? 2 : span < 5 ? 1 : 0), GUTTER - 5, Math.max(8, Math.round(y(level)) + 0.5));
  x.textAlign = "left";
}

/** Annotated spans: a tinted background, with a bar above and an edge at either end. */
function annotated(x: CanvasRenderingContext2D, spans: Strip["spans"], at: (t: number) => number, h: number): void {
  x.fillStyle = ink().of("accent");
  for (const { t, duration } of spans) {
    const [left, right] = [Math.round(at(t)), Math.round(at(t + (duration ?? 0)))];
    x.globalAlpha = 0.1;
    x.fillRect(left, 0, right - left, h);
    x.globalAlpha = 1;
    x.fillRect(left, 0, Math.max(2, right - left), 2);
    x.fillRect(left, 0, 1, h);
    x.fillRect(right - 1, 0, 1, h);
  }
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

/** Shows how far the trace leaves the scale: there is never a silent autoscale. */
function farthest(x: CanvasRenderingContext2D, { track, from, to, high }: Strip, w: number): void {
  const values = track.values;
  const last = track.indexAt(to);
  let most = high;
  for (let k = track.indexAt(from); k < last; k += 1) most = Math.max(most, values[k] || high);
  if (most <= high) return;
  const colours = ink();
  const text = `reaches ${decimal(most, most < 10 ? 1 : 0)}: fit (⇧F)`;
  label(x, text, w - x.measureText(text).width / 2 - 8, 11, colours.of("ink"), colours.of("panel"));
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

/** Beats, responses, breaths, bursts and blinks: filled ones as a single path, which is faster than many small ones. */
function body(x: CanvasRenderingContext2D, strip: Strip, at: (t: number) => number, y: (v: number) => number, h: number): void {
  const colours = ink();
  x.fillStyle = colours.of("ink-2");
  x.beginPath();
  for (const { t, kind, duration } of strip.ticks) {
    const place = at(t);
    if (kind === "beat") {
      x.moveTo(place - 3, 1.5);
      x.lineTo(place + 3, 1.5);
      x.lineTo(place, 6.5);
    } else if (kind === "breath") x.rect(place - 0.5, h - 6, 1.2, 5);
    else if (kind === "burst") x.rect(place, h - 3.5, Math.max(2, at(t + (duration ?? 0)) - place), 2);
    else if (kind === "blink") {
      x.moveTo(place + 2, 4.5);
      x.arc(place, 4.5, 2, 0, 7);
    }
  }
  x.fill();
  responses(x, strip, at, y);
}

function responses(x: CanvasRenderingContext2D, strip: Strip, at: (t: number) => number, y: (v: number) => number): void {
  const colours = ink();
  let free = -100;
  for (const { t, kind, value } of strip.ticks) {
    const [place, level] = [at(t), kind === "response" ? strip.track.at(t, 2) : undefined];
    if (level === undefined) continue;
    x.fillStyle = colours.of("panel");
    x.strokeStyle = colours.of("ink-2");
    x.lineWidth = 1.2;
    x.beginPath();
    x.arc(place, y(level), 2.6, 0, 7);
    x.fill();
    x.stroke();
    if (value === null || place < Math.max(free, GUTTER)) continue;
    const text = `+${decimal(value, 2)}`;
    if (place + 8 + x.measureText(text).width > x.canvas.clientWidth) continue;
    x.fillStyle = colours.of("ink-2");
    x.fillText(text, place + 5, Math.max(8, y(level) - 9));
    free = place + x.measureText(text).width + 12;
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
