import type { Recording } from "../wire";
import { age, longClock } from "./format";

/** The time without a sync to disk after which the recording counts as not growing [s]. */
const STILL_SECS = 2.5;

/** The recording in words. */
export interface RecordingWords {
  kind: "unknown" | "none" | "on" | "fail";
  title: string;
  detail: string;
}

/** The text of the recording bar; `recording` is `undefined` if unknown, as without a connection. */
export function recordingWords(recording: Recording | undefined, lostSecs: number | undefined): RecordingWords {
  if (!recording) return { kind: "unknown", title: "Recording ?", detail: "not known yet" };
  const elapsed = longClock(recording.elapsed_secs);
  if (lostSecs !== undefined) return { kind: "unknown", title: "Recording ?", detail: `was ${elapsed}, ${age(lostSecs)} ago` };
  const still = recording.sync_age_secs ?? 0;
  switch (recording.stage) {
    case "nothing":
      return { kind: "none", title: "Not recording", detail: "no sink stores data" };
    case "tables":
      return { kind: "none", title: "No bag", detail: "tables only" };
    case "not_begun":
      return { kind: "none", title: elapsed, detail: "starting" };
    case "paused": {
      const kept = recording.kept_secs ?? 0;
      return { kind: "none", title: "Not recording", detail: kept > 0 ? `paused, last ${kept.toFixed(0)} s kept` : "paused" };
    }
    case "ended_early":
      return { kind: "fail", title: "Recording ended", detail: recording.reason };
    case "finished":
      return { kind: "none", title: "Finished", detail: "the bag is complete" };
    case "open":
      return still > STILL_SECS
        ? { kind: "fail", title: "Not growing", detail: `nothing on disk for ${age(still)}` }
        : { kind: "on", title: elapsed, detail: `on disk ${age(still)} ago` };
  }
}
