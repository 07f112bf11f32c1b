import { usual, type Choice } from "../view/signals";
import { live } from "./live.svelte";

/** The available window lengths [s]. */
export const WINDOWS = [5, 10, 30, 60, 120, 300] as const;
/** The maximum number of lines at once. */
export const MOST_LINES = 48;

/** The content of the Signals page; the layout is kept in this browser. */
class Signals {
  choices = $state<Choice[]>(remembered());
  windowSecs = $state(30);
  /** The end of the window while it is paused [s]. */
  pausedAt = $state<number | undefined>(undefined);
  cursor = $state<number | undefined>(undefined);
  selection = $state<[number, number] | undefined>(undefined);
  /** Increases when the scales should be fitted. */
  fit = $state(0);
  /** Whether the cameras are also shown. */
  video = $state(localStorage.getItem("video") !== "off");

  /** The chosen lines, or the default ones. */
  get lines(): Choice[] {
    return this.choices.length > 0 ? this.choices : usual(live.model);
  }

  get end(): number {
    return this.pausedAt ?? live.now() - 0.15;
  }

  choose(choice: Choice): void {
    const same = (each: Choice) => each.stream === choice.stream && each.channel === choice.channel;
    const lines = this.lines;
    this.choices = lines.some(same) ? lines.filter((each) => !same(each)) : [...lines, choice].slice(-MOST_LINES);
    localStorage.setItem("signals", JSON.stringify(this.choices));
  }

  reset(): void {
    this.choices = [];
    localStorage.removeItem("signals");
  }

  showVideo(isShown: boolean): void {
    this.video = isShown;
    localStorage.setItem("video", isShown ? "on" : "off");
  }

  pause(): void {
    this.pausedAt = this.pausedAt === undefined ? live.now() - 0.15 : undefined;
  }

  zoom(steps: number): void {
    const at = WINDOWS.findIndex((each) => each >= this.windowSecs);
    this.windowSecs = WINDOWS[Math.min(WINDOWS.length - 1, Math.max(0, at + steps))] ?? 30;
  }

  /** Moves the cursor, and the window with it when the cursor leaves it. */
  move(secs: number): void {
    this.pausedAt ??= this.end;
    this.cursor = Math.max(0, (this.cursor ?? this.end - this.windowSecs / 2) + secs);
    if (this.cursor > this.pausedAt) this.pausedAt = Math.min(live.now(), this.cursor);
    if (this.cursor < this.pausedAt - this.windowSecs) this.pausedAt = this.cursor + this.windowSecs;
  }

  /** Sets the start or the end of the selection to the cursor. */
  edge(isBegin: boolean): void {
    const at = this.cursor ?? this.end;
    const [from, to] = this.selection ?? [at, at];
    const edges: [number, number] = isBegin ? [at, Math.max(at, to)] : [Math.min(from, at), at];
    this.selection = edges;
  }

  key(event: KeyboardEvent): boolean {
    const step = this.windowSecs / 100;
    switch (event.key) {
      case " ": this.pause(); return true;
      case "ArrowLeft": this.move(-step * (event.shiftKey ? 10 : 1)); return true;
      case "ArrowRight": this.move(step * (event.shiftKey ? 10 : 1)); return true;
      case "+": case "=": this.zoom(-1); return true;
      case "-": case "−": this.zoom(1); return true;
      case "End": this.pausedAt = undefined; this.cursor = undefined; return true;
      case "Home": this.pausedAt = Math.max(this.windowSecs, live.now() - (live.model.hello?.stored_secs ?? 600) + this.windowSecs); return true;
      case "[": this.edge(true); return true;
      case "]": this.edge(false); return true;
      case "Enter":
        if (!this.selection || event.target instanceof HTMLButtonElement) return false;
        document.querySelector<HTMLElement>("#span-label")?.focus();
        return true;
      case "F":
        if (!event.shiftKey) return false;
        this.fit += 1;
        return true;
      default: return false;
    }
  }
}

function remembered(): Choice[] {
  try {
    const kept: unknown = JSON.parse(localStorage.getItem("signals") ?? "[]");
    const isChoice = (each: unknown): each is Choice => typeof each === "object" && each !== null && "stream" in each && "channel" in each;
    return Array.isArray(kept) ? kept.filter(isChoice) : [];
  } catch {
    return [];
  }
}

export const signals = new Signals();
