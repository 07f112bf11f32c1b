/** THE table of panels: a file each, and where each stands is up to its page. */
export { default as Alerts } from "./Alerts.svelte";
export { default as Banner } from "./Banner.svelte";
export { default as GoNoGo } from "./GoNoGo.svelte";
export { default as Isa } from "./Isa.svelte";
export { default as Keys } from "./Keys.svelte";
export { default as LogPanel } from "./LogPanel.svelte";
export { default as MapPanel } from "./MapPanel.svelte";
export { default as Markers } from "./Markers.svelte";
export { default as Notes } from "./Notes.svelte";
export { default as Origin } from "./Origin.svelte";
export { default as People } from "./People.svelte";
export { default as Rail } from "./Rail.svelte";
export { default as RecordingBar } from "./RecordingBar.svelte";
export { default as Robots } from "./Robots.svelte";
export { default as Timeline } from "./Timeline.svelte";
