import assert from "node:assert/strict";
import { test } from "node:test";
import { streamUrl, withoutSecrets } from "../src/address.ts";
import * as errors from "../src/errors.ts";
import { closed, refused, told } from "../src/failures.ts";
import { DEFAULTS } from "../src/messages.ts";

const URL_ = "ws://robot.local/v1/stream";
const said = (fields: object) =>
  told({ type: "error", message: "a sentence", fatal: false, ...DEFAULTS.Error, code: "internal", ...fields });

test("the service's errors come as the classes that they are there", () => {
  for (const [code, fatal, kind] of [
    ["bad_frame", false, errors.FrameError],
    ["bad_message", false, errors.MessageError],
    ["bad_message", true, errors.ProtocolError],
    ["rate_exceeded", true, errors.RateExceeded],
    ["checkpoint_unknown", true, errors.CheckpointUnknown],
    ["checkpoint_mismatch", true, errors.CheckpointMismatch],
    ["idle_timeout", true, errors.IdleTimeout],
    ["start_timeout", true, errors.StartTimeout],
    ["overloaded", false, errors.Overloaded],
    ["engine_failed", false, errors.EngineError],
    ["a_code_of_a_newer_service", true, errors.FervorError],
  ] as const) {
    const error = said({ code, fatal });
    assert.equal(error.constructor, kind, code);
    assert.equal(error.message, "a sentence");
  }
  const frame = said({ code: "bad_frame", body: "ann", seq: 7, retry_after: 2 }) as errors.FrameError;
  assert.deepEqual([frame.name, frame.body, frame.seq, frame.retryAfter], ["FrameError", "ann", 7, 2]);
});

test("every close code has its class and is kept", () => {
  for (const [code, kind] of [
    [1001, errors.Unreachable],
    [1009, errors.TooLarge],
    [1011, errors.Unreachable],
    [1012, errors.Unreachable],
    [1013, errors.Overloaded],
    [4400, errors.ProtocolError],
    [4401, errors.AuthError],
    [4404, errors.CheckpointUnknown],
    [4408, errors.IdleTimeout],
    [4410, errors.CheckpointMismatch],
    [4429, errors.RateExceeded],
  ] as const) {
    const error = closed({ code, reason: "why" }, URL_, 2);
    assert.equal(error.constructor, kind, String(code));
    assert.equal(error.closeCode, code);
    assert.equal(
      error.message,
      `the service at ${URL_} closed the connection (code ${code}, why); 2 frames have no answer`,
    );
  }
  const silent = closed({ code: 1006, reason: "" }, URL_, 1);
  assert.equal(silent.closeCode, undefined);
  assert.match(silent.message, /\(without a word\); 1 frame has no answer$/);
});

test("a refused request is told by its status and its problem document", () => {
  const problem = JSON.stringify({ detail: "The house is full." });
  for (const [status, kind, sentence] of [
    [503, errors.Overloaded, /takes no session now: The house is full; try again after 3 s$/],
    [401, errors.AuthError, /wants a token: The house is full$/],
    [404, errors.InputError, /there is no stream at/],
    [400, errors.RequestError, /refused the session: The house is full$/],
    [502, errors.Unreachable, /opens no stream: The house is full$/],
  ] as const) {
    const error = refused({ status, retryAfter: 3, body: problem }, URL_);
    assert.equal(error.constructor, kind, String(status));
    assert.match(error.message, sentence);
  }
  assert.equal(refused({ status: 503, retryAfter: 3, body: "" }, URL_).retryAfter, 3);
  assert.match(refused({ status: 418, body: "<html>" }, URL_).message, /HTTP 418$/);
  const origin = refused({ status: 403, body: '{"code": "origin_refused", "detail": "No."}' }, URL_);
  assert.equal(origin.constructor, errors.OriginRefused);
  assert.equal(refused({ status: 403, body: "" }, "ws://robot.local/stream").constructor, errors.InputError);
});

test("addresses are made complete, and shown without secrets", () => {
  assert.equal(streamUrl("ws://robot.local:8080").href, "ws://robot.local:8080/v1/stream");
  assert.equal(streamUrl(new URL("wss://robot.local/x/v1/stream")).href, "wss://robot.local/x/v1/stream");
  assert.equal(withoutSecrets(streamUrl("ws://me:secret@robot.local?key=1")), "ws://robot.local/v1/stream");
  for (const wrong of [
    "robot.local",
    "http://robot.local",
    "ws://",
    "ws://robot.local:x",
    "ws://robot.local:0",
    "ws://a#b",
  ]) {
    assert.throws(() => streamUrl(wrong), errors.InputError, wrong);
  }
});

test("names and codes of the tree do not rest on the names of classes, which a bundler may shorten", () => {
  for (const [name, kind] of Object.entries(errors)) {
    assert.ok(Object.hasOwn(kind, "name"), name);
    assert.equal(new kind("x").name, name);
    assert.equal(new kind("x").code, kind.code);
  }
});
