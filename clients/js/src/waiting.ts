// Waiting for something that another part of the program brings about.

/** A promise, and the two ways to settle it. */
export class Deferred<Value> {
  readonly promise: Promise<Value>;
  resolve!: (value: Value) => void;
  reject!: (error: unknown) => void;

  constructor() {
    this.promise = new Promise((resolve, reject) => {
      this.resolve = resolve;
      this.reject = reject;
    });
    this.promise.catch(() => {}); // who awaits it hears of it; nobody else must
  }
}

/** An end to waiting: after `seconds` everything raced against it rejects with a TimeoutError. */
export class Deadline {
  readonly #passed = new Deferred<never>();
  readonly #timer: ReturnType<typeof setTimeout> | undefined;

  /** `seconds`: Infinity waits for ever. */
  constructor(seconds: number, sentence: string) {
    if (seconds === Infinity) return;
    this.#timer = setTimeout(() => this.#passed.reject(new DOMException(sentence, "TimeoutError")), 1000 * seconds);
  }

  /** The promise, or the TimeoutError if that comes first. */
  race<Value>(promise: Promise<Value>): Promise<Value> {
    return Promise.race([promise, this.#passed.promise]);
  }

  clear(): void {
    clearTimeout(this.#timer);
  }
}

/** Looks that wait for something to see, in the order in which they came. */
export class Lookout {
  readonly #looks = new Set<() => void>();

  /** What `look` gives once it gives something, now or after a `ring`. */
  until<Value>(look: () => Value | undefined, deadline?: Deadline): Promise<Value> {
    const seen = new Deferred<Value>();
    const again = () => {
      try {
        const value = look();
        if (value === undefined) return;
        seen.resolve(value);
      } catch (error) {
        seen.reject(error);
      }
      this.#looks.delete(again);
    };
    this.#looks.add(again);
    again();
    const waited = deadline === undefined ? seen.promise : deadline.race(seen.promise);
    return waited.finally(() => this.#looks.delete(again));
  }

  /** Something may have changed: everybody looks again. */
  ring(): void {
    for (const look of [...this.#looks]) look();
  }
}
