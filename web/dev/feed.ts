import type { Declared, Event, FromBrowser, FromServer, Stream, StreamHealth } from "../src/wire";
import { PROTOCOL } from "../src/wire";

/** A made-up session, for looking at pages without a server and for tests: one operator, some robots. */
export class Feed {
  readonly streams: Stream[] = [];
  private readonly names = new Map<string, number>();
  private events = 0;
  private wanted = new Set<number>();
  private sent = new Map<number, number>();
  /** The session's time at the start of the page [s]. */
  private readonly zero = performance.now() - 400_000;

  constructor(
    private readonly send: (message: FromServer | ArrayBuffer) => void,
    private readonly robots = 5,
  ) {
    this.person();
    for (let k = 1; k <= robots; k += 1) this.robot(`robot${k}`);
    this.add("/session/events", { about: "session", signal: "event", shape: "event" });
    this.add("/team/alerts", { about: "team", signal: "event", shape: "event", derived: true, family: "alerts" });
  }

  now(): number {
    return (performance.now() - this.zero) / 1000;
  }

  id(name: string): number {
    return this.names.get(name) ?? -1;
  }

  start(): void {
    const now = this.now();
    this.send({
      type: "hello", protocol: PROTOCOL, session: "demo", version: "0", mode: "live", began_unix_ms: Date.now() - 1000 * now, now, stored_secs: 600,
      viewer: { name: "dashboard", right: "control", commands: ["mark", "next_phase", "repeat_phase", "abort_phase", "split", "stop"], blind: true },
      markers: [{ key: "s", label: "stimulus" }, { key: "h", label: "hit" }],
      phases: [{ name: "baseline", from: 0, lasts: 300 }, { name: "1-back", from: 300, lasts: 180 }, { name: "2-back", from: 500, lasts: 180 }],
    });
    this.send({ type: "streams", ...this.declared() });
    this.event("/session/events", 0, "phase", "baseline");
    this.event("/session/events", 300, "phase", "1-back");
    this.event("/session/events", now - 4, "marker", "stimulus");
    const alert = { who: "robot2", why: "offline", stage: "raised", tier: "act", is_of_study: false };
    this.event("/team/alerts", now - 41, "fault", "robot2 needs someone: offline", alert);
    this.event("/team/alerts", now - 25, "fault", "robot3 needs someone: poor link", { ...alert, who: "robot3", why: "poor link", tier: "soon" });
    this.second();
    this.send({ type: "ready" });
    setInterval(() => this.second(), 1000);
    setInterval(() => this.waves(), 100);
  }

  take(message: FromBrowser): void {
    const now = this.now();
    if (message.type === "ping") this.send({ type: "pong", sent: message.sent, received: now, replied: now });
    else if (message.type === "want") this.wanted = new Set(message.streams.map((each) => each.stream));
    else if (message.type === "history") this.history(message);
    else if (message.type === "describe") {
      const stream = this.streams[message.stream];
      if (stream) this.send({ type: "description", stream: stream.id, method: stream.method, doc: stream.doc });
    }
    else if ("reference" in message) {
      const label = message.type === "command" ? message.text : message.type;
      this.send({ type: "echo", reference: message.reference, label, t: now, off_secs: 0, on_disk: true });
      if (message.type === "command") this.event("/session/events", now, "marker", message.text.replace("mark ", ""));
      if (message.type === "acknowledge") this.event("/session/events", now, "command", "", undefined, { who: "dashboard", verb: "acknowledge", text: message.alert });
    }
  }

  private declared(): Declared {
    return {
      whose: this.streams.map(({ about, subject, device }) => ({ about, subject, device })),
      channels: this.streams.map(({ channels }) => ({ names: channels.map((each) => each.name), units: channels.map((each) => each.unit) })),
      streams: this.streams.map(({ id, name, signal, shape, message_type, derived, rate_hz, family, window, inputs, beside, hidden }, k) => ({
        id, name, signal, shape, message_type, derived, rate_hz, family, beside, hidden, whose: k, channels: k, inputs: inputs.map((input) => this.id(input)), ...(window ? { window } : {}),
      })),
    };
  }

