import type { Model } from "../store/model";
import type { Event, Stream } from "../wire";
import { decimal } from "./format";
import { isSpan } from "./strips";

/** A line of the log. */
export interface Line {
  number: number;
  t: number;
  glyph: "" | "act" | "soon" | "note" | "acked" | "ok";
  who: string;
  what: string;
}

/** The newest lines, the newest first. */
export function log(model: Model, most: number): Line[] {
  const lines: Line[] = [];
  for (let k = model.events.length - 1; k >= 0 && lines.length < most; k -= 1) {
    const event = model.events[k];
    const stream = event && model.streams.get(event.stream);
    const line = event && stream ? lineOf(event, stream) : undefined;
    if (line) lines.push(line);
  }
  return lines.sort((a, b) => b.t - a.t || b.number - a.number);
}

/** The line of an event; `undefined` for events that are shown elsewhere or are too frequent. */
export function lineOf(event: Event, stream: Stream): Line | undefined {
  const base = { number: event.number, t: event.t };
  const isOfTask = stream.about === "person" && event.kind === "marker" && !stream.derived;
  if (isOfTask || stream.family === "notes" || stream.family === "stuck" || stream.family === "level") return undefined;
  // The marker set by a command is sent as a separate event.
  if (event.request?.verb === "mark" && event.kind === "command") return undefined;
  if (event.request) return { ...base, ...requested(event.request.verb, event.request.text, event.request.who) };
  if (event.alert) {
    const { stage, tier, who, why } = event.alert;
    const glyph = stage === "raised" ? (tier === "act" || tier === "note" ? tier : "soon") : stage === "unknown" ? "note" : "ok";
    const words = { raised: "", answered: "answered, ", unknown: "no value comes, ", over: "over, " }[stage] ?? "";
    return { ...base, glyph, who, what: `${words}${why}` };
  }
  if (stream.family === "deployment") return undefined;
  const who = stream.subject || (event.kind === "fault" ? "teampulse" : "");
  switch (event.kind) {
    case "phase":
      return { ...base, glyph: "", who: stream.about === "person" ? `${stream.subject} phase` : "phase", what: event.label || "ended" };
    case "marker":
      if (!stream.derived && isSpan(event)) return { ...base, glyph: "", who: who || "span", what: `${event.label}, ${decimal(event.duration ?? 0, 1)} s` };
      return stream.derived ? { ...base, glyph: "note", who, what: event.label } : { ...base, glyph: "", who: who || "marker", what: event.label };
    case "report":
      return { ...base, glyph: "", who: who || "report", what: `${event.label} ${event.value === null ? "?" : decimal(event.value)}` };
    case "intervention":
      return { ...base, glyph: "", who: event.label.split(" ")[0] ?? "", what: event.label.split(" ").slice(1).join(" ") };
    case "fault":
      return { ...base, glyph: "soon", who, what: event.label };
    case "clock":
      return event.label === "end" ? { ...base, glyph: "", who: "session", what: "ended" } : { ...base, glyph: "note", who: "clock", what: event.label };
    default:
      return undefined;
  }
}

function requested(verb: string, text: string, who: string): Omit<Line, "number" | "t"> {
  switch (verb) {
    case "mark":
      return { glyph: "", who: "marker", what: text };
    case "note":
      return { glyph: "note", who: "note", what: text };
    case "acknowledge":
      return { glyph: "acked", who, what: `acknowledged: ${text}` };
    default:
      return { glyph: "", who, what: `${verb} ${text}`.trim() };
  }
}
