import type { Model } from "../store/model";
import type { Event } from "../wire";
import { age, byName, significant } from "./format";
import { isHappening, remedy, sensorName } from "./words";

/** How long an alert stays listed after it is over [s]. */
const OVER_SECS = 60;

/** A problem that needs attention. */
export interface Alert {
  /** The alert's label in the bag, by which it is acknowledged. */
  key: string;
  subject: string;
  /** The cause as in the bag: `offline`, `poor link`. */
  cause: string;
  urgency: "act" | "soon" | "note";
  stage: "open" | "acknowledged" | "answered" | "over";
  /** Whether it is unknown if the problem persists, as no value arrives. */
  unknown: boolean;
  /** The first sentence: what happened. */
  what: string;
  /** The cause, in a sentence. */
  why: string;
  remedy: string;
  /** The problem in a word or two, for a tile. */
  short: string;
  since: number;
  waitsSecs: number;
  /** Who acknowledged the alert, and when [s]. */
  seen: { who: string; t: number } | undefined;
}

interface Cause {
  what: (robot: string) => string;
  short: string;
  remedy: string;
}

/** THE table of causes; the first whose pattern fits. */
const CAUSES: readonly [RegExp, Cause][] = [
  [/^offline/, { what: (robot) => `${robot} is offline.`, short: "offline", remedy: "Check its power first, then its Wi-Fi." }],
  [/empty within/, { what: (robot) => `${robot} will be empty soon.`, short: "empty soon", remedy: "Send it home, or bring a battery." }],
  [/^battery below/, { what: (robot) => `${robot} has a low battery.`, short: "low battery", remedy: "Send it home, or bring a battery." }],
  [/^diagnostics/, { what: (robot) => `${robot} reports an error.`, short: "error", remedy: "Read its diagnostics on Health." }],
  [/link/, { what: (robot) => `${robot} has a weak link.`, short: "weak link", remedy: "Bring it closer, or send a robot that is closer." }],
  [/is stuck$/, { what: (robot) => `${robot} has a sensor that is stuck.`, short: "stuck", remedy: "It keeps repeating the same value. Restart its driver." }],
];

const UNKNOWN: Cause = { what: (robot) => `${robot} needs someone.`, short: "needs you", remedy: "" };

/** All alerts that matter now, the most urgent and the oldest first. */
export function alertsOf(model: Model, now: number): Alert[] {
  const seen = acknowledgements(model);
  const all = [...concluded(model, now), ...faults(model, now), ...ofSensors(model, now)];
  const alerts = all.map((alert) => acknowledged(alert, seen.get(alert.key)));
  return alerts.sort((a, b) => rank(a) - rank(b) || a.since - b.since || byName(a.subject, b.subject));
}

function rank(alert: Alert): number {
  const stages = { open: 0, acknowledged: 10, answered: 20, over: 30 };
  return stages[alert.stage] + ["act", "soon", "note"].indexOf(alert.urgency);
}

function acknowledgements(model: Model): Map<string, { who: string; t: number }> {
  const seen = new Map<string, { who: string; t: number }>();
  for (const { request, t } of model.events) {
    if (request?.verb === "acknowledge") seen.set(request.text, { who: request.who, t });
  }
  return seen;
}

function acknowledged(alert: Alert, seen: Alert["seen"]): Alert {
  const counts = seen !== undefined && seen.t >= alert.since - 1;
  return counts && alert.stage === "open" ? { ...alert, stage: "acknowledged", seen } : alert;
}

/** The course of an alert, from the event that raised it to its newest event. */
export interface Course {
  raised: Event;
  newest: Event;
}

/** The alerts on the alert streams, one for each time that a cause began. */
export function courses(model: Pick<Model, "events">): Course[] {
  const all: Course[] = [];
  const open = new Map<string, Course>();
  for (const event of model.events) {
    if (!event.alert) continue;
    const key = `${event.stream} ${event.alert.who} ${event.alert.why}`;
    const before = open.get(key);
    // An alert that was unknown for a while and continues is the same alert.
    if (before && !(event.alert.stage === "raised" && before.newest.alert?.stage !== "unknown")) before.newest = event;
    else {
      const course = { raised: event, newest: event };
      all.push(course);
      open.set(key, course);
    }
    if (event.alert.stage === "over") open.delete(key);
  }
  return all;
}

/** The state of the alerts: the newest event of each cause. */
function concluded(model: Model, now: number): Alert[] {
  const newest = new Map<string, Course>();
  for (const course of courses(model)) {
    const alert = course.newest.alert;
    if (alert) newest.set(`${course.newest.stream} ${alert.who} ${alert.why}`, course);
  }
  return [...newest.values()].flatMap((course) => {
    const { alert, t } = course.newest;
    // An answered alert lasts until its cause has ended.
    if (!alert || (alert.stage === "over" && now - t > OVER_SECS)) return [];
    const stage = alert.stage === "over" ? "over" : alert.stage === "answered" ? "answered" : "open";
    return [ofCourse(model, course, stage, now)];
  });
}

