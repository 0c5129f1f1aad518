// Messages to payloads and back, in both encodings. A codec knows nothing of what was said before.

import { MessageError } from "./errors.ts";
import { type ClientMessage, DEFAULTS, type ServerMessage } from "./messages.ts";
import { pack, unpack } from "./msgpack.ts";

/** Name and major version of the protocol. */
export const PROTOCOL = "fervor.v1";

/** `json`: text; `msgpack`: smaller, with joints as float32. */
export type Encoding = "json" | "msgpack";

/** One message on the wire. */
export type Payload = string | Uint8Array;

/** One encoding of the protocol. */
export interface Codec {
  readonly encoding: Encoding;
  /** As negotiated in Sec-WebSocket-Protocol. */
  readonly subprotocol: string;
  encode(message: ClientMessage): Payload;
  /** A message of the service; null: one of a type that a newer service knows. Throws MessageError. */
  decode(payload: Payload): ServerMessage | null;
}

/** All codecs. */
export const CODECS: Readonly<Record<Encoding, Codec>> = {
  json: {
    encoding: "json",
    subprotocol: `${PROTOCOL}.json`,
    encode: (message) => JSON.stringify(message),
    decode: (payload) => checked(parsed(payload)),
  },
  msgpack: {
    encoding: "msgpack",
    subprotocol: `${PROTOCOL}.msgpack`,
    encode: (message) => pack(message),
    decode(payload) {
      if (typeof payload === "string") throw new MessageError(`${this.subprotocol} is binary, but text came`);
      return checked(unpack(payload));
    },
  },
};

/** What this client reads of each message; the rest of it is passed on as it is. */
const READ: { readonly [Type in ServerMessage["type"]]: Readonly<Record<string, string>> } = {
  "session.started": { session_id: "string", model: "object", limits: "object", joints: "array" },
  estimate: { body: "string", seq: "number", t: "number" },
  estimates: { estimates: "array" },
  "session.calibrated": { skeleton: "object" },
  checkpoint: { body: "string", seq: "number", token: "string" },
  going_away: { seconds: "number" },
  pong: {},
  error: { code: "string", message: "string", fatal: "boolean" },
  "session.ended": { totals: "object" },
};

function parsed(payload: Payload): unknown {
  if (typeof payload !== "string") throw new MessageError(`${PROTOCOL}.json is text, but bytes came`);
  try {
    return JSON.parse(payload);
  } catch {
    throw new MessageError("the message is not JSON");
  }
}

function checked(value: unknown): ServerMessage | null {
  if (kindOf(value) !== "object") throw new MessageError("the message is not an object");
  const { type } = value as { type?: unknown };
  if (typeof type !== "string") throw new MessageError("the message has no type");
  if (!Object.hasOwn(READ, type)) return null;
  expectFields(value as object, type as ServerMessage["type"]);
  return filled(value as ServerMessage);
}

function expectFields(message: object, type: ServerMessage["type"]): void {
  for (const [field, kind] of Object.entries(READ[type])) {
    const came = kindOf(Reflect.get(message, field));
    if (came !== kind) throw new MessageError(`${type}.${field} is ${came}; expected ${kind}`);
  }
}

function kindOf(value: unknown): string {
  if (value === null) return "null";
  return Array.isArray(value) ? "array" : typeof value;
}

/** The message, with what the service left out. */
function filled(message: ServerMessage): ServerMessage {
  switch (message.type) {
    case "estimate":
      return fill(DEFAULTS.Estimate, message);
    case "estimates":
      for (const estimate of message.estimates) {
        expectFields(estimate, "estimate");
        fill(DEFAULTS.Estimate, estimate);
      }
      return message;
    case "session.calibrated":
      fill(DEFAULTS.SessionCalibrated, message);
      for (const each of message.checkpoints) expectFields(each, "checkpoint");
      return message;
    case "session.started":
      fill(DEFAULTS.Limits, message.limits);
      return fill(DEFAULTS.SessionStarted, message);
    case "session.ended":
      fill(DEFAULTS.Totals, message.totals);
      return message;
    case "error":
      return fill(DEFAULTS.Error, message);
    case "pong":
      return fill(DEFAULTS.Pong, message);
    default:
      return message;
  }
}

function fill<Message extends object>(defaults: Readonly<Record<string, unknown>>, message: Message): Message {
  for (const [field, value] of Object.entries(defaults)) {
    if (!(field in message)) Object.assign(message, { [field]: structuredClone(value) });
  }
  return message;
}
