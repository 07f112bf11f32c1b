/** The number of samples of a stream that are kept: two seconds at 30 per second. */
const KEPT = 64;

/** The values of a sample; `null` is unknown. */
export type Values = readonly (number | null)[];

/** The newest samples of the streams drawn on pictures, indexed by time. */
export class Moments {
  private readonly kept = new Map<number, { t: number; values: Values }[]>();
  private readonly watchers = new Map<number, Set<(t: number) => void>>();

  /** Keeps the samples of a stream from now on, and calls back with the time of each [s]; call the result to stop. */
  watch(stream: number, changed: (t: number) => void): () => void {
    const known = this.watchers.get(stream) ?? new Set();
    known.add(changed);
    this.watchers.set(stream, known);
    return () => {
      known.delete(changed);
      if (known.size > 0) return;
      this.watchers.delete(stream);
      this.kept.delete(stream);
    };
  }

  /** Takes a sample; samples of unwatched streams are dropped. */
  take(stream: number, t: number, values: Values): void {
    const watchers = this.watchers.get(stream);
    if (!watchers) return;
    const known = this.kept.get(stream) ?? [];
    known.push({ t, values });
    if (known.length > KEPT) known.shift();
    this.kept.set(stream, known);
    watchers.forEach((changed) => changed(t));
  }

  /** The sample of a stream that is nearest to a time, within this tolerance [s]. */
  at(stream: number, t: number, most: number): Values | undefined {
    let best: { t: number; values: Values } | undefined;
    for (const each of this.kept.get(stream) ?? []) {
      const off = Math.abs(each.t - t);
      if (off <= most && !(best && Math.abs(best.t - t) < off)) best = each;
    }
    return best?.values;
  }

  /** Forgets all samples. */
  clear(): void {
    this.kept.clear();
  }
}
