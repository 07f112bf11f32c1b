import type { Model } from "../store/model";
import type { Stream } from "../wire";
import { alertsOf, type Alert } from "./alerts";
import { age, byName, clock, decimal } from "./format";
import { light, type Light } from "./people";
import { isHappening } from "./words";

/** The age above which a value is not current [s]. */
const OLD_SECS = 10;

/** A value of a robot with its age; `undefined` if unknown. */
export interface Known {
  value: number;
  sigma: number | undefined;
  ageSecs: number;
  stream: Stream;
  channel: number;
}

export interface Robot {
  id: string;
  state: "online" | "watch" | "needs" | "offline" | "never";
  /** The state in a word or two, with its duration. */
  word: string;
  lights: Light[];
  okLights: number;
  battery: Known | undefined;
  emptySecs: Known | undefined;
  powerW: Known | undefined;
  linkDbm: Known | undefined;
  linkQuality: number | undefined;
  speed: Known | undefined;
  lost: number | undefined;
  deployedSecs: number | undefined;
  alerts: Alert[];
  x: Known | undefined;
  y: Known | undefined;
}

/** Every robot of the session, sorted by name; none is ever removed. */
export function robots(model: Model, now: number): Robot[] {
  const ids = new Map<string, Stream[]>();
  for (const stream of model.streams.values()) {
    if (stream.about !== "robot" || !stream.subject) continue;
    ids.set(stream.subject, [...(ids.get(stream.subject) ?? []), stream]);
  }
  const alerts = alertsOf(model, now);
  return [...ids].sort(([a], [b]) => byName(a, b)).map(([id, own]) => robot(model, id, own, alerts, now));
}

function robot(model: Model, id: string, own: Stream[], alerts: Alert[], now: number): Robot {
  const sensors = own.filter((each) => !each.derived && !each.beside && !isHappening(each));
  const lights = sensors.map((stream) => light(model, stream));
  const mine = alerts.filter((each) => each.subject === id && each.stage === "open");
  const online = feature(model, own, "deployment", "online", now);
  const deployed = feature(model, own, "deployment", "deployed_secs", now);
  const silent = feature(model, own, "deployment", "age_secs", now);
  const isNever = online === undefined && lights.every((each) => each.state === "never");
  const isOffline = online?.value === 0 || mine.some((each) => each.cause === "offline");
  const losses = sensors.map((each) => model.health.get(each.id)?.lost_source);
  const known = losses.filter((each): each is number => typeof each === "number");
  const base = {
    id,
    lights,
    okLights: lights.filter((each) => each.state === "ok").length,
    battery: feature(model, own, "use", "fraction_left", now) ?? reading(model, own, "battery", "percentage", now),
    emptySecs: feature(model, own, "use", "empty_in_secs", now),
    powerW: feature(model, own, "use", "power_w", now),
    linkDbm: feature(model, own, "quality", "rssi_median", now) ?? reading(model, own, "link", "signal_level", now),
    linkQuality: feature(model, own, "quality", "quality", now)?.value,
    speed: reading(model, own, "odometry", "twist.twist.linear.x", now),
    lost: known.length > 0 ? known.reduce((sum, each) => sum + each, 0) : undefined,
    deployedSecs: deployed?.value,
    alerts: mine,
    x: reading(model, own, "odometry", "pose.pose.position.x", now),
    y: reading(model, own, "odometry", "pose.pose.position.y", now),
  };
  if (isNever) return { ...base, state: "never", word: "never seen" };
  if (isOffline) return { ...base, state: "offline", word: `OFFLINE ${clock(silent?.value ?? oldest(mine))}` };
  const worst = mine.find((each) => each.urgency !== "note");
  if (worst) {
    const state = worst.urgency === "act" ? "needs" : "watch";
    return { ...base, state, word: `${worst.short} ${clock(worst.waitsSecs)}` };
  }
  return { ...base, state: "online", word: online ? `online ${clock(deployed?.value ?? 0)}` : "?" };
}

function oldest(alerts: Alert[]): number {
  return Math.max(0, ...alerts.map((each) => each.waitsSecs));
}

/** The newest value of a channel of a family, from the shortest window that has one. */
function feature(model: Model, own: Stream[], family: string, name: string, now: number): Known | undefined {
  for (const stream of own.filter((each) => each.family === family && each.shape === "feature")) {
    const channel = stream.channels.findIndex((each) => each.name === name);
    const last = channel < 0 ? undefined : model.last(stream.id, channel);
    if (!last) continue;
    const sigma = model.features.get(stream.id)?.sigmas[channel] ?? undefined;
    return { value: last.value, sigma, ageSecs: now - last.t, stream, channel };
  }
  return undefined;
}

function reading(model: Model, own: Stream[], signal: string, name: string, now: number): Known | undefined {
  for (const stream of own.filter((each) => each.signal === signal && !each.derived)) {
    const channel = stream.channels.findIndex((each) => each.name === name);
    const newest = channel < 0 ? undefined : model.readings.get(stream.id);
    const value = newest?.values[channel];
    if (newest && typeof value === "number") return { value, sigma: undefined, ageSecs: now - newest.t, stream, channel };
  }
  return undefined;
}

/** Whether a value is current. */
export function isFresh(known: Known | undefined): known is Known {
  return known !== undefined && known.ageSecs <= OLD_SECS;
}

/** The quality of a link, as a word and as a number of bars out of four. */
export function linkWords(robot: Robot): { bars: 0 | 1 | 2 | 3 | 4; word: string } {
  if (!isFresh(robot.linkDbm) || robot.state === "offline") return { bars: 0, word: "no link" };
  const dbm = robot.linkDbm.value;
  if (robot.lost !== undefined && robot.lost > 0 && dbm < -70) return { bars: 1, word: `${robot.lost} lost` };
  if (dbm >= -50) return { bars: 4, word: "strong" };
  if (dbm >= -62) return { bars: 3, word: "good" };
  return dbm >= -75 ? { bars: 2, word: "fair" } : { bars: 1, word: "weak" };
}

/** The speed of a robot, in words. */
export function speedWords(robot: Robot): string {
  if (!isFresh(robot.speed)) return "–";
  const speed = Math.abs(robot.speed.value);
  return speed < 0.01 ? "stopped" : `${decimal(speed, 2)} m/s`;
}

/** The age of a value, if it should be shown. */
export function ageWords(known: Known | undefined): string {
  return known && known.ageSecs > OLD_SECS ? `${age(known.ageSecs)} ago` : "";
}
