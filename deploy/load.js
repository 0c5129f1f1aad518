// Load for a running service: sessions of one body each that stream at 30 Hz, as robots do.
//
//   k6 run -e URL=ws://127.0.0.1:8080/v1/stream -e SESSIONS=100 -e SECONDS=60 deploy/load.js
//
// Fails where a frame is not answered once, an error comes, or a session can't be opened. TOKEN is shown if it is set.
// With P99_MS, it fails too where a hundredth of the estimates come later than that.

import { check } from "k6";
import { Counter, Trend } from "k6/metrics";
import { WebSocket } from "k6/experimental/websockets";

const URL = __ENV.URL || "ws://127.0.0.1:8080/v1/stream";
const SESSIONS = Number(__ENV.SESSIONS || 10);
const FRAMES = Number(__ENV.SECONDS || 10) * 30;
const PERIOD_MS = 1000 / 30;
const JOINTS = 13;

const frames = new Counter("frames");
const estimates = new Counter("estimates");
const errors = new Counter("errors");
const latency = new Trend("latency", true);

export const options = {
  scenarios: {
    robots: { executor: "per-vu-iterations", vus: SESSIONS, iterations: 1, maxDuration: `${FRAMES / 30 + 60}s` },
  },
  thresholds: {
    checks: ["rate==1"],
    errors: ["count==0"],
    frames: [`count==${SESSIONS * FRAMES}`],
    estimates: [`count==${SESSIONS * FRAMES}`],
    ...(__ENV.P99_MS ? { latency: [`p(99)<${__ENV.P99_MS}`] } : {}),
  },
};

// Arms that swing, every robot's person at another pace.
function pose(t, pace) {
  const half = 0.5 * Math.sin(2 * Math.PI * pace * t);
  const turned = [Math.sin(half), 0, 0, Math.cos(half)];
  return Array.from({ length: JOINTS }, (_, joint) => (joint >= 3 && joint < 9 ? turned : [0, 0, 0, 1]));
}

export default function () {
  const params = __ENV.TOKEN ? { headers: { Authorization: `Bearer ${__ENV.TOKEN}` } } : {};
  const socket = new WebSocket(URL, "fervor.v1.json", params);
  const pace = 0.3 + 0.1 * (__VU % 10);
  const sent = new Map();
  let seq = 0;
  let answered = 0;
  let timer;

  const send = (message) => socket.send(JSON.stringify(message));

  function tick() {
    const t = seq / 30;
    sent.set(seq, Date.now());
    send({ type: "frame", body: "0", seq, t, q: pose(t, pace) });
    frames.add(1);
    seq += 1;
    if (seq === FRAMES) {
      clearInterval(timer);
      send({ type: "session.end" });
    }
  }

  function take(estimate) {
    if (!sent.has(estimate.seq)) {
      errors.add(1); // never asked for, or answered before
      return;
    }
    latency.add(Date.now() - sent.get(estimate.seq));
    sent.delete(estimate.seq);
    answered += 1;
    estimates.add(1);
  }

  socket.addEventListener("open", () => send({ type: "session.start", emotion: "joy" }));
  socket.addEventListener("error", () => errors.add(1));
  socket.addEventListener("message", (event) => {
    const message = JSON.parse(event.data);
    if (message.type === "session.started") {
      // Robots don't keep step with each other.
      setTimeout(() => (timer = setInterval(tick, PERIOD_MS)), Math.random() * PERIOD_MS);
    } else if (message.type === "estimate") {
      take(message);
    } else if (message.type === "estimates") {
      message.estimates.forEach(take);
    } else if (message.type === "error") {
      errors.add(1);
    }
  });
  socket.addEventListener("close", () => {
    clearInterval(timer);
    check(answered, { "every frame was answered": (count) => count === FRAMES });
  });
}
