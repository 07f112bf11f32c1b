/** Types of NAL units (ITU-T H.264, table 7-1): an IDR picture, which needs no earlier one, and a sequence parameter set. */
const [IDR, PARAMETERS] = [5, 7];
/** The number of frames waiting for the decoder above which no more are requested from the server. */
const WAITING = 4;
/** While frames wait, one is drawn at least this often [ms]; the others are skipped, as after a jump. */
const PASSED_MS = 200;

/** Whether this browser can decode H.264 here: browsers do so on secure pages only. */
export function decodesVideo(): boolean {
  return "VideoDecoder" in globalThis;
}

/** Whether bytes are an H.264 frame: in Annex B it begins with a start code, unlike any picture file. */
export function isVideo(bytes: Uint8Array): boolean {
  return bytes[0] === 0 && bytes[1] === 0 && (bytes[2] === 1 || (bytes[2] === 0 && bytes[3] === 1));
}

/** The properties of an H.264 frame: whether it is a key frame, and its codec, `avc1.42e01e`, if it contains one. */
export function described(bytes: Uint8Array): { isFirst: boolean; codec: string | undefined } {
  let codec: string | undefined;
  for (let at = 2; at + 1 < bytes.length; at += 1) {
    if (bytes[at] !== 1 || bytes[at - 1] !== 0 || bytes[at - 2] !== 0) continue;
    const type = (bytes[at + 1] ?? 0) & 0x1f;
    if (type === PARAMETERS) codec = `avc1.${[2, 3, 4].map((k) => (bytes[at + k] ?? 0).toString(16).padStart(2, "0")).join("")}`;
    if (type === IDR) return { isFirst: true, codec };
    if (type >= 1 && type < IDR) break;
  }
  return { isFirst: false, codec };
}

/** The consumer of the frames of a stream. */
export interface Viewer {
  /** Draws a frame and closes it; or shows why there is none. */
  show(frame: VideoFrame | undefined, t: number, why: string): void;
  /** A frame was accepted: the next one may be sent. */
  taken(): void;
}

/** Decodes the frames of one stream in order. */
export class FrameDecoder {
  private decoder: VideoDecoder | undefined;
  private codec = "";
  private newest = 0;
  private untaken = 0;
  private shownMs = Number.NEGATIVE_INFINITY;

  constructor(private readonly viewer: Viewer) {}

  /** Decodes a frame with its capture time [s]; one whose predecessors are missing is dropped. */
  take(bytes: Uint8Array, t: number): void {
    const { isFirst, codec } = described(bytes);
    this.newest = t;
    if (isFirst) this.configure(codec ?? this.codec);
    if (this.decoder?.state === "configured") {
      this.decoder.decode(new EncodedVideoChunk({ type: isFirst ? "key" : "delta", timestamp: Math.round(t * 1e6), data: bytes }));
    }
    this.untaken += 1;
    this.answer();
  }

  /** Drops pending frames. */
  close(): void {
    if (this.decoder && this.decoder.state !== "closed") this.decoder.close();
    this.decoder = undefined;
    this.answer();
  }

  private configure(codec: string): void {
    if (this.decoder?.state === "configured" && codec === this.codec) return;
    this.close();
    this.codec = codec;
    const decoder = new VideoDecoder({
      output: (frame) => this.output(decoder, frame),
      error: (error) => this.fail(decoder, error),
    });
    this.decoder = decoder;
    decoder.ondequeue = () => this.answer();
    try {
      decoder.configure({ codec, optimizeForLatency: true });
    } catch (error) {
      this.fail(decoder, error);
    }
  }

  private output(decoder: VideoDecoder, frame: VideoFrame): void {
    const isBehind = decoder.decodeQueueSize > 0 && performance.now() - this.shownMs < PASSED_MS;
    if (decoder !== this.decoder || isBehind) return frame.close();
    this.shownMs = performance.now();
    this.viewer.show(frame, frame.timestamp / 1e6, "");
  }

  private fail(decoder: VideoDecoder, error: unknown): void {
    if (decoder !== this.decoder) return;
    this.decoder = undefined;
    const isUnknown = error instanceof DOMException && error.name === "NotSupportedError";
    this.viewer.show(undefined, this.newest, isUnknown || error instanceof TypeError ? `This browser can’t decode this H.264 (${this.codec})` : "");
    this.answer();
  }

  private answer(): void {
    if ((this.decoder?.decodeQueueSize ?? 0) > WAITING) return;
    for (; this.untaken > 0; this.untaken -= 1) this.viewer.taken();
  }
}