function ofCourse(model: Model, { raised, newest }: Course, stage: Alert["stage"], now: number): Alert {
  const { who, why: cause, tier } = raised.alert ?? { who: "", why: "", tier: "soon" };
  const isOfStudy = raised.alert?.is_of_study === true;
  const words = isOfStudy ? ofStudy(cause) : (CAUSES.find(([pattern]) => pattern.test(cause))?.[1] ?? UNKNOWN);
  const unknown = newest.alert?.stage === "unknown";
  const lost = unknown ? ` No value for ${age(now - newest.t)}.` : "";
  return {
    key: raised.label, subject: who, cause, urgency: isUrgency(tier) ? tier : "soon", stage, unknown, what: words.what(who),
    why: stage === "over" ? "It is over." : `${isOfStudy ? measured(cause, raised) : reason(model, who, cause)}${lost}`,
    remedy: stage === "over" ? "" : unknown ? "It is unknown whether it persists. Check the sensor." : words.remedy,
    short: words.short, since: raised.t, waitsSecs: Math.max(0, now - raised.t), seen: undefined,
  };
}

function isUrgency(tier: string): tier is Alert["urgency"] {
  return tier === "act" || tier === "soon" || tier === "note";
}

/** The text of the study, if there is one, and the value with its limit. */
const OF_STUDY = /^(.*) \((.* (?:above|below) .*)\)$/;

/** An alert that the study defines. */
function ofStudy(cause: string): Cause {
  const text = OF_STUDY.exec(cause)?.[1];
  const what = (who: string) => (text ? `${who}: ${text}.` : `${who} is beyond a limit of the study.`);
  return { what, short: text ?? "beyond a limit", remedy: "" };
}

function measured(cause: string, raised: Event): string {
  const number = OF_STUDY.exec(cause)?.[2] ?? cause;
  const value = raised.value === null ? "" : `, ${significant(raised.value)} when it began`;
  return `${number}${value}.`;
}

function reason(model: Model, robot: string, cause: string): string {
  if (cause !== "offline") return `${cause.charAt(0).toUpperCase()}${cause.slice(1)}.`;
  const own = [...model.streams.values()].filter((each) => each.about === "robot" && each.subject === robot && !each.derived && !isHappening(each));
  const ages = own.flatMap((each) => model.health.get(each.id)?.age_secs ?? []);
  return ages.length > 0 ? `Silent for ${age(Math.min(...ages))} on all ${own.length} streams.` : "Silent.";
}

/** Faults in the session itself. */
function faults(model: Model, now: number): Alert[] {
  const own = model.byName.get("/session/events");
  return model.events
    .filter((event) => event.kind === "fault" && event.stream === own?.id)
    .map((event) => ({
      key: event.label, subject: "teampulse", cause: "fault", urgency: "act", stage: "open", unknown: false, what: "A part of teampulse failed.",
      why: `${event.label}.`, remedy: "The rest continues. See the log in the terminal.", short: "fault", since: event.t,
      waitsSecs: Math.max(0, now - event.t), seen: undefined,
    }));
}

/** Sensors of people that delivered data and are silent now. */
function ofSensors(model: Model, now: number): Alert[] {
  return [...model.streams.values()].flatMap((stream) => {
    const health = model.health.get(stream.id);
    const isSensor = stream.about === "person" && !stream.derived && !stream.beside && !isHappening(stream) && !stream.hidden;
    if (!isSensor || stream.signal === "other" || health?.state !== "dead" || health.age_secs === null) return [];
    const name = sensorName(stream);
    const since = now - health.age_secs;
    const alert: Alert = {
      key: `${stream.name} is silent`, subject: stream.subject, cause: "silent", urgency: "act", stage: "open", unknown: false,
      what: `${stream.subject}: ${name} is silent.`, why: `Nothing for ${age(health.age_secs)}.`,
      remedy: remedy(stream, health), short: `${name} silent`, since, waitsSecs: health.age_secs, seen: undefined,
    };
    return [alert];
  });
}

/** The number of unacknowledged alerts by urgency, and how long the oldest has waited [s]. */
export function waiting(alerts: readonly Alert[]): { act: number; soon: number; oldestSecs: number } {
  const open = alerts.filter((each) => each.stage === "open");
  const count = (urgency: Alert["urgency"]) => open.filter((each) => each.urgency === urgency).length;
  return { act: count("act"), soon: count("soon"), oldestSecs: Math.max(0, ...open.filter((each) => each.urgency !== "note").map((each) => each.waitsSecs)) };
}
