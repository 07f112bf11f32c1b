import { expect, test } from "vitest";
import { Feed } from "../dev/feed";
import { NAMES, placeOf } from "../src/draw/lanes";
import { Model } from "../src/store/model";
import { alertsOf, waiting } from "../src/view/alerts";
import { checks } from "../src/view/checks";
import { age, bytes, clock, decimal, lasts, likeItsSd, listed, meanAndSd, pieces, signed, significant } from "../src/view/format";
import { healthGroups, totals } from "../src/view/health";
import { log } from "../src/view/log";
import { knownBy, lostOn } from "../src/view/network";
import { baselineOf, people } from "../src/view/people";
import { phases, placeInPlan, present } from "../src/view/phases";
import { recordingWords } from "../src/view/recording";
import { robots } from "../src/view/robots";
import { bySubject, drawable, signalOf } from "../src/view/signals";
import { markers, spans } from "../src/view/strips";
import { timeline } from "../src/view/timeline";
import { watching, words } from "../src/view/watching";
import type { Event, Recording } from "../src/wire";

function session(count = 5): { model: Model; now: number; feed: Feed } {
  const model = new Model();
  const feed = new Feed((message) => {
    if (!(message instanceof ArrayBuffer)) model.apply(message);
  }, count);
  feed.start();
  return { model, now: feed.now(), feed };
}

test("numbers have a true minus, and ages and lengths read as people write them", () => {
  expect([decimal(-0.04, 1), decimal(-78), signed(2.46, 2), signed(0, 1)]).toEqual(["0.0", "−78", "+2.46", "0.0"]);
  expect([age(0.42), age(41), age(65)]).toEqual(["0.4 s", "41 s", "1:05"]);
  expect([clock(872), clock(3723)]).toEqual(["14:32", "1:02:03"]);
  expect([bytes(1.83e9), bytes(512), lasts(100_800), lasts(13_260)]).toEqual(["1.83 GB", "512 B", "28 h", "3:41 h"]);
  expect([significant(1234.5), significant(0.0123), listed(["a", "b", "c"])]).toEqual(["1235", "0.012", "a, b and c"]);
});

test("a mean has as many places as two digits of its SD need", () => {
  expect([meanAndSd(95.71, 1.93), meanAndSd(-76.4, 12), meanAndSd(5.961, 0.174), meanAndSd(7, undefined), meanAndSd(3, 0)]).toEqual(["95.7 ± 1.9", "−76 ± 12", "5.96 ± 0.17", "7.00 ± ?", "3.00 ± 0.00"]);
  expect([likeItsSd(95.66, 1.93), likeItsSd(0.0123, undefined)]).toEqual(["95.7", "0.012"]);
});

test("a person's numbers have source and age, or the reason why there is none", () => {
  const { model, now } = session();
  const person = people(model, now)[0];
  const stats = new Map(person?.stats.map((each) => [each.figure.word, each]));
  expect(stats.get("Heart")).toMatchObject({ state: "fresh", source: "ECG" });
  expect(stats.get("Heart")?.compared).toMatchObject({ difference: 19, z: 5.1 });
  expect(stats.get("Pulse")).toMatchObject({ state: "none", why: "signal too poor: 90 % of 30 s usable" });
  expect(person?.lights.map((each) => each.state)).toEqual(["ok", "degraded", "ok", "ok", "never"]);
});

test("a number's own baseline is what it is compared with, and not everything is", () => {
  const { model, now } = session();
  const stats = people(model, now)[0]?.stats ?? [];
  const baseline = (word: string) => {
    const stat = stats.find((each) => each.figure.word === word);
    return stat && baselineOf(model, stat.stream, stat.channel);
  };
  const heart = stats.find((each) => each.figure.word === "Heart");
  expect(baseline("Heart")?.compared?.mean).toBeCloseTo((heart?.value ?? 0) - 19);
  expect(baseline("Pulse")).toBeUndefined();
});

test("a number of long ago is never shown as one of now", () => {
  const { model, now } = session();
  const heart = people(model, now + 60)[0]?.stats.find((each) => each.figure.word === "Heart");
  expect(heart?.state).toBe("stale");
  expect(heart?.ageSecs).toBeGreaterThan(59);
});

test("robots stay in the order in which people count, also when they are silent", () => {
  const { model, now } = session(12);
  const all = robots(model, now);
  expect(all.map((each) => each.id)).toEqual(Array.from({ length: 12 }, (_, k) => `robot${k + 1}`));
  expect(all[1]).toMatchObject({ state: "offline", word: "OFFLINE 0:41" });
  expect(all[2]?.state).toBe("watch");
  expect(robots(model, now + 3600)).toHaveLength(12);
});

test("what needs someone first comes first, and an acknowledgement is believed when the bag has it", () => {
  const { model, now, feed } = session();
  expect(alertsOf(model, now).map((each) => each.what)).toEqual(["robot2 is offline.", "robot3 has a weak link."]);
  expect(waiting(alertsOf(model, now))).toMatchObject({ act: 1, soon: 1 });
  feed.take({ type: "acknowledge", reference: "1", alert: "robot2 needs someone: offline", at: now });
  const seen = alertsOf(model, now).find((each) => each.subject === "robot2");
  expect(seen).toMatchObject({ stage: "acknowledged", seen: { who: "dashboard" } });
  expect(waiting(alertsOf(model, now)).act).toBe(0);
});

