import { expect, test, vi } from "vitest";
import { SessionClock } from "../src/store/clock";
import { Model } from "../src/store/model";
import { Pictures, readPicture } from "../src/store/pictures";
import { stored } from "../src/store/stored";
import { Track } from "../src/store/track";
import { Wants } from "../src/store/wants";
import { readWave } from "../src/store/wave";
import type { Event, Hello } from "../src/wire";

test("a clock is placed by its shortest probes, and a slow answer does not move it", () => {
  const clock = new SessionClock();
  expect(clock.at(0)).toBeUndefined();
  clock.take(1000, 1002, 51.001, 51.001);
  clock.take(2000, 2900, 52.8, 52.8);
  expect(clock.at(1000)).toBeCloseTo(51, 6);
  expect(clock.uncertaintyMs).toBeCloseTo(1, 6);
});

test("a track keeps the newest points in order, and earlier ones are put before them", () => {
  const track = new Track(4);
  for (let k = 0; k < 20; k += 1) track.push(k, 10 * k);
  track.push(3, 99);
  expect([...track.times]).toEqual([16, 17, 18, 19]);
  expect([...track.values]).toEqual([160, 170, 180, 190]);
  expect(track.indexAt(17.5)).toBe(2);
  expect(track.at(17.5, 1)).toBe(170);
  expect(track.at(30, 1)).toBeUndefined();
  const later = new Track(10);
  later.push(5, 5);
  later.prepend([1, 2, 5, 6], [1, Number.NaN, 7, 8]);
  expect([...later.times]).toEqual([1, 2, 5]);
  expect(later.at(5, 1)).toBe(5);
});

test("beats are forgotten with the signal that they were found in", () => {
  const model = new Model();
  model.hello = { stored_secs: 600 } as Hello;
  for (let t = 1; t <= 7200; t += 1) {
    const beat = { number: t, stream: 3, kind: "beat", t, label: "" } as Event;
    model.apply({ type: "events", events: [beat] });
  }
  const times = model.body.get(3)?.map((beat) => beat.t) ?? [];
  expect(times.at(-1)).toBe(7200);
  expect(times.length).toBeGreaterThanOrEqual(600);
  expect(times.length).toBeLessThanOrEqual(900);
});

test("a frame that is not whole is no wave", () => {
  const frame = new ArrayBuffer(24 + 8);
  const head = new DataView(frame);
  head.setUint32(0, 7, true);
  head.setUint32(4, 2, true);
  head.setFloat64(8, 1.5, true);
  head.setFloat64(16, 0.25, true);
  head.setFloat32(24, 1, true);
  head.setFloat32(28, -2, true);
  expect(readWave(frame)).toEqual({ stream: 7, channels: 2, start: 1.5, period: 0.25, samples: new Float32Array([1, -2]) });
  expect(readWave(frame.slice(0, 28))).toBeUndefined();
  expect(readWave(new ArrayBuffer(3))).toBeUndefined();
});

test("of several that draw a stream the finest decides", () => {
  const wants = new Wants(() => undefined);
  const release = wants.want(3, 100);
  wants.want(3, 20);
  expect(wants.all()).toEqual([{ stream: 3, points_per_sec: 100, with_points: false }]);
  wants.want(3, 0, true);
  expect(wants.all()).toEqual([{ stream: 3, points_per_sec: 0, with_points: true }]);
  release();
  expect(wants.all()).toHaveLength(1);
});

test("columns between the values of a slow stream are no gaps, and a long silence is one", () => {
  const mean = [1, null, null, null, 2, null, null, null, null, null, null, null, null, null, null, null, null, 3];
  const reply = { reference: "", stream: 0, from: 0, step: 0.25, channels: [{ min: mean, max: mean, mean }] };
  expect(stored(reply, 0, 1).values.map((each) => (Number.isNaN(each) ? "gap" : each))).toEqual([1, 2, 3]);
  expect(stored(reply, 0, 4).values.map((each) => (Number.isNaN(each) ? "gap" : each))).toEqual([1, "gap", 2, "gap", 3]);
  expect(stored(reply, 7, 1).values).toEqual([]);
});

test("pictures are drawn in their order, and each is acknowledged", async () => {
  const done: Array<() => void> = [];
  const bitmaps: string[] = [];
  const decode = (file: Blob) => new Promise<ImageBitmap>((resolve, reject) => {
    const name = `${file.size}`;
    done.push(() => (file.size === 3 ? reject(new Error("no picture")) : resolve({ close: () => bitmaps.push(name) } as unknown as ImageBitmap)));
  });
  const acknowledged: number[] = [];
  const pictures = new Pictures((streams) => acknowledged.push(...streams), decode);
  const drawn: unknown[] = [];
  pictures.watch(7, (shot, t) => drawn.push([t, shot !== undefined]));
  const all = [1, 2, 3].map((size) => pictures.take({ stream: 7, t: size, bytes: new Uint8Array(size).fill(9) }));
  done[1]?.();
  await all[1];
  done[0]?.();
  done[2]?.();
  await Promise.all(all);
  expect(drawn).toEqual([[2, true], [3, false]]);
  expect(bitmaps).toEqual(["1", "2"]);
  pictures.watch(7, (shot, t) => drawn.push([t, shot !== undefined]));
  expect(drawn).toHaveLength(3);
  await vi.waitUntil(() => acknowledged.length === 3);
});

test("a frame without channels is a picture, and no wave", () => {
  const frame = new ArrayBuffer(16 + 5);
  const head = new DataView(frame);
  head.setUint32(0, 7, true);
  head.setFloat64(8, 1.5, true);
  expect(readWave(frame)).toBeUndefined();
  const picture = readPicture(frame);
  expect([picture?.stream, picture?.t, picture?.bytes.length]).toEqual([7, 1.5, 5]);
  expect(readPicture(frame.slice(0, 16))).toBeUndefined();
});
