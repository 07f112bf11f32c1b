import type { Bus, Computer, Declared, Description, Event, Feature, FromServer, Hello, Machine, Missed, Playback, Recording, Stream, StreamHealth, Timeline, Unmet } from "../wire";
import { Moments, type Values } from "./moments";
import { Track } from "./track";
import type { Wave } from "./wave";

/** The number of physiological events (beats, breaths, …) and of other events that are kept. */
const BODY_EVENTS = 4000;
const OTHER_EVENTS = 5000;
/** The number of points of a drawn channel that are kept. */
const POINTS = 40_000;
/** A step between samples of a wave of this many periods is a gap. */
const GAP_PERIODS = 2.5;

/** The number of additional missed runs of signals from which a link counts as slow: a few may be skipped while joining. */
const SLOW = 5;

const OF_THE_BODY = new Set(["beat", "breath", "response", "burst", "blink"]);
const STEPS = new Set(["/teampulse/stamped_by", "/teampulse/lost_source", "/teampulse/clock_probes"]);

/** A value and the time of its measurement [s]. */
export interface Measured {
  value: number;
  t: number;
}

/** Everything that the server has sent about a session: plain data, without any framework. */
export class Model {
  hello: Hello | undefined;
  readonly streams = new Map<number, Stream>();
  readonly byName = new Map<string, Stream>();
  readonly health = new Map<number, StreamHealth>();
  /** The time of the health assessment [s]. */
  judged: number | undefined;
  /** The newest values of each feature. */
  readonly features = new Map<number, Feature>();
  /** The newest readings of each stream. */
  readonly readings = new Map<number, { t: number; values: (number | null)[] }>();
  /** The last value of each channel of a feature, to show stale values. */
  private readonly lasts = new Map<string, Measured>();
  private readonly tracks = new Map<string, Track>();
  /** The newest samples of landmarks drawn on pictures. */
  readonly moments = new Moments();
  /** Beats, responses, breaths, bursts and blinks, by stream. */
  readonly body = new Map<number, Event[]>();
  /** All other events, in order of arrival. */
  events: Event[] = [];
  /** The numbers of the known events: some are sent again. */
  private readonly taken = new Set<number>();
  recording: Recording | undefined;
  /** The bytes written in each of the last seconds. */
  growth: number[] = [];
  machine: Machine | undefined;
  /** Other computers and their clocks, and the joined buses. */
  computers: Computer[] = [];
  buses: Bus[] = [];
  missed: Missed = { events: 0, states: 0, signals: 0, pictures: 0 };
  /** The last time that many signals were missed, by the browser's clock [ms]. */
  missedAt = Number.NEGATIVE_INFINITY;
  nextPhase: string | undefined;
  /** Why the pictures of a stream cannot be shown. */
  readonly unshown = new Map<number, string>();
  /** The unmet requirements of the study; `undefined` before they are known. */
  unmet: Unmet[] | undefined;
  ready = false;
  /** The position in a recording; `undefined` for a live session. */
  playback: Playback | undefined;
  /** The events of the whole recording. */
  timeline: Timeline | undefined;
  ended: string | undefined;
  /** Increases with each declared stream. */
  streamsVersion = 0;
  /** Increases with each event. */
  eventsVersion = 0;

  /** Handles a message; those for one part of a page, such as `history`, are handled elsewhere. */
  apply(message: FromServer): void {
    switch (message.type) {
      case "hello":
        this.greet(message);
        break;
      case "streams":
        this.declare(message);
        break;
      case "description":
        this.describe(message);
        break;
      case "status":
        this.judged = message.t;
        message.streams.forEach((health) => this.health.set(health.stream, health));
        break;
      case "features":
        message.features.forEach((feature) => this.takeFeature(feature));
        break;
      case "samples":
        message.samples.forEach(({ stream, t, values }) => this.takeReading(stream, t, values));
        break;
      case "events":
        // On joining, events that are kept longer are sent before the others.
        message.events.forEach((event) => this.takeEvent(event));
        this.forget();
        break;
      case "recording":
        this.takeRecording(message);
        break;
      case "network":
        [this.computers, this.buses] = [message.computers, message.buses];
        break;
      case "machine":
        this.machine = message;
        break;
      case "missed":
        if (message.signals > this.missed.signals + SLOW) this.missedAt = performance.now();
        this.missed = message;
        break;
      case "next_phase":
        this.nextPhase = message.name ?? undefined;
        break;
      case "unshown":
        this.unshown.set(message.stream, message.reason);
        break;
      case "required":
        this.unmet = message.unmet;
        break;
      case "ready":
        this.ready = true;
        break;
      case "ended":
        this.ended = message.reason;
        break;
      case "playback":
        this.playback = message;
        break;
      case "moved":
        this.playback = message;
        this.move();
        break;
      case "timeline":
        this.timeline = message;
        break;
      default:
        break;
    }
  }

  /** The points of a channel, kept from now on. */
  track(stream: number, channel: number): Track {
    const key = keyOf(stream, channel);
    const known = this.tracks.get(key);
    if (known) return known;
    const track = new Track(POINTS);
    this.tracks.set(key, track);
    return track;
  }

  /** The last value of a feature's channel. */
  last(stream: number, channel: number): Measured | undefined {
    return this.lasts.get(keyOf(stream, channel));
  }

  /** The sample of a stream that is nearest to a time, within this tolerance [s]. */
  sampleAt(stream: number, t: number, most: number): Values | undefined {
    const newest = this.readings.get(stream);
    return this.moments.at(stream, t, most) ?? (newest && Math.abs(newest.t - t) <= most ? newest.values : undefined);
  }

