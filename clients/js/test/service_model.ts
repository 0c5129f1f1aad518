// A service for tests: the rules of the protocol, and in place of a network a digest of all that a body did.

import type { Encoding, Payload } from "../src/codec.ts";
import type * as messages from "../src/messages.ts";
import { pack, unpack } from "../src/msgpack.ts";

export const IDLE_S = 10;
const CHECKPOINT_S = 0.5;

interface Body {
  digest: number;
  newest: number;
  last: number; // seconds
  label: string;
  flag: string; // that the next estimate carries
  told: number; // client time of the newest checkpoint, seconds
}

/** One session. What it says waits in `said`. */
export class ServiceModel {
  readonly said: Payload[] = [];
  hungUp = false;
  readonly #encoding: Encoding;
  readonly #key: string;
  readonly #latest: boolean;
  #bodies = new Map<string, Body>();
  #label = "unknown";
  #terms = "";
  #name = "";
  #held: { body: string; seconds: number; first?: number; frames: number } | undefined;

  /** Services with the same `key` take each other's checkpoints. */
  constructor(encoding: Encoding, key: string, latest = false) {
    this.#encoding = encoding;
    this.#key = key;
    this.#latest = latest;
  }

  hear(payload: Payload): void {
    if (this.hungUp) return;
    const message = typeof payload === "string" ? JSON.parse(payload) : unpack(payload);
    this.#take(message as messages.ClientMessage);
  }

