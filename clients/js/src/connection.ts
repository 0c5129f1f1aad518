// What a session asks of a transport: connections that carry messages both ways.

import type { Payload } from "./codec.ts";
import type { Close } from "./failures.ts";

/** What to connect to. */
export interface Address {
  readonly url: URL;
  /** The address without secrets, for sentences. */
  readonly shown: string;
  readonly subprotocol: string;
  readonly token: string | undefined;
}

/** Who is told what comes. */
export interface Listener {
  message(payload: Payload): void;
  /** Once, and nothing after it. */
  closed(close: Close): void;
}

/** An open WebSocket. */
export interface Connection {
  /** What the service chose; empty if nothing. */
  readonly subprotocol: string;
  /** Without effect once it is closed. */
  send(payload: Payload): void;
  /** Say goodbye, with code 1000. */
  close(): void;
}

/** Opens a connection; rejects with a FervorError. An abort of `signal` ends the attempt. */
export type Dial = (address: Address, listener: Listener, signal: AbortSignal) => Promise<Connection>;
