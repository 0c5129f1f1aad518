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

/** One that waits for its answer. */
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
    return this.#asked.some((asked) => this.#isDecided(asked));
  }

  /** Whether an answer may rest on frames of this body. */
  holds(body: string): boolean {
    return this.#asked.some((asked) => asked.body === body);
  }

  /** One is asked for. */
  ask(request: SessionCalibrate, entry: Entry, waiter: CalibrationWaiter): void {
    const newest = this.#asked.at(-1);
    if (newest !== undefined && !this.#isDecided(newest)) this.#keep(this.#asked.slice(0, -1));
    const [body, seconds] = [request.body ?? "0", request.seconds ?? DEFAULT_S];
    const since = new FrameMap<true>();
    this.#asked.push({ body, seconds, entry, waiter, first: Infinity, last: -Infinity, gone: false, since });
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
    if (place > 0) this.#keep(this.#asked.slice(place));
  }

  /** The oldest has its answer. */
  calibrated(message: SessionCalibrated): void {
    this.#asked.shift()?.waiter.resolve({ ...message, checkpoints: [] });
  }

  /** One whose pose `body` held came to nothing, or the newest, which could not begin; whether there was one. */
  failed(body: string | null | undefined, error: InputError): boolean {
    const asked = this.#asked.find((each) => each.body === body) ?? this.#asked.at(-1);
    if (asked === undefined) return false;
    this.#asked = this.#asked.filter((each) => each !== asked);
    asked.waiter.reject(error);
    return true;
  }

  /** Nothing will be answered any more. */
  abandon(error: FervorError): void {
    for (const { waiter } of this.#asked.splice(0)) waiter.reject(error);
  }

  /** Whether the frames so far may be enough, if the service takes all; under clock `frames` times are the service's. */
  #isDecided({ gone, first, last, seconds }: Asked): boolean {
    return gone || (this.#timed ? last - first >= seconds : last > -Infinity);
  }

  /** The others were replaced. */
  #keep(left: Asked[]): void {
    const replaced = this.#asked.filter((asked) => !left.includes(asked));
    this.#asked = left;
    for (const { waiter } of replaced) waiter.reject(new InputError("another calibration took the place of this one"));
  }
}
