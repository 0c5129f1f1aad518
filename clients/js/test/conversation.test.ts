// The client's half of the golden transcripts: told what the service says, it says what the client says there, and
// hands out every estimate once; in both encodings. All of them are played against a real service too, by
// tests/test_js_transcripts.py of the source.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { CODECS, type Encoding } from "../src/codec.ts";
import { Conversation } from "../src/conversation.ts";
import { FrameError, ProtocolError, Unreachable } from "../src/errors.ts";
import type { Estimate, Frame, SessionCalibrate, SessionStart } from "../src/messages.ts";
import { pack, unpack } from "../src/msgpack.ts";
import { Retries } from "../src/retries.ts";

// biome-ignore lint/suspicious/noExplicitAny: lines of a transcript are whatever stands there
type Line = Record<string, any>;

const load = (name: string): Line[] =>
  readFileSync(new URL(`../../../transcripts/${name}.jsonl`, import.meta.url), "utf8")
    .trim()
    .split("\n")
    .map((line) => JSON.parse(line));

class Half {
  readonly conversation: Conversation;
  #encoding: Encoding;
  #names = new Map<string, unknown>();
  #pending: unknown[] = [];

  constructor(start: SessionStart, encoding: Encoding) {
    this.#encoding = encoding;
    const retries = new Retries(
      Infinity,
      () => 0,
      () => 0,
    );
    this.conversation = new Conversation({ start, encoding, url: "ws://x", retries, now: () => 0, warn: assert.fail });
  }

  play(lines: Line[]): Estimate[] {
    for (const line of lines) {
      if ("connect" in line) this.#pending = [this.#read(this.conversation.start())];
      else if ("client" in line) this.#says(line.client);
      else if ("server" in line) this.#hears(line.server);
      else if ("cut" in line || line.closed === 1012) this.conversation.interrupted(new Unreachable("cut"));
    }
    const told: Estimate[] = [];
    for (let next = this.conversation.nextEstimate(); next; next = this.conversation.nextEstimate()) told.push(next);
    return told;
  }

  #hears(message: Line): void {
    for (const name of Object.values(message)) if (String(name).startsWith("${")) this.#names.set(name, name.slice(2));
    const shown = this.#filled({ ...message, ...(message.model ? { model: {}, limits: {} } : {}) });
    this.conversation.receive(this.#encoding === "json" ? JSON.stringify(shown) : pack(shown as object));
    this.#take();
  }

  #says(message: Line): void {
    if (this.#pending.length === 0) {
      this.#act(message);
      this.#take();
    }
    assert.deepEqual(this.#pending.shift(), this.#filled(message));
  }

  #take(): void {
    for (let next = this.conversation.nextPayload(); next; next = this.conversation.nextPayload()) {
      this.#pending.push(this.#read(next));
    }
  }

  #act(message: Line): void {
    if (message.type === "frame") {
      const { q, p, type, ...options } = message as Frame;
      this.conversation.frame((q ?? p) as number[][], options as object);
    } else if (message.type === "session.calibrate") {
      const { type, ...held } = message as SessionCalibrate;
      this.conversation.calibrate(held, { resolve: () => {}, reject: () => {} });
    } else if (message.type === "ping") {
      this.#pending.push(message.id === undefined ? this.#read(this.conversation.ping()) : message);
    } else {
      assert.equal(message.type, "session.end");
      this.conversation.end();
    }
  }

  /** What we say, without the fields that stand for their defaults; joints as numbers. */
  #read(payload: string | Uint8Array): unknown {
    const message = (typeof payload === "string" ? JSON.parse(payload) : unpack(payload)) as Line;
    const { body, ...others } = message;
    return this.#plain(body === "0" ? others : message);
  }

  #plain(message: Line): Line {
    const { q } = message;
    if (!(q instanceof Uint8Array)) return message;
    const view = new DataView(q.buffer);
    const joints = Array.from({ length: q.length / 16 }, (_, joint) =>
      [0, 4, 8, 12].map((offset) => Number(view.getFloat32(16 * joint + offset, true).toFixed(4)) + 0),
    );
    return { ...message, q: joints };
  }

  #filled(value: unknown): unknown {
    if (typeof value === "string") return this.#names.get(value) ?? value;
    if (Array.isArray(value)) return value.map((each) => this.#filled(each));
    if (typeof value === "number") return value + 0;
    if (value === null || typeof value !== "object") return value;
    return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, this.#filled(each)]));
  }
}

