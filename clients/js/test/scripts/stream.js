// Streams poses of several bodies, as a robot does, and prints every estimate.
//
//     node stream.js URL '{"poses": "poses.json", "waits": [100], "options": {…}}'
//
// `poses`: {body: [frame][joint][4]}. Before the frames in `waits` it says so, and goes on after a line on its input.

import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { connect } from "fervor-client";

const RATE_HZ = 40;
const [url, given] = process.argv.slice(2);
const { poses: path, waits = [], options = {} } = JSON.parse(given);
const poses = JSON.parse(readFileSync(path, "utf8"));
const lines = createInterface(process.stdin)[Symbol.asyncIterator]();
const say = (message) => console.log(JSON.stringify(message));

const session = await connect(url, {
  ...options,
  onError: (error) => say({ error: error.code, message: error.message }),
  onReconnect: ({ reason, delayS, anew, exact }) =>
    say({ reconnect: delayS === undefined, reason: reason.message, closeCode: reason.closeCode, anew, exact }),
});

async function send() {
  const count = Math.max(...Object.values(poses).map((each) => each.length));
  for (let seq = 0; seq < count; seq++) {
    if (waits.includes(seq)) {
      say({ waits: seq, inFlight: session.inFlight });
      await lines.next();
    }
    for (const [body, each] of Object.entries(poses)) await session.send(each[seq], { body, seq, t: seq / RATE_HZ });
  }
  return session.end({ timeoutS: 60 });
}

async function read() {
  const estimates = [];
  for await (const estimate of session) estimates.push(estimate);
  return estimates;
}

const [totals, estimates] = await Promise.all([send(), read()]);
say({ totals, reconnects: session.reconnects, estimates });
lines.return?.();
process.stdin.destroy();
