// The frames of a WebSocket as its client writes and reads them: RFC 6455, section 5, without extensions.

import { randomFillSync } from "node:crypto";

/** Longest message that is taken: a service answers 4096 frames at once in less. */
export const MOST_BYTES = 16 * 1024 * 1024;

/** What a frame is. */
export const Opcode = { CONTINUATION: 0, TEXT: 1, BINARY: 2, CLOSE: 8, PING: 9, PONG: 10 } as const;

/** A frame, or a message put together from its pieces. */
export interface Piece {
  readonly opcode: number;
  readonly data: Buffer;
}

/** The peer broke the rules: the code to close with, and why. */
export class Violation extends Error {
  readonly code: number;

  constructor(code: number, message: string) {
    super(message);
    this.code = code;
  }
}

/** One frame as a client sends it: final and masked. */
export function encodeFrame(opcode: number, data: Uint8Array): Buffer {
  const extended = data.length < 126 ? 0 : data.length < 0x1_0000 ? 2 : 8;
  const frame = Buffer.allocUnsafe(6 + extended + data.length);
  frame[0] = 0x80 | opcode;
  frame[1] = 0x80 | (extended === 0 ? data.length : extended === 2 ? 126 : 127);
  if (extended === 2) frame.writeUInt16BE(data.length, 2);
  if (extended === 8) frame.writeBigUInt64BE(BigInt(data.length), 2);
  const mask = randomFillSync(frame.subarray(2 + extended, 6 + extended));
  const body = frame.subarray(6 + extended);
  for (let index = 0; index < data.length; index++) body[index] = data[index]! ^ mask[index & 3]!;
  return frame;
}

/** What a close frame holds. */
export function encodeClose(code: number, reason = ""): Buffer {
  const data = Buffer.alloc(2 + Buffer.byteLength(reason));
  data.writeUInt16BE(code);
  data.write(reason, 2);
  return encodeFrame(Opcode.CLOSE, data);
}

/** Puts bytes as they come together to messages, pings, pongs and closes. */
export class FrameReader {
  #bytes: Buffer = Buffer.alloc(0);
  #pieces: Buffer[] = []; // of a message whose end has not come
  #opcode = 0; // of that message
  #size = 0;

  /** Take in bytes; what they complete. Throws Violation. */
  *push(chunk: Buffer): Generator<Piece> {
    this.#bytes = this.#bytes.length === 0 ? chunk : Buffer.concat([this.#bytes, chunk]);
    for (let frame = this.#frame(); frame !== undefined; frame = this.#frame()) {
      const whole = frame.opcode >= Opcode.CLOSE ? frame : this.#message(frame);
      if (whole !== undefined) yield whole;
    }
  }

  /** The next frame, if all of it is there. */
  #frame(): (Piece & { final: boolean }) | undefined {
    const bytes = this.#bytes;
    if (bytes.length < 2) return undefined;
    const [first, second] = [bytes[0]!, bytes[1]!];
    if (first & 0x70) throw new Violation(1002, "an extension was used that nobody asked for");
    if (second & 0x80) throw new Violation(1002, "a service masked its frame");
    const short = second & 0x7f;
    const start = short < 126 ? 2 : short === 126 ? 4 : 10;
    if (bytes.length < start) return undefined;
    const length = short < 126 ? short : short === 126 ? bytes.readUInt16BE(2) : Number(bytes.readBigUInt64BE(2));
    const [opcode, final] = [first & 0x0f, (first & 0x80) !== 0];
    if (opcode >= Opcode.CLOSE && (!final || short > 125)) throw new Violation(1002, "a control frame is too long");
    if (this.#size + length > MOST_BYTES) throw new Violation(1009, `a message has more than ${MOST_BYTES} bytes`);
    if (bytes.length < start + length) return undefined;
    this.#bytes = bytes.subarray(start + length);
    return { opcode, final, data: bytes.subarray(start, start + length) };
  }

  /** The message that this frame completes, if it does. */
  #message({ opcode, final, data }: Piece & { final: boolean }): Piece | undefined {
    const begins = opcode === Opcode.TEXT || opcode === Opcode.BINARY;
    if (begins !== (this.#opcode === 0) || (!begins && opcode !== Opcode.CONTINUATION)) {
      throw new Violation(1002, `a frame of type ${opcode} came at the wrong time`);
    }
    if (begins) this.#opcode = opcode;
    this.#pieces.push(data);
    this.#size += data.length;
    if (!final) return undefined;
    const message = { opcode: this.#opcode, data: this.#pieces.length === 1 ? data : Buffer.concat(this.#pieces) };
    this.#pieces = [];
    this.#opcode = this.#size = 0;
    return message;
  }
}