  #take(message: messages.ClientMessage): void {
    switch (message.type) {
      case "session.start":
        return this.#start(message);
      case "frame":
        return this.#frame(message);
      case "body.reset":
        return this.#reset(message.body);
      case "body.end":
        return this.#end(message.body);
      case "session.calibrate":
        this.#held = { body: message.body ?? "0", seconds: message.seconds ?? 1, frames: 0 };
        return undefined;
      case "session.end":
        return this.#say({ type: "session.ended", reason: "", totals: {} as messages.Totals });
      default:
        return this.#say({ type: "pong", id: null });
    }
  }

  #start({ skeleton = "c13", emotion, resume = [] }: messages.SessionStart): void {
    this.#terms = JSON.stringify(skeleton);
    this.#name = typeof skeleton === "string" ? skeleton : skeleton.name;
    this.#label = (emotion as string | undefined) ?? "unknown";
    const resumed: messages.Resumed[] = [];
    for (const token of resume) {
      const { key, terms, name, body } = JSON.parse(token);
      if (key !== this.#key) return this.#refuse("checkpoint_unknown");
      if (terms !== this.#terms) return this.#refuse("checkpoint_mismatch");
      this.#bodies.set(name, { ...body, last: body.last ?? -Infinity });
      resumed.push({ body: name, seq: body.newest, same_runtime: true });
    }
    const limits = { body_idle_s: IDLE_S, max_message_bytes: 100_000 } as messages.Limits;
    const model = {} as messages.ModelInfo;
    this.#say({
      type: "session.started",
      session_id: "1",
      model,
      limits,
      joints: ["a"],
      fingerprint: "",
      resumed,
    } as never);
  }

  #refuse(code: string): void {
    this.#say({ type: "error", code, message: "no", fatal: true } as messages.Error);
    this.hungUp = true;
  }

  #frame(frame: messages.Frame): void {
    const { body: name = "0", seq, t = 0, emotion } = frame;
    const time = t ?? 0;
    const x =
      frame.q instanceof Uint8Array ? new DataView(frame.q.buffer).getFloat32(0, true) : (frame.q?.[0]?.[0] ?? 0);
    if (x === 9)
      return this.#say({ type: "error", code: "bad_frame", message: "no", fatal: false, body: name, seq } as never);
    const body = this.#follow(name, time);
    const late = seq <= body.newest || (body.last - time >= 0 && body.last - time <= 1);
    if (!late) {
      if (typeof emotion === "string") body.label = emotion;
      body.digest = mix(body.digest, x, body.label);
      body.last = time;
    }
    body.newest = Math.max(body.newest, seq);
    const flags = late ? ["late"] : body.flag ? [body.flag] : [];
    if (!late) body.flag = "";
    this.#answer({ body: name, seq, t: time, intensity: body.digest / 2 ** 32, emotion: body.label, flags });
    this.#calibrate(name, time, late);
    if (time - body.told >= CHECKPOINT_S && this.#held?.body !== name) this.#say(this.#checkpoint(name, body, time));
  }

  /** The body, which is a new one where it was away for long; others that were are forgotten then. */
  #follow(name: string, time: number): Body {
    const known = this.#bodies.get(name);
    if (known !== undefined && time - known.last <= IDLE_S) return known;
    for (const [other, { last }] of this.#bodies) {
      if (time - last <= IDLE_S) continue;
      this.#bodies.delete(other);
      this.#letGo(other);
    }
    const fresh: Body = {
      digest: this.#terms.length,
      newest: -1,
      last: -Infinity,
      label: this.#label,
      flag: "",
      told: -Infinity,
    };
    this.#bodies.set(name, fresh);
    return fresh;
  }

  #answer(fields: Partial<messages.Estimate>): void {
    const newest = this.said.at(-1);
    if (this.#latest && newest !== undefined) {
      const before = (typeof newest === "string" ? JSON.parse(newest) : unpack(newest)) as messages.ServerMessage;
      if (before.type === "estimate" && before.body === fields.body) this.said.pop(); // nobody has read it yet
    }
    this.#say({ type: "estimate", level: "weak", status: "ok", by_emotion: null, ...fields } as messages.Estimate);
  }

  #calibrate(name: string, time: number, late: boolean): void {
    if (late || this.#held?.body !== name) return;
    this.#held.first ??= time;
    this.#held.frames += 1;
    if (time - this.#held.first < this.#held.seconds) return;
    const { frames } = this.#held;
    this.#held = undefined;
    const spec = { name: this.#name, joints: ["a"], parents: [-1], segments: {}, title: `after ${this.#terms.length}` };
    this.#terms = JSON.stringify(spec);
    const checkpoints = [...this.#bodies].map(([other, body]) => {
      Object.assign(body, { digest: this.#terms.length, flag: "reset" });
      return this.#checkpoint(other, body, body.last);
    });
    const found = { skeleton: spec, frames, spread_deg: 0, unseen: [] };
    this.#say({ type: "session.calibrated", ...found, checkpoints });
  }

  #checkpoint(name: string, body: Body, time: number): messages.Checkpoint {
    body.told = time;
    const token = JSON.stringify({ key: this.#key, terms: this.#terms, name, body });
    return { type: "checkpoint", body: name, seq: body.newest, token };
  }

  #reset(name: string): void {
    const body = this.#bodies.get(name);
    if (body !== undefined) Object.assign(body, { digest: this.#terms.length, flag: "reset" });
    else this.#say({ type: "error", code: "bad_frame", message: "who?", fatal: false, body: name } as messages.Error);
  }

  #end(name: string): void {
    if (this.#bodies.delete(name)) this.#letGo(name);
    else this.#reset(name);
  }

  /** A body is gone, and with it the calibration that its pose was held for; one that waits for it goes on to. */
  #letGo(name: string): void {
    if (this.#held?.body !== name || this.#held.first === undefined) return;
    this.#held = undefined;
    this.#say({ type: "error", code: "bad_input", message: "it is gone", fatal: false, body: name } as messages.Error);
  }

  #say(message: messages.ServerMessage): void {
    this.said.push(this.#encoding === "json" ? JSON.stringify(message) : pack(message));
  }
}

function mix(digest: number, x: number, label: string): number {
  const bytes = new Uint8Array(new Float64Array([x]).buffer);
  let mixed = digest;
  for (const byte of [...bytes, ...new TextEncoder().encode(label)]) mixed = Math.imul(mixed ^ byte, 0x01000193);
  return mixed >>> 0;
}
