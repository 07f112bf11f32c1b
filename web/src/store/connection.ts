import type { FromBrowser, FromServer } from "../wire";

/** The delay before reconnecting: the first and the longest one [ms]. */
const FIRST_WAIT_MS = 300;
const LONGEST_WAIT_MS = 5000;
/** The silence after which a connection is given up [ms]. */
const SILENT_MS = 6000;

/** The callbacks of a connection. */
export interface Listener {
  text(message: FromServer): void;
  frame(frame: ArrayBuffer): void;
  opened(): void;
  closed(reason: string): void;
}

/** The connection to the server, reopened whenever it is lost. */
export class Connection {
  private socket: WebSocket | undefined;
  private waitMs = FIRST_WAIT_MS;
  private heardMs = 0;
  private over = false;

  constructor(
    private readonly url: string,
    private readonly listener: Listener,
  ) {
    setInterval(() => this.watch(), 1000);
  }

  /** Connects now. */
  open(): void {
    this.socket?.close();
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.heardMs = performance.now();
    socket.onopen = () => {
      this.waitMs = FIRST_WAIT_MS;
      this.listener.opened();
    };
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => this.take(event.data);
    socket.onclose = (event) => {
      if (socket !== this.socket) return;
      this.socket = undefined;
      this.listener.closed(event.reason);
      if (!this.over) setTimeout(() => this.socket ?? this.open(), this.wait());
    };
  }

  /** Sends a message; returns whether there is a connection. */
  send(message: FromBrowser): boolean {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** The session is over: a connection that closes is not reopened. */
  finish(): void {
    this.over = true;
  }

  private take(data: string | ArrayBuffer): void {
    this.heardMs = performance.now();
    if (typeof data === "string") this.listener.text(JSON.parse(data) as FromServer);
    else this.listener.frame(data);
  }

  private wait(): number {
    const wait = this.waitMs;
    this.waitMs = Math.min(LONGEST_WAIT_MS, 2 * wait);
    return wait;
  }

  private watch(): void {
    const silentMs = performance.now() - this.heardMs;
    if (this.socket && silentMs > SILENT_MS) this.socket.close();
  }
}
