import { MOST_WANTED, type Wanted } from "../wire";

/** The streams drawn on the page, each at the finest resolution requested. */
export class Wants {
  private readonly asked = new Map<symbol, Wanted>();
  private scheduled = false;

  constructor(private readonly send: (streams: Wanted[]) => void) {}

  /** Requests a stream, for a camera optionally the pictures with landmarks; call the result to withdraw the request. */
  want(stream: number, pointsPerSec: number, withPoints = false): () => void {
    const key = Symbol();
    this.asked.set(key, { stream, points_per_sec: pointsPerSec, with_points: withPoints });
    this.schedule();
    return () => {
      this.asked.delete(key);
      this.schedule();
    };
  }

  /** Repeats all requests on a new connection. */
  resend(): void {
    this.send(this.all());
  }

  /** All requests combined. */
  all(): Wanted[] {
    const finest = new Map<number, Wanted>();
    for (const asked of this.asked.values()) {
      const known = finest.get(asked.stream);
      const isWhole = asked.points_per_sec === 0 || known?.points_per_sec === 0;
      const points_per_sec = isWhole ? 0 : Math.max(asked.points_per_sec, known?.points_per_sec ?? 0);
      finest.set(asked.stream, { ...asked, points_per_sec, with_points: asked.with_points || known?.with_points === true });
    }
    return [...finest.values()].slice(0, MOST_WANTED);
  }

  private schedule(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    setTimeout(() => {
      this.scheduled = false;
      this.send(this.all());
    }, 20);
  }
}
