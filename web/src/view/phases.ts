import type { Model } from "../store/model";

/** A phase: done, current or still to come. */
export interface Phase {
  name: string;
  from: number;
  to: number | undefined;
  state: "done" | "now" | "next";
}

/** The past and the planned phases of the session. */
export function phases(model: Pick<Model, "events" | "byName" | "hello">, now: number): Phase[] {
  const own = model.byName.get("/session/events");
  const begun = model.events.filter((each) => each.kind === "phase" && each.stream === own?.id).sort((a, b) => a.t - b.t);
  const plan = model.hello?.phases ?? [];
  const known: Phase[] = begun.flatMap((event, k) => {
    if (event.label === "") return [];
    const next = begun[k + 1]?.t;
    const planned = plan.find((each) => each.name === event.label)?.lasts ?? null;
    const lasts = event.duration !== null && event.duration > 0 ? event.duration : planned;
    const planEnd = lasts !== null ? event.t + lasts : undefined;
    const to = next !== undefined && planEnd !== undefined ? Math.min(next, planEnd) : (next ?? planEnd);
    const isOver = to !== undefined && to <= now;
    return [{ name: event.label, from: event.t, to, state: isOver ? "done" : event.t > now ? "next" : "now" }];
  });
  const last = known.at(-1)?.from ?? -1;
  const names = known.map((each) => each.name);
  const coming = plan.filter((each) => each.from !== null && each.from > last && !names.includes(each.name));
  const ahead = coming.map(({ name, from, lasts }): Phase => {
    const begins = from ?? now;
    return { name, from: begins, to: lasts === null ? undefined : begins + lasts, state: "next" };
  });
  return [...known, ...ahead];
}

/** The current phase, and the next one. */
export function present(all: readonly Phase[]): { now: Phase | undefined; next: Phase | undefined; place: number } {
  const index = all.findIndex((each) => each.state === "now");
  return { now: all[index], next: all.find((each) => each.state === "next"), place: index };
}

/** The number of the current phase in the plan of the study, as `2 of 3`; if a name occurs more than once, its occurrences are counted. */
export function placeInPlan(all: readonly Phase[], plan: readonly { name: string }[]): string | undefined {
  const index = all.findIndex((each) => each.state === "now");
  const name = all[index]?.name;
  const turns = plan.flatMap((each, k) => (each.name === name ? [k + 1] : []));
  const before = all.slice(0, Math.max(0, index)).filter((each) => each.name === name).length;
  const number = turns[Math.min(before, turns.length - 1)];
  return number === undefined ? undefined : `${number} of ${plan.length}`;
}
