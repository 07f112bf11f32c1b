import { MOST_WANTED, type Wanted } from "../wire";

/** The streams that something on the page draws, each at the finest resolution that anything asks for. */
export class Wants {
  private readonly asked = new Map<symbol, Wanted>();
  private scheduled = false;

  constructor(private readonly send: (streams: Wanted[]) => void) {}

  /** Asks for a stream; the result takes that back. */
  want(stream: number, pointsPerSec: number): () => void {
    const key = Symbol();
    this.asked.set(key, { stream, points_per_sec: pointsPerSec });
    this.schedule();
    return () => {
      this.asked.delete(key);
      this.schedule();
    };
  }

  /** Asks again, of a new connection. */
  resend(): void {
    this.send(this.all());
  }

  /** What is asked for in all. */
  all(): Wanted[] {
    const finest = new Map<number, number>();
    for (const { stream, points_per_sec } of this.asked.values()) {
      const known = finest.get(stream);
      const isWhole = points_per_sec === 0 || known === 0;
      finest.set(stream, isWhole ? 0 : Math.max(points_per_sec, known ?? 0));
    }
    return [...finest].map(([stream, points_per_sec]) => ({ stream, points_per_sec })).slice(0, MOST_WANTED);
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