  takeWave(wave: Wave): void {
    for (let channel = 0; channel < wave.channels; channel += 1) {
      const track = this.tracks.get(keyOf(wave.stream, channel));
      if (!track) continue;
      const newest = track.newest;
      if (newest !== undefined && wave.start - newest > Math.max(GAP_PERIODS * wave.period, 0.25)) {
        track.push(newest + 1e-6, Number.NaN);
      }
      for (let k = channel, n = 0; k < wave.samples.length; k += wave.channels, n += 1) {
        track.push(wave.start + n * wave.period, wave.samples[k] ?? Number.NaN);
      }
    }
  }

  /** Handles a new connection: past events are sent again; data of another session are dropped. */
  private greet(hello: Hello): void {
    const isOther = this.hello !== undefined && this.hello.began_unix_ms !== hello.began_unix_ms;
    this.hello = hello;
    this.ready = false;
    this.events = [];
    this.eventsVersion += 1;
    this.taken.clear();
    this.body.clear();
    this.moments.clear();
    if (!isOther) return;
    for (const known of [this.streams, this.byName, this.health, this.features, this.readings, this.lasts, this.unshown]) known.clear();
    this.tracks.clear();
    this.growth = [];
    [this.computers, this.buses] = [[], []];
    this.recording = undefined;
    this.ended = undefined;
  }

  /** Handles another moment of a recording: the data known at that time follow. */
  private move(): void {
    this.ready = false;
    this.events = [];
    this.eventsVersion += 1;
    this.judged = undefined;
    for (const known of [this.taken, this.body, this.health, this.features, this.readings, this.lasts]) known.clear();
    this.moments.clear();
    for (const track of this.tracks.values()) track.clear();
  }

  /** Handles declared streams; omitted fields are empty, and descriptions requested before are kept. */
  private declare({ whose, channels, streams }: Declared): void {
    const lists = channels.map(({ names, units }) => names.map((name, k) => ({ name, unit: units[k] ?? "" })));
    for (const row of streams) {
      const { about = "session", subject = "", device = "" } = whose[row.whose] ?? {};
      const { method = "", doc = "" } = this.streams.get(row.id) ?? {};
      const stream: Stream = {
        id: row.id, name: row.name, signal: row.signal, shape: row.shape, about, subject, device, channels: lists[row.channels] ?? [],
        message_type: row.message_type ?? "", derived: row.derived ?? false, rate_hz: row.rate_hz ?? 0, family: row.family ?? "",
        window: row.window ?? null, inputs: [], beside: row.beside ?? "", hidden: row.hidden ?? false, private: row.private ?? false, method, doc,
      };
      this.streams.set(stream.id, stream);
      this.byName.set(stream.name, stream);
    }
    for (const row of streams) {
      const inputs = (row.inputs ?? []).flatMap((id) => this.streams.get(id)?.name ?? []);
      this.streams.get(row.id)?.inputs.push(...inputs);
    }
    this.streamsVersion += 1;
  }

  private describe({ stream, method, doc }: Description): void {
    const known = this.streams.get(stream);
    if (known) [known.method, known.doc] = [method, doc];
  }

  private takeFeature(feature: Feature): void {
    this.features.set(feature.stream, feature);
    feature.values.forEach((value, channel) => {
      const key = keyOf(feature.stream, channel);
      if (value !== null) this.lasts.set(key, { value, t: feature.t });
      this.tracks.get(key)?.push(feature.t, value ?? Number.NaN);
    });
  }

  private takeReading(stream: number, t: number, values: (number | null)[]): void {
    this.readings.set(stream, { t, values });
    this.moments.take(stream, t, values);
    values.forEach((value, channel) => {
      this.tracks.get(keyOf(stream, channel))?.push(t, value ?? Number.NaN);
    });
  }

  private takeEvent(event: Event): void {
    if (this.taken.has(event.number)) return;
    this.taken.add(event.number);
    if (OF_THE_BODY.has(event.kind)) {
      const known = this.body.get(event.stream) ?? [];
      insert(known, event);
      if (known.length > BODY_EVENTS) known.splice(0, BODY_EVENTS / 4);
      this.forgetUndrawn(known, event.t);
      this.body.set(event.stream, known);
      return;
    }
    if (STEPS.has(this.streams.get(event.stream)?.name ?? "")) return;
    insert(this.events, event);
    this.eventsVersion += 1;
    if (this.events.length > OTHER_EVENTS) this.events.splice(0, OTHER_EVENTS / 5);
  }

  /** Forgets the events of a stream that are older than its stored signal at a time [s], many at once. */
  private forgetUndrawn(events: Event[], now: number): void {
    const stored = this.hello?.stored_secs ?? Number.POSITIVE_INFINITY;
    if (now - (events[0]?.t ?? now) < 1.5 * stored) return;
    events.splice(0, events.findIndex((each) => now - each.t <= stored));
  }

  /** Forgets the oldest event numbers: they are not sent again so late. */
  private forget(): void {
    if (this.taken.size < 4 * OTHER_EVENTS) return;
    const oldest = [...this.taken].sort((a, b) => a - b).slice(0, OTHER_EVENTS);
    oldest.forEach((number) => this.taken.delete(number));
  }

  private takeRecording(recording: Recording): void {
    const before = this.recording?.bytes ?? recording.bytes;
    this.growth = [...this.growth, Math.max(0, recording.bytes - before)].slice(-20);
    this.recording = recording;
  }
}

/** Inserts an event in order: nearly always at the end. */
function insert(events: Event[], event: Event): void {
  let at = events.length;
  while (at > 0 && (events[at - 1]?.number ?? -1) > event.number) at -= 1;
  events.splice(at, 0, event);
}

function keyOf(stream: number, channel: number): string {
  return `${stream}:${channel}`;
}
