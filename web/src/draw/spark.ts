import type { Track } from "../store/track";
import { ink, prepared } from "./canvas";

/** Draws the last minutes of a value over its baseline band; the last point is marked. */
export function drawSpark(canvas: HTMLCanvasElement, track: Track, from: number, to: number, band: { mean: number; sd: number } | undefined, colour: string): void {
  const prepare = prepared(canvas);
  if (!prepare) return;
  const { x, w, h } = prepare;
  const colours = ink();
  const first = track.indexAt(from);
  const [times, values] = [track.times.subarray(first), track.values.subarray(first)];
  const finite = [...values].filter(Number.isFinite);
  if (band) finite.push(band.mean - 1.5 * band.sd, band.mean + 1.5 * band.sd);
  if (finite.length === 0) return;
  const [low, high] = [Math.min(...finite), Math.max(...finite)];
  const room = Math.max((high - low) * 0.08, 1e-6);
  const at = (t: number) => 1 + ((t - from) / (to - from)) * (w - 5);
  const y = (v: number) => h - 2 - ((v - low + room) / (high - low + 2 * room)) * (h - 4);
  if (band) {
    x.fillStyle = colours.of("band");
    x.fillRect(0, y(band.mean + band.sd), w, Math.max(1, y(band.mean - band.sd) - y(band.mean + band.sd)));
    x.strokeStyle = colours.of("ink-3");
    x.setLineDash([2, 3]);
    x.beginPath();
    x.moveTo(0, y(band.mean));
    x.lineTo(w, y(band.mean));
    x.stroke();
    x.setLineDash([]);
  }
  x.strokeStyle = colours.of(colour);
  x.lineWidth = 1.2;
  x.beginPath();
  let pen = false;
  times.forEach((t, k) => {
    const v = values[k] ?? Number.NaN;
    if (Number.isNaN(v)) pen = false;
    else if (pen) x.lineTo(at(t), y(v));
    else {
      x.moveTo(at(t), y(v));
      pen = true;
    }
  });
  x.stroke();
  const last = values.at(-1);
  if (last === undefined || Number.isNaN(last)) return;
  x.fillStyle = colours.of(colour);
  x.beginPath();
  x.arc(at(times.at(-1) ?? to), y(last), 2.6, 0, 7);
  x.fill();
}
