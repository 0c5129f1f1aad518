// What is the same in browsers and in Node.

export { DEFAULT_URL } from "./address.ts";
export type { Encoding, Payload } from "./codec.ts";
export type { Address, Connection, Dial, Listener } from "./connection.ts";
export * from "./errors.ts";
export type { FrameOptions } from "./framer.ts";
export type {
  Estimate,
  Level,
  Limits,
  ModelInfo,
  SessionCalibrated,
  SessionStarted,
  SkeletonSpec,
  Totals,
} from "./messages.ts";
export type { ClientOptions, HeldPose, Options, StartOptions } from "./options.ts";
export type { Joint, Pose } from "./poses.ts";
export type { Reconnect } from "./retries.ts";
export { type Patience, Session } from "./session.ts";
