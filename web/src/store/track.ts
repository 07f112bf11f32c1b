/** Stored data of an earlier time, too coarse for a line: the minimum and the maximum of each column. */
export interface Coarse {
  from: number;
  step: number;
  min: readonly (number | null)[];
  max: readonly (number | null)[];
}

/** The newest values of one channel over time, in a mirrored ring buffer that stays contiguous. */
export class Track {
  private t: Float64Array;
  private v: Float32Array;
  private end = 0;
  /** The stored data before the first point. */
  coarse: Coarse | undefined;
  /** Increases whenever data before the newest point change. */
  revision = 0;

  constructor(
    /** The number of points that are kept. */
    readonly capacity: number,
  ) {
    this.t = new Float64Array(2 * capacity);
    this.v = new Float32Array(2 * capacity);
  }

  get length(): number {
    return Math.min(this.end, this.capacity);
  }

  private get start(): number {
    return this.end - this.length;
  }

  /** The times of the points, in order [s]. */
  get times(): Float64Array {
    return this.t.subarray(this.start, this.end);
  }

  /** The values of the points; NaN is a gap. */
  get values(): Float32Array {
    return this.v.subarray(this.start, this.end);
  }

  /** The time of the newest point; `undefined` without any. */
  get newest(): number | undefined {
    return this.end > 0 ? this.t[this.end - 1] : undefined;
  }

  /** Adds a point; one that is older than the newest is dropped. */
  push(time: number, value: number): void {
    const newest = this.newest;
    if (newest !== undefined && time <= newest) return;
    if (this.end === this.t.length) this.compact();
    this.t[this.end] = time;
    this.v[this.end] = value;
    this.end += 1;
  }

  /** Inserts earlier points before the existing ones. */
  prepend(times: readonly number[], values: readonly number[]): void {
    const [ownTimes, ownValues] = [this.times.slice(), this.values.slice()];
    const first = ownTimes[0] ?? Number.POSITIVE_INFINITY;
    this.end = 0;
    times.forEach((time, k) => {
      if (time < first) this.push(time, values[k] ?? Number.NaN);
    });
    ownTimes.forEach((time, k) => this.push(time, ownValues[k] ?? Number.NaN));
    this.revision += 1;
  }

  /** Forgets all points. */
  clear(): void {
    this.end = 0;
    this.coarse = undefined;
    this.revision += 1;
  }

  /** Takes stored data of an earlier time. */
  before(coarse: Coarse): void {
    this.coarse = coarse;
    this.revision += 1;
  }

  /** The index of the first point at or after a time. */
  indexAt(time: number): number {
    const times = this.times;
    let [low, high] = [0, times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((times[middle] ?? 0) < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The value at a time: the value of the last point before it, unless that point is older than `most` [s]. */
  at(time: number, most: number): number | undefined {
    const index = this.indexAt(time + 1e-9) - 1;
    const when = this.times[index];
    const value = this.values[index];
    if (when === undefined || value === undefined || time - when > most) return undefined;
    return Number.isFinite(value) ? value : undefined;
  }

  private compact(): void {
    const kept = this.capacity;
    this.t.copyWithin(0, this.end - kept, this.end);
    this.v.copyWithin(0, this.end - kept, this.end);
    this.end = kept;
  }
}
