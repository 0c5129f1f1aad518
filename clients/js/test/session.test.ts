// Sessions over real sockets, with the model of the service at the other end.

import assert from "node:assert/strict";
import { once } from "node:events";
import * as http from "node:http";
import type { AddressInfo } from "node:net";
import { type TestContext, test } from "node:test";
import { type WebSocket, WebSocketServer } from "ws";
import { connect, type FervorError, type Options, type Reconnect } from "../src/node.ts";
import { ServiceModel } from "./service_model.ts";

const POSE = [[0.5, 0, 0, 1]];

/** A service on a port of its own; `silent`: it keeps its answers to itself. */
class Service {
  readonly sockets: WebSocket[] = [];
  silent = false;
  refuse = 0;
  readonly #http = http.createServer();
  readonly #server = new WebSocketServer({ noServer: true, handleProtocols: (offered) => [...offered][0] ?? false });

  constructor() {
    this.#http.on("upgrade", (request, socket, head) => {
      if (this.refuse > 0) {
        this.refuse -= 1;
        socket.end("HTTP/1.1 503 Full\r\nRetry-After: 0\r\nContent-Length: 0\r\n\r\n");
        return;
      }
      this.#server.handleUpgrade(request, socket, head, (peer) => this.#talk(peer));
    });
  }

  static async start(t: TestContext): Promise<Service> {
    const service = new Service();
    service.#http.listen(0, "127.0.0.1");
    t.after(() => service.stop());
    await once(service.#http, "listening");
    return service;
  }

  get url(): string {
    return `ws://127.0.0.1:${(this.#http.address() as AddressInfo).port}`;
  }

  cut(): void {
    for (const socket of this.sockets.splice(0)) socket.terminate();
  }

  stop(): void {
    this.cut();
    this.#http.close();
  }

  /** Say what was kept back. */
  flush: () => void = () => {};

  #talk(peer: WebSocket): void {
    const encoding = peer.protocol.endsWith("json") ? "json" : "msgpack";
    const model = new ServiceModel(encoding, "one key");
    this.sockets.push(peer);
    this.flush = () => {
      for (const payload of model.said.splice(0)) peer.send(payload);
    };
    peer.on("message", (data: Buffer, binary) => {
      model.hear(binary ? data : String(data));
      const opening = model.said.length > 0 && String(model.said[0]).includes("session.started");
      if (!this.silent || opening) this.flush();
      if (model.said.length === 0 && String(data).includes("session.end")) peer.close(1000);
    });
  }
}

async function talk(t: TestContext, options: Options = {}) {
  const service = await Service.start(t);
  const told: Reconnect[] = [];
  const session = await connect(service.url, { onReconnect: (news) => told.push(news), ...options });
  t.after(() => session.close());
  return { service, session, told };
}

