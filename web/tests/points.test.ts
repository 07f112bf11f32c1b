import { expect, test } from "vitest";
import { placed } from "../src/draw/points";
import { Model } from "../src/store/model";
import { described, isVideo } from "../src/store/video";
import { cameraName, isDecodable, unshown } from "../src/view/pictures";
import { found, foundWords, halfPeriod, pointStreams } from "../src/view/points";
import type { Stream } from "../src/wire";

const of = (names: readonly string[]) => names.flatMap((name) => [{ name: `${name}_x`, unit: "px" }, { name: `${name}_y`, unit: "px" }, { name: `${name}_score`, unit: "1" }]);

function stream(id: number, name: string, more: Partial<Stream> = {}): Stream {
  return {
    id, name, signal: "other", about: "person", subject: "p001", device: "", derived: false, shape: "sample", message_type: "", channels: [], rate_hz: 0,
    method: "", family: "", window: null, inputs: ["/robot1/front"], beside: "", doc: "", hidden: false, private: false, ...more,
  };
}

const camera = stream(1, "/robot1/front", { shape: "message", signal: "image", message_type: "sensor_msgs/msg/CompressedImage", inputs: [], rate_hz: 30 });
const body = stream(2, "/p/front/pose", { signal: "body", channels: of(["left_shoulder", "left_elbow", "left_wrist", "nose"]) });

function session(...streams: Stream[]): Model {
  const model = new Model();
  streams.forEach((each) => model.streams.set(each.id, each));
  return model;
}

test("points that are certain enough are drawn, with lines between joints of a body", () => {
  const seen = found(body, [10, 20, 0.9, 30, 40, 0.8, 50, 60, 0.1, 5, 6, null]);
  expect(seen?.points.map(({ name, x, y }) => [name, x, y])).toEqual([["left_shoulder", 10, 20], ["left_elbow", 30, 40], ["nose", 5, 6]]);
  expect(seen?.lines.map((line) => line.map(({ name }) => name))).toEqual([["left_shoulder", "left_elbow"]]);
  expect(found(body, Array.from({ length: 12 }, () => null))).toBeUndefined();
  // The same names of another signal are points without lines.
  expect(found({ ...body, signal: "other" }, [1, 2, 1, 3, 4, 1, 5, 6, 1, 7, 8, 1])?.lines).toEqual([]);
});

test("an eye is outlined in the order of its lids around it, and a detector gives a box", () => {
  const lids = ["outside", "top_1", "top_2", "inside", "bottom_1", "bottom_2"].map((part) => `left_eye_${part}`);
  const eye = stream(3, "/p/front/face", { signal: "face", channels: of(lids) });
  // The lower lid numbered either way.
  for (const [first, second] of [[8, 4], [4, 8]] as const) {
    const [outline] = found(eye, [0, 0, 1, 4, -2, 1, 8, -2, 1, 12, 0, 1, first, 2, 1, second, 2, 1])?.lines ?? [];
    expect(outline).toHaveLength(7);
    expect(outline?.at(0)).toEqual(outline?.at(-1));
    const around = outline?.slice(0, -1).map(({ x, y }) => `${x},${y}`) ?? [];
    const from = around.indexOf("0,0");
    const turned = [...around.slice(from), ...around.slice(0, from)];
    expect(turned).toEqual(["0,0", "4,-2", "8,-2", "12,0", "8,2", "4,2"]);
  }
  const sides = ["left", "top", "width", "height"].map((name) => ({ name, unit: "px" }));
  const detector = stream(4, "/p/front/yunet", { signal: "face", channels: [...sides, { name: "score", unit: "1" }, { name: "nose_x", unit: "px" }, { name: "nose_y", unit: "px" }] });
  expect(found(detector, [1, 2, 30, 40, 0.9, 9, 9])).toEqual({ points: [{ name: "nose", x: 9, y: 9 }], lines: [], box: { left: 1, top: 2, width: 30, height: 40 } });
  expect(found(detector, [null, null, null, null, null, null, null])).toBeUndefined();
  expect(foundWords([body, eye, detector])).toBe("body, face");
});

