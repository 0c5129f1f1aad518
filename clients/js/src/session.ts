// A live session: poses in, estimates out, through as many connections as it takes.

import { streamUrl, withoutSecrets } from "./address.ts";
import { CODECS } from "./codec.ts";
import type { Dial } from "./connection.ts";
import { Conversation, type News } from "./conversation.ts";
import { FervorError, Unreachable } from "./errors.ts";
import type { FrameOptions } from "./framer.ts";
import type { FrameKey } from "./frames.ts";
import type { Estimate, Limits, ModelInfo, SessionCalibrated, SessionStarted, Totals } from "./messages.ts";
import { type HeldPose, type Options, type Settled, settle } from "./options.ts";
import type { Pose } from "./poses.ts";
import { Retries } from "./retries.ts";
import { Deadline, Deferred, Lookout } from "./waiting.ts";
import { type Way, Wire } from "./wire.ts";

const now = (): number => performance.now() / 1000;

/** An end to waiting. */
export interface Patience {
  /** Seconds; Infinity: for ever. Then a DOMException with the name TimeoutError is thrown. */
  timeoutS?: number;
}

/**
 * A live session. `connect` makes it.
 *
 * Every frame is answered by one estimate. `estimate` sends a pose and waits for its answer; `send` does not wait, the
 * answers are read by `receive` or by `for await`.
 *
 * Errors. A frame that the service refuses harms nothing else: its `estimate` rejects, and for frames that were sent by
 * `send` the error goes to `onError`. A cut is mended behind the scenes: frames are taken and answers awaited as if
 * nothing had happened, once `window` frames are under way sending waits, and every frame is answered once. Where the
 * session itself is lost, everything rejects: `send` and `estimate` at once, `receive` and the iteration after the last
 * estimate that came.
 */
export class Session implements AsyncIterable<Estimate, void> {
  readonly #conversation: Conversation;
  readonly #settled: Settled;
  readonly #way: Way;
  readonly #lookout = new Lookout();
  readonly #closing = new AbortController(); // no more attempts
  #wire: Wire | undefined;

  private constructor(conversation: Conversation, settled: Settled, way: Way) {
    this.#conversation = conversation;
    this.#settled = settled;
    this.#way = way;
  }

  /** Open a session over connections that `dial` makes. Rejects with a FervorError. */
  static async open(dial: Dial, url: string | URL, options: Options): Promise<Session> {
    const settled = settle(options);
    const { start, encoding, token, openTimeoutS, resume, retryForS, warn, signal } = settled;
    const address = streamUrl(url);
    const shown = withoutSecrets(address);
    const retries = resume ? new Retries(retryForS, now) : undefined;
    const conversation = new Conversation({ start, encoding, url: shown, retries, now, warn });
    const { subprotocol } = CODECS[encoding];
    const way: Way = {
      dial: options.dial ?? dial,
      address: { url: address, shown, subprotocol, token },
      openTimeoutS,
      now,
    };
    const session = new Session(conversation, settled, way);
    signal?.throwIfAborted();
    signal?.addEventListener("abort", () => session.close(), { once: true });
    session.#run();
    await session.#lookout.until(() => conversation.started ?? (conversation.over || undefined));
    signal?.throwIfAborted();
    conversation.mustBeOpen();
    return session;
  }

  /** What the service said at the start, or when the session was resumed: model, limits, joints, fingerprint. */
  get started(): SessionStarted {
    return this.#conversation.started!; // `open` hands out started sessions only
  }

  /** The model that answers. */
  get model(): ModelInfo {
    return this.started.model;
  }

  /** What the service takes from one session. */
  get limits(): Limits {
    return this.started.limits;
  }

  /** The joints of every pose, in this order. */
  get joints(): readonly string[] {
    return this.started.joints;
  }

  /** Frames sent and not yet answered. */
  get inFlight(): number {
    return this.#conversation.inFlight;
  }

  /** Times that the stream was cut and went on. */
  get reconnects(): number {
    return this.#conversation.reconnects;
  }

  /**
   * Send a pose; wait only while `window` frames are under way. Gives the frame's seq, which its estimate will carry.
   *
   * Rejects with a FrameError where the pose can't be sent (the session goes on), with another FervorError where the
   * session is lost or has ended.
   */
  async send(pose: Pose, options: FrameOptions = {}): Promise<number> {
    const { seq } = await this.#lookout.until(() => this.#frame(pose, options));
    return seq;
  }

  /**
   * Send a pose and wait for its estimate, at most `timeoutS` seconds (10 by default). For the rest see `send`.
   *
   * Under delivery `latest` it may be the estimate of a newer frame of the same body. After a timeout the answer will
   * be among those that `receive` gives.
   */
  async estimate(pose: Pose, options: FrameOptions & Patience = {}): Promise<Estimate> {
    const { timeoutS = 10, ...frame } = options;
    const deadline = new Deadline(timeoutS, `no estimate for body '${frame.body ?? "0"}' within ${timeoutS} s`);
    const answer = new Deferred<Estimate>();
    let key: FrameKey | undefined;
    try {
      key = await this.#lookout.until(() => this.#frame(pose, frame, answer), deadline);
      return await deadline.race(answer.promise);
    } catch (error) {
      if (key !== undefined && !(error instanceof FervorError)) this.#conversation.giveUp(key);
      throw error;
    } finally {
      deadline.clear();
    }
  }

