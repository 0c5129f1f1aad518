// The WebSocket of Node against the one of `ws`, and against sockets that misbehave.

import assert from "node:assert/strict";
import { once } from "node:events";
import * as http from "node:http";
import type { AddressInfo } from "node:net";
import * as net from "node:net";
import { type TestContext, test } from "node:test";
import fc from "fast-check";
import { type WebSocket, WebSocketServer } from "ws";
import type { Address } from "../src/connection.ts";
import { InputError, Unreachable } from "../src/errors.ts";
import type { Close } from "../src/failures.ts";
import { nodeDial } from "../src/node_web_socket.ts";
import { encodeFrame, FrameReader, MOST_BYTES, Opcode, Violation } from "../src/node_web_socket_frames.ts";

/** What comes to a client, and where its connection goes to. */
class Ear {
  readonly heard: (string | Uint8Array)[] = [];
  readonly closed: Promise<Close>;
  readonly address: Address;
  #close!: (close: Close) => void;
  #waiting: (() => void) | undefined;

  constructor(port: number, token?: string) {
    const url = new URL(`ws://127.0.0.1:${port}/v1/stream`);
    this.address = { url, shown: url.href, subprotocol: "fervor.v1.json", token };
    this.closed = new Promise((resolve) => {
      this.#close = resolve;
    });
  }

