import type { Model } from "../store/model";
import type { Stream } from "../wire";
import { sensorName } from "./words";

/** The messages whose pictures are shown. */
const SHOWN = new Set(["sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/Image"]);

/** The cameras of the session, by topic. */
export function cameras(model: Model): Stream[] {
  const all = [...model.streams.values()].filter((stream) => !stream.hidden && stream.shape === "message" && (stream.signal === "image" || SHOWN.has(stream.message_type)));
  return all.sort((a, b) => (a.name < b.name ? -1 : 1));
}

/** Why the pictures of a camera are not shown; empty where they are. */
export function unshown(model: Model, stream: Stream): string {
  if (!SHOWN.has(stream.message_type)) return `${stream.message_type || "Such messages"} can’t be shown`;
  return model.unshown.get(stream.id) ?? "";
}

/** What people call a camera: `robot1 · camera`. */
export function cameraName(stream: Stream): string {
  const name = stream.signal === "image" ? "camera" : sensorName(stream);
  const leaf = stream.name.split("/").filter((part) => part !== stream.subject && part !== "compressed" && part !== "image_raw" && part !== "image");
  const site = leaf.at(-1)?.replaceAll("_", " ");
  return [stream.subject, site && site !== "persons" ? site : name].filter(Boolean).join(" · ");
}
