// JavaScript client of fervor, for Node: the names are those of the entry for browsers.

import { DEFAULT_URL } from "./address.ts";
import { nodeDial, type Tls } from "./node_web_socket.ts";
import type { Options } from "./options.ts";
import { Session } from "./session.ts";

export type { Tls } from "./node_web_socket.ts";
export * from "./public.ts";

/**
 * Open a session.
 *
 * `url` is where the service is, like `ws://robot.local:8080`; the path `/v1/stream` is added where there is none.
 * `tls` holds settings for `wss://`, as `node:https` takes them. Rejects with InputError (a wrong address or option),
 * AuthError, Overloaded (`retryAfter` says when to try again) or Unreachable.
 */
export function connect(url: string | URL = DEFAULT_URL, options: Options & { tls?: Tls } = {}): Promise<Session> {
  const { tls, ...others } = options;
  return Session.open(nodeDial(tls), url, others);
}
