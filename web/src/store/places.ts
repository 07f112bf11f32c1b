import type { Spot } from "../draw/map";
import { isFresh, robots, type Robot } from "../view/robots";
import { live } from "./live.svelte";

/** The duration of a trail [s], and the spacing of kept spots [m]. */
const TRAIL_SECS = 60;
const APART_M = 0.25;
const MOST_SPOTS = 1500;

const trails = new Map<string, Spot[]>();
const spots = new Map<string, Spot>();

/** Records the current position of each robot. */
export function follow(all: readonly Robot[]): void {
  for (const robot of all) {
    if (!robot.x || !robot.y) continue;
    const t = live.now() - robot.x.ageSecs;
    const trail = trails.get(robot.id) ?? [];
    const last = trail.at(-1);
    if (last && t < last.t - 1) forget();
    if (last && Math.abs(t - last.t) < 0.2) continue;
    const dbm = isFresh(robot.linkDbm) ? robot.linkDbm.value : undefined;
    const spot = { t, x: robot.x.value, y: robot.y.value, dbm };
    trail.push(spot);
    trails.set(robot.id, trail.filter((each) => t - each.t <= TRAIL_SECS));
    const cell = `${Math.round(spot.x / APART_M)} ${Math.round(spot.y / APART_M)}`;
    if (spots.size < MOST_SPOTS || spots.has(cell)) spots.set(cell, spot);
  }
}

/** Forgets all positions, as another moment of a recording is shown. */
function forget(): void {
  trails.clear();
  spots.clear();
}

/** The positions of a robot over the last minute. */
export function trailOf(id: string): readonly Spot[] {
  return trails.get(id) ?? [];
}

/** The Wi-Fi level along the paths of the robots. */
export function heardSpots(): Spot[] {
  return [...spots.values()];
}

setInterval(() => follow(robots(live.model, live.now())), 250);
