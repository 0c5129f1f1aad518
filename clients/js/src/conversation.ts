// The client's side of the protocol: what to send, and which frame an answer belongs to. No socket, no timer.
//
// Rules: `start` first, then frames · a frame is answered by one estimate or one error that names it · answers are
// matched by body and seq, in whatever order they come · a recoverable error concerns one message, the conversation goes
// on · a fatal one ends it; what was answered before can still be read.
//
// A conversation that resumes outlives its connections: `interrupted` says when to open the next one and `start` again.
// Meanwhile it stays OPEN or ENDING, and frames are taken as ever; they leave once there is a connection.

import { Answers, type Waiter } from "./answers.ts";
import type { CalibrationWaiter } from "./calibrations.ts";
import { CODECS, type Codec, type Encoding, type Payload } from "./codec.ts";
import {
  EngineError,
  type FervorError,
  FrameError,
  InputError,
  MessageError,
  ProtocolError,
  Unreachable,
} from "./errors.ts";
import { told } from "./failures.ts";
import { checkBody, type FrameOptions, Framer } from "./framer.ts";
import type { FrameKey } from "./frames.ts";
import { Line } from "./line.ts";
import { Log } from "./log.ts";
import type * as messages from "./messages.ts";
import type { Pose } from "./poses.ts";
import type { Reconnect, Retries } from "./retries.ts";
import { Standing } from "./standing.ts";

/** What a caller is told by callbacks: a recoverable error that nobody awaits, or how a reconnect goes. */
export type News = FervorError | Reconnect;

/** What a conversation is made of. */
export interface Opening {
  readonly start: messages.SessionStart;
  readonly encoding: Encoding;
  /** Where the service is, for sentences. */
  readonly url: string;
  /** When to try again after a cut; undefined: the first one ends the conversation. */
  readonly retries?: Retries | undefined;
  /** The monotonic clock, seconds. */
  readonly now: () => number;
  readonly warn: (sentence: string) => void;
  readonly mostKept?: number | undefined;
}

/**
 * One session as its client sees it.
 *
 * The caller's duties: send the payload of `start` on each new connection, then whatever `nextPayload` gives, in that
 * order; hand every message that comes to `receive`; call `interrupted` when a connection is gone or could not be had,
 * and `lost` when there shall be none.
 */
export class Conversation extends Standing {
  readonly codec: Codec;
  #start: messages.SessionStart;
  readonly #framer: Framer;
  readonly #answers: Answers;
  readonly #line: Line;

  constructor({ start, encoding, url, retries, now, warn, mostKept }: Opening) {
    const latest = start.delivery === "latest";
    const timed = start.clock !== "frames";
    super(url);
    this.codec = CODECS[encoding];
    this.#start = start;
    this.#framer = new Framer(encoding, timed ? now : undefined);
    this.#answers = new Answers(latest, warn);
    const keeps = retries !== undefined;
    const log = new Log({ latest, emotionTtlS: start.emotion_ttl_s, idles: timed, keeps, mostKept, now, warn });
    this.#line = new Line(log, retries, now);
  }

  /** Whether there is a connection on which the session goes on. */
  get linked(): boolean {
    return this.#line.link === "up" && !this.over;
  }

  /** Whether a new connection waits for its `session.started`. */
  get linking(): boolean {
    return this.#line.link === "starting" && !this.over;
  }

  /** Times that the session went on on another connection. */
  get reconnects(): number {
    return this.#line.reconnects;
  }

  /** Frames sent and not yet answered. */
  get inFlight(): number {
    return this.#answers.inFlight;
  }

  // --- what to send --------------------------------------------------------------------------------------------------

