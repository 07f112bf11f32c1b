/** The canvases that are redrawn continuously. */
const drawn = new Set<{ draw: () => void; canvas: Element }>();
const visible = new Set<Element>();
let running = false;
let last = 0;

/** The browser's frames continue at full rate. A few strips are drawn 30 times a second, many less often, so that all of them
 * together use a bounded share of a processor: each at least 12 times. */
const [SHORTEST_MS, LONGEST_MS] = [33, 80];
const MS_FOR_EACH = 3.3;
/** Samples that arrive at a steady pace may each wait for nearly a whole step. If they wait for more than this share of it,
 * the next drawing is one frame later, until samples arrive just before it. */
const LONG = 0.6;
const [FRAME_MS, JUDGED_MS] = [1000 / 60, 1000];
/** The interval between drawings with reduced motion [ms]. */
const REDUCED_MS = 200;

const reduced = matchMedia("(prefers-reduced-motion: reduce)");
const watcher = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (isIntersecting) visible.add(target);
    else visible.delete(target);
  }
});

/** Redraws a canvas continuously while it is in view; call the result to stop. */
export function everyFrame(canvas: Element, draw: () => void): () => void {
  const entry = { draw, canvas };
  drawn.add(entry);
  watcher.observe(canvas);
  if (!running) {
    running = true;
    requestAnimationFrame(frame);
  }
  return () => {
    drawn.delete(entry);
    watcher.unobserve(canvas);
    visible.delete(canvas);
  };
}

/** Draws with the next frame: the page changes then anyway, and is painted once instead of twice. */
export function drawSoon(): void {
  last = Number.NEGATIVE_INFINITY;
}

/** Samples waiting to be drawn: the sum of their arrival times [ms] and their number; and how long drawn samples had waited. */
const waiting = { sum: 0, count: 0 };
const waited = { sum: 0, count: 0, since: 0 };

/** Registers samples that will be drawn. */
export function arrived(): void {
  waiting.sum += performance.now();
  waiting.count += 1;
}

/** The delay of the next drawing [ms], computed once a second. */
function shift(now: number): number {
  waited.sum += waiting.count * now - waiting.sum;
  waited.count += waiting.count;
  waiting.sum = waiting.count = 0;
  if (now - waited.since < JUDGED_MS) return 0;
  const isLong = waited.sum > waited.count * LONG * step();
  waited.sum = waited.count = 0;
  waited.since = now;
  return isLong ? FRAME_MS : 0;
}

/** The interval between drawings [ms]. */
function step(): number {
  if (reduced.matches) return REDUCED_MS;
  return Math.min(LONGEST_MS, Math.max(SHORTEST_MS, MS_FOR_EACH * visible.size));
}

function frame(now: number): void {
  if (drawn.size === 0) {
    running = false;
    return;
  }
  requestAnimationFrame(frame);
  if (now - last < step() - 1) return;
  last = now + shift(now);
  for (const { draw, canvas } of drawn) if (visible.has(canvas)) draw();
}
