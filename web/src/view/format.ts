/** A number with a true minus sign and a fixed number of decimals. */
export function decimal(value: number, decimals = 0): string {
  const text = value.toFixed(decimals);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
}

/** A number with its sign. */
export function signed(value: number, decimals = 0): string {
  const text = decimal(value, decimals);
  return value > 0 && Number(value.toFixed(decimals)) !== 0 ? `+${text}` : text;
}

/** A number with three significant digits, for any unit. */
export function significant(value: number): string {
  const size = Math.abs(value);
  if (size >= 100 || value === 0) return decimal(value);
  if (size >= 10) return decimal(value, 1);
  if (size >= 1) return decimal(value, 2);
  return size >= 0.001 ? decimal(value, 3) : value.toExponential(1).replace("-", "−");
}

/** A mean and its SD with two digits, and the mean with as many decimals: `95.7 ± 1.9`. */
export function meanAndSd(mean: number, sd: number | undefined): string {
  return sd === undefined ? `${significant(mean)} ± ?` : `${decimal(mean, placesOf(sd))} ± ${decimal(sd, placesOf(sd))}`;
}

/** A number with as many decimals as its SD. */
export function likeItsSd(value: number, sd: number | undefined): string {
  return sd === undefined ? significant(value) : decimal(value, placesOf(sd));
}

/** The number of decimals for two significant digits. */
function placesOf(sd: number): number {
  return sd > 0 ? Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(sd)))) : 2;
}

/** The offset of a clock: `1.2 ms`, or `own origin` if it counts from another origin. */
export function ahead(secs: number | null | undefined): string {
  if (typeof secs !== "number") return "?";
  return Math.abs(secs) > 86_400 ? "own origin" : `${decimal(1000 * secs, 1)} ms`;
}

/** A duration as `14:32` or `1:02:03`. */
export function clock(secs: number): string {
  const whole = Math.max(0, Math.floor(secs));
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const two = (n: number) => String(n).padStart(2, "0");
  return h > 0 ? `${h}:${two(m)}:${two(s)}` : `${m}:${two(s)}`;
}

/** A duration that always includes hours, for the recording. */
export function longClock(secs: number): string {
  return secs < 3600 ? `0:${clock(secs).padStart(5, "0")}` : clock(secs);
}

/** An age: `0.4 s`, `12 s`, `1:05`. */
export function age(secs: number): string {
  const known = Math.max(0, secs);
  if (known < 9.95) return `${known.toFixed(1)} s`;
  return known < 60 ? `${Math.floor(known)} s` : clock(known);
}

/** The time of day. */
export function timeOfDay(unixMs: number, decimals = 0): string {
  const at = new Date(unixMs);
  const two = (n: number) => String(n).padStart(2, "0");
  const hms = `${two(at.getHours())}:${two(at.getMinutes())}:${two(at.getSeconds())}`;
  return decimals === 0 ? hms : `${hms}.${String(at.getMilliseconds()).padStart(3, "0").slice(0, decimals)}`;
}

const SIZES: [number, string][] = [[1e12, "TB"], [1e9, "GB"], [1e6, "MB"], [1e3, "kB"]];

/** A number of bytes: `1.83 GB`. */
export function bytes(count: number): string {
  const [unit, name] = SIZES.find(([size]) => count >= size) ?? [1, "B"];
  const value = count / unit;
  return `${decimal(value, name === "B" || value >= 100 ? 0 : value >= 10 ? 1 : 2)} ${name}`;
}

/** A write rate: `2.1 MB/s`. */
export function byteRate(perSec: number): string {
  return perSec >= 1e6 ? `${decimal(perSec / 1e6, 1)} MB/s` : `${decimal(perSec / 1e3)} kB/s`;
}

/** An approximate duration: `28 h`, `3:41 h`, `12 min`. */
export function lasts(secs: number): string {
  const mins = Math.floor(secs / 60);
  if (secs >= 36_000) return `${Math.floor(secs / 3600)} h`;
  return mins >= 60 ? `${Math.floor(mins / 60)}:${String(mins % 60).padStart(2, "0")} h` : `${mins} min`;
}

/** A number of things: `1 robot`, `5 robots`. */
export function counted(count: number, one: string, many = `${one}s`): string {
  return `${grouped(count)} ${count === 1 ? one : many}`;
}

/** A count with thin spaces between thousands. */
export function grouped(count: number): string {
  return String(Math.round(count)).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

const UNITS: Record<string, string> = {
  uS: "µS", uV: "µV", degC: "°C", "1/min": "/min", "1": "", "uV^2": "µV²", "ms^2": "ms²", "m/s^2": "m/s²",
  "uS/s": "µS/s", "uV/s": "µV/s", "%/min": "%/min",
};

/** A unit in its usual notation. */
export function unit(ascii: string): string {
  return UNITS[ascii] ?? ascii;
}

/** A list in words: `ECG, EDA and breath`. */
export function listed(words: readonly string[]): string {
  const last = words.at(-1);
  return words.length < 2 || last === undefined ? words.join("") : `${words.slice(0, -1).join(", ")} and ${last}`;
}

/** Natural order of names: `robot2` before `robot10`. */
export const byName = new Intl.Collator("en", { numeric: true }).compare;

/** The pieces between which a name may be broken into lines: after slashes and underscores. */
export function pieces(name: string): string[] {
  return name.split(/(?<=[/_])(?=[^/_])/);
}