  /** The payload that opens the conversation, or resumes it on a new connection. */
  start(): Payload {
    if (this.started !== undefined) return this.codec.encode(this.#line.resume(this.#start, this.started));
    this.state = "starting";
    this.#line.link = "starting";
    return this.codec.encode(this.#start);
  }

  /**
   * Take a pose as a frame to send, and give its seq; `waiter` gets the answer, which else goes to those unread.
   *
   * Throws FrameError where the pose can't be sent (nothing happened), FervorError where the conversation is not open.
   */
  frame(pose: Pose, options: FrameOptions = {}, waiter?: Waiter): FrameKey {
    const { joints } = this.mustBeOpen();
    const made = this.#framer.make(pose, joints, options);
    const { body, seq } = made;
    if (this.#answers.waits(made)) {
      const sentence = `frame ${seq} of body '${body}' is under way; expected a seq that rises`;
      throw new FrameError(sentence, { body, seq });
    }
    const frame = this.#line.log.remind(made);
    this.#framer.count(frame);
    this.#answers.expect(frame, waiter);
    this.#line.log.addFrame(frame);
    this.#line.post(frame);
    return { body, seq };
  }

  /** Make the service forget what `body` did so far. */
  resetBody(body: string): void {
    this.mustBeOpen();
    checkBody(body);
    const message: messages.BodyReset = { type: "body.reset", body };
    this.#answers.countReset();
    if (this.#line.log.addReset(body, message)) this.#line.post(message);
  }

  /** Say that `body` is gone. */
  endBody(body: string): void {
    this.mustBeOpen();
    checkBody(body);
    const message: messages.BodyEnd = { type: "body.end", body };
    if (this.#line.log.addEnd(body, message)) this.#line.post(message);
  }

  /** Make the service take its alignment from the frames that follow; after a cut it is asked again. */
  calibrate(held: Omit<messages.SessionCalibrate, "type">, waiter: CalibrationWaiter): void {
    this.mustBeOpen();
    const message: messages.SessionCalibrate = { type: "session.calibrate", ...held };
    this.#line.log.addCalibrate(message, waiter);
    this.#line.post(message);
  }

  /** A payload that says no more than that we are here; not in the queue of the others. */
  ping(): Payload {
    return this.codec.encode({ type: "ping" });
  }

  /** End the conversation; answers under way still come. */
  end(): void {
    this.mustBeOpen();
    this.#line.post({ type: "session.end" });
    this.state = "ending";
  }

  /** What to send next on this connection, if anything; wait `pauseS` before. */
  nextPayload(): Payload | undefined {
    const message = this.#line.next();
    return message === undefined ? undefined : this.codec.encode(message);
  }

  /** Seconds to wait before the next payload, while a backlog leaves that the service would find too fast. */
  get pauseS(): number {
    return this.#line.pauseS;
  }

  // --- what comes ----------------------------------------------------------------------------------------------------

  /** Take in a message: recoverable errors that nobody awaits, and that the stream goes on after a cut. */
  receive(payload: Payload): News[] {
    const message = this.over ? null : this.#read(payload);
    switch (message?.type) {
      case "session.started":
        return this.#opened(message);
      case "estimate":
        this.#answered(message);
        break;
      case "estimates":
        for (const estimate of message.estimates) this.#answered(estimate);
        break;
      case "checkpoint":
        this.#line.log.checkpoint(message);
        break;
      case "error":
        return this.#refused(message);
      case "session.calibrated":
        this.#calibrated(message);
        break;
      case "session.ended":
        this.#ended(this.reconnects > 0 ? this.#answers.totals : message.totals);
        break;
    }
    return [];
  }

  /**
   * The connection is gone, or there could be none; `failure` is why, unless the service told it.
   *
   * Gives when to open another one and `start` again; undefined: never, the conversation is over.
   */
  interrupted(failure: FervorError): Reconnect | undefined {
    const reason = this.#line.cut(failure);
    if (this.over) return undefined;
    if (!this.#line.resumes || this.started === undefined) {
      this.lost(reason);
      return undefined;
    }
    if (this.state === "ending" && this.inFlight === 0 && !this.#line.log.calibrations.decided) {
      this.#ended(this.#answers.totals); // only the goodbye is missing
      return undefined;
    }
    const news = this.#line.again(reason);
    if (news === undefined) this.lost(this.#line.surrender());
    return news;
  }

  /** The conversation is over; `failure` says why, undefined that it was meant to be. */
  lost(failure: FervorError | undefined): void {
    if (this.over) return;
    this.close(failure);
    const unanswered = failure ?? new Unreachable(`the session with ${this.url} ended before this was answered`);
    this.#answers.abandon(unanswered);
    this.#line.log.calibrations.abandon(unanswered);
  }

  // --- what came -----------------------------------------------------------------------------------------------------

  /** The oldest unread estimate; undefined if there is none yet, or all is read and the conversation has ended. */
  nextEstimate(): messages.Estimate | undefined {
    return this.#answers.next();
  }

  /** Nobody awaits this frame any more: its answer will be among the unread. */
  giveUp(key: FrameKey): void {
    this.#answers.giveUp(key);
  }

  /** The message; null if a newer service says what this client does not know, or nothing that makes sense. */
  #read(payload: Payload): messages.ServerMessage | null {
    try {
      return this.codec.decode(payload);
    } catch (error) {
      if (!(error instanceof MessageError)) throw error;
      const sentence = `the service at ${this.url} sent what this client can't read: ${error.message}`;
      this.lost(new ProtocolError(sentence, { cause: error }));
      return null;
    }
  }

  #opened(message: messages.SessionStarted): News[] {
    const again = this.started !== undefined;
    this.started = message;
    this.#line.log.idleS = message.limits.body_idle_s;
    if (!again) {
      this.state = "open";
      this.#line.link = "up";
      return [];
    }
    const { news, echoes } = this.#line.resumed(message);
    this.#answers.expectAgain(echoes);
    if (this.state === "ending") this.#line.post({ type: "session.end" });
    return [news];
  }

  #answered(estimate: messages.Estimate): void {
    const lost = this.#answers.waits(estimate) && this.#line.log.beginsAnew(estimate.body);
    const unsaid = lost && !estimate.flags.includes("reset");
    const settled = this.#answers.settle(unsaid ? { ...estimate, flags: ["reset", ...estimate.flags] } : estimate);
    if (!settled?.length) return;
    this.#line.log.answered(settled, estimate.flags);
    this.#line.progress();
  }

  /** From here on a resume must ask for the new alignment, under the name that the service goes on using. */
  #calibrated(message: messages.SessionCalibrated): void {
    const asked = this.#start.skeleton ?? "c13";
    const name = typeof asked === "string" ? asked : asked.name;
    this.#start = { ...this.#start, skeleton: { ...message.skeleton, name } };
    this.#line.log.calibrated(message);
  }

  #refused(message: messages.Error): News[] {
    const error = told(message);
    if (message.fatal) {
      this.#line.fault = error;
      this.#line.link = "down";
      if (!this.#line.resumes || this.started === undefined) this.lost(error);
      return [];
    }
    if (message.body !== null && message.seq !== null) return this.#frameRefused(message as FrameKey, error);
    if (error.constructor === InputError && this.#line.log.calibrationFailed(message.body, error)) return [];
    return [error];
  }

  #frameRefused({ body, seq }: FrameKey, error: FervorError): News[] {
    const awaited = this.#answers.refuse({ body, seq }, error);
    if (awaited === null) return [];
    this.#line.log.refused({ body, seq }, !(error instanceof EngineError));
    this.#line.progress();
    return awaited ? [] : [error];
  }

  #ended(totals: messages.Totals): void {
    this.totals = totals;
    this.lost(undefined);
  }
}
