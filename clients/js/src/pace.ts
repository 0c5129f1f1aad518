/** How fast a backlog may leave: below the frames a second that a service takes from one session. */
export class Pace {
  readonly #rate: number;
  readonly #most: number;
  readonly #now: () => number;
  #left: number;
  #then: number;

  /** `now`: the monotonic clock, seconds. */
  constructor(framesPerSecond: number, now: () => number) {
    this.#rate = 0.95 * framesPerSecond;
    this.#most = Math.max(framesPerSecond / 2, 1);
    this.#left = this.#most;
    this.#now = now;
    this.#then = now();
  }

  /** Seconds until the next frame may leave. */
  get waitS(): number {
    const now = this.#now();
    this.#left = Math.min(this.#most, this.#left + (now - this.#then) * this.#rate);
    this.#then = now;
    return Math.max((1 - this.#left) / this.#rate, 0);
  }

  /** A frame leaves. */
  take(): void {
    this.#left -= 1;
  }
}
