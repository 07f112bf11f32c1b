import type { Found } from "../view/points";

/** A width and a height. */
export interface Size {
  w: number;
  h: number;
}

/** The landmarks of a picture, and their colour. */
export interface Drawn {
  found: Found;
  colour: string;
}

/** The position of a whole picture in a box with another aspect ratio. */
export function placed(picture: Size, box: Size): { scale: number; left: number; top: number } {
  const scale = Math.min(box.w / picture.w, box.h / picture.h);
  return { scale, left: (box.w - scale * picture.w) / 2, top: (box.h - scale * picture.h) / 2 };
}

/** Draws landmarks over their picture in a box; landmarks outside the picture are left out. */
export function drawFound(x: CanvasRenderingContext2D, all: readonly Drawn[], picture: Size, box: Size, ground: string): void {
  const { scale, left, top } = placed(picture, box);
  // The centre of a picture's first pixel is 0, 0.
  const at = (point: { x: number; y: number }): [number, number] => [left + scale * (point.x + 0.5), top + scale * (point.y + 0.5)];
  // A point stays a point on a small picture and does not cover a face on a large one.
  const radius = Math.min(4, Math.max(1.25, Math.min(box.w, box.h) / 110));
  x.save();
  x.beginPath();
  x.rect(left, top, scale * picture.w, scale * picture.h);
  x.clip();
  x.lineCap = x.lineJoin = "round";
  for (const { found, colour } of all) {
    const shapes = new Path2D();
    for (const line of found.lines) trace(shapes, line.map(at));
    if (found.box) {
      const [from, to] = [at({ x: found.box.left, y: found.box.top }), at({ x: found.box.left + found.box.width, y: found.box.top + found.box.height })];
      shapes.rect(from[0], from[1], to[0] - from[0], to[1] - from[1]);
    }
    const dots = new Path2D();
    for (const point of found.points) dot(dots, at(point), radius);
    // A rim in the page's colour keeps the lines visible on a picture of any colour.
    x.strokeStyle = ground;
    x.lineWidth = 1.1 * radius + 2;
    x.stroke(shapes);
    x.lineWidth = 2;
    x.stroke(dots);
    x.strokeStyle = x.fillStyle = colour;
    x.lineWidth = 1.1 * radius;
    x.stroke(shapes);
    x.fill(dots);
  }
  x.restore();
}

function trace(path: Path2D, line: readonly (readonly [number, number])[]): void {
  line.forEach(([x, y], k) => (k === 0 ? path.moveTo(x, y) : path.lineTo(x, y)));
}

function dot(path: Path2D, [x, y]: readonly [number, number], radius: number): void {
  path.moveTo(x + radius, y);
  path.arc(x, y, radius, 0, 2 * Math.PI);
}
