// A viewer by Foxglove's own client: lists the channels, subscribes to topics, decodes their messages by the definitions
// that came with them, and publishes a marker. Each line that it prints is a JSON object.
import { createRequire } from "node:module";

const require = createRequire(new URL("../../web/package.json", import.meta.url));
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const WebSocket = require("ws");

const [address, count, marker, ...topics] = process.argv.slice(2);
const say = (line) => console.log(JSON.stringify(line, (_, value) => (typeof value === "bigint" ? String(value) : ArrayBuffer.isView(value) ? [...value] : value)));
const client = new FoxgloveClient({ ws: new WebSocket(address, ["foxglove.sdk.v1", "foxglove.websocket.v1"]) });
const wanted = new Map();
let left = Number(count);

client.on("serverInfo", ({ name, capabilities, supportedEncodings }) => {
  say({ name, capabilities, supportedEncodings });
  if (marker) {
    const channel = client.advertise({ topic: "/session/events", encoding: "json", schemaName: "marker" });
    client.sendMessage(channel, new TextEncoder().encode(JSON.stringify({ label: marker })));
  }
});
client.on("status", ({ level, message }) => say({ status: message, level }));
client.on("error", (error) => say({ error: String(error) }));
client.on("advertise", (channels) => {
  for (const { id, topic, schema, schemaName, encoding, schemaEncoding } of channels) {
    say({ channel: topic, schemaName, encoding, schemaEncoding });
    if (!topics.includes(topic)) continue;
    const reader = new MessageReader(parse(schema, { ros2: true }));
    wanted.set(client.subscribe(id), { topic, reader });
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const { topic, reader } = wanted.get(subscriptionId);
  say({ topic, timestamp, message: reader.readMessage(data) });
  left -= 1;
  if (left === 0) process.exit(0);
});
