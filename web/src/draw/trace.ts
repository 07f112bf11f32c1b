import { ink } from "./canvas";
import type { Strip } from "./strip";

/** The number of points stroked at once: without a GPU the cost of a path grows faster than its length. */
const STROKED = 48;

/** The geometry of a strip: its maps from time and level to pixels, the part to draw, and the screen pixels per page pixel. */
export interface Plot {
  at: (t: number) => number;
  y: (v: number) => number;
  left: number;
  right: number;
  scale: number;
}

/** Draws a part of the trace, with the points before and after it. */
export function trace(x: CanvasRenderingContext2D, strip: Strip, isDense: boolean, plot: Plot): void {
  const { track } = strip;
  // Positions are linear in time.
  const secs = 1 / (plot.at(1) - plot.at(0));
  const begin = (plot.left - plot.at(0)) * secs;
  const first = Math.max(0, track.indexAt(begin) - 1);
  const last = Math.min(track.indexAt(strip.to), track.indexAt(begin + (plot.right - plot.left) * secs) + 1);
  if (isDense) columns(x, strip, first, last, plot);
  else line(x, strip, first, last, plot);
  outside(x, strip, first, last, plot);
}

/** Few points: a line through them, or steps. */
function line(x: CanvasRenderingContext2D, strip: Strip, first: number, last: number, { at, y, scale }: Plot): void {
  const { times, values } = strip.track;
  x.strokeStyle = ink().of(strip.colour);
  x.lineWidth = 1.4 * scale;
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

/** Many points: a line from the minimum to the maximum in each column of pixels, joined with the previous column. */
function columns(x: CanvasRenderingContext2D, strip: Strip, first: number, last: number, { at, y, scale }: Plot): void {
  const { times, values } = strip.track;
  const half = 0.6 * scale;
  x.fillStyle = ink().of(strip.colour);
  let [column, top, bottom, held] = [Number.NaN, 0, 0, Number.NaN];
  const fill = () => {
    if (!Number.isNaN(column)) x.fillRect(column, top - half, 1, bottom - top + 2 * half);
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
      // If there are temporarily fewer points than pixels, the line continues.
      for (let c = column + 1; c < place && !Number.isNaN(held); c += 1) {
        x.fillRect(c, held + ((level - held) * (c - column)) / (place - column) - half, 1, 2 * half);
      }
      const joined = Number.isNaN(held) ? level : held;
      [column, top, bottom] = [place, Math.min(level, joined), Math.max(level, joined)];
    }
    held = level;
  }
  fill();
}

/** Ticks where the trace leaves the scale. */
function outside(x: CanvasRenderingContext2D, strip: Strip, first: number, last: number, { at, scale }: Plot): void {
  const { times, values } = strip.track;
  x.fillStyle = ink().of("degraded");
  for (let k = first; k < last; k += 1) {
    if ((values[k] ?? 0) > strip.high) x.fillRect(at(times[k] ?? 0) - scale, 0, 2 * scale, 3 * scale);
  }
}

/** The data before the first point, as bands from the minimum to the maximum. */
export function bands(x: CanvasRenderingContext2D, strip: Strip, { at, y, left, right }: Plot): void {
  const { coarse, times } = strip.track;
  if (!coarse) return;
  const until = times[0] ?? strip.to;
  x.fillStyle = ink().of(strip.colour);
  x.globalAlpha = 0.28;
  coarse.min.forEach((min, k) => {
    const [from, max] = [coarse.from + k * coarse.step, coarse.max[k] ?? null];
    if (min === null || max === null || from >= until) return;
    const [begin, end] = [at(from), at(Math.min(until, from + coarse.step))];
    if (end < left || begin > right) return;
    x.fillRect(begin, y(max), end - begin, Math.max(1, y(min) - y(max)));
  });
  x.globalAlpha = 1;
}
