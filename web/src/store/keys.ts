import { waiting, alertsOf } from "../view/alerts";
import { live } from "./live.svelte";
import { PAGES, place } from "./page.svelte";

/** A page's own key handler; returns whether it handled the key. */
type PageKeys = (event: KeyboardEvent) => boolean;
let ofPage: PageKeys | undefined;

/** Registers the key handler of the shown page; call the result to remove it. */
export function pageKeys(keys: PageKeys): () => void {
  ofPage = keys;
  return () => {
    if (ofPage === keys) ofPage = undefined;
  };
}

function isTyping(target: EventTarget | null): boolean {
  return target instanceof HTMLElement && target.matches("input, textarea, select, [contenteditable]");
}

/** Bare letters set the study's markers at the time of the key press; other keys belong to the page. */
export function onKey(event: KeyboardEvent): void {
  if (event.key === "Escape") {
    place.opened = undefined;
    place.keysShown = false;
    if (isTyping(event.target) && event.target instanceof HTMLElement) event.target.blur();
    return;
  }
  if (isTyping(event.target) || event.ctrlKey || event.metaKey || event.altKey || event.repeat) {
    if (event.repeat && !isTyping(event.target) && !(live.isReplay && replayed(event))) ofPage?.(event);
    return;
  }
  if (event.key === "?") {
    place.keysShown = !place.keysShown;
    event.preventDefault();
    return;
  }
  if (live.isReplay && replayed(event)) event.preventDefault();
  else if (ofPage?.(event)) event.preventDefault();
  else if (event.shiftKey ? shifted(event) : bare(event)) event.preventDefault();
}

/** Moves the position in a recording. */
function replayed(event: KeyboardEvent): boolean {
  const step = event.shiftKey ? 10 : 1;
  switch (event.key) {
    case " ":
      if (event.target instanceof HTMLButtonElement) return false;
      live.play({ paused: !(live.playback?.paused ?? false) });
      return true;
    case "ArrowLeft":
      live.step(-step);
      return true;
    case "ArrowRight":
      live.step(step);
      return true;
    case "Home":
      live.play({ t: 0 });
      return true;
    case "End":
      live.play({ t: live.playback?.length ?? null });
      return true;
    default:
      return false;
  }
}

function shifted(event: KeyboardEvent): boolean {
  switch (event.code) {
    case "KeyA":
      acknowledgeOldest(event.timeStamp);
      return true;
    case "KeyP":
      if (live.actions.may("next_phase")) live.actions.command("next_phase", event.timeStamp);
      return true;
    case "KeyL":
      place.toggleLandmarks();
      return true;
    case "KeyN":
      place.go("session");
      setTimeout(() => document.querySelector<HTMLElement>("#note")?.focus(), 50);
      return true;
    default:
      return false;
  }
}

function bare(event: KeyboardEvent): boolean {
  const own = live.model.hello?.markers.find((each) => each.key === event.key);
  if (own) return mark(own.label, event);
  const page = PAGES[Number(event.key) - 1];
  if (page) {
    place.go(page.key);
    return true;
  }
  if (event.key === "/") {
    document.querySelector<HTMLElement>("input[type=search]")?.focus();
    return true;
  }
  return /^[a-z]$/.test(event.key) && mark(event.key, event);
}

function mark(label: string, event: KeyboardEvent): boolean {
  if (!live.actions.may("mark")) return false;
  live.actions.command(`mark ${label}`, event.timeStamp);
  return true;
}

/** Acknowledges the oldest of the most urgent alerts. */
export function acknowledgeOldest(browserMs: number): void {
  const alerts = alertsOf(live.model, live.now()).filter((each) => each.stage === "open");
  const oldest = alerts[0];
  if (oldest && waiting(alerts).oldestSecs >= 0) live.actions.acknowledge(oldest.key, browserMs);
}