test("estimates are read as they come, until the session has ended", async (t) => {
  const { session } = await talk(t, { emotion: "joy" });
  for (let seq = 0; seq < 10; seq++) assert.equal(await session.send(POSE, { t: seq / 10 }), seq);
  await session.end();
  const seqs: number[] = [];
  for await (const { seq, emotion } of session) {
    seqs.push(seq);
    assert.equal(emotion, "joy");
  }
  assert.deepEqual(seqs, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
  assert.equal(await session.receive(), undefined);
  await assert.rejects(session.send(POSE), /has ended; connect again/);
});

test("each estimate goes to who asked for it", async (t) => {
  const { session } = await talk(t, { encoding: "msgpack" });
  const asked = ["ann", "ben", "ann"].map((body, index) => session.estimate(POSE, { body, t: index }));
  await session.send(POSE, { body: "cyd", t: 0 });
  assert.deepEqual(
    (await Promise.all(asked)).map(({ body, seq }) => [body, seq]),
    [
      ["ann", 0],
      ["ben", 0],
      ["ann", 1],
    ],
  );
  assert.equal((await session.receive())?.body, "cyd");
});

test("sending waits while the window is full, and keeps its order", async (t) => {
  const { service, session } = await talk(t, { window: 2 });
  service.silent = true;
  const sent: number[] = [];
  const sending = [0, 1, 2, 3].map((seq) => session.send(POSE, { t: seq }).then((number) => sent.push(number)));
  await Promise.all(sending.slice(0, 2));
  assert.equal(session.inFlight, 2);
  assert.deepEqual(sent, [0, 1]);
  service.silent = false;
  await once(service.sockets[0]!, "message"); // both have come; say so
  service.flush();
  await Promise.all(sending);
  assert.deepEqual(sent, [0, 1, 2, 3]);
});

test("an estimate that comes too late is among those that are read", async (t) => {
  const { service, session } = await talk(t);
  service.silent = true;
  await assert.rejects(session.estimate(POSE, { t: 0, timeoutS: 0.01 }), { name: "TimeoutError" });
  service.flush();
  assert.equal((await session.receive())?.seq, 0);
});

test("a refused frame rejects, or goes to onError, and harms nothing else", async (t) => {
  const errors: FervorError[] = [];
  const { session } = await talk(t, { onError: (error) => errors.push(error) });
  await assert.rejects(session.estimate([[9, 0, 0, 1]], { t: 0 }), { name: "FrameError", code: "bad_frame", seq: 0 });
  await session.send([[9, 0, 0, 1]], { t: 0.1 });
  assert.equal((await session.estimate(POSE, { t: 0.2 })).seq, 2);
  assert.deepEqual(
    errors.map(({ code }) => code),
    ["bad_frame"],
  );
  await assert.rejects(session.send([[1, 2]]), { name: "FrameError" });
  session.resetBody("nobody");
  await session.estimate(POSE, { t: 0.3 });
  assert.equal(errors.length, 2);
});

test("what a callback throws harms nothing, and is warned of", async (t) => {
  const warnings: string[] = [];
  const onError = () => {
    throw new Error("oh");
  };
  const { session } = await talk(t, { onError, warn: (sentence) => warnings.push(sentence) });
  await session.send([[9, 0, 0, 1]], { t: 0 });
  await session.estimate(POSE, { t: 0.1 });
  assert.deepEqual(warnings, ["onError failed: Error: oh"]);
});

for (const encoding of ["json", "msgpack"] as const) {
  test(`cuts are mended, in ${encoding}`, async (t) => {
    const { service, session, told } = await talk(t, { encoding, retryForS: Infinity });
    const intensities: (number | null)[] = [];
    for (let seq = 0; seq < 60; seq++) {
      if (seq % 20 === 10) {
        service.refuse = 2;
        service.cut();
      }
      intensities.push((await session.estimate([[seq % 8, 0, 0, 1]], { t: seq / 10 })).intensity);
    }
    const whole = await talk(t, { encoding });
    for (let seq = 0; seq < 60; seq++) {
      const { intensity } = await whole.session.estimate([[seq % 8, 0, 0, 1]], { t: seq / 10 });
      assert.equal(intensities[seq], intensity);
    }
    assert.equal(session.reconnects, 3);
    assert.equal(told.filter(({ reason }) => reason.code === "overloaded").length >= 6, true);
    assert.deepEqual((await session.end()).estimates, 60);
  });
}

test("without resume the first cut ends it, for all who wait", async (t) => {
  const { service, session } = await talk(t, { resume: false });
  service.silent = true;
  const asked = session.estimate(POSE, { t: 0 });
  const read = session.receive();
  await once(service.sockets[0]!, "message");
  service.cut();
  for (const waiting of [asked, read])
    await assert.rejects(waiting, /closed the connection \(without a word\); 1 frame has/);
  await assert.rejects(session.send(POSE), { name: "Unreachable" });
});

test("a session that nobody takes back is lost with a sentence", async (t) => {
  const { service, session } = await talk(t, { retryForS: 0.3, onReconnect: () => {} });
  service.stop();
  await assert.rejects(session.receive(), /closed the connection .*; tried to reconnect .* in \d+ s/);
});

test("a session is closed while it is cut, at once", async (t) => {
  const lost = new Promise<AbortController>((resolve) => {
    const controller = new AbortController();
    const onReconnect = () => resolve(controller);
    talk(t, { signal: controller.signal, retryForS: Infinity, onReconnect }).then(({ service, session }) => {
      service.stop();
      closed = session.receive();
    });
  });
  let closed: Promise<unknown> | undefined;
  (await lost).abort();
  assert.equal(await closed, undefined);
});

test("a calibration resolves with the skeleton, and times out without frames", async (t) => {
  const { session } = await talk(t);
  const found = session.calibrate({ seconds: 0.2 });
  for (let seq = 0; seq < 3; seq++) await session.send(POSE, { t: seq / 10 });
  assert.equal((await found).frames, 3);
  await assert.rejects(session.calibrate({ timeoutS: 0.01 }), { name: "TimeoutError" });
});

test("what can't be opened says why", async (t) => {
  const service = await Service.start(t);
  service.refuse = 1;
  await assert.rejects(connect(service.url), { name: "Overloaded", closeCode: 1013 });
  await assert.rejects(connect("http://robot.local"), { name: "InputError" });
  await assert.rejects(
    connect(service.url, { encoding: "xml" as never }),
    /encoding is "xml"; expected json or msgpack/,
  );
  await assert.rejects(connect(service.url, { window: 0 }), /window is 0/);
  await assert.rejects(
    connect(service.url, { checkpoint_s: Number.NaN }),
    /checkpoint_s is NaN; expected a finite number/,
  );
  await assert.rejects(connect(service.url, { signal: AbortSignal.abort() }), { name: "AbortError" });
  const { url } = service;
  service.stop();
  await assert.rejects(connect(url), /no service answers at/);
});

test("a service that says nothing is given up in time, and so is one that speaks otherwise", async (t) => {
  const mute = new WebSocketServer({ port: 0, host: "127.0.0.1", handleProtocols: () => "chat" });
  t.after(() => {
    for (const client of mute.clients) client.terminate();
    mute.close();
  });
  await once(mute, "listening");
  const url = `ws://127.0.0.1:${(mute.address() as AddressInfo).port}`;
  await assert.rejects(connect(url), /does not speak fervor.v1.json/);
  mute.options.handleProtocols = (offered: Set<string>) => [...offered][0] ?? false;
  await assert.rejects(connect(url, { openTimeoutS: 0.05 }), /no service answered at .* in time/);
});

test("leaving a block ends the session", async (t) => {
  const { session } = await talk(t);
  await session.send(POSE, { t: 0 });
  await session[Symbol.asyncDispose]();
  assert.equal((await session.receive())?.seq, 0);
  assert.equal(await session.receive(), undefined);
});
