/** Probes whose round trip is this much longer than the shortest are ignored [ms]. */
const SLACK_MS = 2;
/** The number of the newest probes that are kept. */
const KEPT = 20;

interface Probe {
  /** The session's time minus the browser's [s]. */
  offset: number;
  rttMs: number;
}

/** The session's clock relative to the browser's, measured by probes over the connection. */
export class SessionClock {
  private probes: Probe[] = [];
  private offset: number | undefined;

  /** A first, rough reading: the session's time as stated by the server, on arrival. */
  roughly(sessionSecs: number, arrivedMs: number): void {
    if (this.probes.length === 0) this.offset = sessionSecs - arrivedMs / 1000;
  }

  /** Takes an answered probe: sent and arrived by the browser's clock [ms], received and replied by the session's [s]. */
  take(sentMs: number, arrivedMs: number, received: number, replied: number): void {
    const rttMs = arrivedMs - sentMs - (replied - received) * 1000;
    const offset = (received + replied) / 2 - (sentMs + arrivedMs) / 2000;
    this.probes = [...this.probes, { offset, rttMs }].slice(-KEPT);
    const shortest = Math.min(...this.probes.map((probe) => probe.rttMs));
    const accepted = this.probes.filter((probe) => probe.rttMs <= shortest + SLACK_MS);
    this.offset = accepted.reduce((sum, probe) => sum + probe.offset, 0) / accepted.length;
  }

  /** Resets the clock: another connection may lead to another session. */
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

  /** Half the shortest round trip: the largest error of a click's time [ms]. */
  get uncertaintyMs(): number | undefined {
    if (this.probes.length === 0) return undefined;
    return Math.min(...this.probes.map((probe) => probe.rttMs)) / 2;
  }
}
