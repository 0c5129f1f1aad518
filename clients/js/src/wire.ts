// One connection of a session: dialled, started, written, read and kept alive until it is gone.

import type { Payload } from "./codec.ts";
import type { Address, Connection, Dial } from "./connection.ts";
import type { Conversation, News } from "./conversation.ts";
import { FervorError, Unreachable } from "./errors.ts";
import { type Close, closed } from "./failures.ts";

/** Silence after which the service is asked whether it is there; a network may go away without a word. */
export const KEEPALIVE_S = 5;

/** Longest wait for its answer: a loaded service may be slow. */
export const KEEPALIVE_PATIENCE_S = 10;

/** How to connect. */
export interface Way {
  readonly dial: Dial;
  readonly address: Address;
  /** For connecting and starting, seconds. */
  readonly openTimeoutS: number;
  /** The monotonic clock, seconds. */
  readonly now: () => number;
}

/** One connection. */
export class Wire {
  readonly #conversation: Conversation;
  readonly #way: Way;
  readonly #tell: (news: readonly News[]) => void;
  readonly #abort = new AbortController();
  #connection: Connection | undefined;
  #gone: ((failure: FervorError) => void) | undefined;
  #opening: Timer;
  #pause: Timer;
  #quiet: Timer;
  #heard = 0; // seconds, when the newest message came
  #asked = -Infinity; // seconds, when the newest ping left

  /** `tell`: called after every message, with the news that it brings. */
  constructor(conversation: Conversation, way: Way, tell: (news: readonly News[]) => void) {
    this.#conversation = conversation;
    this.#way = way;
    this.#tell = tell;
  }

  /** Connect, start or resume the conversation, and carry it on; why the connection is gone. */
  run(): Promise<FervorError> {
    const { dial, address, openTimeoutS } = this.#way;
    const late = new Unreachable(`no service answered at ${address.shown} in time`);
    const listener = {
      message: (payload: Payload) => this.#message(payload),
      closed: (close: Close) => this.end(closed(close, address.shown, this.#conversation.inFlight)),
    };
    return new Promise((resolve) => {
      this.#gone = resolve;
      this.#opening = setTimeout(() => this.end(late), 1000 * openTimeoutS);
      dial(address, listener, this.#abort.signal).then(
        (connection) => this.#opened(connection),
        (error) => this.end(error instanceof FervorError ? error : new Unreachable(String(error), { cause: error })),
      );
    });
  }

  /** Hang up. */
  end(failure: FervorError): void {
    for (const timer of [this.#opening, this.#pause, this.#quiet]) clearTimeout(timer);
    const gone = this.#gone;
    this.#gone = undefined;
    this.#abort.abort(failure);
    this.#connection?.close();
    gone?.(failure);
  }

  /** Send what is to be sent, as fast as the service bears it. */
  pump(): void {
    clearTimeout(this.#pause);
    while (this.#connection !== undefined && this.#gone !== undefined) {
      const pause = this.#conversation.pauseS;
      if (pause > 0) {
        this.#pause = setTimeout(() => this.pump(), 1000 * pause);
        return;
      }
      const payload = this.#conversation.nextPayload();
      if (payload === undefined) return;
      this.#connection.send(payload);
    }
  }

  #opened(connection: Connection): void {
    this.#connection = connection;
    if (this.#gone === undefined) {
      connection.close(); // nobody waits for it any more
      return;
    }
    const { shown, subprotocol } = this.#way.address;
    if (connection.subprotocol !== subprotocol) {
      this.end(new Unreachable(`what answers at ${shown} is a WebSocket, but does not speak ${subprotocol}`));
      return;
    }
    connection.send(this.#conversation.start());
  }

  #message(payload: Payload): void {
    if (this.#gone === undefined) return;
    this.#heard = this.#way.now();
    const news = this.#conversation.receive(payload);
    const { linked, linking } = this.#conversation;
    if (linked && this.#opening !== undefined) {
      clearTimeout(this.#opening);
      this.#opening = undefined;
      this.#watch();
    }
    this.pump();
    this.#tell(news);
    if (!linked && !linking) this.end(new Unreachable(`the session with ${this.#way.address.shown} is over`));
  }

  /** See that somebody is still there, and be heard often enough ourselves. */
  #watch(): void {
    const idleS = this.#conversation.started?.limits.idle_timeout_s ?? Infinity;
    const everyS = Math.min(KEEPALIVE_S, idleS / 3);
    this.#quiet = setTimeout(() => {
      const now = this.#way.now();
      const unanswered = this.#asked > this.#heard;
      if (unanswered && now - this.#asked >= KEEPALIVE_PATIENCE_S) {
        this.end(new Unreachable(`no word from ${this.#way.address.shown} for ${(now - this.#heard).toFixed(0)} s`));
        return;
      }
      if (!unanswered && now - this.#heard >= 0.9 * everyS) {
        this.#asked = now;
        this.#connection?.send(this.#conversation.ping());
      }
      this.#watch();
    }, 1000 * everyS);
  }
}

type Timer = ReturnType<typeof setTimeout> | undefined;
