import type { FromServer } from "../src/wire";
import { Feed } from "./feed";

/** Stands for the connection, so that pages can be looked at without a server: `npm run dev`, then /dev/. */
class FeedSocket {
  static readonly OPEN = 1;
  readyState = 1;
  binaryType = "";
  onopen: (() => void) | undefined;
  onmessage: ((event: { data: string | ArrayBuffer }) => void) | undefined;
  onclose: (() => void) | undefined;
  private readonly feed: Feed;

  constructor() {
    const robots = Number(new URLSearchParams(location.search).get("robots") ?? 5);
    const send = (message: FromServer | ArrayBuffer) =>
      this.onmessage?.({ data: message instanceof ArrayBuffer ? message : JSON.stringify(message) });
    this.feed = new Feed(send, robots);
    setTimeout(() => {
      this.onopen?.();
      this.feed.start();
    }, 10);
  }

  send(text: string): void {
    this.feed.take(JSON.parse(text));
  }

  close(): void {
    this.readyState = 3;
  }
}

Object.assign(globalThis, { WebSocket: FeedSocket });
await import("../src/main");
