// When to connect again after a stream was cut, and when to give up. No clock and no dice but those handed in.
//
// Rules: what another try may cure is tried again, after a pause that doubles from FIRST_PAUSE_S to LONGEST_PAUSE_S and
// of which a random part is waited (full jitter, so that a fleet does not come back as one) · a service that says when
// to come back is not asked earlier · an outage lasts until a frame is answered again or a connection has held for
// STABLE_S, so that a service that dies at every frame is not asked for ever · after `retryForS` seconds it is over.

import { FervorError, IdleTimeout, Overloaded, StartTimeout, Unreachable } from "./errors.ts";

export const FIRST_PAUSE_S = 0.1;
export const LONGEST_PAUSE_S = 5;

/** A connection that held this long ends an outage, even if no frame was sent on it. */
export const STABLE_S = 10;

/** Times that a fault of the service's own may follow a resume before it counts as caused by this stream. */
export const MOST_FAULTS = 3;

/** What `onReconnect` is told: the connection is lost, an attempt failed, or the stream goes on. */
export interface Reconnect {
  /** Why the connection was lost, or why the last attempt failed. */
  readonly reason: FervorError;
  /** The attempt that follows or, when the stream goes on, that succeeded; from 1. */
  readonly attempt: number;
  /** Since the connection was lost. */
  readonly seconds: number;
  /** Seconds until the attempt that follows; undefined: the stream goes on. */
  readonly delayS?: number;
  /** Bodies of which the service knows nothing any more: their next estimate is flagged `reset`. */
  readonly anew: readonly string[];
  /** Estimates are equal to the bit to those of an uninterrupted stream; else, on another kind of machine, to 1e-6. */
  readonly exact: boolean;
}

/** Whether the same attempt may succeed later: nobody there, no room, silence, or a fault of the service's own. */
export function worthRetrying(error: FervorError): boolean {
  return [Unreachable, Overloaded, StartTimeout, IdleTimeout].some((kind) => error instanceof kind) || isFault(error);
}

/** The outages of one session. */
export class Retries {
  attempt = 0;
  /** The newest failure. */
  reason = new FervorError("nothing failed");
  readonly #retryForS: number;
  readonly #now: () => number;
  readonly #dice: () => number;
  #lost: number | undefined; // seconds, when the outage began
  #first = this.reason;
  #up: number | undefined;
  #faults = 0;

  /** `retryForS`: seconds to try for, Infinity: for ever. `dice`: throws a number in [0, 1). */
  constructor(retryForS: number, now: () => number, dice: () => number = Math.random) {
    this.#retryForS = retryForS;
    this.#now = now;
    this.#dice = dice;
  }

  /** How long the outage lasts. */
  get seconds(): number {
    return this.#lost === undefined ? 0 : this.#now() - this.#lost;
  }

  /**
   * The connection was lost, or an attempt failed: seconds until the next attempt, undefined to give up.
   *
   * `curable`: the next attempt will differ so that this error can't come again.
   */
  failed(error: FervorError, curable = false): number | undefined {
    if (this.#up !== undefined && this.#now() - this.#up >= STABLE_S) this.answered();
    this.#up = undefined;
    if (this.#lost === undefined) {
      this.#lost = this.#now();
      this.#first = error;
      this.attempt = 0;
    }
    this.reason = error;
    this.#faults += Number(isFault(error));
    const left = this.#retryForS - this.seconds;
    if (!(curable || worthRetrying(error)) || left <= 0 || this.#faults > MOST_FAULTS) return undefined;
    this.attempt += 1;
    const pause = this.#dice() * Math.min(FIRST_PAUSE_S * 2 ** Math.min(this.attempt - 1, 16), LONGEST_PAUSE_S);
    return Math.min((error.retryAfter ?? 0) + pause, left);
  }

  /** There is a connection again. */
  connected(): void {
    this.#up = this.#now();
  }

  /** A frame was answered: the outage, if there was one, is over. */
  answered(): void {
    this.#lost = undefined;
    this.#faults = 0;
  }

  /** The error to end with: the first failure, how long it was tried to mend, and what failed last. */
  surrender(): FervorError {
    if (this.attempt === 0) return this.#first;
    const times = this.attempt === 1 ? "once" : `${this.attempt} times`;
    const last = this.reason === this.#first ? "" : `, the last time: ${this.reason.message}`;
    const told = worthRetrying(this.reason) ? this.#first : this.reason;
    const kind = told.constructor as typeof FervorError;
    return new kind(`${this.#first.message}; tried to reconnect ${times} in ${this.seconds.toFixed(0)} s${last}`, {
      retryAfter: this.reason.retryAfter,
      closeCode: told.closeCode,
      cause: told,
    });
  }
}

function isFault(error: FervorError): boolean {
  return error.constructor === FervorError;
}
