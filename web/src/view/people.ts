import type { Model } from "../store/model";
import type { Feature, Stream, StreamHealth } from "../wire";
import { FIGURES, MOST_FIGURES, type Figure } from "./figures";
import { byName } from "./format";
import { isHappening, reasonWords, remedy, sensorName, stateOf, why, type State } from "./words";

/** The age above which a value is not current [s]. */
const OLD_SECS = 10;
/** The quality below which a value is marked as degraded. */
const POOR = 0.5;

/** A sensor, as a light. */
export interface Light {
  stream: Stream;
  name: string;
  state: State;
  why: string;
  remedy: string;
}

/** The comparison of a value with the person's own baseline. */
export interface Compared {
  difference: number;
  z: number | undefined;
  /** The baseline's mean and SD. */
  mean: number;
  sd: number | undefined;
}

/** A value of a person, or the reason why it is missing. */
export interface Stat {
  figure: Figure;
  stream: Stream;
  channel: number;
  source: string;
  state: "fresh" | "degraded" | "stale" | "none";
  value: number | undefined;
  ageSecs: number | undefined;
  why: string;
  usable: number | undefined;
  beside: number | undefined;
  compared: Compared | undefined;
  /** Why the value cannot be compared; empty if it is compared, or never will be. */
  comparedWhy: string;
}

export interface Person {
  id: string;
  lights: Light[];
  stats: Stat[];
  /** The streams drawn as strips, the most informative first. */
  strips: Stream[];
  /** Whether something is hidden from this viewer. */
  hidden: boolean;
  phase: string;
}

/** Everyone, in the order of their names. */
export function people(model: Model, now: number): Person[] {
  const ids = new Set([...model.streams.values()].filter((each) => each.about === "person" && each.subject).map((each) => each.subject));
  return [...ids].sort(byName).map((id) => person(model, id, now));
}

function person(model: Model, id: string, now: number): Person {
  const own = [...model.streams.values()].filter((each) => each.about === "person" && each.subject === id);
  const raw = own.filter((each) => !each.derived && !each.beside);
  const sensors = raw.filter((each) => !isHappening(each) && !UNLIT.has(each.signal) && !each.hidden);
  const phases = model.events.filter((each) => each.kind === "phase" && model.streams.get(each.stream)?.subject === id);
  return {
    id,
    lights: apart(sensors.map((stream) => light(model, stream))).sort((a, b) => ORDER.indexOf(a.stream.signal) - ORDER.indexOf(b.stream.signal)),
    stats: stats(model, own, now),
    strips: ["ecg", "ppg", "eda", "respiration"].flatMap((signal) => {
      const found = sensors.filter((each) => each.signal === signal && each.shape !== "event");
      return found.sort((a, b) => b.rate_hz - a.rate_hz).slice(0, 1);
    }),
    hidden: own.some((each) => each.hidden),
    phase: phases.at(-1)?.label ?? "",
  };
}

/** Signals without their own light: the sensors of a device show when it is out of range or empty. */
const UNLIT = new Set(["other", "battery", "link"]);
const ORDER = ["ecg", "interval", "ppg", "eda", "respiration", "eeg", "emg", "acceleration", "temperature", "image", "video", "face", "body", "expression", "audio"];

/** Adds the device name to sensors with the same name. */
function apart(lights: Light[]): Light[] {
  const isTwice = (light: Light) => lights.some((other) => other !== light && other.name === light.name);
  return lights.map((each) => (isTwice(each) && each.stream.device ? { ...each, name: `${each.name} ${each.stream.device.replaceAll("_", " ")}` } : each));
}

export function light(model: Model, stream: Stream): Light {
  const health = model.health.get(stream.id);
  return { stream, name: sensorName(stream), state: stateOf(health), why: why(health), remedy: remedy(stream, health) };
}

/** The values of a person: for each word the best source and the shortest window. */
function stats(model: Model, own: Stream[], now: number): Stat[] {
  const best = new Map<string, Stat>();
  for (const figure of FIGURES) {
    for (const stream of own.filter((each) => each.family === figure.family && isWindow(each))) {
      const channel = stream.channels.findIndex(({ name }) => name === figure.channel || name.startsWith(`${figure.channel}/`));
      if (channel < 0) continue;
      const found = stat(model, figure, stream, channel, now);
      const known = best.get(figure.word);
      if (!known || rank(model, found) < rank(model, known)) best.set(figure.word, found);
    }
  }
  return [...best.values()].slice(0, MOST_FIGURES);
}

function isWindow(stream: Stream): boolean {
  return stream.window !== null && stream.window !== "phases" && !stream.hidden;
}

function windowSecs(stream: Stream): number {
  return stream.window !== null && stream.window !== "phases" ? stream.window.secs : 0;
}

