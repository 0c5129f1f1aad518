// What can go wrong, and whose fault it is. Every message is one sentence: what is wrong, where, and what was expected.
//
//   FervorError
//   ├── InputError            the caller sent something that can't be used
//   │   ├── RequestError      the service refused the request for a session
//   │   └── MessageError      a message that can't be used; the session goes on
//   │       ├── FrameError    one frame; its body goes on with the next
//   │       └── ProtocolError the session can't go on
//   │           ├── TooLarge · StartTimeout · IdleTimeout · RateExceeded
//   │           └── CheckpointUnknown · CheckpointMismatch
//   ├── AuthError             no token, or a wrong one
//   ├── OriginRefused         a web page of a site that may not use the service
//   ├── Overloaded            not now; try again later
//   ├── Unreachable           no service answers, or it went away
//   └── EngineError           a fault of the service's own

/** What an error may carry beside its sentence. */
export interface ErrorDetails {
  cause?: unknown;
  /** Seconds after which to try again, where that makes sense. */
  retryAfter?: number | undefined;
  /** With which the connection was closed, where that differs from the code of the class. */
  closeCode?: number | undefined;
  body?: string | undefined;
  seq?: number | undefined;
}

/** Root of all errors that this client raises on purpose; by itself a fault of the service that nobody foresaw. */
export class FervorError extends Error {
  static override readonly name: string = "FervorError";
  static readonly code: string = "internal";
  static readonly closeCode: number | undefined = 1011;

  /** For programs; the same as on the wire. */
  readonly code: string;
  /** WebSocket close code; undefined where the session goes on, or nobody closed. */
  readonly closeCode: number | undefined;
  /** Seconds after which to try again, where that makes sense. */
  readonly retryAfter: number | undefined;

  constructor(message: string, details: ErrorDetails = {}) {
    super(message, details.cause === undefined ? undefined : { cause: details.cause });
    const kind = new.target;
    this.name = kind.name;
    this.code = kind.code;
    this.closeCode = details.closeCode ?? kind.closeCode;
    this.retryAfter = details.retryAfter;
  }
}

/** The caller sent something that can't be used. */
export class InputError extends FervorError {
  static override readonly name: string = "InputError";
  static override readonly code: string = "bad_input";
  static override readonly closeCode: number | undefined = undefined;
}

/** The service refused the request for a session. */
export class RequestError extends InputError {
  static override readonly name = "RequestError";
  static override readonly code = "bad_request";
}

/** A message that can't be used; the session goes on as if it had not been sent. */
export class MessageError extends InputError {
  static override readonly name: string = "MessageError";
  static override readonly code: string = "bad_message";
}

/** One frame that can't be used; its body goes on with the next frame. */
export class FrameError extends MessageError {
  static override readonly name = "FrameError";
  static override readonly code = "bad_frame";

  readonly body: string | undefined;
  readonly seq: number | undefined;

  constructor(message: string, details: ErrorDetails = {}) {
    super(message, details);
    this.body = details.body;
    this.seq = details.seq;
  }
}

/** The session can't go on. */
export class ProtocolError extends MessageError {
  static override readonly name: string = "ProtocolError";
  static override readonly closeCode: number = 4400;
}

/** More bytes than the service takes in one piece. */
export class TooLarge extends ProtocolError {
  static override readonly name = "TooLarge";
  static override readonly code = "too_large";
  static override readonly closeCode = 1009;
}

/** No session.start in time. */
export class StartTimeout extends ProtocolError {
  static override readonly name = "StartTimeout";
  static override readonly code = "start_timeout";
  static override readonly closeCode = 4408;
}

/** Nothing came for too long. */
export class IdleTimeout extends ProtocolError {
  static override readonly name = "IdleTimeout";
  static override readonly code = "idle_timeout";
  static override readonly closeCode = 4408;
}

/** More frames a second than the service takes from one session. */
export class RateExceeded extends ProtocolError {
  static override readonly name = "RateExceeded";
  static override readonly code = "rate_exceeded";
  static override readonly closeCode = 4429;
}

/** A checkpoint that no key of the service signed, or that is too old. */
export class CheckpointUnknown extends ProtocolError {
  static override readonly name = "CheckpointUnknown";
  static override readonly code = "checkpoint_unknown";
  static override readonly closeCode = 4404;
}

/** A checkpoint of another model, or of other terms. */
export class CheckpointMismatch extends ProtocolError {
  static override readonly name = "CheckpointMismatch";
  static override readonly code = "checkpoint_mismatch";
  static override readonly closeCode = 4410;
}

/** No token, or a wrong one. */
export class AuthError extends FervorError {
  static override readonly name = "AuthError";
  static override readonly code = "unauthorized";
  static override readonly closeCode = 4401;
}

/** A web page of a site that may not use this service. */
export class OriginRefused extends FervorError {
  static override readonly name = "OriginRefused";
  static override readonly code = "origin_refused";
  static override readonly closeCode = 4401;
}

/** The service is full; the same may succeed later. */
export class Overloaded extends FervorError {
  static override readonly name = "Overloaded";
  static override readonly code = "overloaded";
  static override readonly closeCode = 1013;
}

/** No service answers at the address, or it went away. */
export class Unreachable extends FervorError {
  static override readonly name = "Unreachable";
  static override readonly code = "unreachable";
  static override readonly closeCode: number | undefined = undefined;
}

/** A model run failed: a fault of the service's own, not the caller's. */
export class EngineError extends FervorError {
  static override readonly name = "EngineError";
  static override readonly code = "engine_failed";
  static override readonly closeCode = undefined;
}
