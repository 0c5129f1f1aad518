// Where a service listens: the addresses people write, made complete.

import { InputError } from "./errors.ts";

/** Path of the WebSocket endpoint. */
export const STREAM_PATH = "/v1/stream";

/** Where `fervor serve` listens unless told otherwise. */
export const DEFAULT_URL = `ws://127.0.0.1:8080${STREAM_PATH}`;

/** The WebSocket address that `url` means; one without a path gets `STREAM_PATH`. Throws InputError for any other. */
export function streamUrl(url: string | URL): URL {
  const found = URL.canParse(url) ? new URL(url) : undefined;
  const usable = found && /^wss?:$/.test(found.protocol) && found.hostname !== "" && found.port !== "0" && !found.hash;
  if (!usable) throw new InputError(`'${url}' is not the address of a stream; expected one like ${DEFAULT_URL}`);
  if (found.pathname === "/") found.pathname = STREAM_PATH;
  return found;
}

/** The address as it may stand in messages and logs: without user, password and query. */
export function withoutSecrets(url: URL): string {
  return `${url.protocol}//${url.host}${url.pathname}`;
}