test("a camera has the points that were found in its own pictures, and none that are hidden from this viewer", () => {
  const hidden = { ...body, id: 5, hidden: true };
  const others = stream(6, "/p/side/pose", { channels: body.channels, inputs: ["/robot1/side"] });
  const numbers = stream(7, "/p/front/fer", { channels: [{ name: "happy", unit: "1" }] });
  const computed = stream(8, "/p/front/pose/posture", { channels: body.channels, derived: true, shape: "feature" });
  const model = session(camera, body, hidden, others, numbers, computed);
  expect(pointStreams(model, camera).map(({ id }) => id)).toEqual([2]);
  expect(halfPeriod(model, camera)).toBeCloseTo(1 / 60);
  expect(halfPeriod(model, { ...camera, rate_hz: 0.1 })).toBe(0.25);
});

test("a picture has its own points, of its time, and no others", () => {
  const model = session(camera, body);
  const come: number[] = [];
  const end = model.moments.watch(2, (t) => come.push(t));
  for (const t of [1, 1.1, 1.2]) model.apply({ type: "samples", samples: [{ stream: 2, t, values: [t] }] });
  const at = (t: number) => model.sampleAt(2, t, 1 / 60)?.[0];
  expect([at(1.1), at(1.11), at(1.15), at(1.2), at(1.3)]).toEqual([1.1, 1.1, undefined, 1.2, undefined]);
  expect(come).toEqual([1, 1.1, 1.2]);
  end();
  // Without anybody who draws, only the newest is known.
  expect([at(1.1), at(1.2)]).toEqual([undefined, 1.2]);
  for (let k = 0; k < 200; k += 1) model.moments.watch(2, () => undefined);
  for (let k = 0; k < 200; k += 1) model.moments.take(2, 10 + k / 30, [k]);
  expect([model.moments.at(2, 10, 0.01), model.moments.at(2, 10 + 199 / 30, 0.01)?.[0]]).toEqual([undefined, 199]);
});

test("a picture is placed whole in a box of any shape", () => {
  expect(placed({ w: 640, h: 480 }, { w: 320, h: 240 })).toEqual({ scale: 0.5, left: 0, top: 0 });
  expect(placed({ w: 1280, h: 720 }, { w: 400, h: 300 })).toEqual({ scale: 0.3125, left: 0, top: 37.5 });
  expect(placed({ w: 480, h: 640 }, { w: 400, h: 320 })).toEqual({ scale: 0.5, left: 80, top: 0 });
});

test("a frame of H.264 says what it needs, and pictures are no video", () => {
  const first = new Uint8Array([0, 0, 0, 1, 0x67, 0x42, 0xe0, 0x1e, 9, 0, 0, 0, 1, 0x68, 1, 0, 0, 1, 0x65, 9]);
  const next = new Uint8Array([0, 0, 1, 0x09, 0xf0, 0, 0, 1, 0x41, 9]);
  expect([described(first), described(next)]).toEqual([{ isFirst: true, codec: "avc1.42e01e" }, { isFirst: false, codec: undefined }]);
  expect([first, next, new Uint8Array([0xff, 0xd8, 0xff]), new Uint8Array([])].map(isVideo)).toEqual([true, true, false, false]);
  const video = { ...camera, message_type: "foxglove_msgs/msg/CompressedVideo" };
  expect([isDecodable(video, true), isDecodable(video, false), isDecodable(camera, false)]).toEqual([true, false, true]);
  expect([cameraName({ ...video, subject: "robot1", name: "/robot1/front/h264" }), cameraName({ ...camera, subject: "robot1", name: "/robot1/side/image_raw/ffmpeg" })]).toEqual(["robot1 · front", "robot1 · side"]);
  expect(unshown(session(video), video, false)).toContain("secure pages only");
});