for (const name of ["hello", "resume", "drain", "calibrate"]) {
  for (const encoding of ["json", "msgpack"] as const) {
    test(`the client's half of ${name}, in ${encoding}`, () => {
      const lines = load(name);
      const start = lines.find(({ client }) => client?.type === "session.start")?.client;
      const half = new Half(start, encoding);
      const told = half.play(lines);
      assert.ok(half.conversation.over);
      const expected = lines.flatMap(({ server }) => (server?.type === "estimate" ? [server] : []));
      const once = new Map(expected.map((estimate) => [JSON.stringify(estimate), estimate]));
      assert.deepEqual(told, [...once.values()]); // one that was sent again comes again, unchanged
    });
  }
}

const STARTED = { type: "session.started", session_id: "1", model: {}, limits: {}, joints: ["a"], fingerprint: "" };

function opened(start: Partial<SessionStart> = {}): Conversation {
  const asked: SessionStart = { type: "session.start", ...start };
  const conversation = new Conversation({
    start: asked,
    encoding: "json",
    url: "ws://x",
    now: () => 5,
    warn: assert.fail,
  });
  conversation.start();
  conversation.receive(JSON.stringify(STARTED));
  return conversation;
}

test("frames are numbered per body and timed, and under clock frames the service times them", () => {
  const conversation = opened();
  const pose = [[0, 0, 0, 1]];
  assert.deepEqual(conversation.frame(pose), { body: "0", seq: 0 });
  assert.deepEqual(conversation.frame(pose, { body: "ann" }), { body: "ann", seq: 0 });
  assert.deepEqual(conversation.frame(pose, { seq: 7, t: 9 }), { body: "0", seq: 7 });
  assert.deepEqual(conversation.frame(pose), { body: "0", seq: 8 });
  const sent = Array.from({ length: 4 }, () => JSON.parse(conversation.nextPayload() as string));
  assert.deepEqual(
    sent.map(({ t }) => t),
    [5, 5, 9, 5],
  );
  const counted = opened({ clock: "frames" });
  counted.frame(pose);
  assert.ok(!("t" in JSON.parse(counted.nextPayload() as string)));
});

test("what can't be sent is refused here, names its frame, and changes nothing", () => {
  const conversation = opened();
  const pose = [[0, 0, 0, 1]];
  for (const [options, sentence] of [
    [{ seq: -1 }, /seq is -1/],
    [{ seq: 0.5 }, /seq is 0.5/],
    [{ t: Number.NaN }, /t is NaN; expected seconds/],
    [{ body: "" }, /body is ""; expected a name of 1 to 64 characters/],
    [{ emotion: { joy: Number.NaN } }, /emotion.joy is NaN/],
  ] as const) {
    assert.throws(() => conversation.frame(pose, options), sentence);
    assert.throws(() => conversation.frame(pose, options), FrameError);
  }
  conversation.frame(pose, { seq: 3 });
  assert.throws(() => conversation.frame(pose, { seq: 3 }), /frame 3 of body '0' is under way/);
  assert.equal(conversation.inFlight, 1);
});

test("messages and fields of a newer service are passed over; nonsense ends the conversation", () => {
  const conversation = opened();
  assert.deepEqual(conversation.receive('{"type": "applause", "loud": true}'), []);
  assert.equal(conversation.state, "open");
  conversation.receive('{"type": "estimate", "seq": 1}');
  assert.ok(conversation.failure instanceof ProtocolError);
  assert.match(conversation.failure.message, /sent what this client can't read: estimate.body is undefined/);
});

test("each codec refuses the other's payloads", () => {
  assert.throws(() => CODECS.json.decode(new Uint8Array(1)), /is text, but bytes came/);
  assert.throws(() => CODECS.msgpack.decode("{}"), /is binary, but text came/);
  for (const wrong of ["", "null", "[]", "3", "{}", '{"type": 3}'])
    assert.throws(() => CODECS.json.decode(wrong), wrong);
});
