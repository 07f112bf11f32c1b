/** THE table of pages, in the order of the rail and of their keys. */
export const PAGES = [
  { key: "team", title: "Team" },
  { key: "signals", title: "Signals" },
  { key: "session", title: "Session" },
  { key: "health", title: "Health" },
] as const;

export type PageKey = (typeof PAGES)[number]["key"];

/** The current page of this browser, and its display preferences. */
class Place {
  page = $state<PageKey>(fromHash());
  theme = $state<"light" | "dark">(remembered());
  /** The stream and channel whose origin is shown. */
  opened = $state<{ stream: number; channel: number } | undefined>(undefined);
  keysShown = $state(false);
  /** Whether landmarks are drawn on pictures. */
  landmarks = $state(localStorage.getItem("landmarks") !== "hidden");

  go(page: PageKey): void {
    location.hash = `/${page}`;
    this.page = page;
  }

  toggleTheme(): void {
    this.theme = this.theme === "dark" ? "light" : "dark";
    localStorage.setItem("theme", this.theme);
  }

  toggleLandmarks(): void {
    this.landmarks = !this.landmarks;
    localStorage.setItem("landmarks", this.landmarks ? "shown" : "hidden");
  }

  open(stream: number, channel: number): void {
    this.opened = { stream, channel };
  }
}

function fromHash(): PageKey {
  const name = location.hash.replace(/^#\/?/, "");
  return PAGES.find((each) => each.key === name)?.key ?? "team";
}

function remembered(): "light" | "dark" {
  const asked = new URLSearchParams(location.search).get("theme") ?? localStorage.getItem("theme");
  if (asked === "dark" || asked === "light") return asked;
  return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

export const place = new Place();
addEventListener("hashchange", () => (place.page = fromHash()));
