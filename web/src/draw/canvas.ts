/** The colours and the font of the page, read once for each theme. */
export interface Ink {
  of: (token: string) => string;
  font: (weight?: number) => string;
  size: number;
  /** A key that differs for every theme, screen and size. */
  theme: string;
}

let known: { theme: string; ink: Ink } | undefined;

/** The page's current colours. */
export function ink(): Ink {
  const theme = `${document.documentElement.dataset["theme"] ?? ""}${devicePixelRatio}${innerWidth >= 1600}`;
  if (known?.theme === theme) return known.ink;
  const style = getComputedStyle(document.documentElement);
  const colours = new Map<string, string>();
  const size = Math.round(parseFloat(style.fontSize) * 0.6875 * 10) / 10;
  const family = style.getPropertyValue("--font");
  const of = (token: string) => {
    const colour = colours.get(token) ?? style.getPropertyValue(`--${token}`).trim();
    colours.set(token, colour);
    return colour;
  };
  known = { theme, ink: { of, size, theme, font: (weight = 400) => `${weight} ${size}px ${family}` } };
  return known.ink;
}

/** Fits a canvas to its element's size and keeps its content; `undefined` while it has no size. A canvas on a panel is opaque, which is cheaper. */
export function fitted(canvas: HTMLCanvasElement, ground?: string): { x: CanvasRenderingContext2D; w: number; h: number; scale: number } | undefined {
  const [w, h] = [canvas.clientWidth, canvas.clientHeight];
  const x = canvas.getContext("2d", { alpha: ground === undefined });
  if (!x || w === 0 || h === 0) return undefined;
  const scale = devicePixelRatio || 1;
  const [width, height] = [Math.round(w * scale), Math.round(h * scale)];
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  x.setTransform(scale, 0, 0, scale, 0, 0);
  x.font = ink().font();
  x.textBaseline = "middle";
  return { x, w, h, scale };
}

/** Fits a canvas to its element's size and clears it; `undefined` while it has no size. */
export function prepared(canvas: HTMLCanvasElement): { x: CanvasRenderingContext2D; w: number; h: number } | undefined {
  const sized = fitted(canvas);
  sized?.x.clearRect(0, 0, sized.w, sized.h);
  return sized;
}

/** Diagonal lines over a part of a canvas. */
export function hatch(x: CanvasRenderingContext2D, left: number, right: number, top: number, bottom: number, colour: string): void {
  x.save();
  x.beginPath();
  x.rect(left, top, right - left, bottom - top);
  x.clip();
  x.strokeStyle = colour;
  x.lineWidth = 1.5;
  x.beginPath();
  for (let p = left - (bottom - top); p < right; p += 6) {
    x.moveTo(p, bottom);
    x.lineTo(p + bottom - top, top);
  }
  x.stroke();
  x.restore();
}

/** A word on its own background, so that it is legible above a trace. */
export function label(x: CanvasRenderingContext2D, text: string, at: number, y: number, colour: string, ground: string): void {
  const width = x.measureText(text).width + 8;
  x.fillStyle = ground;
  x.fillRect(at - width / 2, y - 8, width, 16);
  x.fillStyle = colour;
  x.textAlign = "center";
  x.fillText(text, at, y);
  x.textAlign = "left";
}

/** Round numbers that divide a scale into a few parts. */
export function ticks(low: number, high: number, most: number): number[] {
  const rough = (high - low) / Math.max(1, most);
  if (!(rough > 0)) return [];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= rough) ?? 10 * power;
  const found: number[] = [];
  for (let at = Math.ceil(low / step) * step; at <= high + step * 1e-6; at += step) found.push(Math.round(at / step) * step);
  return found;
}
