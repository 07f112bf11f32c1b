import type { HistoryReply } from "../wire";

/** The shortest silence that is a gap if no rate is declared [s]. */
const GAP_SECS = 5;

/** Converts stored data of a channel to points: the minimum and the maximum of each column, and NaN in each gap. */
export function stored(reply: HistoryReply, channel: number, rateHz: number): { times: number[]; values: number[] } {
  const column = reply.channels[channel];
  const [times, values]: [number[], number[]] = [[], []];
  const gapSecs = rateHz > 0 ? Math.max(3.5 / rateHz, 3 * reply.step) : GAP_SECS;
  let before = Number.NEGATIVE_INFINITY;
  column?.mean.forEach((mean, k) => {
    const at = reply.from + k * reply.step;
    const [min, max] = [column.min[k] ?? null, column.max[k] ?? null];
    if (mean === null || min === null || max === null) return;
    const last = times.at(-1);
    if (last !== undefined && at - last > gapSecs) {
      times.push(last + 1e-6);
      values.push(Number.NaN);
    }
    const isFalling = mean < before;
    before = mean;
    times.push(at + reply.step / 4);
    values.push(min === max ? mean : isFalling ? max : min);
    if (min === max) return;
    times.push(at + (3 * reply.step) / 4);
    values.push(isFalling ? min : max);
  });
  return { times, values };
}
