// Connections over the WebSocket that browsers have.
//
// It tells nothing of the answer where a request is refused, and can set no headers: the token goes among the
// subprotocols, and why there is no connection is asked for by HTTP, which works where the page may read the answer.

import type { Address, Connection, Dial, Listener } from "./connection.ts";
import { type FervorError, InputError, Unreachable } from "./errors.ts";
import { refused } from "./failures.ts";

const TOKEN = /^[\w!#$%&'*+\-.^`|~]+$/; // RFC 7230, token

/** A connection over the global WebSocket. */
export const dialWebSocket: Dial = (address, listener, signal) =>
  new Promise((resolve, reject) => {
    const socket = new WebSocket(address.url, subprotocols(address));
    socket.binaryType = "arraybuffer";
    const giveUp = () => socket.close();
    signal.addEventListener("abort", giveUp);
    const failed = () => {
      signal.removeEventListener("abort", giveUp);
      reasonOf(address, signal).then(reject, reject);
    };
    socket.addEventListener("close", failed);
    socket.addEventListener("open", () => {
      signal.removeEventListener("abort", giveUp);
      socket.removeEventListener("close", failed);
      listen(socket, listener);
      resolve(new WebSocketConnection(socket));
    });
  });

class WebSocketConnection implements Connection {
  readonly #socket: WebSocket;

  constructor(socket: WebSocket) {
    this.#socket = socket;
  }

  get subprotocol(): string {
    return this.#socket.protocol;
  }

  send(payload: string | Uint8Array): void {
    if (this.#socket.readyState === WebSocket.OPEN) this.#socket.send(payload as string | Uint8Array<ArrayBuffer>);
  }

  close(): void {
    this.#socket.close(1000);
  }
}

function listen(socket: WebSocket, listener: Listener): void {
  socket.addEventListener("message", ({ data }: MessageEvent<string | ArrayBuffer>) =>
    listener.message(typeof data === "string" ? data : new Uint8Array(data)),
  );
  socket.addEventListener("close", ({ code, reason }) => listener.closed({ code, reason }));
}

function subprotocols({ subprotocol, token }: Address): string[] {
  if (!token) return [subprotocol];
  if (TOKEN.test(token)) return [subprotocol, `fervor.token.${token}`];
  throw new InputError(
    "the token holds characters that a browser can't send; expected letters, digits and !#$%&'*+-.^_`|~",
  );
}

/** Why there is no connection, as far as a web page may know. */
async function reasonOf({ url, shown, token }: Address, signal: AbortSignal): Promise<FervorError> {
  const address = new URL(url);
  address.protocol = url.protocol === "wss:" ? "https:" : "http:";
  const silent = `no session could be opened at ${shown}: no service answers there, or it refused this page`;
  try {
    const headers: HeadersInit = token ? { Authorization: `Bearer ${token}` } : {};
    const answer = await fetch(address, { headers, signal, cache: "no-store" });
    if (answer.status !== 426) return refused({ status: answer.status, body: await answer.text() }, shown);
    return new Unreachable(
      `the service at ${shown} opened no session: it has no room, or something on the way refused`,
    );
  } catch (cause) {
    return new Unreachable(silent, { cause });
  }
}
