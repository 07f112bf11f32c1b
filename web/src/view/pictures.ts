import type { Model } from "../store/model";
import { decodesVideo } from "../store/video";
import type { Stream } from "../wire";
import { sensorName } from "./words";

/** The message types of video, and all types whose pictures can be shown. */
const VIDEO = new Set(["foxglove_msgs/msg/CompressedVideo", "ffmpeg_image_transport_msgs/msg/FFMPEGPacket"]);
const SHOWN = new Set(["sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/Image", ...VIDEO]);

/** The cameras of the session, by topic. */
export function cameras(model: Model): Stream[] {
  const all = [...model.streams.values()].filter((stream) => !stream.hidden && !stream.private && stream.shape === "message" && (stream.signal === "image" || SHOWN.has(stream.message_type)));
  return all.sort((a, b) => (a.name < b.name ? -1 : 1));
}

/** Whether this browser can show the pictures of a camera: browsers decode video on secure pages only. */
export function isDecodable(stream: Stream, hasDecoder = decodesVideo()): boolean {
  return hasDecoder || !VIDEO.has(stream.message_type);
}

/** Why the pictures of a camera are not shown; empty if they are. */
export function unshown(model: Model, stream: Stream, hasDecoder = decodesVideo()): string {
  if (!isDecodable(stream, hasDecoder)) return "Browsers decode H.264 on secure pages only. Open this page via localhost or https.";
  if (!SHOWN.has(stream.message_type)) return `${stream.message_type || "Such messages"} can’t be shown`;
  return model.unshown.get(stream.id) ?? "";
}

/** The last parts of topic names that state how pictures are sent, not which camera sends them. */
const TRANSPORTS = new Set(["compressed", "image_raw", "image", "h264", "ffmpeg", "video"]);

/** The display name of a camera: `robot1 · camera`. */
export function cameraName(stream: Stream): string {
  const name = stream.signal === "image" ? "camera" : sensorName(stream);
  const leaf = stream.name.split("/").filter((part) => part !== stream.subject && !TRANSPORTS.has(part));
  const site = leaf.at(-1)?.replaceAll("_", " ");
  return [stream.subject, site && site !== "persons" ? site : name].filter(Boolean).join(" · ");
}