test("an alert of the study has its tier, its number and its limit, and one that is silent stays", () => {
  const { model, now, feed } = session();
  const why = "breathe (ECG_Rate_Mean above 120 1/min for 30 s)";
  const event = (number: number, t: number, stage: string, value: number | null): Event => ({
    number, stream: feed.id("/team/alerts"), t, kind: stage === "raised" ? "fault" : "marker", label: `p001 ${stage}: ${why}`, value, duration: null,
    request: null, alert: { who: "p001", why, stage, tier: stage === "raised" ? "note" : "soon", is_of_study: stage === "raised" },
  });
  const own = () => alertsOf(model, now).find((each) => each.subject === "p001" && each.cause === why);
  model.apply({ type: "events", events: [event(901, now - 60, "raised", 131.4)] });
  expect(own()).toMatchObject({ urgency: "note", stage: "open", what: "p001: breathe.", unknown: false });
  expect(own()?.why).toBe("ECG_Rate_Mean above 120 1/min for 30 s, 131 when it began.");
  expect(waiting(alertsOf(model, now))).toMatchObject({ act: 1, soon: 1 });
  model.apply({ type: "events", events: [event(902, now - 30, "unknown", null)] });
  expect(own()).toMatchObject({ stage: "open", unknown: true, since: now - 60 });
  model.apply({ type: "events", events: [event(903, now - 20, "raised", 130)] });
  expect(own()).toMatchObject({ stage: "open", unknown: false, since: now - 60 });
  model.apply({ type: "events", events: [event(904, now - 10, "over", null)] });
  expect(own()).toMatchObject({ stage: "over" });
});

test("what the study requires and is not there is a no-go with its remedy", () => {
  const { model, now } = session();
  const named = (what: string) => checks(model, now, undefined).find((each) => each.what === what);
  const battery = "battery of robot robot1";
  model.apply({ type: "required", unmet: [{ what: `${battery}: advertised, but nothing is published`, fix: "Check it." }] });
  expect(named(battery)).toMatchObject({ glyph: "act", value: "advertised, but nothing is published", fix: "Check it." });
  model.apply({ type: "required", unmet: [] });
  expect(named(battery)).toBeUndefined();
  expect(named("Required by the study")?.glyph).toBe("ok");
});

test("phases are done, now and next", () => {
  const { model, now } = session();
  const all = phases(model, now);
  expect(all.map((each) => [each.name, each.state])).toEqual([["baseline", "done"], ["1-back", "now"], ["2-back", "next"]]);
  expect(present(all)).toMatchObject({ place: 1, next: { name: "2-back" } });
});

test("the number of a phase is that of the study, which also has phases that begin by hand", () => {
  const phase = (name: string, state: "done" | "now" | "next") => ({ name, from: 0, to: undefined, state });
  const plan = ["baseline", "task", "baseline"].map((name) => ({ name }));
  expect(placeInPlan([phase("baseline", "now")], plan)).toBe("1 of 3");
  expect(placeInPlan([phase("baseline", "done"), phase("task", "now")], plan)).toBe("2 of 3");
  expect(placeInPlan([phase("baseline", "done"), phase("task", "done"), phase("baseline", "now")], plan)).toBe("3 of 3");
  expect(placeInPlan([phase("of another program", "now")], plan)).toBeUndefined();
  expect(placeInPlan([], plan)).toBeUndefined();
});

test("names are text, and the newest line of the log is first", () => {
  const { model, feed } = session();
  feed.take({ type: "command", reference: "2", text: "mark <b>x</b>", at: null });
  expect(log(model, 10)[0]).toMatchObject({ who: "marker", what: "<b>x</b>" });
});

test("a recording is shown as one only while it truly grows", () => {
  const recording: Recording = {
    stage: "open", path: "", bytes: 1, bytes_per_sec: 1, free_bytes: null, sync_age_secs: 0.4, elapsed_secs: 872, kept_secs: null, reason: "",
  };
  expect(recordingWords(recording, undefined)).toEqual({ kind: "on", title: "0:14:32", detail: "on disk 0.4 s ago" });
  expect(recordingWords({ ...recording, sync_age_secs: 3.2 }, undefined)).toMatchObject({ kind: "fail", title: "Not growing" });
  expect(recordingWords(recording, 7)).toMatchObject({ kind: "unknown" });
  expect(recordingWords(undefined, undefined)).toMatchObject({ kind: "unknown" });
  const paused: Recording = { ...recording, stage: "paused", kept_secs: 30 };
  expect(recordingWords(paused, undefined)).toEqual({ kind: "none", title: "Not recording", detail: "paused, last 30 s kept" });
  expect(recordingWords({ ...recording, stage: "ended_early", reason: "disk full" }, undefined)).toMatchObject({ kind: "fail", detail: "disk full" });
});

