// The line to /v1/watch: connects, says what to look at, and connects again after a cut.

import { request, socketAddress, token } from "./access.ts";
import type { Look, Snapshot, WatchStarted } from "./messages.ts";

export type LinkState = "waiting" | "live" | "refused";

export interface Listener {
  started(message: WatchStarted): void;
  seen(snapshot: Snapshot): void;
  /** How the line is, in a word and a sentence. */
  link(state: LinkState, sentence: string): void;
}

const SUBPROTOCOL = "fervor.watch.v1.json";
const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 8000;

export class Watch {
  #socket: WebSocket | undefined;
  #wait = FIRST_WAIT_MS;
  #look = "";
  #retry = 0;
  readonly #listener: Listener;

  constructor(listener: Listener) {
    this.#listener = listener;
  }

  connect(): void {
    clearTimeout(this.#retry);
    const shown = token();
    const protocols = shown ? [SUBPROTOCOL, `fervor.token.${shown}`] : [SUBPROTOCOL];
    let opened = false;
    try {
      this.#socket = new WebSocket(socketAddress("v1/watch"), protocols);
    } catch {
      // A subprotocol is a word of HTTP; what is none can be no token either.
      this.#listener.link("refused", "This is no token: it has characters that none can have.");
      return;
    }
    this.#socket.onopen = () => {
      opened = true;
      this.#wait = FIRST_WAIT_MS;
      this.#listener.link("live", "live");
      if (this.#look) this.#socket?.send(this.#look);
    };
    this.#socket.onmessage = (event) => this.#hear(JSON.parse(event.data as string) as WatchStarted | Snapshot);
    this.#socket.onclose = () => void this.#closed(opened);
  }

  /** Say what to look at; the newest counts. */
  look(look: Look): void {
    const said = JSON.stringify({ type: "look", ...look });
    if (said === this.#look) return;
    this.#look = said;
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(said);
  }

  #hear(message: WatchStarted | Snapshot): void {
    if (message.type === "watch.started") this.#listener.started(message);
    else if (message.type === "snapshot") this.#listener.seen(message);
  }

  async #closed(opened: boolean): Promise<void> {
    // Browsers don't say why a handshake failed; the same question without an upgrade does.
    const sentence = opened ? "the line was cut; connecting again" : await this.#whyNot();
    if (sentence === undefined) return;
    this.#listener.link("waiting", sentence);
    this.#retry = window.setTimeout(() => this.connect(), this.#wait * (0.75 + Math.random() / 2));
    this.#wait = Math.min(2 * this.#wait, LONGEST_WAIT_MS);
  }

  async #whyNot(): Promise<string | undefined> {
    try {
      const answer = await request("v1/watch");
      if (answer.status === 426) return "as many pages are open as the service takes; trying again";
      const { detail } = (await answer.json()) as { detail: string };
      if (answer.status !== 401 && answer.status !== 403) return detail;
      this.#listener.link("refused", token() ? "The service does not know this token." : "This service needs a token.");
      return undefined;
    } catch {
      return "the service does not answer; trying again";
    }
  }
}
