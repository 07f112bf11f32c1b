import type { Done } from "../store/actions.svelte";

/** The outcome of an action on this page, in words. */
export function inWords(done: Done): string {
  switch (done.state) {
    case "sent":
      return "sent";
    case "recorded":
      return "recorded, not yet on disk";
    case "on disk":
      return `in the bag, ± ${Math.ceil(done.offMs ?? 1)} ms`;
    case "unrecorded":
      return "not in a bag: nothing is recorded now";
    default:
      return done.reason;
  }
}

/** Whether an action is not, or may not be, in the bag. */
export function isLost(done: Done | undefined): boolean {
  return done?.state === "refused" || done?.state === "unanswered" || done?.state === "unrecorded";
}
