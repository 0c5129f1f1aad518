// Messages of `GET /v1/stream`, made from its AsyncAPI document by `npm run types`: do not edit.
// Fields that the service may leave out are there all the same: see DEFAULTS.

/**
 * Joints as little-endian float32, one after the other; MessagePack only. Untracked: zeros in q, NaN in p.
 */
export type Raw = Uint8Array;
/**
 * How strongly an emotion shows: weak below the threshold, strong above, with hysteresis between.
 */
export type Level = "weak" | "strong";
/**
 * What a client may send; session.start first.
 */
export type ClientMessage = SessionStart | Frame | Frames | BodyReset | BodyEnd | SessionCalibrate | Ping | SessionEnd;
/**
 * What the service says; every frame is answered by one estimate.
 */
export type ServerMessage =
  | SessionStarted
  | Estimate
  | Estimates
  | SessionCalibrated
  | Checkpoint
  | GoingAway
  | Pong
  | Error
  | SessionEnded;

/**
 * A joint tree, which joint drives which segment of the rig, and its alignment.
 */
export interface SkeletonSpec {
  name: string;
  title?: string;
  /**
   * in the order they are sent
   */
  joints: string[];
  /**
   * index of each joint's parent; -1 for a root
   */
  parents: number[];
  /**
   * rig segment → the joint whose absolute rotation is that segment's
   */
  segments: {
    [k: string]: string;
  };
  /**
   * rig segment → alignment A, xyzw; identity where absent
   */
  bind?: {
    [k: string]: [number, number, number, number];
  };
  axes?: "local" | "global";
  quaternion?: "xyzw" | "wxyz";
  /**
   * reject jumps over 120° in one frame
   */
  noisy?: boolean;
}
/**
 * Opens the conversation: what the client will send, and what it wants back.
 */
export interface SessionStart {
  type: "session.start";
  /**
   * name from /v1/skeletons, or one of your own
   */
  skeleton?: string | SkeletonSpec;
  /**
   * default: what the skeleton's sensor gives
   */
  axes?: ("local" | "global") | null;
  /**
   * default: what the skeleton's sensor gives
   */
  quaternion?: ("xyzw" | "wxyz") | null;
  /**
   * joints sent, in this order; others count as untracked
   */
  joints?: string[] | null;
  /**
   * the sensor's rate; used by clock `frames`
   */
  nominal_hz?: number | null;
  clock?: "time" | "frames";
  delivery?: "every" | "latest";
  memory?: "staggered" | "stateful" | "window";
  /**
   * label of new bodies until a frame brings one
   */
  emotion?:
    | string
    | {
        [k: string]: number;
      }
    | null;
  /**
   * seconds a label holds; default: for ever, probabilities 2 s
   */
  emotion_ttl_s?: number | null;
  /**
   * estimates carry the intensity under every emotion too
   */
  by_emotion?: boolean;
  /**
   * seconds between the checkpoints of a body, client clock; absent: none are sent
   */
  checkpoint_s?: number | null;
  /**
   * checkpoint tokens to go on from, one a body
   */
  resume?: string[];
}
/**
 * One timestamped pose of one body.
 */
export interface Frame {
  type: "frame";
  body?: string;
  /**
   * rises by one or more from frame to frame
   */
  seq: number;
  /**
   * seconds, client clock; needed by clock `time`
   */
  t?: number | null;
  /**
   * one quaternion a joint; null where untracked
   */
  q?: ([number, number, number, number] | null)[] | Raw | null;
  /**
   * landmark sensors, in place of q: one position a joint, right-handed, any unit
   */
  p?: ([number, number, number] | null)[] | Raw | null;
  /**
   * false where untracked
   */
  mask?: boolean[] | null;
  /**
   * a new label; absent: the old one holds; `unknown` clears it
   */
  emotion?:
    | string
    | {
        [k: string]: number;
      }
    | null;
}
/**
 * Several frames in one message, answered by one `estimates`.
 */
export interface Frames {
  type: "frames";
  frames: Frame[];
}
/**
 * Forget what a body did so far; its next frame is a first one.
 */
export interface BodyReset {
  type: "body.reset";
  body: string;
}
/**
 * A body is gone; its state is freed.
 */
export interface BodyEnd {
  type: "body.end";
  body: string;
}
/**
 * Takes the alignment of an unknown sensor from a pose that a body holds from its next frame on.
 */
export interface SessionCalibrate {
  type: "session.calibrate";
  body?: string;
  /**
   * `n`: arms hanging; `t`: arms straight out to the sides
   */
  pose?: "n" | "t";
  /**
   * how long the pose is held, client clock
   */
  seconds?: number;
  /**
   * the person's up in sensor axes
   */
  up?: [number, number, number];
  /**
   * the way the person faces, in sensor axes
   */
  forward?: [number, number, number];
  /**
   * for the skeleton that comes back
   */
  name?: string | null;
}
/**
 * Asks for a pong, through the same queue as frames' errors.
 */
