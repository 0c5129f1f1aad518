// MessagePack, as much of it as the protocol uses: nil, booleans, numbers, text, bytes, arrays, maps with text as keys.
// Source: the MessagePack specification. Integers beyond 2^53 and extension types are refused.

import { MessageError } from "./errors.ts";

/** What can be packed; fields that are undefined are left out. */
export type Packable = null | boolean | number | string | Uint8Array | readonly Packable[] | object;

const UTF8 = new TextEncoder();
const FROM_UTF8 = new TextDecoder("utf-8", { fatal: true });
const DEEPEST = 32;

/** The value as MessagePack. */
export function pack(value: Packable): Uint8Array {
  return new Packer().pack(value);
}

/** The value of some MessagePack; throws MessageError where it is none. */
export function unpack(bytes: Uint8Array): unknown {
  const unpacker = new Unpacker(bytes);
  try {
    const value = unpacker.value(0);
    if (unpacker.left === 0) return value;
  } catch (error) {
    if (error instanceof MessageError) throw error;
    throw new MessageError("the message is not MessagePack: it ends too early or holds text that is not UTF-8");
  }
  throw new MessageError(`the message is not MessagePack: ${unpacker.left} bytes follow its end`);
}

class Packer {
  #bytes = new Uint8Array(512);
  #view = new DataView(this.#bytes.buffer);
  #at = 0;

  pack(value: Packable): Uint8Array {
    this.#value(value);
    return this.#bytes.slice(0, this.#at);
  }

