// Poses as callers give them to frames: numbered per body, timed, checked.

import type { Encoding } from "./codec.ts";
import { FrameError } from "./errors.ts";
import type { FrameKey } from "./frames.ts";
import type { Frame } from "./messages.ts";
import { type Pose, toJoints, type Width } from "./poses.ts";

/** What may be said of a pose. */
export interface FrameOptions {
  /** Whose pose it is, where several people are tracked; "0" if left out. */
  body?: string;
  /** The frame's number; one more than the body's last if left out. */
  seq?: number;
  /** Seconds on the caller's clock; the monotonic clock's now if left out. Don't mix the two. */
  t?: number;
  /** A new label or a probability per emotion; the old one holds if left out. */
  emotion?: Frame["emotion"];
  /** One a joint: false where untracked. */
  mask?: readonly boolean[];
}

/** Makes the frames of one conversation. */
export class Framer {
  readonly #encoding: Encoding;
  readonly #now: (() => number) | undefined;
  readonly #nextSeq = new Map<string, number>();
  #width: Width = 4; // numbers a joint had in the newest pose

  /** `now`: seconds, for frames without a time; undefined: the service counts them. */
  constructor(encoding: Encoding, now: (() => number) | undefined) {
    this.#encoding = encoding;
    this.#now = now;
  }

  /** A pose of `joints` as a frame. Throws FrameError where that can't be sent; nothing happened then. */
  make(pose: Pose, joints: readonly string[], options: FrameOptions): Frame & FrameKey {
    const { body = "0", emotion, mask } = options;
    const seq = options.seq ?? this.#nextSeq.get(body) ?? 0;
    const t = options.t ?? this.#now?.();
    try {
      checkBody(body);
      if (!Number.isSafeInteger(seq) || seq < 0) throw new FrameError(`seq is ${seq}; expected an integer from 0 on`);
      if (t !== undefined && !Number.isFinite(t)) throw new FrameError(`t is ${t}; expected seconds`);
      const rows = toJoints(pose, joints, this.#encoding, this.#width);
      this.#width = rows.q ? 4 : 3;
      const said = {
        ...(emotion == null ? {} : { emotion: checkEmotion(emotion) }),
        ...(mask ? { mask: [...mask] } : {}),
      };
      return { type: "frame", body, seq, ...(t === undefined ? {} : { t }), ...rows, ...said };
    } catch (error) {
      if (!(error instanceof FrameError)) throw error;
      throw new FrameError(`frame ${seq} of body '${body}': ${error.message}`, { body, seq, cause: error });
    }
  }

  /** The frame is sent: the body's next one gets a higher number. */
  count({ body, seq }: FrameKey): void {
    this.#nextSeq.set(body, Math.max(seq + 1, this.#nextSeq.get(body) ?? 0));
  }
}

/** Throws FrameError where this can't be the name of a body. */
export function checkBody(body: unknown): void {
  if (typeof body !== "string" || body.length < 1 || [...body].length > 64) {
    throw new FrameError(`body is ${JSON.stringify(body)}; expected a name of 1 to 64 characters`);
  }
}

/** A number that JSON does not know would arrive as null. */
function checkEmotion(emotion: NonNullable<Frame["emotion"]>): NonNullable<Frame["emotion"]> {
  if (typeof emotion === "string") return emotion;
  const wrong = Object.entries(emotion).find(([, probability]) => !Number.isFinite(probability));
  if (wrong) throw new FrameError(`emotion.${wrong[0]} is ${wrong[1]}; expected a probability`);
  return { ...emotion };
}