  private add(name: string, stream: Partial<Stream>): void {
    const id = this.streams.length;
    this.names.set(name, id);
    this.streams.push({
      id, name, signal: "other", about: "person", subject: "", device: "", derived: false, shape: "sample", message_type: "", channels: [],
      rate_hz: 0, method: "", family: "", window: null, inputs: [], beside: "", doc: "", hidden: false, private: false, ...stream,
    });
  }

  private person(): void {
    const raw = (leaf: string, signal: string, rate_hz: number, unit: string) =>
      this.add(`/p/${leaf}`, { signal, subject: "p001", shape: "wave", rate_hz, channels: [{ name: leaf, unit }] });
    const feature = (input: string, family: string, channels: [string, string][]) =>
      this.add(`/p/${input}/${family}/w30`, {
        subject: "p001", derived: true, shape: "feature", family, window: { secs: 30 }, rate_hz: 1, inputs: [`/p/${input}`],
        channels: channels.map(([name, unit]) => ({ name, unit })), method: "causal, windows of 30 s",
      });
    raw("ecg", "ecg", 130, "mV");
    raw("ppg", "ppg", 64, "1");
    raw("eda_fingers", "eda", 128, "uS");
    raw("respiration", "respiration", 50, "1");
    raw("face", "image", 30, "");
    feature("ecg", "heart", [["ECG_Rate_Mean", "1/min"]]);
    feature("ppg", "pulse", [["PPG_Rate_Mean", "1/min"]]);
    feature("respiration", "breath", [["RSP_Rate_Mean", "1/min"]]);
    feature("eda_fingers", "skin", [["EDA_Tonic_Mean", "uS"], ["SCR_Peaks_Rate", "1/min"]]);
    this.add("/p/ecg/beats", { subject: "p001", derived: true, shape: "event", signal: "event", inputs: ["/p/ecg"], family: "beats" });
    this.add("/p/state/w30", {
      subject: "p001", derived: true, shape: "feature", family: "state", window: { secs: 30 },
      channels: ["heart_rate_difference", "heart_rate_z"].map((name) => ({ name, unit: "1" })),
    });
  }

  private robot(id: string): void {
    const own = (leaf: string, stream: Partial<Stream>) => this.add(`/${id}/${leaf}`, { about: "robot", subject: id, ...stream });
    const channels = (...names: string[]) => names.map((name) => ({ name, unit: "1" }));
    own("battery_state", { signal: "battery", rate_hz: 2, channels: channels("voltage", "percentage") });
    own("wifi", { signal: "link", rate_hz: 5, channels: [{ name: "signal_level", unit: "dBm" }] });
    own("odom", { signal: "odometry", rate_hz: 20, channels: channels("pose.pose.position.x", "pose.pose.position.y", "twist.twist.linear.x") });
    own("deployment", { derived: true, shape: "feature", family: "deployment", channels: channels("deployed_secs", "online", "age_secs", "outages") });
    own("battery_state/use/w30", { derived: true, shape: "feature", family: "use", channels: channels("power_w", "percent_per_min", "empty_in_secs", "fraction_left"), window: { secs: 30 } });
    own("wifi/quality/w30", { derived: true, shape: "feature", family: "quality", channels: [{ name: "rssi_median", unit: "dBm" }], window: { secs: 30 } });
  }

  private event(name: string, t: number, kind: string, label: string, alert?: Event["alert"], request?: Event["request"]): void {
    this.events += 1;
    const event: Event = { number: this.events, stream: this.id(name), t, kind, label, value: null, duration: null, request: request ?? null, alert: alert ?? null };
    this.send({ type: "events", events: [event] });
  }

  private feature(name: string, values: (number | null)[], reasons: string[] = []): void {
    const feature = { stream: this.id(name), t: this.now(), window_secs: 30, coverage: 1, quality: 0.9, values, sigmas: [], reasons: values.map((_, k) => reasons[k] ?? "ok") };
    this.send({ type: "features", features: [feature] });
  }

