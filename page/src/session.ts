// Sessions of this page. Its estimates are not read here: the page sees them as everybody's, on the watched line.

import { connect, type FervorError, type Session } from "../../clients/js/src/index.ts";
import { request, socketAddress, token } from "./access.ts";

/** Opens a session for a sensor; `tell` hears of what goes wrong. Throws what the service says where it says no. */
export async function open(skeleton: string, tell: (problem: unknown) => void): Promise<Session> {
  const options = { skeleton, token: token() || undefined, onError: tell };
  const session = await connect(socketAddress("v1/stream"), options).catch(refusal);
  void drain(session, tell);
  return session;
}

/** Browsers don't say why a handshake failed; the same question without an upgrade does. */
async function refusal(error: FervorError): Promise<never> {
  const answer = await request("v1/stream").catch(() => undefined);
  if (answer?.status !== 401 && answer?.status !== 403) throw error;
  const { detail } = (await answer.json()) as { detail: string };
  throw new Error(`This token lets nobody stream: ${detail}`);
}

async function drain(session: Session, tell: (problem: unknown) => void): Promise<void> {
  try {
    for await (const _ of session);
  } catch (error) {
    tell(error);
  }
}
