/** What is drawn again with each frame. */
const drawn = new Set<{ draw: () => void; canvas: Element }>();
const visible = new Set<Element>();
let running = false;
let last = 0;

/** The browser's frames go on at full speed. A few strips are drawn 30 times a second, many less often, so that all of them
 * together take a bounded part of a processor: each at least 12 times. */
const [SHORTEST_MS, LONGEST_MS] = [33, 80];
const MS_FOR_EACH = 3.3;
/** With reduced motion strips step. */
const REDUCED_MS = 200;

const reduced = matchMedia("(prefers-reduced-motion: reduce)");
const watcher = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (isIntersecting) visible.add(target);
    else visible.delete(target);
  }
});

/** Draws a canvas again and again while it is in view; the result ends that. */
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

/** Draws with the next frame: the page changes with it anyway, and is painted once instead of twice. */
export function drawSoon(): void {
  last = Number.NEGATIVE_INFINITY;
}

/** From one drawing to the next [ms]. */
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
  last = now;
  for (const { draw, canvas } of drawn) if (visible.has(canvas)) draw();
}
