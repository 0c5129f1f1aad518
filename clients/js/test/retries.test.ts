import assert from "node:assert/strict";
import { test } from "node:test";
import { AuthError, CheckpointUnknown, FervorError, Overloaded, Unreachable } from "../src/errors.ts";
import { Pace } from "../src/pace.ts";
import { FIRST_PAUSE_S, LONGEST_PAUSE_S, MOST_FAULTS, Retries, STABLE_S } from "../src/retries.ts";

const GONE = new Unreachable("gone");

function clock(): { now: () => number; pass(seconds: number): void } {
  let time = 1000;
  return { now: () => time, pass: (seconds) => (time += seconds) };
}

test("pauses double up to the longest, and a random part of each is waited", () => {
  const whole = new Retries(
    Infinity,
    () => 0,
    () => 1,
  );
  const pauses = Array.from({ length: 8 }, () => whole.failed(GONE)!);
  assert.deepEqual(
    pauses.slice(0, 4),
    [1, 2, 4, 8].map((times) => times * FIRST_PAUSE_S),
  );
  assert.equal(pauses.at(-1), LONGEST_PAUSE_S);
  const jittered = new Retries(
    Infinity,
    () => 0,
    () => 0.25,
  );
  assert.equal(jittered.failed(GONE), FIRST_PAUSE_S / 4);
});

test("a service that says when to come back is not asked earlier", () => {
  const retries = new Retries(
    Infinity,
    () => 0,
    () => 0,
  );
  assert.equal(retries.failed(new Overloaded("full", { retryAfter: 7 })), 7);
});

test("what another try can't cure is not tried again, unless that try will differ", () => {
  assert.equal(new Retries(Infinity, () => 0).failed(new AuthError("no")), undefined);
  assert.equal(new Retries(Infinity, () => 0).failed(new CheckpointUnknown("no")), undefined);
  assert.notEqual(new Retries(Infinity, () => 0).failed(new CheckpointUnknown("no"), true), undefined);
});

test("after the time for it, it is given up", () => {
  const { now, pass } = clock();
  const retries = new Retries(10, now, () => 1);
  assert.notEqual(retries.failed(GONE), undefined);
  pass(9.95);
  assert.ok(retries.failed(GONE)! <= 0.05 + 1e-9);
  pass(0.06);
  assert.equal(retries.failed(GONE), undefined);
});

test("a fault of the service's own that comes over and over is caused by this stream", () => {
  const retries = new Retries(
    Infinity,
    () => 0,
    () => 0,
  );
  const fault = new FervorError("a fault");
  for (let time = 0; time < MOST_FAULTS; time++) assert.notEqual(retries.failed(fault), undefined);
  assert.equal(retries.failed(fault), undefined);
});

test("an outage ends with an answer, or with a connection that held", () => {
  const { now, pass } = clock();
  const retries = new Retries(20, now, () => 0);
  retries.failed(GONE);
  pass(15);
  retries.answered();
  retries.failed(GONE);
  pass(15);
  assert.notEqual(retries.failed(GONE), undefined);
  retries.connected();
  pass(STABLE_S);
  assert.notEqual(retries.failed(GONE), undefined);
  assert.equal(retries.attempt, 1);
});

test("a backlog leaves below the rate that the service takes", () => {
  const { now, pass } = clock();
  const pace = new Pace(100, now);
  const begun = now();
  for (let frame = 0; frame < 1000; frame++) {
    pass(pace.waitS);
    pace.take();
    assert.ok(frame + 1 <= 50 + 95 * (now() - begun) + 1e-6);
  }
  assert.ok(now() - begun > 9.9);
});
