// Where a conversation stands, and why it ended.
//
// NEW ──start──▶ STARTING ──session.started──▶ OPEN ──end──▶ ENDING ──session.ended──▶ CLOSED
// └──────── fatal error, connection lost for good, from any state ─────▲

import { type FervorError, Unreachable } from "./errors.ts";
import type { SessionStarted, Totals } from "./messages.ts";

/** Where a conversation stands. */
export type State = "new" | "starting" | "open" | "ending" | "closed";

/** The state of one conversation. */
export class Standing {
  readonly url: string;
  state: State = "new";
  /** Why the conversation ended, unless both sides wanted it to. */
  failure: FervorError | undefined;
  /** What the session came to, once it has ended. */
  totals: Totals | undefined;
  /** The newest one: a resume brings another. */
  started: SessionStarted | undefined;

  constructor(url: string) {
    this.url = url;
  }

  /** Whether nothing more will come. */
  get over(): boolean {
    return this.state === "closed";
  }

  /** What the service said at the start; throws why nothing can be sent, unless something can. */
  mustBeOpen(): SessionStarted {
    if (this.state === "open" && this.started !== undefined) return this.started;
    if (this.failure !== undefined) throw this.failure;
    const what = this.state === "new" || this.state === "starting" ? "has not started" : "has ended; connect again";
    throw new Unreachable(`the session with ${this.url} ${what}`);
  }

  /** The conversation is over; `failure` says why, undefined that it was meant to be. */
  protected close(failure: FervorError | undefined): void {
    this.state = "closed";
    this.failure = failure;
  }
}
