import type { Feature, Stream, StreamHealth } from "../wire";
import { age, decimal } from "./format";

/** The states of a stream, with the glyph and the word of each. */
export type State = "ok" | "late" | "degraded" | "stale" | "dead" | "never";

export const STATE_WORDS: Record<State, string> = {
  ok: "ok", late: "late", degraded: "degraded", stale: "stale", dead: "dead", never: "never seen",
};

/** The latency from which a stream counts as late, although its times are correct [s]. */
export const LATE_SECS = 1;

/** The displayed state of a stream; `late` for one that is otherwise ok. */
export function stateOf(health: StreamHealth | undefined): State {
  const state = (health?.state ?? "never") as State;
  return state === "ok" && (health?.latency_secs ?? 0) > LATE_SECS ? "late" : state;
}

/** Whether a stream carries events, so that silence is normal. */
export function isHappening(stream: Stream): boolean {
  return stream.signal === "event" || stream.signal === "input" || stream.shape === "event";
}

const SENSORS: Record<string, string> = {
  ecg: "ECG", ppg: "PPG", eda: "EDA", emg: "EMG", eeg: "EEG", respiration: "breath", temperature: "temperature",
  acceleration: "movement", interval: "intervals", image: "camera", audio: "sound", input: "input",
  battery: "battery", link: "link", odometry: "odometry", diagnostics: "diagnostics",
};

/** The display name of a stream: `ECG`, `EDA fingers`, `battery`. */
export function sensorName(stream: Stream): string {
  const leaf = stream.name.split("/").at(-1) ?? stream.name;
  if (stream.about === "person" && stream.signal === "temperature") return "skin temp";
  const word = SENSORS[stream.signal];
  if (!word) return leaf.replaceAll("_", " ");
  const site = leaf.startsWith(`${stream.signal}_`) ? leaf.slice(stream.signal.length + 1).replaceAll("_", " ") : "";
  return site ? `${word} ${site}` : word;
}

/** Why a stream is not ok, in a few words. */
export function why(health: StreamHealth | undefined): string {
  if (!health || health.state === "never") return "never seen";
  if (health.state === "stale" || health.state === "dead") {
    return health.age_secs === null ? STATE_WORDS[health.state] : `silent for ${age(health.age_secs)}`;
  }
  if (stateOf(health) === "late") {
    const error = health.uncertainty_secs;
    return `${age(health.latency_secs ?? 0)} behind; its times are correct${error === null ? "" : ` to ± ${decimal(1000 * error)} ms`}`;
  }
  return health.reason;
}

const BODY_SENSORS = new Set(["ecg", "ppg", "eda", "emg", "eeg", "respiration", "interval"]);

/** The remedy for the state of a stream. */
export function remedy(stream: Stream, health: StreamHealth | undefined): string {
  const state = stateOf(health);
  const isWorn = stream.about === "person" && (BODY_SENSORS.has(stream.signal) || stream.signal === "acceleration");
  switch (state) {
    case "never":
      return "Connect it, or remove it from the study.";
    case "dead":
    case "stale":
      return isWorn ? "Is it still worn, switched on and in range?" : "Check its power first, then its network.";
    case "degraded":
      return isWorn ? "Check its fit and its battery." : "Check its driver and its network.";
    default:
      return "";
  }
}

const REASONS: Record<string, string> = {
  short: "not enough data in the window yet", gap: "data missing in the window", quality: "signal too poor",
  missing: "not measured by this device", undefined: "undefined for these data",
  no_baseline: "no baseline yet to compare with", nothing: "there is none",
  brief_baseline: "the baseline is too short to compare with",
};

/** Why a value is missing, in words. */
export function reasonWords(feature: Feature, channel: number): string {
  const reason = feature.reasons[channel] ?? "missing";
  const coverage = feature.coverage ?? 0;
  if (reason === "short" && coverage < 0.95) {
    const needs = Math.max(1, Math.ceil((0.95 - coverage) * feature.window_secs));
    return `first value in about ${needs} s: needs ${decimal(feature.window_secs)} s, has ${decimal(coverage * feature.window_secs)} s`;
  }
  if (reason === "quality" && feature.quality !== null) {
    return `signal too poor: ${decimal(100 * feature.quality)} % of ${decimal(feature.window_secs)} s usable`;
  }
  return REASONS[reason] ?? reason;
}
