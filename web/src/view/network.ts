import type { Bus, Computer } from "../wire";
import { age, decimal, grouped } from "./format";

/** How the clock of another computer is known, in words. */
export function knownBy({ known_by, round_trip_secs, probe_age_secs }: Computer): string {
  const probed = round_trip_secs === null ? "" : `${decimal(1000 * round_trip_secs, 1)} ms round trip`;
  const when = probe_age_secs === null ? "" : `, ${age(probe_age_secs)} ago`;
  switch (known_by) {
    case "probes":
      return `probed${probed ? `, ${probed}${when}` : ""}`;
    case "stamps":
      return "by the stamps of received messages: run teampulse there to probe it";
    default:
      return probed ? `probed, ${probed}${when}; it stamps no stream yet` : "not known yet: no message stamped by it has arrived";
  }
}

/** The losses on a bus: unknown is never 0. */
export function lostOn({ lost, uncounted }: Bus): string {
  if (lost === null) return "?";
  return uncounted > 0 ? `${grouped(lost)}, ? of ${uncounted}` : grouped(lost);
}
