import { PICTURE_HEAD_BYTES } from "../wire";
import { FrameDecoder, isVideo } from "./video";

/** Acknowledgements leave together at most this often [ms]. */
const TOGETHER_MS = 15;

/** A picture from a binary frame. */
export interface Picture {
  stream: number;
  /** When the picture was taken [s]. */
  t: number;
  /** JPEG, PNG or WebP; or a frame of H.264. */
  bytes: Uint8Array<ArrayBuffer>;
}

/** Decodes a binary frame; `undefined` if it is not a picture. */
export function readPicture(frame: ArrayBuffer): Picture | undefined {
  if (frame.byteLength <= PICTURE_HEAD_BYTES) return undefined;
  const head = new DataView(frame);
  if (head.getUint32(4, true) !== 0) return undefined;
  return { stream: head.getUint32(0, true), t: head.getFloat64(8, true), bytes: new Uint8Array(frame, PICTURE_HEAD_BYTES) };
}

/** A drawable picture. */
export type Shot = ImageBitmap | VideoFrame;

/** The width and height of a drawable picture [px]. */
export function sizeOf(shot: Shot): [number, number] {
  return "displayWidth" in shot ? [shot.displayWidth, shot.displayHeight] : [shot.width, shot.height];
}

/** Draws a picture taken at a time [s]; `undefined` if it cannot be decoded, with the reason if known. */
export type Show = (shot: Shot | undefined, t: number, why: string) => void;

/** The newest picture of a stream. */
interface Newest {
  number: number;
  shot: Shot | undefined;
  t: number;
  why: string;
}

/** The pictures of the session: each is decoded and drawn, and the newest is kept; then the server sends the next one. */
export class Pictures {
  private readonly shows = new Map<number, Set<Show>>();
  private readonly newest = new Map<number, Newest>();
  private readonly videos = new Map<number, FrameDecoder>();
  private numbers = 0;
  private acknowledged: number[] = [];

  constructor(
    private readonly acknowledge: (streams: number[]) => void,
    private readonly decode: (file: Blob) => Promise<ImageBitmap> = (file) => createImageBitmap(file),
  ) {}

  /** Draws the pictures of a stream; call the result to stop. */
  watch(stream: number, show: Show): () => void {
    const known = this.shows.get(stream) ?? new Set();
    known.add(show);
    this.shows.set(stream, known);
    const newest = this.newest.get(stream);
    if (newest) show(newest.shot, newest.t, newest.why);
    return () => {
      known.delete(show);
      if (known.size === 0) this.endVideo(stream);
    };
  }

  /** Handles a received picture. */
  async take({ stream, t, bytes }: Picture): Promise<void> {
    this.numbers += 1;
    const number = this.numbers;
    if (isVideo(bytes)) return this.video(stream).take(bytes, t);
    const shot = await this.decode(new Blob([bytes])).catch(() => undefined);
    this.put(stream, { number, shot, t, why: "" });
    this.shown(stream);
  }

  /** Drops pending acknowledgements: they belong to the previous connection. */
  reset(): void {
    this.acknowledged = [];
    for (const stream of [...this.videos.keys()]) this.endVideo(stream);
  }

  /** Drops the newest pictures: another moment is shown. */
  clear(): void {
    for (const { shot } of this.newest.values()) shot?.close();
    this.newest.clear();
    for (const stream of [...this.videos.keys()]) this.endVideo(stream);
  }

  private put(stream: number, picture: Newest): void {
    // Two pictures of a stream may be decoded at once, and the later one may finish first.
    const before = this.newest.get(stream);
    if (before && before.number > picture.number) return picture.shot?.close();
    before?.shot?.close();
    this.newest.set(stream, picture);
    this.shows.get(stream)?.forEach((show) => show(picture.shot, picture.t, picture.why));
  }

  private video(stream: number): FrameDecoder {
    const known = this.videos.get(stream);
    if (known) return known;
    const video = new FrameDecoder({
      show: (shot, t, why) => this.put(stream, { number: this.numbers, shot, t, why }),
      taken: () => this.shown(stream),
    });
    this.videos.set(stream, video);
    return video;
  }

  private endVideo(stream: number): void {
    this.videos.get(stream)?.close();
    this.videos.delete(stream);
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
