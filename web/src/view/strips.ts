import type { Model } from "../store/model";
import type { Track } from "../store/track";
import type { Event, Stream, Timeline } from "../wire";
import { age, significant, unit } from "./format";
import { sensorName, STATE_WORDS, stateOf } from "./words";

/** Signals whose level drifts: their scale grows with them. */
const DRIFTING = new Set(["eda", "temperature", "battery", "link", "odometry", "input"]);

/** The scale of a strip, from its first seconds of data. It is kept until it is fitted again; the scale of a drifting level only grows. */
export function scaleOf(stream: Stream): (track: Track, from: number, to: number) => [number, number] {
  const grows = stream.derived || DRIFTING.has(stream.signal);
  let fixed: [number, number] | undefined;
  let isSettled = false;
  return (track, from, to) => {
    if (fixed && isSettled) return grows ? (fixed = grown(fixed, track.values.at(-1))) : fixed;
    const first = track.indexAt(from);
    const values = [...track.values.subarray(first), ...coarseOf(track, from)].filter(Number.isFinite);
    if (values.length < 2) return fixed ?? [0, 1];
    const [low, high] = [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];
    const room = Math.max((high - low) * 0.18, Math.abs(high) * 0.01, 1e-3);
    fixed = [low - room, high + room];
    const span = (track.newest ?? to) - (track.times[first] ?? to);
    isSettled = span > Math.min(8, 0.8 * (to - from));
    return fixed;
  };
}

/** The minima and maxima of the stored columns since a time. */
function coarseOf(track: Track, from: number): number[] {
  const { coarse } = track;
  if (!coarse) return [];
  const first = Math.max(0, Math.floor((from - coarse.from) / coarse.step));
  return [...coarse.min.slice(first), ...coarse.max.slice(first)].filter((each) => each !== null);
}

function grown([low, high]: [number, number], value: number | undefined): [number, number] {
  const step = (high - low) / 4;
  if (value === undefined || Number.isNaN(value)) return [low, high];
  return [value < low ? value - step : low, value > high ? value + step : high];
}

/** Beats, responses, breaths, bursts and blinks detected in a stream. */
export function bodyTicks(model: Model, stream: Stream, from: number, to: number): Event[] {
  const found: Event[] = [];
  for (const [id, events] of model.body) {
    const source = model.streams.get(id);
    if (!source?.derived || source.inputs[0] !== stream.name) continue;
    for (let k = events.length - 1; k >= 0; k -= 1) {
      const event = events[k];
      if (!event || event.t < from - 5) break;
      if (event.t <= to) found.push(event);
    }
  }
  return found.reverse();
}

let ofSession: { model: Model; version: number; whole: Timeline | undefined; events: Event[]; spans: Event[] } | undefined;

/** The phases, markers and annotated spans of the session, collected once per new event, as strips need them in every frame. */
function marksOf(model: Model): { events: Event[]; spans: Event[] } {
  const [version, whole] = [model.eventsVersion, model.timeline];
  if (ofSession?.model === model && ofSession.version === version && ofSession.whole === whole) return ofSession;
  const events = model.events.filter((event) => (event.kind === "phase" || (event.kind === "marker" && !event.request && !isSpan(event))) && ofTheSession(model, event));
  ofSession = { model, version, whole, events, spans: spansOf({ streams: model.streams, events: whole?.events ?? model.events }) };
  return ofSession;
}

/** Whether an event is an annotated span: a marker with a duration. */
export function isSpan(event: Event): boolean {
  return event.kind === "marker" && (event.duration ?? 0) > 0;
}

/** The annotated spans of the session. In a recording they are known before the time at which they were annotated. */
export function spansOf(model: Pick<Model, "events" | "streams">): Event[] {
  return model.events.filter((event) => isSpan(event) && ofTheSession(model, event));
}

function ofTheSession(model: Pick<Model, "streams">, event: Event): boolean {
  return model.streams.get(event.stream)?.about === "session";
}

/** Events of the session that are drawn on every strip. */
export function markers(model: Model, from: number, to: number): Event[] {
  return marksOf(model).events.filter((event) => event.t >= from && event.t <= to);
}

/** Annotated spans that overlap an interval. */
export function spans(model: Model, from: number, to: number): Event[] {
  return marksOf(model).spans.filter((event) => event.t <= to && event.t + (event.duration ?? 0) >= from);
}

export function markerTimes(model: Model, from: number, to: number): number[] {
  return markers(model, from, to).map((each) => each.t);
}

/** The longest silence of a stream that is not shown as a gap [s]. */
export function patience(stream: Stream): number {
  return stream.rate_hz > 0 ? Math.max(1.5, 3 / stream.rate_hz) : 5;
}

/** A strip in words, for screen readers. */
export function spoken(model: Model, stream: Stream, track: Track, now: number, secs: number): string {
  const first = track.indexAt(now - secs);
  const values = [...track.values.subarray(first)].filter(Number.isFinite);
  const units = unit(stream.channels[0]?.unit ?? "");
  const name = `${sensorName(stream)} of ${stream.subject || "the team"}`;
  const last = values.at(-1);
  if (last === undefined) return `${name}: no sample in ${secs} s`;
  const mean = values.reduce((sum, each) => sum + each, 0) / values.length;
  const state = STATE_WORDS[stateOf(model.health.get(stream.id))];
  return `${name}: last ${significant(last)} ${units}, ${age(now - (track.newest ?? now))} ago; mean ${significant(mean)} over ${secs} s; ${state}`;
}
