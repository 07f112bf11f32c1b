import type { Echo, FromBrowser, Refused } from "../wire";
import type { Live } from "./live.svelte";

/** The time without an echo after which a click counts as not in the bag [ms]. */
const UNANSWERED_MS = 2000;
/** The number of the newest actions that are kept. */
const KEPT = 50;

/** A user action on this page, and its outcome. */
export interface Done {
  reference: string;
  /** The kind of action: `mark`, `span`, `note`, `acknowledge`, `report` or the verb of another command. */
  verb: string;
  /** The marker's label, the note, … */
  text: string;
  /** The time of the action [s]. */
  at: number | undefined;
  sentMs: number;
  state: "sent" | "recorded" | "on disk" | "unrecorded" | "refused" | "unanswered";
  /** The uncertainty of the action's time in the bag [ms]. */
  offMs: number | undefined;
  /** Why the action was refused, and the remedy. */
  reason: string;
}

/** The user actions on this page. */
export class Actions {
  done = $state.raw<Done[]>([]);

  constructor(private readonly live: Live) {}

  /** Whether the viewer may send commands of this verb. */
  may(verb: string): boolean {
    return this.live.model.hello?.viewer.commands.includes(verb) ?? false;
  }

  /** Whether the viewer may write notes, report and acknowledge. */
  get mayWrite(): boolean {
    const right = this.live.model.hello?.viewer.right;
    if (this.live.isReplay) return false;
    return right === "mark" || right === "control";
  }

  /** Sends a command with a time by the browser's clock [ms]. */
  command(text: string, browserMs: number): void {
    const [verb = "", ...rest] = text.split(" ");
    this.send(verb, rest.join(" "), browserMs, (reference, at) => ({ type: "command", reference, text, at }));
  }

  note(text: string, browserMs: number): void {
    this.send("note", text, browserMs, (reference, at) => ({ type: "note", reference, text, at }));
  }

  /** Labels a span of the signals [s]. */
  annotate(text: string, [from, to]: readonly [number, number], browserMs: number): void {
    this.send("span", text, browserMs, (reference) => ({ type: "annotate", reference, text, from, to }));
  }

  acknowledge(alert: string, browserMs: number): void {
    this.send("acknowledge", alert, browserMs, (reference, at) => ({ type: "acknowledge", reference, alert, at }));
  }

  report(subject: string | null, value: number, browserMs: number): void {
    this.send("report", `isa ${value}`, browserMs, (reference, at) => ({
      type: "report", reference, subject, scale: "isa", value, at,
    }));
  }

  showEstimates(browserMs: number): void {
    this.send("show_estimates", "", browserMs, (reference) => ({ type: "show_estimates", reference }));
  }

  echo(echo: Echo): void {
    const half = this.live.clock.uncertaintyMs ?? 0;
    this.change(echo.reference, {
      state: echo.on_disk === null ? "unrecorded" : echo.on_disk ? "on disk" : "recorded",
      offMs: Math.max(1, half) + Math.abs(echo.off_secs ?? 0) * 1000,
    });
  }

  refuse(refused: Refused): void {
    const reason = refused.hint ? `${refused.reason}. ${refused.hint}` : refused.reason;
    if (refused.reference !== null) this.change(refused.reference, { state: "refused", reason });
  }

  /** The connection is lost: unanswered actions may not be in the bag. */
  lose(): void {
    const reason = "The connection was lost before the answer";
    this.done = this.done.map((each) => (each.state === "sent" ? { ...each, state: "unanswered", reason } : each));
  }

  private send(verb: string, text: string, browserMs: number, message: (reference: string, at: number | null) => FromBrowser): void {
    const reference = this.live.reference();
    const at = this.live.clock.at(browserMs);
    const isSent = this.live.send(message(reference, at ?? null));
    const state = isSent ? "sent" : "unanswered";
    const reason = isSent ? "" : "There is no connection";
    const done: Done = { reference, verb, text, at, sentMs: performance.now(), state, offMs: undefined, reason };
    this.done = [done, ...this.done].slice(0, KEPT);
    setTimeout(() => this.expire(reference), UNANSWERED_MS);
  }

  private expire(reference: string): void {
    const isOpen = this.done.some((each) => each.reference === reference && each.state === "sent");
    if (isOpen) this.change(reference, { state: "unanswered", reason: "Not in the bag after 2 s" });
  }

  private change(reference: string, change: Partial<Done>): void {
    this.done = this.done.map((each) => (each.reference === reference ? { ...each, ...change } : each));
  }
}
