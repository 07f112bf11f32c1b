import type { Model } from "../store/model";
import { counted, lasts, listed } from "./format";
import { people } from "./people";
import { recordingWords } from "./recording";
import { robots } from "./robots";

/** One line of the go or no-go checks. */
export interface Check {
  glyph: "act" | "soon" | "ok" | "late" | "never";
  what: string;
  value: string;
  fix: string;
}

/** The conditions for recording, checked before and during it, the worst first. */
export function checks(model: Model, now: number, lostSecs: number | undefined): Check[] {
  const all = [...required(model), ...ofPeople(model, now), ...ofRobots(model, now), clocks(model), recorded(model, lostSecs), disk(model)];
  const rank = (check: Check) => ["act", "soon", "never", "late", "ok"].indexOf(check.glyph);
  return all.sort((a, b) => rank(a) - rank(b));
}

/** The requirements of the study, as reported by `teampulse check`. */
function required(model: Model): Check[] {
  if (!model.unmet) return [];
  if (model.unmet.length === 0) return [{ glyph: "ok", what: "Required by the study", value: "all present", fix: "" }];
  return model.unmet.map(({ what, fix }): Check => {
    const [name = what, ...rest] = what.split(": ");
    return { glyph: "act", what: name, value: rest.join(": ") || "required, but missing", fix };
  });
}

function ofPeople(model: Model, now: number): Check[] {
  return people(model, now).flatMap((person) => {
    const ok = person.lights.filter((each) => each.state === "ok").map((each) => each.name);
    const bad = person.lights.filter((each) => each.state !== "ok").map((each): Check => {
      const glyph = each.state === "dead" ? "act" : each.state === "never" ? "never" : each.state === "late" ? "late" : "soon";
      return { glyph, what: `${person.id}: ${each.name}`, value: each.why, fix: each.remedy };
    });
    const fine: Check[] = ok.length > 0 ? [{ glyph: "ok", what: `${person.id}: ${listed(ok)}`, value: "ok", fix: "" }] : [];
    return [...bad, ...fine];
  });
}

function ofRobots(model: Model, now: number): Check[] {
  const all = robots(model, now);
  const bad = all.filter((each) => each.state !== "online").map((each): Check => {
    const alert = each.alerts[0];
    const glyph = each.state === "watch" ? "soon" : each.state === "never" ? "never" : "act";
    return { glyph, what: each.id, value: each.word.toLowerCase(), fix: alert?.remedy ?? "Check its power first, then its Wi-Fi." };
  });
  const ok = all.filter((each) => each.state === "online");
  const least = Math.min(...ok.flatMap((each) => (each.battery ? [each.battery.value] : [])));
  if (ok.length === 0) return bad;
  const names = ok.length > 5 ? counted(ok.length, "robot") : listed(ok.map((each) => each.id));
  return [...bad, { glyph: "ok", what: names, value: Number.isFinite(least) ? `battery ${Math.round(100 * least)} % or more` : "online", fix: "" }];
}

const COMPUTERS = new Set(["host", "remote", "two_way"]);

/** The clocks of computers; the clocks of sensors are assessed with the sensors. */
function clocks(model: Model): Check {
  const ofComputers = [...model.health.values()].filter((each) => COMPUTERS.has(each.clock));
  const known = ofComputers.flatMap((each) => (each.uncertainty_secs === null ? [] : [each.uncertainty_secs]));
  const worst = Math.max(0, ...known);
  if (known.length === 0) return { glyph: "late", what: "Clocks", value: "not known yet", fix: "Known after the first seconds of data." };
  const value = `${counted(known.length, "stream")} within ± ${Math.ceil(1000 * worst)} ms`;
  return worst > 0.1 ? { glyph: "soon", what: "Clocks", value, fix: "See Health for the stream; run chrony on its computer." } : { glyph: "ok", what: "Clocks", value, fix: "" };
}

function recorded(model: Model, lostSecs: number | undefined): Check {
  const words = recordingWords(model.recording, lostSecs);
  const glyph = words.kind === "on" ? "ok" : words.kind === "fail" ? "act" : words.kind === "none" ? "soon" : "late";
  return { glyph, what: words.kind === "on" ? "Recording" : words.title, value: words.detail, fix: words.kind === "fail" ? "Check the disk; see the terminal." : "" };
}

function disk(model: Model): Check {
  const recording = model.recording;
  if (!recording?.free_bytes || recording.bytes_per_sec <= 0) return { glyph: "late", what: "Disk", value: "free space unknown", fix: "" };
  const secs = recording.free_bytes / recording.bytes_per_sec;
  const glyph = secs < 1800 ? "act" : secs < 7200 ? "soon" : "ok";
  return { glyph, what: "Disk", value: `room for ${lasts(secs)}`, fix: glyph === "ok" ? "" : "Free some space, or record to another disk." };
}
