// What a caller can ask for, and the `session.start` that opens the conversation.

import type { Encoding } from "./codec.ts";
import type { Dial } from "./connection.ts";
import { type FervorError, InputError } from "./errors.ts";
import type { SessionCalibrate, SessionStart } from "./messages.ts";
import type { Reconnect } from "./retries.ts";

/** Most frames under way: eight seconds of a 30 Hz sensor. Then sending waits for answers. */
export const WINDOW = 256;

/** How long a cut is tried to mend: a robot drives out of the dead spot, a service is deployed anew. */
export const RETRY_FOR_S = 60;

/** Seconds between the checkpoints of a body, where a session resumes. */
export const CHECKPOINT_S = 1;

/** How a session behaves on this side. */
export interface ClientOptions {
  /** For a service that wants one. */
  token?: string | undefined;
  /** `json` by default; `msgpack` is smaller, and sends joints as float32. */
  encoding?: Encoding | undefined;
  /** Most frames under way, 256 by default; then sending waits. */
  window?: number | undefined;
  /** Go on by itself after a cut, as by default; else the first cut ends the session. */
  resume?: boolean | undefined;
  /** Seconds for which a cut is tried to mend, 60 by default; Infinity: for ever. */
  retryForS?: number | undefined;
  /** Seconds for connecting and starting, and for each attempt to reconnect; 10 by default. */
  openTimeoutS?: number | undefined;
  /** Recoverable errors that nobody awaits; `warn` hears of them by default. */
  onError?: ((error: FervorError) => void) | undefined;
  /** The connection is lost, an attempt failed, or the stream goes on; `warn` hears of it by default. */
  onReconnect?: ((news: Reconnect) => void) | undefined;
  /** Takes sentences for people; `console.warn` by default. */
  warn?: ((sentence: string) => void) | undefined;
  /** Closes the session when it aborts. */
  signal?: AbortSignal | undefined;
  /** Another way to open connections than the platform's own. */
  dial?: Dial | undefined;
}

/** What is asked of the service: the fields of `session.start`, under their names there. */
export type StartOptions = Omit<SessionStart, "type" | "resume">;

/** All that `connect` takes. */
export type Options = ClientOptions & StartOptions;

/** How a body holds still for a calibration. */
export type HeldPose = Omit<SessionCalibrate, "type">;

/** Options with defaults, and what they ask of the service. */
export interface Settled {
  readonly start: SessionStart;
  readonly encoding: Encoding;
  readonly token: string | undefined;
  readonly window: number;
  readonly resume: boolean;
  readonly retryForS: number;
  readonly openTimeoutS: number;
  readonly onError: (error: FervorError) => void;
  readonly onReconnect: (news: Reconnect) => void;
  readonly warn: (sentence: string) => void;
  readonly signal: AbortSignal | undefined;
}

/** The options, checked; what is no option of the client's is the service's to judge. Throws InputError. */
export function settle(options: Options): Settled {
  const { token, encoding = "json", window = WINDOW, resume = true, retryForS = RETRY_FOR_S, ...others } = options;
  const { openTimeoutS = 10, onError, onReconnect, signal, warn = console.warn, dial: _, ...asked } = others;
  if (encoding !== "json" && encoding !== "msgpack") throw wrong("encoding", encoding, "json or msgpack");
  if (!(window >= 1)) throw wrong("window", window, "a number from 1 on");
  if (!(retryForS >= 0)) throw wrong("retryForS", retryForS, "seconds");
  if (!(openTimeoutS > 0)) throw wrong("openTimeoutS", openTimeoutS, "seconds");
  const checkpoints = resume ? { checkpoint_s: CHECKPOINT_S } : {};
  const start: SessionStart = { ...checkpoints, ...asked, type: "session.start" };
  checkNumbers(start);
  return {
    start,
    encoding,
    token,
    window,
    resume,
    retryForS,
    openTimeoutS,
    onError: onError ?? ((error) => warn(error.message)),
    onReconnect: onReconnect ?? ((news) => warn(sentenceOf(news))),
    warn,
    signal,
  };
}

/** How a reconnect goes, in a sentence. */
export function sentenceOf({ reason, attempt, seconds, delayS, anew, exact }: Reconnect): string {
  if (delayS !== undefined) {
    return `${reason.message}; attempt ${attempt} to reconnect follows in ${delayS.toFixed(1)} s`;
  }
  const lost = anew.length > 0 ? `; these bodies begin anew: ${anew.join(", ")}` : "";
  const near = exact ? "" : "; on another kind of machine, so estimates are equal to 1e-6 only";
  return `the stream goes on after ${seconds.toFixed(1)} s${lost}${near}`;
}

/** A number that JSON does not know would arrive as null, and mean a default. */
function checkNumbers(start: SessionStart): void {
  for (const [name, value] of Object.entries(start)) {
    if (typeof value === "number" && !Number.isFinite(value)) throw wrong(name, value, "a finite number");
  }
}

function wrong(name: string, value: unknown, expected: string): InputError {
  const shown = typeof value === "string" ? JSON.stringify(value) : String(value);
  return new InputError(`${name} is ${shown}; expected ${expected}`);
}