test("events come in any order on joining, and some again, but each is there once and in order", () => {
  const { model, feed } = session();
  const before = model.events.length;
  const event = (number: number) => ({ number, stream: feed.id("/session/events"), t: number, kind: "marker", label: `${number}`, value: null, duration: null, request: null, alert: null });
  model.apply({ type: "events", events: [event(902), event(900), event(902)] });
  model.apply({ type: "events", events: [event(901), event(900)] });
  expect(model.events.slice(before).map((each) => each.number)).toEqual([900, 901, 902]);
});

test("an annotated span is one from its begin to its end, in a recording also before it was annotated", () => {
  const { model, now } = session();
  const id = model.byName.get("/session/events")?.id ?? -1;
  const span: Event = { number: 9000, stream: id, t: now - 20, kind: "marker", label: "talks", value: null, duration: 8, request: null, alert: null };
  model.apply({ type: "events", events: [span] });
  const labels = (from: number, to: number) => spans(model, from, to).map((each) => each.label);
  expect([labels(now - 15, now), labels(now - 11, now), labels(now - 30, now - 21)]).toEqual([["talks"], [], []]);
  expect(markers(model, now - 30, now).map((each) => each.label)).toEqual(["stimulus"]);
  const lane = timeline(model, now).lanes.find((each) => each.name === "markers");
  expect(lane?.spans).toEqual([{ from: now - 20, to: now - 12, kind: "span" }]);
  expect(lane?.ticks).not.toContain(span.t);
  expect(log(model, 9).find((each) => each.what.startsWith("talks"))?.what).toBe("talks, 8.0 s");
  const later = { ...span, number: 3, t: now + 100, label: "later" };
  model.apply({ type: "timeline", events: [later], left_out: 0, absences: [] });
  expect(labels(now + 99, now + 120)).toEqual(["later"]);
});

test("how a computer's clock is known is said, and what can't be counted is not 0", () => {
  const computer = { name: "laptop", offset_secs: 0.06, skew_ppm: 4, uncertainty_secs: 0.001, streams: 2, round_trip_secs: 0.0008, probe_age_secs: 2.1 };
  expect(knownBy({ ...computer, known_by: "probes" })).toBe("probed, 0.8 ms round trip, 2.1 s ago");
  expect(knownBy({ ...computer, known_by: "stamps", round_trip_secs: null })).toContain("by the stamps of received messages");
  expect(knownBy({ ...computer, known_by: "unknown", round_trip_secs: null })).toContain("not known yet");
  const bus = { name: "ROS domain 0", node: "/teampulse", participants: 1, topics: 2, streams: 2, rate_hz: 40, lost: null, uncounted: 2 };
  expect([lostOn(bus), lostOn({ ...bus, lost: 0, uncounted: 0 }), lostOn({ ...bus, lost: 1234 })]).toEqual(["?", "0", "1 234, ? of 2"]);
});

test("whose cameras and microphones are on is said, and of many the first", () => {
  const { model } = session();
  expect(watching(model)).toEqual({ cameras: [], microphones: [] });
  for (const stream of model.streams.values()) {
    const health = model.health.get(stream.id);
    if (stream.signal === "image" && health) health.state = "degraded";
  }
  expect(watching(model)).toEqual({ cameras: ["p001"], microphones: [] });
  expect(words({ cameras: ["a", "b", "c", "d"], microphones: ["p001"] })).toBe("camera on: a, b and 2 more · microphone on: p001");
});

test("what happened before a recording began is drawn at its start, not over the names", () => {
  expect([-5, 0, 55, 110].map((t) => placeOf(t, 110, NAMES + 220))).toEqual([NAMES, NAMES, NAMES + 110, NAMES + 220]);
});

test("every stream is counted in the state of its row, also one that was never seen and may be silent", () => {
  const { model } = session();
  const face = model.byName.get("/p/face");
  if (face) face.signal = "event";
  const groups = healthGroups(model);
  expect(groups.flatMap((each) => each.rows).find((each) => each.stream === face)).toMatchObject({ state: "never", isBad: false });
  expect(totals(groups)).toMatchObject({ all: 21, ok: 16, words: "1 degraded, 3 dead, 1 never seen" });
});

test("a name breaks only after slashes and underscores", () => {
  expect(pieces("polar_h10/rr_interval")).toEqual(["polar_", "h10/", "rr_", "interval"]);
  expect([pieces("/robot1/odom").join(""), pieces("heart rate"), pieces("")]).toEqual(["/robot1/odom", ["heart rate"], [""]]);
});

test("signals are listed below whose they are, in their order, by names that are theirs alone", () => {
  const { model } = session(1);
  const runs = bySubject(drawable(model).filter((each) => !each.stream.derived));
  expect(runs.map((each) => each.title)).toEqual(["p001", "robot1"]);
  const [own = []] = runs.map((each) => each.rows.map(({ stream, choice }) => signalOf(stream, choice.channel)));
  expect(own).toEqual(["ECG", "EDA fingers", "camera", "PPG", "breath"]);
});