  /** The next estimate of a frame that was sent by `send`; undefined after the last of a session that has ended. */
  async receive(): Promise<Estimate | undefined> {
    const next = await this.#lookout.until(
      () => this.#conversation.nextEstimate() ?? (this.#conversation.over || undefined),
    );
    if (typeof next === "object") return next;
    if (this.#conversation.failure !== undefined) throw this.#conversation.failure;
    return undefined;
  }

  /** The estimates of frames that were sent by `send`, as they come, until the session has ended. */
  async *[Symbol.asyncIterator](): AsyncGenerator<Estimate, void> {
    for (let next = await this.receive(); next !== undefined; next = await this.receive()) yield next;
  }

  /** Forget what a body did so far; its next pose is a first one. */
  resetBody(body = "0"): void {
    this.#conversation.resetBody(body);
    this.#wire?.pump();
  }

  /** Say that a body is gone, so that the service frees what it keeps of it. */
  endBody(body: string): void {
    this.#conversation.endBody(body);
    this.#wire?.pump();
  }

  /**
   * Take the alignment of an unknown sensor from a pose that a body holds; its frames are sent meanwhile, as ever.
   *
   * In force from then on. Keep the `skeleton` of the answer as JSON; `connect` takes it again. Rejects with an
   * InputError where the pose was not held still: nothing changed then.
   */
  async calibrate(options: HeldPose & Patience = {}): Promise<SessionCalibrated> {
    const { timeoutS = 30, ...held } = options;
    const deadline = new Deadline(timeoutS, `no calibration within ${timeoutS} s; is the pose being sent?`);
    const found = new Deferred<SessionCalibrated>();
    try {
      this.#conversation.calibrate(held, found);
      this.#wire?.pump();
      return await deadline.race(found.promise);
    } finally {
      deadline.clear();
    }
  }

  /** Say that no more poses come, and wait until all are answered; what came of them. Estimates can still be read. */
  async end({ timeoutS = 10 }: Patience = {}): Promise<Totals> {
    if (this.#conversation.state === "open") this.#conversation.end();
    this.#wire?.pump();
    const deadline = new Deadline(timeoutS, `the service did not end the session within ${timeoutS} s`);
    try {
      await this.#lookout.until(() => this.#conversation.over || undefined, deadline);
    } finally {
      deadline.clear();
    }
    if (this.#conversation.totals === undefined) this.#conversation.mustBeOpen();
    return this.#conversation.totals!;
  }

  /** Close the connection now, whatever is under way. */
  close(): void {
    this.#conversation.lost(undefined);
    this.#closing.abort();
    this.#wire?.end(new Unreachable("the session was closed"));
    this.#lookout.ring();
  }

  /** End the session as far as that is possible, and close it; throws nothing of its own. */
  async [Symbol.asyncDispose](): Promise<void> {
    try {
      await this.end();
    } catch {
      // it ended otherwise, and whoever used it was told
    } finally {
      this.close();
    }
  }

  /** Send a frame if there is room for it, or fail; undefined where it has to wait. */
  #frame(pose: Pose, options: FrameOptions, answer?: Deferred<Estimate>): FrameKey | undefined {
    const { inFlight, over } = this.#conversation;
    if (inFlight >= this.#settled.window && !over) return undefined;
    const key = this.#conversation.frame(pose, options, answer);
    this.#wire?.pump();
    return key;
  }

  /** Connect, and again after each cut, until the session is over. */
  async #run(): Promise<void> {
    while (!this.#conversation.over) {
      this.#wire = new Wire(this.#conversation, this.#way, (news) => this.#tell(news));
      const failure = await this.#wire.run();
      this.#wire = undefined;
      const plan = this.#conversation.interrupted(failure);
      this.#tell(plan === undefined ? [] : [plan]);
      if (plan?.delayS !== undefined) await this.#wait(plan.delayS);
    }
  }

  /** Wait, but not longer than until `close`. */
  #wait(seconds: number): Promise<void> {
    const { signal } = this.#closing;
    return new Promise((resolve) => {
      const done = () => {
        clearTimeout(timer);
        signal.removeEventListener("abort", done);
        resolve();
      };
      const timer = setTimeout(done, 1000 * seconds);
      signal.addEventListener("abort", done);
    });
  }

  /** Hand news to whoever waits for it, and to the caller's functions, whose own faults must not end the session. */
  #tell(news: readonly News[]): void {
    this.#lookout.ring();
    for (const item of news) {
      const name = item instanceof FervorError ? "onError" : "onReconnect";
      try {
        item instanceof FervorError ? this.#settled.onError(item) : this.#settled.onReconnect(item);
      } catch (error) {
        this.#settled.warn(`${name} failed: ${error}`);
      }
    }
  }
}
