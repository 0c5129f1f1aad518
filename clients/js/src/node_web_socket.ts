// Connections of Node: a WebSocket over `node:http`, without a package to install.
//
// Node 20 has no WebSocket of its own, and that of later ones can set no headers and hides why a request was refused.

import { createHash, randomBytes } from "node:crypto";
import * as http from "node:http";
import * as https from "node:https";
import type { Duplex } from "node:stream";
import { TextDecoder } from "node:util";
import type { Address, Connection, Dial, Listener } from "./connection.ts";
import { InputError, Unreachable } from "./errors.ts";
import { type Close, type Refusal, refused } from "./failures.ts";
import { encodeClose, encodeFrame, FrameReader, Opcode, type Piece, Violation } from "./node_web_socket_frames.ts";

/** TLS settings for `wss://`, as `node:https` takes them. */
export type Tls = Pick<
  https.RequestOptions,
  "ca" | "cert" | "key" | "passphrase" | "rejectUnauthorized" | "servername"
>;

/** Longest wait for the other side when closing. */
const CLOSE_TIMEOUT_S = 2;

/** Longest answer to a refused request that is read. */
const MOST_REFUSAL_BYTES = 65_536;

const GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"; // RFC 6455, section 1.3

/** A way to open connections over `node:http` and `node:https`. */
export function nodeDial(tls: Tls = {}): Dial {
  return (address, listener, signal) =>
    new Promise((resolve, reject) => {
      const key = randomBytes(16).toString("base64");
      const request = ask(address, key, tls, signal);
      request.on("upgrade", (response, socket, head) => {
        const accept = createHash("sha1")
          .update(key + GUID)
          .digest("base64");
        if (response.headers["sec-websocket-accept"] !== accept) {
          socket.destroy();
          reject(new Unreachable(`what answers at ${address.shown} is not a fervor service: it accepts no WebSocket`));
          return;
        }
        const subprotocol = response.headers["sec-websocket-protocol"] ?? "";
        resolve(new NodeConnection(socket, subprotocol, listener, head));
      });
      request.on("response", (response) => {
        refusalOf(response).then((refusal) => reject(refused(refusal, address.shown)));
      });
      request.on("error", (error) => reject(unreachable(error, address)));
      request.end();
    });
}

function ask(address: Address, key: string, tls: Tls, signal: AbortSignal): http.ClientRequest {
  const { url, subprotocol, token } = address;
  const secure = url.protocol === "wss:";
  const target = new URL(url);
  target.protocol = secure ? "https:" : "http:";
  const headers: http.OutgoingHttpHeaders = {
    Connection: "Upgrade",
    Upgrade: "websocket",
    "Sec-WebSocket-Key": key,
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Protocol": subprotocol,
    ...(token ? { Authorization: `Bearer ${token}` } : {}),
  };
  try {
    const options = { headers, signal, agent: false as const };
    return secure ? https.request(target, { ...options, ...tls }) : http.request(target, options);
  } catch (cause) {
    throw new InputError(`no request can be made for ${address.shown}; expected a token that fits into a header`, {
      cause,
    });
  }
}

async function refusalOf(response: http.IncomingMessage): Promise<Refusal> {
  const after = response.headers["retry-after"] ?? "";
  let body = "";
  try {
    for await (const chunk of response.setEncoding("utf8")) {
      body += chunk;
      if (body.length > MOST_REFUSAL_BYTES) break;
    }
  } catch {
    // the status says enough
  }
  return { status: response.statusCode ?? 0, retryAfter: /^\d+$/.test(after) ? Number(after) : undefined, body };
}

function unreachable(error: NodeJS.ErrnoException, { shown }: Address): Unreachable {
  const causes: Readonly<Record<string, string>> = {
    ECONNREFUSED: "connection refused; is `fervor serve` running there?",
    ENOTFOUND: "the name of the host is not known",
    EAI_AGAIN: "the name of the host can't be looked up",
  };
  const { code = "" } = error;
  if (code.startsWith("HPE_")) {
    return new Unreachable(`what answers at ${shown} is not a fervor service: its answer is no HTTP/1.1`, {
      cause: error,
    });
  }
  return new Unreachable(`no service answers at ${shown}: ${causes[code] ?? error.message}`, { cause: error });
}

/** An open WebSocket over the socket of an upgraded request. */
class NodeConnection implements Connection {
  readonly subprotocol: string;
  readonly #socket: Duplex;
  readonly #listener: Listener;
  readonly #reader = new FrameReader();
  readonly #utf8 = new TextDecoder("utf-8", { fatal: true });
  #close: Close | undefined; // as either side said
  #closing = false;
  #told = false;
  #patience: NodeJS.Timeout | undefined;

  constructor(socket: Duplex, subprotocol: string, listener: Listener, head: Buffer) {
    this.subprotocol = subprotocol;
    this.#socket = socket;
    this.#listener = listener;
    if ("setNoDelay" in socket) (socket as unknown as { setNoDelay(): void }).setNoDelay(); // frames are small and urgent
    socket.on("data", (chunk: Buffer) => this.#read(chunk));
    socket.on("error", () => {}); // a close follows
    socket.on("end", () => socket.end());
    socket.on("close", () => this.#closed());
    if (head.length > 0) socket.unshift(head);
  }

  send(payload: string | Uint8Array): void {
    if (this.#closing || !this.#socket.writable) return;
    const text = typeof payload === "string";
    this.#socket.write(encodeFrame(text ? Opcode.TEXT : Opcode.BINARY, text ? Buffer.from(payload) : payload));
  }

  close(): void {
    this.#goodbye(1000);
  }

  #read(chunk: Buffer): void {
    try {
      for (const piece of this.#reader.push(chunk)) this.#take(piece);
    } catch (error) {
      if (!(error instanceof Violation)) throw error;
      this.#close ??= { code: error.code, reason: error.message };
      this.#goodbye(error.code, error.message);
      this.#socket.removeAllListeners("data").resume(); // no more can be understood
      this.#socket.end();
    }
  }

  #take({ opcode, data }: Piece): void {
    if (opcode === Opcode.TEXT) this.#say(this.#text(data));
    else if (opcode === Opcode.BINARY)
      this.#say(new Uint8Array(data)); // a copy: the buffer is the socket's
    else if (opcode === Opcode.PING && !this.#closing) this.#socket.write(encodeFrame(Opcode.PONG, data));
    else if (opcode === Opcode.CLOSE) this.#takeClose(data);
    else if (opcode > Opcode.PONG) throw new Violation(1002, `a frame of the unknown type ${opcode}`);
  }

  #say(payload: string | Uint8Array): void {
    if (this.#close === undefined) this.#listener.message(payload);
  }

  #takeClose(data: Buffer): void {
    const code = data.length >= 2 ? data.readUInt16BE(0) : 1005;
    this.#close ??= { code, reason: this.#text(data.subarray(2)) };
    this.#goodbye(code === 1005 ? 1000 : code);
    this.#socket.end();
  }

  #text(data: Buffer): string {
    try {
      return this.#utf8.decode(data);
    } catch {
      throw new Violation(1007, "a text is not UTF-8");
    }
  }

  #goodbye(code: number, reason = ""): void {
    if (this.#closing) return;
    this.#closing = true;
    if (this.#socket.writable) this.#socket.write(encodeClose(code, reason));
    this.#patience = setTimeout(() => this.#socket.destroy(), 1000 * CLOSE_TIMEOUT_S);
  }

  #closed(): void {
    clearTimeout(this.#patience);
    if (this.#told) return;
    this.#told = true;
    this.#listener.closed(this.#close ?? { code: 1006, reason: "" });
  }
}
