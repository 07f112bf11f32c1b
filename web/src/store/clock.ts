/** Probes whose round trip is this much longer than the shortest are not believed [ms]. */
const SLACK_MS = 2;
/** How many of the newest probes are kept. */
const KEPT = 20;

interface Probe {
  /** The session's time less the browser's [s]. */
  offset: number;
  rttMs: number;
}

/** The session's clock, as probes through the connection place it on the browser's own. */
export class SessionClock {
  private probes: Probe[] = [];
  private offset: number | undefined;

  /** A first, rough reading: the session's time as the server gave it, on arrival. */
  roughly(sessionSecs: number, arrivedMs: number): void {
    if (this.probes.length === 0) this.offset = sessionSecs - arrivedMs / 1000;
  }

  /** Takes an answered probe: sent and arrived by the browser's clock [ms], received and replied by the session's [s]. */
  take(sentMs: number, arrivedMs: number, received: number, replied: number): void {
    const rttMs = arrivedMs - sentMs - (replied - received) * 1000;
    const offset = (received + replied) / 2 - (sentMs + arrivedMs) / 2000;
    this.probes = [...this.probes, { offset, rttMs }].slice(-KEPT);
    const shortest = Math.min(...this.probes.map((probe) => probe.rttMs));
    const believed = this.probes.filter((probe) => probe.rttMs <= shortest + SLACK_MS);
    this.offset = believed.reduce((sum, probe) => sum + probe.offset, 0) / believed.length;
  }

  /** Forgets what it knows: another connection may lead to another session. */
  reset(): void {
    this.probes = [];
    this.offset = undefined;
  }

  /** The session's time at a moment of the browser's clock [s]; `undefined` before the first reading. */
  at(browserMs: number): number | undefined {
    return this.offset === undefined ? undefined : this.offset + browserMs / 1000;
  }

  /** The round trip of the newest probe [ms]. */
  get rttMs(): number | undefined {
    return this.probes.at(-1)?.rttMs;
  }

  /** Half the shortest round trip: the placing of a click is no worse than this [ms]. */
  get uncertaintyMs(): number | undefined {
    if (this.probes.length === 0) return undefined;
    return Math.min(...this.probes.map((probe) => probe.rttMs)) / 2;
  }
}