export interface Ping {
  type: "ping";
  id?: string | null;
}
/**
 * No more frames; the service answers what is under way, then `session.ended`.
 */
export interface SessionEnd {
  type: "session.end";
}
/**
 * What the service takes from one session; more is refused with an error.
 */
export interface Limits {
  max_message_bytes: number;
  max_bodies: number;
  max_frames_per_message: number;
  max_frames_per_second: number;
  max_joints: number;
  max_unanswered_frames: number;
  max_unsent_bytes: number;
  start_timeout_s: number;
  idle_timeout_s: number;
  body_idle_s: number;
}
/**
 * The model that will answer.
 */
export interface ModelInfo {
  name: string;
  version: string;
  /**
   * `demo`: procedural training data, not science
   */
  purpose: "demo" | "research";
  sha256: string;
  rate_hz: number;
  emotions: string[];
  thresholds: {
    [k: string]: number;
  };
}
/**
 * A body that goes on from a checkpoint.
 */
export interface Resumed {
  body: string;
  /**
   * newest frame that the checkpoint knows; replay those after it
   */
  seq: number;
  /**
   * estimates will be equal to the bit; else to 1e-6
   */
  same_runtime: boolean;
}
/**
 * The answer to `session.start`.
 */
export interface SessionStarted {
  type: "session.started";
  session_id: string;
  protocol: string;
  model: ModelInfo;
  limits: Limits;
  /**
   * joints expected in every frame, in this order
   */
  joints: string[];
  /**
   * runtime whose estimates are equal to the bit
   */
  fingerprint: string;
  resumed: Resumed[];
}
/**
 * The answer to one frame.
 */
export interface Estimate {
  type: "estimate";
  body: string;
  seq: number;
  t: number;
  /**
   * share of observers expected to recognise the emotion; null: no pose yet
   */
  intensity: number | null;
  level: Level | null;
  /**
   * the label in force, or `unknown`
   */
  emotion: string;
  status: ("warming_up" | "ok" | "insufficient") | string;
  flags: (
    | (
        | "between_steps"
        | "interpolated"
        | "held"
        | "gap_reset"
        | "clock_reset"
        | "reset"
        | "late"
        | "duplicate"
        | "jump"
        | "lost"
      )
    | string
  )[];
  by_emotion: {
    [k: string]: number;
  } | null;
}
/**
 * The answer to `frames`.
 */
export interface Estimates {
  type: "estimates";
  estimates: Estimate[];
}
/**
 * Everything needed to go on with a body after its frame `seq`, on any service with the same key.
 */
export interface Checkpoint {
  type: "checkpoint";
  body: string;
  seq: number;
  /**
   * signed; keep it as it is
   */
  token: string;
}
/**
 * The answer to `session.calibrate`: in force from the next frame on; `session.start` takes it again.
 */
export interface SessionCalibrated {
  type: "session.calibrated";
  skeleton: SkeletonSpec;
  frames: number;
  /**
   * largest deviation of a segment from its mean, degrees
   */
  spread_deg: number;
  /**
   * segments that were never tracked; they keep their alignment
   */
  unseen: string[];
  /**
   * of each body under the new alignment, if asked for; those before are void
   */
  checkpoints: Checkpoint[];
}
/**
 * The service stops: last checkpoints follow, then it closes with 1012. Connect again and resume.
 */
export interface GoingAway {
  type: "going_away";
  /**
   * time until the service closes at the latest
   */
  seconds: number;
}
/**
 * The answer to `ping`.
 */
export interface Pong {
  type: "pong";
  id: string | null;
}
/**
 * A sentence on what went wrong; after a fatal one the service closes.
 */
export interface Error {
  type: "error";
  code: string;
  message: string;
  fatal: boolean;
  body: string | null;
  seq: number | null;
  retry_after: number | null;
}
/**
 * What a session came to.
 */
export interface Totals {
  frames: number;
  estimates: number;
  late: number;
  duplicate: number;
  rejected: number;
  resets: number;
}
/**
 * The last message of a conversation.
 */
export interface SessionEnded {
  type: "session.ended";
  reason: string;
  totals: Totals;
}

/** What stands for the fields that the service may leave out. */
export const DEFAULTS = {
  Limits: {
    max_message_bytes: 1048576,
    max_bodies: 16,
    max_frames_per_message: 1024,
    max_frames_per_second: 2000,
    max_joints: 256,
    max_unanswered_frames: 4096,
    max_unsent_bytes: 4194304,
    start_timeout_s: 10,
    idle_timeout_s: 60,
    body_idle_s: 10,
  },
  SessionStarted: { protocol: "fervor.v1", resumed: [] },
  Estimate: { flags: [], by_emotion: null },
  SessionCalibrated: { checkpoints: [] },
  Pong: { id: null },
  Error: { body: null, seq: null, retry_after: null },
  Totals: { frames: 0, estimates: 0, late: 0, duplicate: 0, rejected: 0, resets: 0 },
};
