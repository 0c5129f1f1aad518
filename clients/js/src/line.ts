// The line to the service: what leaves on it in which order, and what becomes of that when it is cut.
//
// Rules: a message leaves once per connection · while there is none, messages are kept by the log alone · on a new
// connection all that the log kept leaves first, at a pace that the service bears, and what is new queues up behind.

import { CheckpointMismatch, CheckpointUnknown, type FervorError } from "./errors.ts";
import type { FrameKey } from "./frames.ts";
import type { Log } from "./log.ts";
import type { ClientMessage, SessionStart, SessionStarted } from "./messages.ts";
import { Pace } from "./pace.ts";
import type { Reconnect, Retries } from "./retries.ts";

/** Where a service refuses the checkpoints of a resume, those are left out first that came this long before the cut. */
const STALE_S = 5;

/** Where a connection stands. */
export type Link = "down" | "starting" | "up";

/** One connection after the other. */
export class Line {
  link: Link = "down";
  reconnects = 0;
  /** What the service told before it hung up. */
  fault: FervorError | undefined;
  readonly log: Log;
  readonly #retries: Retries | undefined;
  readonly #now: () => number;
  #queue: ClientMessage[] = [];
  #pace: Pace | undefined; // while a backlog leaves
  #tokens: readonly string[] = [];

  /** `retries`: when to try again after a cut; undefined: the first one is the end. */
  constructor(log: Log, retries: Retries | undefined, now: () => number) {
    this.log = log;
    this.#retries = retries;
    this.#now = now;
  }

  /** Whether it outlives a cut. */
  get resumes(): boolean {
    return this.#retries !== undefined;
  }

  /** Seconds to wait before the next message, while a backlog leaves that the service would find too fast. */
  get pauseS(): number {
    return this.#queue.length > 0 ? (this.#pace?.waitS ?? 0) : 0;
  }

  /** Send this now or, from the log, once there is a connection. */
  post(message: ClientMessage): void {
    if (this.link === "up") this.#queue.push(message);
  }

  /** What to send next, if anything. */
  next(): ClientMessage | undefined {
    const message = this.link === "up" ? this.#queue.shift() : undefined;
    if (message === undefined) this.#pace = undefined;
    else this.#pace?.take();
    return message;
  }

  /** The `session.start` for a new connection, in place of the one that `started`. */
  resume(start: SessionStart, started: SessionStarted): SessionStart {
    this.link = "starting";
    this.#tokens = this.log.tokens(started.limits.max_message_bytes);
    return { ...start, resume: [...this.#tokens] };
  }

  /** The new connection stands: what to tell of it, and the frames that are sent again though answered before. */
  resumed(started: SessionStarted): { news: Reconnect; echoes: FrameKey[] } {
    const retries = this.#mending;
    this.log.resumed(started.resumed);
    const { messages, echoes } = this.log.replay();
    this.link = "up";
    this.#queue = messages;
    this.#pace = new Pace(started.limits.max_frames_per_second, this.#now);
    retries.connected();
    this.reconnects += 1;
    const { reason, attempt, seconds } = retries;
    const exact = started.resumed.every((body) => body.same_runtime);
    return { news: { reason, attempt, seconds, anew: [...this.log.anew].sort(), exact }, echoes };
  }

  /** The connection is gone: why, as the service told it, or else `failure`. */
  cut(failure: FervorError): FervorError {
    const reason = this.fault ?? failure;
    this.fault = undefined;
    this.link = "down";
    this.#queue = [];
    return reason;
  }

  /** When to connect again after `reason`; undefined: not any more, see `surrender`. */
  again(reason: FervorError): Reconnect | undefined {
    const retries = this.#mending;
    const delayS = retries.failed(reason, this.#leaveOut(reason));
    if (delayS === undefined) return undefined;
    return { reason, attempt: retries.attempt, seconds: retries.seconds, delayS, anew: [], exact: true };
  }

  /** The error to end with. */
  surrender(): FervorError {
    return this.#mending.surrender();
  }

  /** A frame was answered for the first time. */
  progress(): void {
    this.#retries?.answered();
  }

  /** Where a service refused the checkpoints of a resume: choose fewer for the next; whether that was so. */
  #leaveOut(reason: FervorError): boolean {
    const tokens = this.#tokens;
    this.#tokens = [];
    if (tokens.length === 0) return false;
    if (reason instanceof CheckpointMismatch) return this.log.refuseTokens();
    if (!(reason instanceof CheckpointUnknown)) return false;
    const cut = this.#now() - this.#mending.seconds;
    return this.log.refuseTokens(cut - STALE_S) || this.log.refuseTokens();
  }

  get #mending(): Retries {
    if (this.#retries === undefined) throw new Error("only a line that outlives a cut connects again");
    return this.#retries;
  }
}
