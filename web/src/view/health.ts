import type { Model } from "../store/model";
import type { Stream, StreamHealth } from "../wire";
import { byName } from "./format";
import { isHappening, remedy, stateOf, STATE_WORDS, why, type State } from "./words";

/** A stream and its health. */
export interface Row {
  stream: Stream;
  health: StreamHealth | undefined;
  state: State;
  why: string;
  remedy: string;
  /** Whether the stream needs attention; event streams may be silent. */
  isBad: boolean;
  /** The rate as a share of the declared rate; `undefined` if none is declared. */
  share: number | undefined;
}

/** The streams of a person, a robot or the session. */
export interface Group {
  key: string;
  title: string;
  isPerson: boolean;
  rows: Row[];
  counts: [State, number][];
  bad: number;
  /** The name of a stream within the group. */
  within: (stream: Stream) => string;
}

const STATES: readonly State[] = ["ok", "late", "degraded", "stale", "dead", "never"];
const ABOUT = ["person", "robot", "team", "session"];

/** The raw streams in groups, people first, each group sorted by name. */
export function healthGroups(model: Model): Group[] {
  const groups = new Map<string, Row[]>();
  for (const stream of model.streams.values()) {
    const health = model.health.get(stream.id);
    if (stream.derived || (!health && stream.about === "session")) continue;
    const key = `${stream.about} ${stream.subject}`;
    const share = stream.rate_hz > 0 && health ? health.rate_hz / stream.rate_hz : undefined;
    const [state, isAwaited] = [stateOf(health), isHappening(stream) && stateOf(health) === "never"];
    const words = isAwaited ? { why: "Nothing yet; it is sent only occasionally", remedy: "" } : { why: why(health), remedy: remedy(stream, health) };
    const row = { stream, health, state, isBad: state !== "ok" && !isAwaited, ...words, share };
    groups.set(key, [...(groups.get(key) ?? []), row]);
  }
  return [...groups].sort(([a], [b]) => order(a) - order(b) || byName(a, b)).map(([key, rows]) => groupOf(key, rows));
}

function order(key: string): number {
  return ABOUT.indexOf(key.split(" ")[0] ?? "");
}

function groupOf(key: string, rows: Row[]): Group {
  const [about = "", subject = ""] = key.split(" ");
  const counts = STATES.map((state): [State, number] => [state, rows.filter((each) => each.state === state).length]);
  const within = (stream: Stream) => {
    const at = subject ? stream.name.indexOf(`/${subject}/`) : -1;
    return at < 0 ? stream.name : stream.name.slice(at + subject.length + 2);
  };
  return {
    key, title: subject || about, isPerson: about === "person", within,
    rows: rows.sort((a, b) => byName(a.stream.name, b.stream.name)),
    counts: counts.filter(([, count]) => count > 0),
    bad: rows.filter((each) => each.isBad).length,
  };
}

/** A summary of all streams. */
export function totals(groups: readonly Group[]) {
  const rows = groups.flatMap((each) => each.rows);
  const of = (state: State) => rows.filter((each) => each.state === state).length;
  const others = STATES.slice(1).flatMap((state) => (of(state) > 0 ? [`${of(state)} ${STATE_WORDS[state]}`] : []));
  const sum = (count: (health: StreamHealth) => number | null) => rows.reduce((all, each) => all + ((each.health && count(each.health)) ?? 0), 0);
  const errors = rows.flatMap((each) => {
    const secs = each.health?.uncertainty_secs;
    return typeof secs === "number" ? [{ secs, name: each.stream.name }] : [];
  });
  return {
    all: rows.length, ok: of("ok"), words: others.join(", "), lost: sum((health) => health.lost_source), lostQueue: sum((health) => health.lost_queue),
    unknown: rows.filter((each) => each.health?.lost_source === null).length,
    worst: errors.sort((a, b) => b.secs - a.secs)[0],
  };
}
