// Calibrations that were asked for: which of them is still to be answered, and which one an answer belongs to.
//
// Rules. A service has one under way; another takes its place, unless the frames sent between the two have decided it
// by then · answers name no request, but come in order: that of one is told before any estimate of a frame that was
// sent after the next one · those that wait for an answer are asked again after a cut, in their places, for the frames
// between them decide the same again.

import { type FervorError, InputError } from "./errors.ts";
import { type FrameKey, FrameMap } from "./frames.ts";
import type { SessionCalibrate, SessionCalibrated } from "./messages.ts";
import type { Entry } from "./track.ts";

const DEFAULT_S = 1; // how long a pose is held unless a request says so

/** Who awaits a calibration. */
export interface CalibrationWaiter {
  resolve(found: SessionCalibrated): void;
  reject(error: FervorError): void;
}

/** One that waits for its answer, or that one before it may have been replaced by. */
interface Asked {
  readonly body: string;
  readonly seconds: number;
  readonly entry: Entry;
  readonly waiter: CalibrationWaiter;
  /** Of the frames of its body since, seconds. */
  first: number;
  last: number;
  /** Its body was gone after it had begun. */
  gone: boolean;
  /** Frames of all bodies since, before the next one was asked for; kept while others wait before it. */
  readonly since: FrameMap<true>;
  /** By the next one. It is asked again while others wait before it, for it took the place of those. */
  replaced: boolean;
}

/** Those of one conversation. */
export class Calibrations {
  readonly #timed: boolean;
  #asked: Asked[] = [];

  /** `timed`: frames have times of the client's, as under clock `time`. */
  constructor(timed: boolean) {
    this.#timed = timed;
  }

  /** What to ask again after a cut. */
  get entries(): Entry[] {
    return this.#asked.map(({ entry }) => entry);
  }

  /** Whether an answer may be on its way. */
  get decided(): boolean {
    return this.#waiting.some((asked) => this.#isDecided(asked));
  }

  /** Whether an answer may rest on frames of this body. */
  holds(body: string): boolean {
    return this.#waiting.some((asked) => asked.body === body);
  }

  /** One is asked for. */
  ask(request: SessionCalibrate, entry: Entry, waiter: CalibrationWaiter): void {
    const newest = this.#asked.at(-1);
    if (newest !== undefined && !this.#isDecided(newest)) this.#replace(newest);
    this.#asked.push({
      body: request.body ?? "0",
      seconds: request.seconds ?? DEFAULT_S,
      entry,
      waiter,
      first: Infinity,
      last: -Infinity,
      gone: false,
      since: new FrameMap(),
      replaced: false,
    });
    this.#forget();
  }

  /** A frame is under way; `time` in seconds. */
  sent(key: FrameKey, time: number): void {
    const newest = this.#asked.at(-1);
    if (newest === undefined) return;
    if (this.#asked.length > 1) newest.since.set(key, true);
    if (key.body !== newest.body) return;
    newest.first = Math.min(newest.first, time);
    newest.last = Math.max(newest.last, time);
  }

  /** A body is gone, and with it the pose that it held. */
  gone(body: string): void {
    const newest = this.#asked.at(-1);
    if (newest?.body === body && newest.last > -Infinity) newest.gone = true;
  }

  /** A frame has its estimate: of those before the newest one at its time no answer comes any more. */
  estimated(key: FrameKey): void {
    const place = this.#asked.findIndex(({ since }) => since.has(key));
    for (const asked of this.#asked.slice(0, Math.max(place, 0))) this.#replace(asked);
    this.#forget();
  }

  /** The oldest has its answer. */
  calibrated(message: SessionCalibrated): void {
    const oldest = this.#asked.shift();
    this.#forget();
    oldest?.waiter.resolve({ ...message, checkpoints: [] });
  }

  /** One whose pose `body` held came to nothing, or the newest, which could not begin; whether there was one. */
  failed(body: string | null | undefined, error: InputError): boolean {
    const waiting = this.#waiting;
    const asked = waiting.find((each) => each.body === body) ?? waiting.at(-1);
    if (asked === undefined) return false;
    this.#asked = this.#asked.filter((each) => each !== asked);
    this.#forget();
    asked.waiter.reject(error);
    return true;
  }

  /** Nothing will be answered any more. */
  abandon(error: FervorError): void {
    for (const { waiter, replaced } of this.#asked.splice(0)) if (!replaced) waiter.reject(error);
  }

  /** Whether the frames so far may be enough, if the service takes all; under clock `frames` times are the service's. */
  #isDecided({ gone, first, last, seconds }: Asked): boolean {
    return gone || (this.#timed ? last - first >= seconds : last > -Infinity);
  }

  get #waiting(): Asked[] {
    return this.#asked.filter(({ replaced }) => !replaced);
  }

  #replace(asked: Asked): void {
    if (asked.replaced) return;
    asked.replaced = true;
    asked.waiter.reject(new InputError("another calibration took the place of this one"));
  }

  /** Those that were replaced, unless others wait before them. */
  #forget(): void {
    while (this.#asked[0]?.replaced) this.#asked.shift();
  }
}
