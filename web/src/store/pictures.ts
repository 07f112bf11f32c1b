import { PICTURE_HEAD_BYTES } from "../wire";

/** Acknowledgements leave together at most this often [ms]. */
const TOGETHER_MS = 15;

/** A picture, as it comes in a binary frame. */
export interface Picture {
  stream: number;
  /** When it was taken [s]. */
  t: number;
  /** JPEG, PNG or WebP. */
  file: Blob;
}

/** Reads a binary frame; `undefined` if it is no picture. */
export function readPicture(frame: ArrayBuffer): Picture | undefined {
  if (frame.byteLength <= PICTURE_HEAD_BYTES) return undefined;
  const head = new DataView(frame);
  if (head.getUint32(4, true) !== 0) return undefined;
  return { stream: head.getUint32(0, true), t: head.getFloat64(8, true), file: new Blob([new Uint8Array(frame, PICTURE_HEAD_BYTES)]) };
}

/** Draws a picture that was taken at a time [s]; `undefined` of one that can't be decoded. */
export type Show = (bitmap: ImageBitmap | undefined, t: number) => void;

/** The pictures of the session: each is decoded and drawn, and the newest kept; the server sends the next one when it was. */
export class Pictures {
  private readonly shows = new Map<number, Set<Show>>();
  /** The newest of each stream. */
  private readonly newest = new Map<number, { number: number; bitmap: ImageBitmap | undefined; t: number }>();
  private numbers = 0;
  private acknowledged: number[] = [];

  constructor(
    private readonly acknowledge: (streams: number[]) => void,
    private readonly decode: (file: Blob) => Promise<ImageBitmap> = (file) => createImageBitmap(file),
  ) {}

  /** Draws the pictures of a stream; the result ends that. */
  watch(stream: number, show: Show): () => void {
    const known = this.shows.get(stream) ?? new Set();
    known.add(show);
    this.shows.set(stream, known);
    const newest = this.newest.get(stream);
    if (newest) show(newest.bitmap, newest.t);
    return () => known.delete(show);
  }

  /** Takes a picture that has come. */
  async take({ stream, t, file }: Picture): Promise<void> {
    this.numbers += 1;
    const number = this.numbers;
    const bitmap = await this.decode(file).catch(() => undefined);
    // Two of a stream may be decoded at once, and the later one first.
    const before = this.newest.get(stream);
    if (before && before.number > number) {
      bitmap?.close();
    } else {
      before?.bitmap?.close();
      this.newest.set(stream, { number, bitmap, t });
      this.shows.get(stream)?.forEach((show) => show(bitmap, t));
    }
    this.shown(stream);
  }

  /** Forgets what has not left: it was of another connection. */
  reset(): void {
    this.acknowledged = [];
  }

  /** Forgets the newest: another moment is shown. */
  clear(): void {
    for (const { bitmap } of this.newest.values()) bitmap?.close();
    this.newest.clear();
  }

  private shown(stream: number): void {
    this.acknowledged.push(stream);
    if (this.acknowledged.length > 1) return;
    setTimeout(() => {
      if (this.acknowledged.length > 0) this.acknowledge(this.acknowledged);
      this.acknowledged = [];
    }, TOGETHER_MS);
  }
}
