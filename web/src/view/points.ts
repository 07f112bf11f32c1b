import type { Model } from "../store/model";
import type { Values } from "../store/moments";
import type { Stream } from "../wire";

/** A landmark in a picture. */
export interface Point {
  name: string;
  /** The position in pixels of the camera's frame; the centre of the first pixel is 0, 0. */
  x: number;
  y: number;
}

/** The landmarks that a stream found in a picture. */
export interface Found {
  points: Point[];
  /** Lines between points that belong together. */
  lines: Point[][];
  box: { left: number; top: number; width: number; height: number } | undefined;
}

/** Points with a lower score are not shown. */
export const LEAST_SCORE = 0.3;

/** Half a frame period if no rate is known, and its upper limit [s]. */
const [USUAL_HALF_SECS, LONGEST_HALF_SECS] = [1 / 60, 0.25];

/** Lines between the points on one side of a body, named as in COCO and MediaPipe. */
const OF_A_SIDE = [
  ["shoulder", "elbow"], ["elbow", "wrist"], ["wrist", "pinky"], ["wrist", "index"], ["wrist", "thumb"], ["shoulder", "hip"], ["hip", "knee"],
  ["knee", "ankle"], ["ankle", "heel"], ["heel", "foot_index"], ["ankle", "foot_index"], ["eye", "ear"],
] as const;
/** Lines from one side to the other, and from the middle to each side. */
const ACROSS = ["shoulder", "hip"] as const;
const SIDES = ["left", "right"] as const;
const BONES: readonly (readonly [string, string])[] = [
  ...SIDES.flatMap((side) => OF_A_SIDE.map(([from, to]) => [`${side}_${from}`, `${side}_${to}`] as const)),
  ...ACROSS.map((part) => [`left_${part}`, `right_${part}`] as const),
  ...SIDES.map((side) => ["nose", `${side}_eye`] as const),
  ["mouth_left", "mouth_right"],
];
/** The points around an eye, named as in hri_msgs. */
const LIDS = ["outside", "top_1", "top_2", "inside", "bottom_1", "bottom_2"];

/** The channel indices of the points and the box of a stream; −1 for a missing channel. */
interface Layout {
  points: { name: string; x: number; y: number; score: number }[];
  box: number[] | undefined;
}
const layouts = new WeakMap<Stream, Layout>();

function layout(stream: Stream): Layout {
  const known = layouts.get(stream);
  if (known) return known;
  const place = new Map(stream.channels.map(({ name }, k) => [name, k]));
  const at = (name: string) => place.get(name) ?? -1;
  const points = stream.channels.flatMap(({ name, unit }, x) => {
    const of = name.slice(0, -2);
    return name.endsWith("_x") && unit === "px" && at(`${of}_y`) >= 0 ? [{ name: of, x, y: at(`${of}_y`), score: at(`${of}_score`) }] : [];
  });
  const sides = ["left", "top", "width", "height"].map(at);
  const found = { points, box: sides.every((side) => side >= 0 && stream.channels[side]?.unit === "px") ? sides : undefined };
  layouts.set(stream, found);
  return found;
}

/** The streams of landmarks in the pictures of a camera, as far as this viewer may see them. */
export function pointStreams(model: Model, camera: Stream): Stream[] {
  const all = [...model.streams.values()].filter((each) => !each.hidden && !each.derived && each.shape === "sample" && each.inputs.length === 1 && each.inputs[0] === camera.name);
  return all.filter((each) => layout(each).points.length > 0 || layout(each).box !== undefined);
}

/** The largest time between a picture and its landmarks [s]: half a frame period. */
export function halfPeriod(model: Model, camera: Stream): number {
  const rate = model.health.get(camera.id)?.rate_hz || camera.rate_hz;
  return rate > 0 ? Math.min(0.5 / rate, LONGEST_HALF_SECS) : USUAL_HALF_SECS;
}

/** The points of a sample with a sufficient score; `undefined` if nothing was found. */
export function found(stream: Stream, values: Values): Found | undefined {
  const { points: places, box: sides } = layout(stream);
  const number = (place: number) => values[place] ?? undefined;
  const points = places.flatMap(({ name, x, y, score }): Point[] => {
    const [at, below, certain] = [number(x), number(y), number(score)];
    return at === undefined || below === undefined || (certain ?? 1) < LEAST_SCORE ? [] : [{ name, x: at, y: below }];
  });
  const [left, top, width, height] = (sides ?? []).map(number);
  const box = left === undefined || top === undefined || width === undefined || height === undefined ? undefined : { left, top, width, height };
  if (points.length === 0 && !box) return undefined;
  const byName = new Map(points.map((each) => [each.name, each]));
  return { points, lines: [...(stream.signal === "body" ? bones(byName) : []), ...lids(byName)], box };
}

function bones(points: Map<string, Point>): Point[][] {
  return BONES.flatMap((names) => {
    const ends = names.flatMap((name) => points.get(name) ?? []);
    return ends.length === 2 ? [ends] : [];
  });
}

/** The outline of each eye whose lids were found. */
function lids(points: Map<string, Point>): Point[][] {
  return SIDES.flatMap((side) => {
    const around = LIDS.flatMap((part) => points.get(`${side}_eye_${part}`) ?? []);
    return around.length === LIDS.length ? [outline(around)] : [];
  });
}

/** Sorts points by their angle around the centre and closes the outline, so that no lines cross, however the lids are numbered. */
function outline(points: Point[]): Point[] {
  const middle = (of: (point: Point) => number) => points.reduce((sum, point) => sum + of(point), 0) / points.length;
  const [x, y] = [middle((point) => point.x), middle((point) => point.y)];
  const sorted = [...points].sort((a, b) => Math.atan2(a.y - y, a.x - x) - Math.atan2(b.y - y, b.x - x));
  return [...sorted, ...sorted.slice(0, 1)];
}

/** What was found, in words: `body, face`. */
export function foundWords(streams: readonly Stream[]): string {
  return [...new Set(streams.map((each) => ({ body: "body", face: "face" })[each.signal] ?? each.name.split("/").at(-1) ?? ""))].join(", ");
}
