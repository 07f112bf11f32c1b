import type { Model } from "../store/model";
import { byName } from "./format";
import { stateOf } from "./words";

/** The cameras and microphones that are on. */
export interface Watching {
  cameras: string[];
  microphones: string[];
}

/** The states in which a device delivers data. */
const ON = new Set(["ok", "late", "degraded"]);

/** The subjects with pictures or sound now: people, robots, or the team. */
export function watching(model: Model): Watching {
  const of = (signal: string) => {
    const on = [...model.streams.values()].filter((each) => each.signal === signal && !each.derived && ON.has(stateOf(model.health.get(each.id))));
    return [...new Set(on.map((each) => each.subject || "the team"))].sort(byName);
  };
  return { cameras: of("image"), microphones: of("audio") };
}

/** The devices that are on, in words; if there are many, only the first ones are named. */
export function words({ cameras, microphones }: Watching): string {
  const of = (device: string, names: string[]) => (names.length > 0 ? [`${device} on: ${few(names)}`] : []);
  return [...of("camera", cameras), ...of("microphone", microphones)].join(" · ");
}

function few(names: readonly string[]): string {
  return names.length <= 3 ? names.join(", ") : `${names.slice(0, 2).join(", ")} and ${names.length - 2} more`;
}
