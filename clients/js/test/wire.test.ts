// A connection that fell silent: the clock is handed in, and timers are the test's.

import assert from "node:assert/strict";
import { mock, test } from "node:test";
import type { Connection, Listener } from "../src/connection.ts";
import { Conversation } from "../src/conversation.ts";
import { Unreachable } from "../src/errors.ts";
import { KEEPALIVE_PATIENCE_S, KEEPALIVE_S, Wire } from "../src/wire.ts";

const STARTED = { type: "session.started", session_id: "1", model: {}, limits: {}, joints: ["a"], fingerprint: "" };

async function opened(limits: object = {}) {
  let time = 100;
  const now = () => time;
  const sent: string[] = [];
  let listener!: Listener;
  const connection: Connection = {
    subprotocol: "fervor.v1.json",
    send: (payload) => sent.push(JSON.parse(payload as string).type),
    close: () => sent.push("(close)"),
  };
  const dial = (_: unknown, told: Listener) => {
    listener = told;
    return Promise.resolve(connection);
  };
  const start = { type: "session.start" } as const;
  const conversation = new Conversation({ start, encoding: "json", url: "ws://x", now, warn: assert.fail });
  const address = { url: new URL("ws://x"), shown: "ws://x", subprotocol: "fervor.v1.json", token: undefined };
  const wire = new Wire(conversation, { dial, address, openTimeoutS: 10, now }, () => {});
  const gone = wire.run();
  await Promise.resolve();
  await Promise.resolve();
  listener.message(JSON.stringify({ ...STARTED, limits }));
  const pass = (seconds: number) => {
    time += seconds;
    mock.timers.tick(1000 * seconds);
  };
  return { gone, listener, pass, sent, wire };
}

test("a quiet connection is kept alive, and one that is dead is given up", async (t) => {
  mock.timers.enable({ apis: ["setTimeout"] });
  t.after(() => mock.timers.reset());
  const { gone, listener, pass, sent } = await opened();
  pass(KEEPALIVE_S);
  assert.deepEqual(sent, ["session.start", "ping"]);
  listener.message('{"type": "pong"}');
  pass(KEEPALIVE_S);
  assert.deepEqual(sent, ["session.start", "ping", "ping"]);
  for (let waited = 0; waited < KEEPALIVE_PATIENCE_S; waited += KEEPALIVE_S) pass(KEEPALIVE_S);
  const failure = await gone;
  assert.ok(failure instanceof Unreachable);
  assert.match(failure.message, /no word from ws:\/\/x for 15 s/);
  assert.deepEqual(sent.slice(3), ["(close)"]);
});

test("a service with little patience hears more often", async (t) => {
  mock.timers.enable({ apis: ["setTimeout"] });
  t.after(() => mock.timers.reset());
  const { pass, sent, wire } = await opened({ idle_timeout_s: 3 });
  pass(1);
  assert.deepEqual(sent, ["session.start", "ping"]);
  wire.end(new Unreachable("the test is over"));
});
