// Which frames wait for an answer, and which answers nobody has read yet.
//
// Rules: a frame is answered once, by an estimate or by an error that names it · an answer that somebody awaits goes to
// them, every other one into the inbox · what comes again after a replay was answered before and is dropped.

import { EngineError, type FervorError } from "./errors.ts";
import { type FrameKey, FrameMap } from "./frames.ts";
import { DEFAULTS, type Estimate, type Totals } from "./messages.ts";

/** Estimates kept for a caller who does not read them (half an hour of one body); then the oldest go. */
export const UNREAD = 65_536;

/** Who awaits the answer to one frame. */
export interface Waiter {
  resolve(estimate: Estimate): void;
  reject(error: FervorError): void;
}

/** The answers of one conversation. */
export class Answers {
  readonly #latest: boolean;
  readonly #warn: (sentence: string) => void;
  readonly #waiting = new FrameMap<Waiter | undefined>();
  readonly #echoes = new FrameMap<true>(); // answered before they were sent again
  readonly #totals: Totals = { ...DEFAULTS.Totals };
  #inbox: Estimate[] = [];
  #read = 0; // estimates of the inbox that were read
  #overflowed = false;

  /** `latest`: an estimate answers the older frames of its body too. */
  constructor(latest: boolean, warn: (sentence: string) => void) {
    this.#latest = latest;
    this.#warn = warn;
  }

  /** Frames sent and not yet answered. */
  get inFlight(): number {
    return this.#waiting.size;
  }

  /** What the conversation came to, counted here, each frame once however often it was sent. */
  get totals(): Totals {
    return { ...this.#totals };
  }

  /** Whether this frame is under way. */
  waits(key: FrameKey): boolean {
    return this.#waiting.has(key);
  }

  /** A frame is under way. */
  expect(key: FrameKey, waiter?: Waiter): void {
    this.#waiting.set(key, waiter);
  }

  /** These frames, answered before, are sent again on a new connection. */
  expectAgain(keys: readonly FrameKey[]): void {
    this.#echoes.clear();
    for (const key of keys) this.#echoes.set(key, true);
  }

  /** Take in an estimate: the frames that it answers; null if it is an echo and was dropped. */
  settle(estimate: Estimate): FrameKey[] | null {
    const echo = this.#echoes.has(estimate);
    for (const key of this.#reach(estimate, this.#echoes)) this.#echoes.take(key);
    if (echo) return null;
    const settled = this.#reach(estimate, this.#waiting);
    this.#count(estimate, Math.max(settled.length, 1));
    const own = this.#waiting.get(estimate);
    for (const key of settled) this.#waiting.take(key)?.resolve(estimate);
    if (own === undefined) this.#keep(estimate);
    return settled;
  }

  /** Take in an error that names a frame: whether somebody awaits it; null if it is an echo and was dropped. */
  refuse(key: FrameKey, error: FervorError): boolean | null {
    if (this.#echoes.take(key)) return null;
    this.#totals[error instanceof EngineError ? "frames" : "rejected"] += 1;
    const waiter = this.#waiting.take(key);
    waiter?.reject(error);
    return waiter !== undefined;
  }

  /** The caller reset a body. */
  countReset(): void {
    this.#totals.resets += 1;
  }

  /** The oldest unread estimate, if there is one. */
  next(): Estimate | undefined {
    const estimate = this.#inbox[this.#read];
    if (estimate === undefined) return undefined;
    this.#read += 1;
    if (this.#read === this.#inbox.length || this.#read === UNREAD) {
      this.#inbox = this.#inbox.slice(this.#read);
      this.#read = 0;
    }
    return estimate;
  }

  /** Nobody awaits this frame any more: its answer goes into the inbox. */
  giveUp(key: FrameKey): void {
    if (this.#waiting.has(key)) this.#waiting.set(key, undefined);
  }

  /** No more answers come. */
  abandon(error: FervorError): void {
    for (const waiter of this.#waiting.clear()) waiter?.reject(error);
  }

  /** Those of some frames that an estimate answers: its own, and those that delivery `latest` skipped for it. */
  #reach({ body, seq }: FrameKey, frames: FrameMap<unknown>): FrameKey[] {
    if (this.#latest) return frames.through({ body, seq });
    return frames.has({ body, seq }) ? [{ body, seq }] : [];
  }

  #count(estimate: Estimate, frames: number): void {
    const { flags } = estimate;
    if (flags.includes("duplicate")) {
      this.#totals.duplicate += 1;
      return;
    }
    this.#totals.frames += frames;
    this.#totals.estimates += frames;
    this.#totals.late += Number(flags.includes("late"));
    this.#totals.resets += Number(flags.includes("gap_reset") || flags.includes("clock_reset"));
  }

  #keep(estimate: Estimate): void {
    this.#inbox.push(estimate);
    if (this.#inbox.length - this.#read <= UNREAD) return;
    this.next();
    if (!this.#overflowed) this.#warn(`${UNREAD} estimates are unread; from now on the oldest are dropped`);
    this.#overflowed = true;
  }
}
