import type { FromBrowser, FromServer, HistoryReply, Playback } from "../wire";
import { PROTOCOL } from "../wire";
import { arrived } from "../draw/frames";
import { Actions } from "./actions.svelte";
import { SessionClock } from "./clock";
import { Connection } from "./connection";
import { Model } from "./model";
import { Pictures, readPicture } from "./pictures";
import type { Track } from "./track";
import { stored } from "./stored";
import { readWave } from "./wave";
import { Wants } from "./wants";

/** The interval at which the content of the page is recomputed [ms]: numbers that change more often can't be read. Waves are drawn separately. */
const TICK_MS = 500;
/** The interval between probes of the session's clock: at first, and later [ms]. */
const PROBE_MS = [200, 200, 200, 200, 200, 2000];

/** How long a requested position is used before the server has answered [ms]. */
const UNANSWERED_MS = 1000;

/** The session as known to this page: its model, its clock and its connection. */
export class Live {
  readonly model = new Model();
  readonly clock = new SessionClock();
  readonly wants = new Wants((streams) => this.send({ type: "want", streams }));
  readonly pictures = new Pictures((streams) => this.send({ type: "shown", streams }));
  readonly actions = new Actions(this);
  /** Increases whenever what is shown may have changed. */
  tick = $state(0);
  /** Whether there is a connection. */
  connected = $state(false);
  /** When the connection was lost, by the browser's clock [ms]. */
  lostMs = $state<number | undefined>(undefined);
  /** The session's time when the connection was last lost, and when it was restored [s]. */
  back = $state<{ from: number; to: number } | undefined>(undefined);
  private readonly connection: Connection;
  /** Increases with each jump in a recording. */
  moves = $state(0);
  /** When the position in a recording was last received, by the browser's clock [ms]. */
  private playbackMs = 0;
  /** The last requested position, until the recording reaches it [s], and when it was requested, by the browser's clock [ms]. */
  private requested: { t: number; atMs: number } | undefined;
  /** Requests the past of each drawn channel again. */
  private readonly pasts = new Map<string, () => void>();
  private readonly histories = new Map<string, (reply: HistoryReply) => void>();
  private references = 0;
  private probes = 0;

  constructor(url: string) {
    this.connection = new Connection(url, {
      text: (message) => this.take(message),
      frame: (frame) => {
        const wave = readWave(frame);
        if (wave) {
          arrived();
          return this.model.takeWave(wave);
        }
        const picture = readPicture(frame);
        if (picture) void this.pictures.take(picture);
      },
      opened: () => this.open(),
      closed: () => this.lose(),
    });
  }

  start(): void {
    this.lostMs = performance.now();
    this.connection.open();
    setInterval(() => (this.tick += 1), TICK_MS);
  }

  /** Tries to connect at once. */
  retry(): void {
    this.connection.open();
  }

  /** The session's current time [s]; the time of the loss while there is no connection. */
  now(): number {
    const at = this.connected ? performance.now() : (this.lostMs ?? performance.now());
    const { playback } = this.model;
    if (playback) {
      const passed = playback.paused ? 0 : ((at - this.playbackMs) / 1000) * playback.rate;
      return Math.min(playback.length, playback.t + passed);
    }
    return this.clock.at(at) ?? this.model.hello?.now ?? 0;
  }

  /** Whether a recording is shown. */
  get isReplay(): boolean {
    return this.model.hello?.mode === "replay";
  }

  /** The position in a recording, and the state of the playback. */
  get playback(): Playback | undefined {
    return this.model.playback;
  }

  /** Whether this viewer may control the playback. */
  get mayPlay(): boolean {
    return this.model.hello?.viewer.right === "control";
  }

  /** Moves the position in a recording, or changes the playback. */
  play({ t = null, rate = null, paused = null }: { t?: number | null; rate?: number | null; paused?: boolean | null }): void {
    if (t !== null) {
      const inside = Math.min(this.playback?.length ?? t, Math.max(0, t));
      this.requested = { t: inside, atMs: performance.now() };
    }
    this.send({ type: "play", reference: this.reference(), t, rate, paused });
  }