  #value(value: unknown): void {
    if (value === null || value === undefined) this.#byte(0xc0);
    else if (typeof value === "boolean") this.#byte(value ? 0xc3 : 0xc2);
    else if (typeof value === "number") this.#number(value);
    else if (typeof value === "string") this.#text(value);
    else if (value instanceof Uint8Array) this.#binary(value);
    else if (Array.isArray(value)) this.#array(value);
    else if (typeof value === "object") this.#map(value);
    else throw new MessageError(`a ${typeof value} can't be sent; expected what JSON knows, or bytes`);
  }

  #number(value: number): void {
    if (!Number.isSafeInteger(value) || Object.is(value, -0)) {
      const at = this.#room(9);
      this.#bytes[at] = 0xcb;
      this.#view.setFloat64(at + 1, value);
    } else if (value >= 0 && value < 0x80) this.#byte(value);
    else if (value < 0 && value >= -0x20) this.#byte(value + 0x100);
    else if (value >= 0 && value < 0x1_0000_0000) this.#head(value, [0xcc, 0xcd, 0xce]);
    else {
      const at = this.#room(9);
      this.#bytes[at] = value < 0 ? 0xd3 : 0xcf;
      this.#view.setBigInt64(at + 1, BigInt(value));
    }
  }

  #text(value: string): void {
    const bytes = UTF8.encode(value);
    if (bytes.length < 0x20) this.#byte(0xa0 + bytes.length);
    else this.#head(bytes.length, [0xd9, 0xda, 0xdb]);
    this.#copy(bytes);
  }

  #binary(bytes: Uint8Array): void {
    this.#head(bytes.length, [0xc4, 0xc5, 0xc6]);
    this.#copy(bytes);
  }

  #array(values: readonly unknown[]): void {
    if (values.length < 0x10) this.#byte(0x90 + values.length);
    else this.#head(values.length, [undefined, 0xdc, 0xdd]);
    for (const each of values) this.#value(each);
  }

  #map(object: object): void {
    const entries = Object.entries(object).filter(([, value]) => value !== undefined);
    if (entries.length < 0x10) this.#byte(0x80 + entries.length);
    else this.#head(entries.length, [undefined, 0xde, 0xdf]);
    for (const [key, value] of entries) {
      this.#text(key);
      this.#value(value);
    }
  }

  /** A type and an unsigned number, in the smallest of 8, 16 and 32 bits that has a type. */
  #head(number: number, types: readonly [number | undefined, number, number]): void {
    if (number < 0x100 && types[0] !== undefined) {
      const at = this.#room(2);
      this.#bytes[at] = types[0];
      this.#bytes[at + 1] = number;
    } else if (number < 0x1_0000) {
      const at = this.#room(3);
      this.#bytes[at] = types[1];
      this.#view.setUint16(at + 1, number);
    } else {
      const at = this.#room(5);
      this.#bytes[at] = types[2];
      this.#view.setUint32(at + 1, number);
    }
  }

  #byte(value: number): void {
    const at = this.#room(1);
    this.#bytes[at] = value;
  }

  #copy(bytes: Uint8Array): void {
    const at = this.#room(bytes.length);
    this.#bytes.set(bytes, at);
  }

  /** Where so many bytes begin that are to be written next; it may make the buffer another one. */
  #room(count: number): number {
    const at = this.#at;
    this.#at += count;
    if (this.#at > this.#bytes.length) {
      const larger = new Uint8Array(Math.max(2 * this.#bytes.length, this.#at));
      larger.set(this.#bytes);
      this.#bytes = larger;
      this.#view = new DataView(larger.buffer);
    }
    return at;
  }
}

class Unpacker {
  readonly #bytes: Uint8Array;
  readonly #view: DataView;
  #at = 0;

  constructor(bytes: Uint8Array) {
    this.#bytes = new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength); // a Buffer's slice is no copy
    this.#view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  get left(): number {
    return this.#bytes.length - this.#at;
  }

  value(depth: number): unknown {
    if (depth > DEEPEST) throw new MessageError("the message is not of the protocol: it is nested too deeply");
    const type = this.#view.getUint8(this.#take(1));
    if (type < 0x80) return type;
    if (type >= 0xe0) return type - 0x100;
    if (type < 0x90) return this.#map(type - 0x80, depth);
    if (type < 0xa0) return this.#array(type - 0x90, depth);
    if (type < 0xc0) return this.#text(type - 0xa0);
    return this.#sized(type, depth);
  }

  #sized(type: number, depth: number): unknown {
    switch (type) {
      case 0xc0:
        return null;
      case 0xc2:
      case 0xc3:
        return type === 0xc3;
      case 0xc4:
      case 0xc5:
      case 0xc6:
        return this.#binary(this.#unsigned(type - 0xc4));
      case 0xca:
        return this.#view.getFloat32(this.#take(4));
      case 0xcb:
        return this.#view.getFloat64(this.#take(8));
      case 0xcc:
      case 0xcd:
      case 0xce:
        return this.#unsigned(type - 0xcc);
      case 0xcf:
        return this.#safe(this.#view.getBigUint64(this.#take(8)));
      default:
        return this.#signedOrLong(type, depth);
    }
  }

  #signedOrLong(type: number, depth: number): unknown {
    switch (type) {
      case 0xd0:
        return this.#view.getInt8(this.#take(1));
      case 0xd1:
        return this.#view.getInt16(this.#take(2));
      case 0xd2:
        return this.#view.getInt32(this.#take(4));
      case 0xd3:
        return this.#safe(this.#view.getBigInt64(this.#take(8)));
      case 0xd9:
      case 0xda:
      case 0xdb:
        return this.#text(this.#unsigned(type - 0xd9));
      case 0xdc:
      case 0xdd:
        return this.#array(this.#unsigned(type - 0xdb), depth);
      case 0xde:
      case 0xdf:
        return this.#map(this.#unsigned(type - 0xdd), depth);
      default:
        throw new MessageError(`the message is not of the protocol: MessagePack type 0x${type.toString(16)} came`);
    }
  }

  /** An unsigned number of 2 ** `power` bytes. */
  #unsigned(power: number): number {
    if (power === 0) return this.#view.getUint8(this.#take(1));
    return power === 1 ? this.#view.getUint16(this.#take(2)) : this.#view.getUint32(this.#take(4));
  }

  #safe(value: bigint): number {
    const number = Number(value);
    if (!Number.isSafeInteger(number)) throw new MessageError(`the integer ${value} is beyond 2^53`);
    return number;
  }

  #text(length: number): string {
    return FROM_UTF8.decode(this.#slice(length));
  }

  #binary(length: number): Uint8Array {
    return this.#slice(length).slice();
  }

  #array(length: number, depth: number): unknown[] {
    const values: unknown[] = [];
    for (let index = 0; index < length; index++) values.push(this.value(depth + 1));
    return values;
  }

  #map(length: number, depth: number): Record<string, unknown> {
    const entries: [string, unknown][] = [];
    for (let index = 0; index < length; index++) {
      const key = this.value(depth + 1);
      if (typeof key !== "string") throw new MessageError("the message is not of the protocol: a key is not text");
      entries.push([key, this.value(depth + 1)]);
    }
    return Object.fromEntries(entries); // which defines, so that a key like __proto__ harms nothing
  }

  #slice(length: number): Uint8Array {
    const at = this.#take(length);
    return this.#bytes.subarray(at, at + length);
  }

  #take(count: number): number {
    const at = this.#at;
    if (count > this.left) throw new RangeError("the message ends too early");
    this.#at += count;
    return at;
  }
}
