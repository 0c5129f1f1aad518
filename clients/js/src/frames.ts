// Frames by body and seq: which are under way, which were answered before.

/** A frame: its body and seq. */
export interface FrameKey {
  readonly body: string;
  readonly seq: number;
}

/** Something for each of some frames, in the order in which they were put there. */
export class FrameMap<Value> {
  readonly #bodies = new Map<string, Map<number, Value>>();
  #size = 0;

  get size(): number {
    return this.#size;
  }

  has({ body, seq }: FrameKey): boolean {
    return this.#bodies.get(body)?.has(seq) ?? false;
  }

  get({ body, seq }: FrameKey): Value | undefined {
    return this.#bodies.get(body)?.get(seq);
  }

  set({ body, seq }: FrameKey, value: Value): void {
    const frames = this.#bodies.get(body) ?? new Map<number, Value>();
    if (!frames.has(seq)) this.#size++;
    this.#bodies.set(body, frames.set(seq, value));
  }

  /** Take a frame out; what was there for it. */
  take(key: FrameKey): Value | undefined {
    const frames = this.#bodies.get(key.body);
    if (!frames?.has(key.seq)) return undefined;
    const value = frames.get(key.seq);
    frames.delete(key.seq);
    this.#size--;
    if (frames.size === 0) this.#bodies.delete(key.body);
    return value;
  }

  /** The frames of a body up to `seq`. */
  through({ body, seq }: FrameKey): FrameKey[] {
    const numbers = [...(this.#bodies.get(body)?.keys() ?? [])];
    return numbers.filter((number) => number <= seq).map((number) => ({ body, seq: number }));
  }

  /** Take out all; what was there. */
  clear(): Value[] {
    const values = [...this.#bodies.values()].flatMap((frames) => [...frames.values()]);
    this.#bodies.clear();
    this.#size = 0;
    return values;
  }
}
