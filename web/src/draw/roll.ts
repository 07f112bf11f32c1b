import type { Strip } from "./strip";

/** The number of pixels left of the new part that are redrawn: half a line's width, and its joins. */
const BACK = 4;

/** Draws a strip between two positions of a canvas [px], with the maps from time and level to pixels. */
export type Paint = (x: CanvasRenderingContext2D, strip: Strip, at: (t: number) => number, y: (v: number) => number, left: number, right: number) => void;

/** The position of the moving part of a strip on the screen's pixels. */
export interface Frame {
  /** The width and height of the moving part [px of the screen]. */
  width: number;
  height: number;
  /** The time span of a column of pixels [s]. */
  secs: number;
  /** The column after the last one shown, counted from the session's start. */
  end: number;
  /** A key of everything else that the strip depends on: when it changes, everything is redrawn. */
  key: string;
  y: (v: number) => number;
}

/** The moving part of a strip, kept as a ring of pixel columns: a frame draws only the new columns and shifts the rest. */
export class Roll {
  private readonly pixels = document.createElement("canvas");
  private readonly x = this.pixels.getContext("2d", { alpha: false });
  private key = "";
  private end = 0;
  private newest = Number.NEGATIVE_INFINITY;

  /** Draws the columns that are new since the last frame; returns whether there are any. */
  update(strip: Strip, frame: Frame, paint: Paint): boolean {
    const room = frame.width + 2 * BACK;
    const isSame = frame.key === this.key && frame.end >= this.end && frame.end - this.end < frame.width;
    if (!isSame) {
      this.pixels.width = room;
      this.pixels.height = frame.height;
      this.key = frame.key;
      this.end = frame.end - frame.width;
      this.newest = Number.NEGATIVE_INFINITY;
    }
    const index = strip.track.indexAt(strip.to) - 1;
    const newest = strip.track.times[index] ?? Number.NEGATIVE_INFINITY;
    if (isSame && newest === this.newest && frame.end === this.end) return false;
    const oldest = frame.end - frame.width;
    const joined = Math.floor(this.newest / frame.secs) - BACK;
    const from = newest > this.newest ? Math.max(oldest, Math.min(this.end, joined)) : this.end;
    this.runs(from, frame.end, (left, right, shift) => {
      const { x } = this;
      if (!x) return;
      x.save();
      x.beginPath();
      x.rect(left, 0, right - left, frame.height);
      x.clip();
      paint(x, strip, (t) => t / frame.secs - shift, frame.y, left, right);
      x.restore();
    });
    this.end = frame.end;
    this.newest = newest;
    return true;
  }

  /** Copies the last columns onto a canvas whose unit is a screen pixel. */
  show(onto: CanvasRenderingContext2D, left: number, { width, height }: Frame): void {
    const first = this.end - width;
    this.runs(first, this.end, (from, to, shift) => {
      onto.drawImage(this.pixels, from, 0, to - from, height, left + from + shift - first, 0, to - from, height);
    });
  }

  /** Splits a range of columns into its contiguous runs in the ring, each with its shift. */
  private runs(from: number, to: number, take: (left: number, right: number, shift: number) => void): void {
    const room = this.pixels.width;
    for (let column = from; column < to; ) {
      const shift = Math.floor(column / room) * room;
      const until = Math.min(to, shift + room);
      take(column - shift, until - shift, shift);
      column = until;
    }
  }
}
