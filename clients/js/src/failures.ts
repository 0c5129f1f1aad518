// What goes wrong on the way to the service and back, told as errors of the tree.
//
// `told` is what the service said, `refused` why there is no connection, `closed` why there is none any more.

import { STREAM_PATH } from "./address.ts";
import * as errors from "./errors.ts";
import type { Error as ErrorMessage } from "./messages.ts";

type Kind = typeof errors.FervorError;

const BY_CODE: ReadonlyMap<string, Kind> = new Map(
  (
    [
      errors.FervorError,
      errors.InputError,
      errors.FrameError,
      errors.MessageError,
      errors.TooLarge,
      errors.StartTimeout,
      errors.IdleTimeout,
      errors.RateExceeded,
      errors.CheckpointUnknown,
      errors.CheckpointMismatch,
      errors.AuthError,
      errors.Overloaded,
      errors.EngineError,
    ] as Kind[]
  ).map((kind) => [kind.code, kind]),
);

const BY_CLOSE_CODE: ReadonlyMap<number, Kind> = new Map<number, Kind>([
  [1009, errors.TooLarge],
  [1013, errors.Overloaded],
  [4400, errors.ProtocolError],
  [4401, errors.AuthError],
  [4404, errors.CheckpointUnknown],
  [4408, errors.IdleTimeout],
  [4410, errors.CheckpointMismatch],
  [4429, errors.RateExceeded],
]);

/** How a connection was closed; code 1005: without one, 1006: without a word. */
export interface Close {
  readonly code: number;
  readonly reason: string;
}

/** An answer to the request for an upgrade that is none. */
export interface Refusal {
  readonly status: number;
  /** Seconds, as in Retry-After. */
  readonly retryAfter?: number | undefined;
  readonly body: string;
}

/** The error that the service told. */
export function told(message: ErrorMessage): errors.FervorError {
  const known = BY_CODE.get(message.code) ?? errors.FervorError;
  const kind = message.fatal && known === errors.MessageError ? errors.ProtocolError : known;
  const { body, seq, retry_after: retryAfter } = message;
  return new kind(message.message, {
    retryAfter: retryAfter ?? undefined,
    body: body ?? undefined,
    seq: seq ?? undefined,
  });
}

/** Why the connection to `url` ended although nobody here closed it; `unanswered` frames were under way. */
export function closed(close: Close, url: string, unanswered: number): errors.FervorError {
  const coded = close.code !== 1006;
  const cause = coded ? `code ${close.code}${close.reason ? `, ${close.reason}` : ""}` : "without a word";
  const frames = unanswered ? `; ${unanswered} frame${unanswered > 1 ? "s have" : " has"} no answer` : "";
  const kind = BY_CLOSE_CODE.get(close.code) ?? errors.Unreachable;
  return new kind(`the service at ${url} closed the connection (${cause})${frames}`, {
    closeCode: coded ? close.code : undefined,
  });
}

/** Why the service at `url` opened no session: by the status and the problem document (RFC 9457) of its answer. */
export function refused(refusal: Refusal, url: string): errors.FervorError {
  const { status, retryAfter } = refusal;
  const { code, detail } = problem(refusal.body);
  if (status === 503) {
    const wait = retryAfter === undefined ? "" : `; try again after ${retryAfter} s`;
    const why = detail ?? "it is overloaded";
    return new errors.Overloaded(`the service at ${url} takes no session now: ${why}${wait}`, { retryAfter });
  }
  if (status === 401) {
    return new errors.AuthError(`the service at ${url} wants a token: ${detail ?? "none came, or a wrong one"}`);
  }
  if (code === errors.OriginRefused.code) {
    return new errors.OriginRefused(`the service at ${url} refused this page's origin: ${detail}`);
  }
  // Servers refuse a WebSocket on a path they don't know with 403 as well as 404.
  if (status === 404 || (status === 403 && !url.endsWith(STREAM_PATH))) {
    return new errors.InputError(`there is no stream at ${url}; expected an address that ends in ${STREAM_PATH}`);
  }
  if (status >= 400 && status < 500) {
    return new errors.RequestError(`the service at ${url} refused the session: ${detail ?? `HTTP ${status}`}`);
  }
  return new errors.Unreachable(`what answers at ${url} opens no stream: ${detail ?? `HTTP ${status}`}`);
}

function problem(body: string): { code?: string; detail?: string } {
  try {
    const { code, detail } = JSON.parse(body);
    return { code: String(code), ...(detail ? { detail: String(detail).replace(/\.$/, "") } : {}) };
  } catch {
    return {};
  }
}
