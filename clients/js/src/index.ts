// JavaScript client of fervor, for browsers: send body poses, get emotional intensities back while the person moves.
// Node has an entry of its own, with the same names.

import { DEFAULT_URL } from "./address.ts";
import type { Options } from "./options.ts";
import { Session } from "./session.ts";
import { dialWebSocket } from "./web_socket.ts";

export * from "./public.ts";

/**
 * Open a session.
 *
 * `url` is where the service is, like `ws://robot.local:8080`; the path `/v1/stream` is added where there is none.
 * Rejects with InputError (a wrong address or option), AuthError, OriginRefused, Overloaded or Unreachable.
 */
export function connect(url: string | URL = DEFAULT_URL, options: Options = {}): Promise<Session> {
  return Session.open(dialWebSocket, url, options);
}
