import { WAVE_HEAD_BYTES } from "../wire";

/** A run of samples from a binary frame. */
export interface Wave {
  stream: number;
  channels: number;
  /** The time of the first sample [s]. */
  start: number;
  /** The sampling period [s]. */
  period: number;
  /** The values sample by sample, each with all channels. */
  samples: Float32Array;
}

/** Decodes a binary frame; `undefined` if it is incomplete. */
export function readWave(frame: ArrayBuffer): Wave | undefined {
  if (frame.byteLength < WAVE_HEAD_BYTES) return undefined;
  const head = new DataView(frame);
  const channels = head.getUint32(4, true);
  const bytes = frame.byteLength - WAVE_HEAD_BYTES;
  if (channels === 0 || bytes % (4 * channels) !== 0) return undefined;
  return {
    stream: head.getUint32(0, true),
    channels,
    start: head.getFloat64(8, true),
    period: head.getFloat64(16, true),
    samples: new Float32Array(frame, WAVE_HEAD_BYTES),
  };
}
