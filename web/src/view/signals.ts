import type { Model } from "../store/model";
import type { Track } from "../store/track";
import type { Stream } from "../wire";
import { FIGURES } from "./figures";
import { byName } from "./format";
import { isHappening, sensorName } from "./words";

/** A line of the Signals page: a channel of a stream, by name, so that it stays valid in the next session. */
export interface Choice {
  stream: string;
  channel: string;
}

/** Signals whose mean is meaningless, as they oscillate around a level. */
const WAVES = new Set(["ecg", "ppg", "eeg", "emg", "respiration", "acceleration", "audio"]);

/** Whether a channel's mean and SD are meaningful. */
export function hasLevel(stream: Stream): boolean {
  return stream.derived || !WAVES.has(stream.signal);
}

/** All drawable channels: sensors first, then the values of people, then all others. */
export function drawable(model: Model): { choice: Choice; stream: Stream; label: string }[] {
  const all = [...model.streams.values()].filter((each) => !each.hidden && each.channels.length > 0 && !isHappening(each));
  const ordered = all.filter((each) => each.window !== "phases").sort((a, b) => Number(a.derived) - Number(b.derived) || byName(a.name, b.name));
  return ordered.flatMap((stream) =>
    stream.channels.map(({ name }) => ({ choice: { stream: stream.name, channel: name }, stream, label: labelOf(stream, name) })),
  );
}

/** The display name of a channel: `p001 ECG`, `robot4 battery voltage`. */
export function labelOf(stream: Stream, channel: string): string {
  return `${stream.subject} ${signalOf(stream, channel)}`.trim();
}

/** The display name of a channel of a known person or robot: `ECG`, `battery voltage`. */
export function signalOf(stream: Stream, channel: string): string {
  const figure = FIGURES.find((each) => each.family === stream.family && each.channel === channel);
  if (figure) return `${figure.word.toLowerCase()}${figure.unit === "/min" ? " rate" : ""}`;
  const sensor = stream.derived ? stream.family : sensorName(stream);
  return stream.channels.length > 1 ? `${sensor} ${channel.split(".").slice(-2).join(".")}` : sensor;
}

/** Splits rows into runs of the same person, robot or session, in their order. */
export function bySubject<T extends { stream: Stream }>(rows: readonly T[]): { title: string; rows: T[] }[] {
  const runs: { title: string; rows: T[] }[] = [];
  for (const row of rows) {
    const title = row.stream.subject || row.stream.about;
    const last = runs.at(-1);
    if (last?.title === title) last.rows.push(row);
    else runs.push({ title, rows: [row] });
  }
  return runs;
}

/** The default lines: an operator's signals above a robot's link and battery. */
export function usual(model: Model): Choice[] {
  const streams = [...model.streams.values()].filter((each) => !each.hidden);
  const people = streams.filter((each) => each.about === "person");
  const first = [...people].sort((a, b) => byName(a.subject, b.subject))[0]?.subject;
  const own = people.filter((each) => each.subject === first);
  const raw = (signal: string) => own.find((each) => !each.derived && each.signal === signal && each.shape !== "event");
  const heart = own.find((each) => each.family === "heart" && each.window !== "phases") ?? own.find((each) => each.family === "pulse" && each.window !== "phases");
  const rate = FIGURES.find((each) => each.family === heart?.family)?.channel ?? "";
  const chosen: Choice[] = [];
  const add = (stream: Stream | undefined, channel = stream?.channels[0]?.name) => {
    if (stream && channel) chosen.push({ stream: stream.name, channel });
  };
  add(raw("ecg") ?? raw("ppg"));
  add(heart, rate);
  for (const signal of ["eda", "respiration", "eeg", "emg"]) add(raw(signal));
  const robots = streams.filter((each) => each.about === "robot" && !each.derived).sort((a, b) => byName(a.name, b.name));
  add(robots.find((each) => each.signal === "link"));
  add(robots.find((each) => each.signal === "battery"));
  return chosen;
}

/** Summary statistics of a span of a channel. */
export interface Summary {
  count: number;
  mean: number;
  sd: number | undefined;
  median: number;
  mad: number;
  min: number;
  max: number;
  /** The share of the span with data [0..1]. */
  covered: number;
}

/** Summarises a span; `undefined` if it has no values. */
export function summary(track: Track, from: number, to: number): Summary | undefined {
  const [first, last] = [track.indexAt(from), track.indexAt(to)];
  const values = track.values.slice(first, last).filter(Number.isFinite);
  if (values.length === 0) return undefined;
  const mean = values.reduce((sum, each) => sum + each, 0) / values.length;
  const square = values.reduce((sum, each) => sum + (each - mean) ** 2, 0);
  const median = middle(values);
  return {
    count: values.length, mean, median, mad: middle(values.map((each) => Math.abs(each - median))),
    sd: values.length > 1 ? Math.sqrt(square / (values.length - 1)) : undefined,
    min: values.reduce((a, b) => Math.min(a, b)), max: values.reduce((a, b) => Math.max(a, b)), covered: covered(track.times.subarray(first, last), from, to),
  };
}

function middle(values: Float32Array | Float64Array): number {
  const sorted = values.slice().sort();
  const half = sorted.length >> 1;
  const [low = 0, high = 0] = [sorted[Math.max(0, half - 1)], sorted[half]];
  return sorted.length % 2 === 1 ? high : (low + high) / 2;
}

/** The share of a span in which no point is far from the one before it. */
function covered(times: Float64Array, from: number, to: number): number {
  const steps = times.map((t, k) => t - (times[k - 1] ?? from));
  const longest = Math.max(3 * middle(steps.subarray(1)), 0.5);
  const last = to - (times.at(-1) ?? to);
  const gaps = steps.filter((step) => step > longest).reduce((sum, step) => sum + step, last > longest ? last : 0);
  return Math.max(0, Math.min(1, 1 - gaps / (to - from)));
}

/** The time from which a stream's signal is too poor, and why; `undefined` if it is not. */
export function poorSince(model: Model, stream: Stream): { from: number; word: string } | undefined {
  // The analysis of the signal itself, over its shortest window: others need more than a good signal.
  const families = new Set(FIGURES.map((each) => each.family));
  const own = [...model.streams.values()].filter((each) => each.derived && each.inputs.length === 1 && each.inputs[0] === stream.name && families.has(each.family) && each.window !== "phases");
  const features = own.flatMap((each) => model.features.get(each.id) ?? []).sort((a, b) => a.window_secs - b.window_secs);
  const [feature] = features;
  if (!feature || feature.quality === null || feature.quality >= 0.5 || (feature.coverage ?? 0) <= 0.5) return undefined;
  return { from: feature.t - feature.window_secs, word: `${Math.round(100 * feature.quality)} % usable` };
}
