import type { Phase } from "../view/phases";
import { clock } from "../view/format";
import { ink, prepared } from "./canvas";

/** A span on a lane. */
export interface LaneSpan {
  from: number;
  to: number;
  kind: "act" | "soon" | "here" | "gap" | "span";
}

/** A row of the timeline. */
export interface Lane {
  name: string;
  phases?: readonly Phase[];
  ticks?: readonly number[];
  dots?: readonly number[];
  spans?: readonly LaneSpan[];
  /** The colour of spans with data. */
  colour?: string;
}

/** The width of the names on the left [px]. */
export const NAMES = 88;

/** Draws the session from its start: phases, markers, alerts, and the data of people and robots. */
export function drawLanes(canvas: HTMLCanvasElement, lanes: readonly Lane[], now: number, total: number): void {
  const prepare = prepared(canvas);
  if (!prepare) return;
  const { x, w, h } = prepare;
  const colours = ink();
  const height = h / (lanes.length + 1);
  const at = (t: number) => placeOf(t, total, w);
  x.fillStyle = colours.of("sunk");
  x.fillRect(0, 0, NAMES, h);
  x.fillRect(at(now), 0, w, h);
  lanes.forEach((lane, k) => {
    const [top, bottom] = [k * height + 3, (k + 1) * height - 3];
    x.fillStyle = colours.of("ink-3");
    x.fillText(lane.name, 12, (top + bottom) / 2);
    x.strokeStyle = colours.of("line");
    x.beginPath();
    x.moveTo(0, Math.round((k + 1) * height) - 0.5);
    x.lineTo(w, Math.round((k + 1) * height) - 0.5);
    x.stroke();
    lane.phases?.forEach((phase) => drawPhase(x, phase, at, top, bottom, now, total));
    lane.spans?.forEach((span) => drawSpan(x, span, at, top, bottom, lane.colour ?? "person"));
    x.fillStyle = colours.of("ink-2");
    lane.ticks?.forEach((t) => x.fillRect(Math.round(at(t)), top, 1.5, bottom - top));
    x.fillStyle = colours.of("accent");
    lane.dots?.forEach((t) => {
      x.beginPath();
      x.arc(at(t), (top + bottom) / 2, 3.2, 0, 7);
      x.fill();
    });
  });
  axis(x, at, now, total, w, h - height / 2);
}

/** The position of a time on a timeline of this width [px]; a time before the start is placed at the start, not on the names. */
export function placeOf(t: number, total: number, width: number): number {
  return NAMES + (Math.max(0, t) / total) * (width - NAMES);
}

function drawPhase(x: CanvasRenderingContext2D, phase: Phase, at: (t: number) => number, top: number, bottom: number, now: number, total: number): void {
  const colours = ink();
  const [left, right] = [at(phase.from), at(Math.min(total, phase.to ?? Math.max(now, phase.from)))];
  if (right - left < 1) return;
  x.beginPath();
  x.roundRect(left + 0.5, top, Math.max(2, right - left - 1.5), bottom - top, 3);
  x.strokeStyle = colours.of("line-strong");
  x.fillStyle = colours.of(phase.state === "done" ? "line" : phase.state === "now" ? "panel" : "sunk");
  x.fill();
  if (phase.state !== "done") {
    x.setLineDash([3, 2]);
    x.stroke();
    x.setLineDash([]);
  }
  x.save();
  x.clip();
  if (phase.state === "now") {
    x.fillStyle = colours.of("ink");
    x.fillRect(left, top, at(now) - left, bottom - top);
  }
  const room = (phase.state === "now" ? at(now) : right) - left;
  x.fillStyle = colours.of(phase.state === "now" ? "ink-inv" : phase.state === "next" ? "ink-2" : "ink");
  if (x.measureText(phase.name).width + 10 < room) x.fillText(phase.name, left + 6, (top + bottom) / 2);
  x.restore();
}

function drawSpan(x: CanvasRenderingContext2D, span: LaneSpan, at: (t: number) => number, top: number, bottom: number, colour: string): void {
  const colours = ink();
  const [left, right] = [at(span.from), Math.max(at(span.from) + 3, at(span.to))];
  const middle = (top + bottom) / 2;
  if (span.kind === "here") {
    x.globalAlpha = 0.42;
    x.fillStyle = colours.of(colour);
    x.fillRect(left, top, right - left, bottom - top);
    x.globalAlpha = 1;
  } else if (span.kind === "span") {
    x.fillStyle = colours.of("accent");
    x.globalAlpha = 0.3;
    x.fillRect(left, top, right - left, bottom - top);
    x.globalAlpha = 1;
    x.fillRect(left, bottom - 2, right - left, 2);
  } else if (span.kind === "gap") {
    x.fillStyle = colours.of("panel");
    x.fillRect(left, top, right - left, bottom - top);
    x.strokeStyle = colours.of("line-strong");
    x.strokeRect(Math.round(left) + 0.5, top + 0.5, right - left - 1, bottom - top - 1);
  } else {
    x.fillStyle = colours.of(span.kind === "act" ? "act" : "degraded");
    x.fillRect(left, span.kind === "act" ? top : middle + 0.75, right - left, (bottom - top) / 2 - 0.75);
  }
}

function axis(x: CanvasRenderingContext2D, at: (t: number) => number, now: number, total: number, w: number, y: number): void {
  const colours = ink();
  const step = [10, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200].find((each) => total / each <= 10) ?? 14_400;
  x.textAlign = "center";
  x.fillStyle = colours.of("ink-3");
  for (let t = 0; t <= total; t += step) {
    const half = x.measureText(clock(t)).width / 2;
    const place = Math.min(w - half - 2, Math.max(NAMES + half + 2, at(t)));
    if (Math.abs(place - at(now)) > 42) x.fillText(clock(t), place, y);
  }
  x.fillStyle = colours.of("ink");
  x.fillRect(at(now), 0, 1.5, y + 8);
  const text = clock(now);
  const width = x.measureText(text).width + 12;
  const left = Math.min(w - width, at(now) - width / 2);
  x.beginPath();
  x.roundRect(left, y - 8, width, 16, 3);
  x.fill();
  x.fillStyle = colours.of("panel");
  x.fillText(text, left + width / 2, y);
  x.textAlign = "left";
}