  private second(): void {
    const now = this.now();
    const health = this.streams.filter((each) => !each.derived).map((each): StreamHealth => {
      const isOff = each.subject === "robot2";
      const state = isOff ? "dead" : each.name === "/p/face" ? "never" : each.name === "/p/ppg" ? "degraded" : "ok";
      return {
        stream: each.id, state, reason: state === "degraded" ? "motion in 38 % of 30 s" : "", rate_hz: isOff ? 0 : each.rate_hz, age_secs: isOff ? 41 : 0.1,
        received: 1000, lost_source: each.signal === "image" ? null : 0, lost_queue: 0, late: 0, duplicates: 0, clock: "one_way", epoch: 0, offset_secs: 0.0003,
        skew_ppm: 3, jitter_secs: 0.003, uncertainty_secs: 0.002, latency_secs: 0.03,
      };
    });
    this.send({ type: "status", t: now, streams: health });
    this.feature("/p/ecg/heart/w30", [92 + 3 * Math.sin(now / 20)]);
    this.feature("/p/ppg/pulse/w30", [null], ["quality"]);
    this.feature("/p/respiration/breath/w30", [19]);
    this.feature("/p/eda_fingers/skin/w30", [6.18, 9]);
    this.feature("/p/state/w30", [19, 5.1]);
    for (let k = 1; k <= this.robots; k += 1) this.secondOf(`robot${k}`, k, now);
    this.send({ type: "recording", stage: "open", path: "sessions/demo", bytes: 2e6 * now, bytes_per_sec: 2.1e6, free_bytes: 212e9, sync_age_secs: 0.4, elapsed_secs: now, kept_secs: null, reason: "" });
    this.send({ type: "machine", cpu_cores: 0.3, memory_bytes: 9e7, skipped: 0, viewers: 1, waiting_bytes: 0 });
  }

  private secondOf(id: string, k: number, now: number): void {
    const isOff = id === "robot2";
    this.feature(`/${id}/deployment`, [now, isOff ? 0 : 1, isOff ? 41 : 0, 0]);
    if (isOff) return;
    this.feature(`/${id}/battery_state/use/w30`, [14.5, -0.2, 13000, 0.9 - 0.05 * k]);
    this.feature(`/${id}/wifi/quality/w30`, [-39 - 8 * k]);
    const values = [2 * k + Math.cos(now / 9 + k), k % 2 ? 2 : 4 + Math.sin(now / 7), 0.3];
    this.send({ type: "samples", samples: [{ stream: this.id(`/${id}/odom`), t: now, values }] });
  }

  private waves(): void {
    for (const stream of this.streams.filter((each) => each.shape === "wave" && this.wanted.has(each.id) && each.name !== "/p/face")) {
      const period = 1 / stream.rate_hz;
      const from = this.sent.get(stream.id) ?? this.now() - 10;
      const count = Math.max(0, Math.floor((this.now() - from) / period));
      this.sent.set(stream.id, from + count * period);
      const frame = new ArrayBuffer(24 + 4 * count);
      const head = new DataView(frame);
      head.setUint32(0, stream.id, true);
      head.setUint32(4, 1, true);
      head.setFloat64(8, from, true);
      head.setFloat64(16, period, true);
      const samples = new Float32Array(frame, 24);
      for (let k = 0; k < count; k += 1) samples[k] = shape(stream.signal, from + k * period);
      this.send(frame);
    }
    const now = this.now();
    if (Math.floor(now / 0.65) !== Math.floor((now - 0.1) / 0.65)) this.event("/p/ecg/beats", 0.65 * Math.floor(now / 0.65), "beat", "beat");
  }

  private history({ reference, stream, from, to, points }: { reference: string; stream: number; from: number; to: number; points: number }): void {
    const step = (to - from) / points;
    const signal = this.streams[stream]?.signal ?? "";
    const mean = Array.from({ length: points }, (_, k) => shape(signal, from + k * step));
    this.send({ type: "history", reference, stream, from, step, channels: [{ min: mean, max: mean, mean }] });
  }
}

function shape(signal: string, t: number): number {
  const beat = (t % 0.65) / 0.65;
  if (signal === "ecg") return 1.1 * Math.exp(-(((beat - 0.1) / 0.012) ** 2)) + 0.2 * Math.exp(-(((beat - 0.4) / 0.06) ** 2));
  if (signal === "eda") return 5.2 + 0.5 * Math.sin(t / 9) + 0.2 * Math.sin(t / 3);
  return Math.sin((2 * Math.PI * t) / 3.2);
}
