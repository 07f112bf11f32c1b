import type { Lane } from "../draw/lanes";
import type { Model } from "../store/model";
import { present } from "./phases";
import { timeline, type Happened } from "./timeline";

/** The maximum number of people and robots with their own lane. */
const MOST_LANES = 8;

/** The events of a recording, as shown by its scrubber. */
export interface Recorded {
  lanes: Lane[];
  /** The name of the phase at the position. */
  phase: string | undefined;
  /** The times of alerts, of the starts of gaps, and of markers [s]. */
  alerts: number[];
  gaps: number[];
  markers: number[];
}

/** The events of the whole recording or, until it has been read, the events known up to the position. */
export function recorded(model: Model, now: number, isTall: boolean): Recorded {
  const whole: Happened = model.timeline ? { streams: model.streams, byName: model.byName, hello: model.hello, events: model.timeline.events } : model;
  const length = model.playback?.length ?? now;
  const { lanes, all } = timeline(whole, now, length);
  const absences = model.timeline?.absences ?? [];
  const shown = absences.length > MOST_LANES ? absences.filter((each) => each.gaps.length > 0).slice(0, MOST_LANES) : absences;
  const bodies: Lane[] = shown.map(({ subject, about, gaps }) => ({
    name: subject,
    colour: about,
    spans: [{ from: 0, to: length, kind: "here" }, ...gaps.map(({ from, to }) => ({ from, to, kind: "gap" as const }))],
  }));
  const rest = lanes.filter((each) => each.name !== "robots");
  const few = rest.filter((each) => each.name === "phases" || each.name === "alerts");
  return {
    lanes: isTall ? [...rest, ...bodies] : few,
    phase: present(all).now?.name,
    alerts: whole.events.filter((each) => each.alert?.stage === "raised").map((each) => each.t),
    gaps: absences.flatMap((each) => each.gaps.map((gap) => gap.from)),
    markers: lanes.find((each) => each.name === "markers")?.ticks?.slice() ?? [],
  };
}

/** The first of these times after now [s]. */
export function nextOf(times: readonly number[], now: number): number | undefined {
  const later = times.filter((t) => t > now + 0.5);
  return later.length > 0 ? Math.min(...later) : undefined;
}
