// Plays the client's half of a golden transcript, over the transport and the codecs of the client.
//
//     node player.js TRANSCRIPT URL
//
// Where the service is to stop, or another one to take its place, it says so, and reads the address that answers next.

import assert from "node:assert/strict";
import { subscribe } from "node:diagnostics_channel";
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const inside = (name) => import(pathToFileURL(`node_modules/fervor-client/dist/${name}.js`));
const { nodeDial } = await inside("node_web_socket");
const { encodeFrame, Opcode } = await inside("node_web_socket_frames");
const { CODECS } = await inside("codec");
const { unpack } = await inside("msgpack");
const { closed, told } = await inside("failures");

const ERRORS = { 400: "RequestError", 401: "AuthError", 503: "Overloaded" }; // by the status of a refusal
const CLOSES = {
  1000: "Unreachable",
  1007: "Unreachable",
  1009: "TooLarge",
  1012: "Unreachable",
  4400: "ProtocolError",
  4404: "CheckpointUnknown",
  4408: "IdleTimeout",
  4410: "CheckpointMismatch",
  4429: "RateExceeded",
};
const NEAR = 1e-6;

let wire; // the socket below the newest connection, for what no client would do
subscribe("http.client.request.start", ({ request }) => {
  request.once("upgrade", (_, socket) => {
    wire = socket;
  });
});

/** What comes on a connection, in order, for whoever asks. */
class Inbox {
  #came = [];
  #waiting;

  put(item) {
    this.#came.push(item);
    this.#waiting?.();
  }

  async next() {
    while (this.#came.length === 0) await new Promise((resolve) => (this.#waiting = resolve));
    return this.#came.shift();
  }
}

/** Sees that what came is what a transcript expects; names in it take what stands there. */
function expectAlike(expected, came, names, place = "") {
  if (typeof expected === "string" && expected.startsWith("${")) {
    assert.ok(came, `${place} is empty`);
    names.set(expected, came);
  } else if (Array.isArray(expected)) {
    assert.equal(came.length, expected.length, place);
    for (const [index, each] of expected.entries()) expectAlike(each, came[index], names, `${place}.${index}`);
  } else if (expected !== null && typeof expected === "object") {
    assert.deepEqual(Object.keys(came).sort(), Object.keys(expected).sort(), place);
    for (const key of Object.keys(expected)) expectAlike(expected[key], came[key], names, `${place}.${key}`);
  } else if (typeof expected === "number" && !Number.isInteger(expected)) {
    assert.ok(Math.abs(expected - came) <= NEAR, `${place} is ${came}, not ${expected}`);
  } else if (/\.(message|reason)$/.test(place))
    assert.ok(came, place); // sentences for people may change
  else assert.equal(came, expected, place);
}

/** A client's message with what the service gave before in place of its name, and raw joints as bytes. */
function filled(value, names) {
  if (typeof value === "string") return names.get(value) ?? value;
  if (Array.isArray(value)) return value.map((each) => filled(each, names));
  if (value === null || typeof value !== "object") return value;
  if (value.float32) return new Uint8Array(new Float32Array(value.float32).buffer);
  return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, filled(each, names)]));
}

class Player {
  #url;
  #names = new Map();
  #codec;
  #connection;
  #inbox;
  #lines = createInterface(process.stdin)[Symbol.asyncIterator]();

  constructor(url) {
    this.#url = new URL(url);
  }

  async play(lines) {
    for (const [number, line] of lines.entries()) {
      const kind = Object.keys(line)[0];
      try {
        await this[kind](line);
      } catch (error) {
        throw new Error(`line ${number + 1}: ${JSON.stringify(line).slice(0, 200)}`, { cause: error });
      }
    }
    this.#lines.return();
  }

  about() {}

  async connect({ connect: { subprotocols, authorization }, accepted, refused }) {
    const inbox = new Inbox();
    const address = {
      url: this.#url,
      shown: this.#url.href,
      subprotocol: subprotocols.join(", "),
      token: authorization?.replace("Bearer ", ""),
    };
    const listener = { message: (payload) => inbox.put({ payload }), closed: (close) => inbox.put({ close }) };
    const dialled = nodeDial()(address, listener, new AbortController().signal);
    if (refused !== undefined) {
      await assert.rejects(dialled, ({ name, code, retryAfter }) => {
        assert.equal(name, ERRORS[refused.status]);
        if (refused.status !== 400) assert.equal(code, refused.code);
        assert.equal(retryAfter, refused.retry_after);
        return true;
      });
      return;
    }
    this.#connection = await dialled;
    this.#inbox = inbox;
    assert.equal(this.#connection.subprotocol, accepted);
    this.#codec = Object.values(CODECS).find(({ subprotocol }) => subprotocol === accepted);
  }

  client({ client, times = 1, hex }) {
    const payload = this.#codec.encode(filled(client, this.#names));
    if (hex !== undefined) assert.deepEqual(unpack(payload), unpack(Buffer.from(hex, "hex")));
    for (let time = 0; time < times; time++) this.#connection.send(payload);
  }

  client_text({ client_text: text, times = 1 }) {
    this.#connection.send(text.repeat(times));
  }

  client_hex({ client_hex: hex }) {
    this.#connection.send(Buffer.from(hex, "hex"));
  }

  client_text_hex({ client_text_hex: hex }) {
    wire.write(encodeFrame(Opcode.TEXT, Buffer.from(hex, "hex")));
  }

  async server({ server, hex }) {
    const { payload } = await this.#inbox.next();
    assert.ok(payload, "the service closed");
    expectAlike(server, typeof payload === "string" ? JSON.parse(payload) : unpack(payload), this.#names);
    const message = this.#codec.decode(payload);
    assert.equal(message.type, server.type);
    if (message.type === "error") assert.equal(told(message).code, server.code);
    if (hex !== undefined) assert.deepEqual(unpack(Buffer.from(hex, "hex")), server);
  }

  async closed({ closed: code }) {
    const { close, payload } = await this.#inbox.next();
    assert.equal(payload, undefined);
    assert.equal(close.code, code);
    const error = closed(close, this.#url.href, 0);
    assert.deepEqual([error.name, error.closeCode], [CLOSES[code], code]);
  }

  cut() {
    wire.resetAndDestroy();
  }

  async service({ service }) {
    console.log(JSON.stringify({ service }));
    if (service === "stops") return;
    const { value } = await this.#lines.next();
    this.#url = new URL(value);
  }
}

const [path, url] = process.argv.slice(2);
const lines = readFileSync(path, "utf8").trim().split("\n");
await new Player(url).play(lines.map((line) => JSON.parse(line)));
console.log(JSON.stringify({ played: lines.length }));
process.exit();
