import { ink, prepared } from "./canvas";

/** A position of a robot, with the signal level of its link there [dBm]. */
export interface Spot {
  t: number;
  x: number;
  y: number;
  dbm: number | undefined;
}

/** With more robots than this, only those in need are labelled. */
const NAMED = 16;

/** The longest time between two positions that are connected by a line [s]. */
const GAP_SECS = 3;

/** A robot on the map. */
export interface Placed {
  id: string;
  trail: readonly Spot[];
  state: "online" | "watch" | "needs" | "offline" | "never";
  /** The text beside its name: how long ago it was there. */
  note: string;
}

/** Draws robots with their trails; the dots are larger where the Wi-Fi was better. */
export function drawMap(canvas: HTMLCanvasElement, robots: readonly Placed[], spots: readonly Spot[]): void {
  const prepare = prepared(canvas);
  if (!prepare) return;
  const { x, w, h } = prepare;
  const colours = ink();
  const all = [...spots, ...robots.flatMap((each) => each.trail)];
  x.fillStyle = colours.of("sunk");
  x.strokeStyle = colours.of("line-strong");
  x.lineWidth = 1.5;
  x.fillRect(1, 1, w - 2, h - 2);
  x.strokeRect(1, 1, w - 2, h - 2);
  if (all.length === 0) return;
  const [x0, x1] = [Math.min(...all.map((each) => each.x)), Math.max(...all.map((each) => each.x))];
  const [y0, y1] = [Math.min(...all.map((each) => each.y)), Math.max(...all.map((each) => each.y))];
  const margin = 34;
  const scale = Math.min((w - 2 * margin) / Math.max(2, x1 - x0), (h - 2 * margin) / Math.max(2, y1 - y0));
  const at = (v: number) => w / 2 + (v - (x0 + x1) / 2) * scale;
  const up = (v: number) => h / 2 - (v - (y0 + y1) / 2) * scale;
  x.fillStyle = colours.of("robot");
  x.globalAlpha = 0.22;
  for (const spot of spots) {
    if (spot.dbm === undefined) continue;
    x.beginPath();
    x.arc(at(spot.x), up(spot.y), Math.max(0.8, Math.min(4.5, (spot.dbm + 88) / 9)), 0, 7);
    x.fill();
  }
  x.globalAlpha = 1;
  length(x, scale, h);
  robots.forEach((robot) => trail(x, robot, at, up));
  const inNeed = (robot: Placed) => robot.state !== "online";
  // Robots in need last, so that they are on top.
  const ordered = [...robots].sort((a, b) => Number(inNeed(a)) - Number(inNeed(b)));
  const isNamed = (robot: Placed) => robots.length <= NAMED || inNeed(robot);
  ordered.forEach((robot) => marker(x, robot, at, up, isNamed(robot) ? 6.5 : 4.5));
  const places = ordered.flatMap((robot) => robot.trail.at(-1) ?? []);
  const taken = places.map((spot): Taken => [at(spot.x) - 7, up(spot.y), 14]);
  ordered.filter(isNamed).forEach((robot) => named(x, robot, at, up, w, taken));
}

/** A length scale at the lower left. */
function length(x: CanvasRenderingContext2D, scale: number, h: number): void {
  const metres = [0.5, 1, 2, 5, 10, 20, 50, 100].find((each) => each * scale >= 36) ?? 200;
  const colours = ink();
  x.fillStyle = colours.of("ink-3");
  x.fillRect(12, h - 12, metres * scale, 1.5);
  x.fillText(`${metres} m`, 16 + metres * scale, h - 12);
}