  /** Moves the position by some seconds; quick steps add up, even before the server has answered the first. */
  step(secs: number): void {
    const { requested } = this;
    const isUnderWay = requested !== undefined && performance.now() - requested.atMs < UNANSWERED_MS;
    this.play({ t: (isUnderWay ? requested.t : this.now()) + secs });
  }

  send(message: FromBrowser): boolean {
    return this.connection.send(message);
  }

  /** A new reference, which the server returns with its answer. */
  reference(): string {
    this.references += 1;
    return `${this.references}`;
  }

  /** Requests the description of a stream. */
  describe(stream: number): void {
    this.send({ type: "describe", reference: this.reference(), stream });
  }

  /** Requests the stored data of a stream. */
  history(stream: number, from: number, to: number, points: number, take: (reply: HistoryReply) => void): void {
    const reference = this.reference();
    this.histories.set(reference, take);
    if (!this.send({ type: "history", reference, stream, from, to, points })) this.histories.delete(reference);
  }

  /** The points of a channel, filled with stored data of the last seconds; as bands where that data is coarse. */
  track(stream: number, channel: number, secs: number, points: number, coarsestSecs = Number.POSITIVE_INFINITY): Track {
    const track = this.model.track(stream, channel);
    this.pasts.set(`${stream}:${channel}`, () => this.track(stream, channel, secs, points, coarsestSecs));
    const first = track.times[0] ?? this.now();
    const from = Math.max(0, this.now() - secs);
    if (first - from > 1) this.history(stream, from, first, points, (reply) => {
        const column = reply.channels[channel];
        if (reply.step > coarsestSecs) {
          if (column) track.before({ from: reply.from, step: reply.step, min: column.min, max: column.max });
          return;
        }
        const { times, values } = stored(reply, channel, this.model.streams.get(stream)?.rate_hz ?? 0);
        track.prepend(times, values);
      });
    return track;
  }

  private open(): void {
    if (this.lostMs !== undefined && this.model.ready) this.back = { from: this.now(), to: this.now() };
    this.connected = true;
    this.lostMs = undefined;
    this.probes = 0;
    this.clock.reset();
    this.probe();
  }

  private lose(): void {
    if (this.connected) this.lostMs = performance.now();
    this.connected = false;
    this.histories.clear();
    this.pictures.reset();
    this.actions.lose();
  }

  private probe(): void {
    if (!this.connected) return;
    this.send({ type: "ping", sent: performance.now() });
    const wait = PROBE_MS[Math.min(this.probes, PROBE_MS.length - 1)];
    this.probes += 1;
    setTimeout(() => this.probe(), wait);
  }

  private take(message: FromServer): void {
    const arrived = performance.now();
    this.model.apply(message);
    switch (message.type) {
      case "hello":
        if (message.protocol !== PROTOCOL) location.reload();
        this.clock.roughly(message.now, arrived);
        this.wants.resend();
        break;
      case "pong":
        this.clock.take(message.sent, arrived, message.received, message.replied);
        break;
      case "history":
        this.histories.get(message.reference)?.(message);
        this.histories.delete(message.reference);
        break;
      case "echo":
        this.actions.echo(message);
        break;
      case "refused":
        this.actions.refuse(message);
        break;
      case "description":
        this.tick += 1;
        break;
      case "ended":
        this.connection.finish();
        break;
      case "playback":
        this.playbackMs = arrived;
        break;
      case "moved":
        this.playbackMs = arrived;
        if (this.requested && Math.abs(message.t - this.requested.t) < 0.5) this.requested = undefined;
        this.histories.clear();
        this.pictures.clear();
        this.moves += 1;
        break;
      case "ready":
        if (this.moves > 0) this.pasts.forEach((ask) => ask());
        this.tick += 1;
        break;
      default:
        break;
    }
  }
}

const scheme = location.protocol === "https:" ? "wss:" : "ws:";
/** The session. */
export const live = new Live(`${scheme}//${location.host}/ws`);