/** Streams with a value come first, then shorter windows, then faster sensors. */
function rank(model: Model, stat: Stat): number {
  const states = { fresh: 0, degraded: 0, stale: 1, none: 2 };
  const rate = model.byName.get(stat.stream.inputs[0] ?? "")?.rate_hz ?? 0;
  return 10_000 * states[stat.state] + windowSecs(stat.stream) + 1 / (1 + rate);
}

function stat(model: Model, figure: Figure, stream: Stream, channel: number, now: number): Stat {
  const feature = model.features.get(stream.id);
  const input = model.byName.get(stream.inputs[0] ?? "");
  const health = input && stream.inputs.length === 1 ? model.health.get(input.id) : undefined;
  const source = input && stream.inputs.length === 1 ? sensorName(input) : stream.family;
  const base = { figure, stream, channel, source, beside: undefined, compared: undefined, comparedWhy: "", usable: undefined };
  const last = model.last(stream.id, channel);
  const silent = health && (health.state === "stale" || health.state === "dead");
  const value = feature?.values[channel] ?? null;
  if (silent || (feature && now - feature.t > OLD_SECS)) {
    if (!last) return { ...base, state: "none", value: undefined, ageSecs: undefined, why: why(health) };
    const words = health ? `${why(health)}. ${input ? remedy(input, health) : ""}` : "no new data";
    return { ...base, state: "stale", value: last.value, ageSecs: now - last.t, why: words };
  }
  if (!feature || value === null) {
    const words = feature ? reasonWords(feature, channel) : "no value yet";
    return { ...base, state: "none", value: undefined, ageSecs: undefined, why: words };
  }
  const { compared, why: comparedWhy } = comparedOf(model, figure, stream, value);
  const isPoor = feature.quality !== null && feature.quality < POOR;
  return {
    ...base,
    state: isPoor ? "degraded" : "fresh",
    value,
    ageSecs: now - feature.t,
    why: isPoor ? `${Math.round(100 * (feature.quality ?? 0))} % usable` : "",
    usable: feature.quality ?? undefined,
    beside: beside(figure, stream, feature),
    compared,
    comparedWhy,
  };
}

function beside(figure: Figure, stream: Stream, feature: Feature): number | undefined {
  const place = stream.channels.findIndex(({ name }) => name === figure.beside?.channel);
  return feature.values[place] ?? undefined;
}

/** The difference from the person's own baseline, as computed by the feature `state`; never computed here. */
function comparedOf(model: Model, figure: Figure, of: Stream, value: number): { compared: Compared | undefined; why: string } {
  if (!figure.measure) return { compared: undefined, why: "" };
  for (const stream of model.streams.values()) {
    const isState = stream.family === "state" && stream.subject === of.subject && !stream.hidden;
    if (!isState || windowSecs(stream) !== windowSecs(of)) continue;
    const feature = model.features.get(stream.id);
    const place = (name: string) => stream.channels.findIndex((each) => each.name === name);
    const number = (name: string) => feature?.values[place(name)] ?? undefined;
    const difference = number(`${figure.measure}_difference`);
    const z = number(`${figure.measure}_z`);
    if (difference === undefined) {
      const reason = feature?.reasons[place(`${figure.measure}_difference`)] ?? "no_baseline";
      return { compared: undefined, why: NO_COMPARISON[reason] ?? "" };
    }
    const sd = z !== undefined && Math.abs(z) > 1e-9 ? Math.abs(difference / z) : undefined;
    return { compared: { difference, z, mean: value - difference, sd }, why: "" };
  }
  const isHidden = [...model.streams.values()].some((each) => each.family === "state" && each.subject === of.subject && each.hidden);
  return { compared: undefined, why: isHidden ? "comparison hidden" : (NO_COMPARISON["no_baseline"] ?? "") };
}

/** The baseline of a channel, or why it has none; `undefined` for channels that are never compared. */
export function baselineOf(model: Model, stream: Stream, channel: number): { compared: Compared | undefined; why: string } | undefined {
  const figure = FIGURES.find((each) => each.family === stream.family && each.channel === stream.channels[channel]?.name);
  if (!figure?.measure) return undefined;
  const value = model.features.get(stream.id)?.values[channel] ?? undefined;
  return value === undefined ? { compared: undefined, why: "no current value" } : comparedOf(model, figure, stream, value);
}

/** Why a value cannot be compared, by the reason from the feature `state`. */
const NO_COMPARISON: Record<string, string> = {
  no_baseline: "no baseline yet",
  brief_baseline: "baseline too short: needs 150 s",
  gap: "comparison: gap in the data",
};

/** Whether a person's sensor has been lost: it delivered data and no longer does. */
export function isLost(health: StreamHealth | undefined): boolean {
  return health?.state === "dead";
}