function trail(x: CanvasRenderingContext2D, robot: Placed, at: (v: number) => number, up: (v: number) => number): void {
  x.strokeStyle = ink().of("robot");
  x.lineWidth = 1.4;
  x.lineCap = "round";
  robot.trail.forEach((spot, k) => {
    const before = robot.trail[k - 1];
    if (!before || spot.t - before.t > GAP_SECS) return;
    x.globalAlpha = ((robot.state === "offline" ? 0.35 : 0.8) * k) / robot.trail.length;
    x.beginPath();
    x.moveTo(at(before.x), up(before.y));
    x.lineTo(at(spot.x), up(spot.y));
    x.stroke();
  });
  x.globalAlpha = 1;
}

function marker(x: CanvasRenderingContext2D, robot: Placed, at: (v: number) => number, up: (v: number) => number, radius: number): void {
  const spot = robot.trail.at(-1);
  if (!spot) return;
  const colours = ink();
  const [px, py] = [at(spot.x), up(spot.y)];
  const isOff = robot.state === "offline" || robot.state === "never";
  const isBad = isOff || robot.state === "needs";
  x.lineWidth = 1.6;
  x.beginPath();
  x.arc(px, py, radius, 0, 7);
  if (isOff) {
    x.fillStyle = colours.of("panel");
    x.strokeStyle = colours.of("act");
    x.setLineDash([3, 2.4]);
    x.fill();
    x.stroke();
    x.setLineDash([]);
    cross(x, px, py, radius * 0.34);
  } else {
    x.fillStyle = colours.of(isBad ? "act" : "robot");
    x.strokeStyle = colours.of("panel");
    x.fill();
    x.stroke();
    heading(x, robot, px, py, radius);
  }
}

/** An occupied area: its left, its vertical middle and its width [px]. */
type Taken = [number, number, number];

/** Writes a robot's name beside it, if there is room. */
function named(x: CanvasRenderingContext2D, robot: Placed, at: (v: number) => number, up: (v: number) => number, w: number, taken: Taken[]): void {
  const spot = robot.trail.at(-1);
  if (!spot) return;
  const colours = ink();
  const [px, py, radius] = [at(spot.x), up(spot.y), 6.5];
  const isBad = robot.state !== "online" && robot.state !== "watch";
  x.font = ink().font(600);
  const width = x.measureText(robot.id).width;
  const isLeft = px + radius + 6 + width > w - 4;
  const left = isLeft ? px - radius - 5 - width : px + radius + 5;
  const isTaken = (at: number) => taken.some(([a, b, c]) => Math.abs(b - at) < 12 && a < left + width && a + c > left);
  const y = [0, 13, -13, 26, -26, 39].map((shift) => py + shift).find((at) => !isTaken(at)) ?? py;
  taken.push([left, y, width]);
  x.lineWidth = 3;
  x.strokeStyle = colours.of("sunk");
  x.lineJoin = "round";
  x.strokeText(robot.id, left, y);
  x.fillStyle = colours.of(isBad ? "act" : "ink");
  x.fillText(robot.id, left, y);
  x.font = ink().font();
  if (robot.note && !isLeft) {
    x.fillStyle = colours.of("ink-2");
    x.fillText(robot.note, left + width + 4, y);
  }
}

function cross(x: CanvasRenderingContext2D, px: number, py: number, e: number): void {
  x.beginPath();
  x.moveTo(px - e, py - e);
  x.lineTo(px + e, py + e);
  x.moveTo(px + e, py - e);
  x.lineTo(px - e, py + e);
  x.stroke();
}

function heading(x: CanvasRenderingContext2D, robot: Placed, px: number, py: number, radius: number): void {
  const [before, last] = [robot.trail.at(-4), robot.trail.at(-1)];
  if (!before || !last || Math.hypot(last.x - before.x, last.y - before.y) < 0.01) return;
  x.save();
  x.translate(px, py);
  x.rotate(-Math.atan2(last.y - before.y, last.x - before.x));
  x.fillStyle = ink().of("panel");
  x.beginPath();
  x.moveTo(radius * 0.55, 0);
  x.lineTo(-radius * 0.35, -radius * 0.45);
  x.lineTo(-radius * 0.35, radius * 0.45);
  x.fill();
  x.restore();
}
