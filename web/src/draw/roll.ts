import type { Strip } from "./strip";

/** Pixels to the left of what is new that are drawn again: half a line's width, and its joins. */
const BACK = 4;

/** Draws a strip between two places of a canvas [px]: what is there at each time, at each level. */
export type Paint = (x: CanvasRenderingContext2D, strip: Strip, at: (t: number) => number, y: (v: number) => number, left: number, right: number) => void;

/** Where the moving part of a strip lies on the screen's pixels. */
export interface Frame {
  /** Its width and height [px of the screen]. */
  width: number;
  height: number;
  /** The time that a column of pixels takes [s]. */
  secs: number;
  /** The column behind the last that is shown, counted from the session's start. */
  end: number;
  /** What else it depends on: when this changes all is drawn anew. */
  key: string;
  y: (v: number) => number;
}

/** The part of a strip that moves, kept as a ring of pixel columns: a frame draws only what is new, and the rest is shifted. */
export class Roll {
  private readonly pixels = document.createElement("canvas");
  private readonly x = this.pixels.getContext("2d", { alpha: false });
  private key = "";
  private end = 0;
  private newest = Number.NEGATIVE_INFINITY;

  /** Draws what is new since the last frame; returns whether anything is. */
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

  /** Puts the last columns onto a canvas whose unit is a pixel of the screen. */
  show(onto: CanvasRenderingContext2D, left: number, { width, height }: Frame): void {
    const first = this.end - width;
    this.runs(first, this.end, (from, to, shift) => {
      onto.drawImage(this.pixels, from, 0, to - from, height, left + from + shift - first, 0, to - from, height);
    });
  }

  /** A range of columns as the runs in which they lie in the ring, and how far each of these is shifted. */
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