  dial(signal = new AbortController().signal) {
    const message = (payload: string | Uint8Array) => {
      this.heard.push(payload);
      this.#waiting?.();
    };
    return nodeDial()(this.address, { message, closed: (close) => this.#close(close) }, signal);
  }

  async hear(count: number): Promise<(string | Uint8Array)[]> {
    while (this.heard.length < count) {
      await new Promise<void>((resolve) => {
        this.#waiting = resolve;
      });
    }
    return this.heard;
  }
}

async function serve(t: TestContext): Promise<{ server: WebSocketServer; port: number }> {
  const handleProtocols = (offered: Set<string>) => [...offered][0] ?? false;
  const server = new WebSocketServer({ port: 0, host: "127.0.0.1", handleProtocols });
  t.after(() => {
    for (const client of server.clients) client.terminate();
    server.close();
  });
  await once(server, "listening");
  return { server, port: (server.address() as AddressInfo).port };
}

async function pair(t: TestContext) {
  const { server, port } = await serve(t);
  const ear = new Ear(port, "a-secret");
  const arrives = once(server, "connection") as Promise<[WebSocket, http.IncomingMessage]>;
  const connection = await ear.dial();
  const [peer, request] = await arrives;
  return { ear, connection, peer, request };
}

/** A server that answers a request for an upgrade with these bytes. */
async function mumble(t: TestContext, answer: string): Promise<number> {
  const server = net.createServer((socket) => socket.once("data", () => socket.end(answer)).on("error", () => {}));
  server.listen(0, "127.0.0.1");
  t.after(() => server.close());
  await once(server, "listening");
  return (server.address() as AddressInfo).port;
}

test("messages of every size go both ways, as text and as bytes", async (t) => {
  const { ear, connection, peer, request } = await pair(t);
  assert.equal(connection.subprotocol, "fervor.v1.json");
  assert.equal(request.headers.authorization, "Bearer a-secret");
  peer.on("message", (data, binary) => peer.send(data, { binary }));
  const sizes = [0, 1, 125, 126, 65_535, 65_536, 1_000_000];
  for (const size of sizes) {
    connection.send("é".repeat(size / 2));
    connection.send(new Uint8Array(size).fill(size));
  }
  const heard = await ear.hear(2 * sizes.length);
  for (const [index, size] of sizes.entries()) {
    assert.equal(heard[2 * index], "é".repeat(size / 2));
    assert.deepEqual(heard[2 * index + 1], new Uint8Array(size).fill(size));
  }
});

test("pings are answered, and pieces put together", async (t) => {
  const { ear, peer } = await pair(t);
  const pong = once(peer, "pong");
  peer.send("one ", { fin: false });
  peer.ping("are you there");
  peer.send("message", { fin: true });
  assert.equal(String((await pong)[0]), "are you there");
  assert.deepEqual(await ear.hear(1), ["one message"]);
});

test("the peer's close code and reason are told, and answered", async (t) => {
  const { ear, peer } = await pair(t);
  const closed = once(peer, "close");
  peer.close(4404, "who are you?");
  assert.deepEqual(await ear.closed, { code: 4404, reason: "who are you?" });
  assert.equal((await closed)[0], 4404);
});

test("a close without a code, and an end without a close", async (t) => {
  const first = await pair(t);
  first.peer.close();
  assert.equal((await first.ear.closed).code, 1005);
  const second = await pair(t);
  second.peer.terminate();
  assert.equal((await second.ear.closed).code, 1006);
});

test("closing says 1000", async (t) => {
  const { connection, ear, peer } = await pair(t);
  const closed = once(peer, "close");
  connection.close();
  connection.send("too late");
  assert.equal((await closed)[0], 1000);
  assert.equal((await ear.closed).code, 1000);
});

test("a refusal is told by its status, its problem and Retry-After", async (t) => {
  const server = http.createServer();
  server.on("upgrade", (_, socket) => {
    const body = '{"detail": "All rooms are taken."}';
    socket.end(`HTTP/1.1 503 Full\r\nRetry-After: 4\r\nContent-Length: ${body.length}\r\n\r\n${body}`);
  });
  server.listen(0, "127.0.0.1");
  t.after(() => server.close());
  await once(server, "listening");
  const { port } = server.address() as AddressInfo;
  await assert.rejects(new Ear(port).dial(), {
    name: "Overloaded",
    retryAfter: 4,
    message: /All rooms are taken; try/,
  });
});

test("what is no service is told so", async (t) => {
  const accept = "HTTP/1.1 101 Yes\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: x\r\n\r\n";
  for (const [answer, sentence] of [
    ["SSH-2.0-OpenSSH_9.2\r\n", /is not a fervor service: its answer is no HTTP/],
    ["", /no service answers at .*socket hang up/],
    [accept, /is not a fervor service: it accepts no WebSocket/],
    ["HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n", /opens no stream: HTTP 200/],
  ] as const) {
    await assert.rejects(new Ear(await mumble(t, answer)).dial(), (error: Error) => {
      assert.ok(error instanceof Unreachable);
      assert.match(error.message, sentence);
      return true;
    });
  }
  await assert.rejects(new Ear(9, "a token\nwith more").dial(), InputError);
});

test("an attempt ends when it is aborted", async (t) => {
  const server = net.createServer(() => {});
  server.listen(0, "127.0.0.1");
  t.after(() => server.close());
  await once(server, "listening");
  const controller = new AbortController();
  const dialled = new Ear((server.address() as AddressInfo).port).dial(controller.signal);
  controller.abort();
  await assert.rejects(dialled, Unreachable);
});

/** As a service sends it: not masked. */
function unmasked(opcode: number, data: Buffer, final = true): Buffer {
  const head =
    data.length < 126 ? Buffer.from([0, data.length]) : Buffer.from([0, 126, data.length >> 8, data.length & 255]);
  head[0] = (final ? 0x80 : 0) | opcode;
  return Buffer.concat([head, data]);
}

test("messages are the same however their bytes are cut", () => {
  const message = fc.record({ data: fc.uint8Array({ maxLength: 300 }), pieces: fc.integer({ min: 1, max: 3 }) });
  fc.assert(
    fc.property(fc.array(message), fc.infiniteStream(fc.integer({ min: 1, max: 50 })), (messages, cuts) => {
      const bytes = Buffer.concat(
        messages.flatMap(({ data, pieces }) => {
          const size = Math.ceil(data.length / pieces) || 1;
          return Array.from({ length: pieces }, (_, index) => {
            const part = Buffer.from(data.slice(index * size, index === pieces - 1 ? undefined : (index + 1) * size));
            return unmasked(index === 0 ? Opcode.BINARY : Opcode.CONTINUATION, part, index === pieces - 1);
          });
        }),
      );
      const reader = new FrameReader();
      const read: Uint8Array[] = [];
      for (let at = 0; at < bytes.length; ) {
        const chunk = bytes.subarray(at, at + cuts.next().value);
        for (const { data } of reader.push(chunk)) read.push(new Uint8Array(data));
        at += chunk.length;
      }
      assert.deepEqual(
        read,
        messages.map(({ data }) => data),
      );
    }),
  );
});

test("a peer that breaks the rules is told with which code", () => {
  const huge = Buffer.alloc(10);
  huge[0] = 0x82;
  huge[1] = 127;
  huge.writeBigUInt64BE(BigInt(MOST_BYTES + 1), 2);
  for (const [bytes, code] of [
    [Buffer.from([0xc1, 0]), 1002], // an extension
    [encodeFrame(Opcode.TEXT, Buffer.from("masked")), 1002],
    [Buffer.from([0x80, 0]), 1002], // the end of nothing
    [Buffer.from([0x01, 0, 0x81, 0]), 1002], // a message inside another
    [Buffer.from([0x09, 0]), 1002], // half a ping
    [Buffer.from([0x83, 0]), 1002], // an unknown type
    [huge, 1009],
  ] as const) {
    assert.throws(
      () => [...new FrameReader().push(bytes)],
      (error: Error) => error instanceof Violation && error.code === code,
      bytes.toString("hex"),
    );
  }
});

test("text that is not UTF-8 closes with 1007", async (t) => {
  const { ear, peer } = await pair(t);
  const closed = once(peer, "close");
  peer.send(Buffer.from([0xff]), { binary: false });
  assert.equal((await ear.closed).code, 1007);
  assert.equal((await closed)[0], 1007);
  assert.deepEqual(ear.heard, []);
});
