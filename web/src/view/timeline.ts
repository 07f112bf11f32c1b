import type { Lane, LaneSpan } from "../draw/lanes";
import type { Model } from "../store/model";
import { courses } from "./alerts";
import { phases, type Phase } from "./phases";
import { isSpan, spansOf } from "./strips";

/** The events, and what is known about their streams. */
export type Happened = Pick<Model, "events" | "streams" | "byName" | "hello">;

/** The session as lanes, and its planned duration [s]; open spans last until now, or to the end of a recording. */
export function timeline(model: Happened, now: number, end = now): { lanes: Lane[]; total: number; all: Phase[] } {
  const all = phases(model, now);
  const planned = Math.max(0, ...all.map((each) => each.to ?? each.from));
  const about = (id: number) => model.streams.get(id)?.about;
  const times = (kinds: readonly string[]) => model.events.filter((each) => kinds.includes(each.kind) && about(each.stream) !== "team").map((each) => each.t);
  const marks = model.events.filter((each) => (each.kind === "marker" && !isSpan(each) && about(each.stream) === "session") || each.request?.verb === "mark").map((each) => each.t);
  const steps = model.events.filter((each) => each.kind === "intervention").map((each) => each.t);
  const lanes: Lane[] = [
    { name: "phases", phases: all },
    { name: "markers", ticks: marks, spans: spansOf(model).map(({ t, duration }) => ({ from: t, to: t + (duration ?? 0), kind: "span" })) },
    { name: "alerts", spans: alertSpans(model, end) },
    { name: "reports", dots: times(["report"]) },
    { name: "commands", ticks: steps },
    { name: "robots", colour: "robot", spans: robotSpans(model, end) },
  ];
  return { lanes, total: Math.max(60, planned, now * 1.08), all };
}

function alertSpans(model: Happened, now: number): LaneSpan[] {
  return courses(model).flatMap(({ raised, newest }): LaneSpan[] => {
    const isOpen = newest.alert?.stage === "raised" || newest.alert?.stage === "unknown";
    const kind = raised.alert?.tier === "act" ? "act" : "soon";
    return raised.alert?.tier === "note" ? [] : [{ from: raised.t, to: isOpen ? now : newest.t, kind }];
  });
}

/** The session as a span with gaps in which a robot was offline. */
function robotSpans(model: Happened, now: number): LaneSpan[] {
  const gaps: LaneSpan[] = [];
  const open = new Map<string, number>();
  for (const { alert, t } of model.events) {
    if (alert?.why !== "offline") continue;
    if (alert.stage === "raised") open.set(alert.who, t);
    else if (alert.stage === "over" && open.has(alert.who)) {
      gaps.push({ from: open.get(alert.who) ?? t, to: t, kind: "gap" });
      open.delete(alert.who);
    }
  }
  for (const from of open.values()) gaps.push({ from, to: now, kind: "gap" });
  return [{ from: 0, to: now, kind: "here" }, ...gaps];
}
