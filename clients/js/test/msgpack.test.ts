import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import fc from "fast-check";
import { MessageError } from "../src/errors.ts";
import { type Packable, pack, unpack } from "../src/msgpack.ts";

const leaf = fc.oneof(
  fc.constant(null),
  fc.boolean(),
  fc.maxSafeInteger(),
  fc.double(),
  fc.string({ unit: "grapheme" }),
  fc.uint8Array({ maxLength: 300 }),
  fc.constantFrom("x".repeat(40), "x".repeat(300), "x".repeat(70_000), new Uint8Array(70_000)),
  fc.constantFrom(-0, 0x7f, 0x80, 0xff, 0x100, 0xffff, 0x1_0000, 0xffff_ffff, 0x1_0000_0000, -0x20, -0x21, 2 ** 53 - 1),
);
const value = fc.letrec<{ value: Packable; leaf: Packable }>((tie) => ({
  leaf,
  value: fc.oneof(
    { maxDepth: 4 },
    tie("leaf"),
    fc.array(tie("value"), { maxLength: 20 }),
    fc.dictionary(fc.string(), tie("value"), { maxKeys: 20, noNullPrototype: true }),
  ),
})).value;

test("what was packed is unpacked", () => {
  fc.assert(fc.property(value, (given) => assert.deepEqual(unpack(pack(given)), given)));
});

test("long arrays and maps too", () => {
  const array = Array.from({ length: 70_000 }, (_, index) => index % 7);
  assert.deepEqual(unpack(pack(array)), array);
  const map = Object.fromEntries(array.map((each, index) => [`${index}`, each]));
  assert.deepEqual(unpack(pack(map)), map);
});

test("fields that are undefined are left out", () => assert.deepEqual(unpack(pack({ a: undefined, b: 1 })), { b: 1 }));

test("what another encoder wrote is unpacked: signed integers, float32, 64 bits", () => {
  for (const [hex, expected] of [
    ["d0df", -33],
    ["d1ff00", -256],
    ["d2ffff0000", -65_536],
    ["d3ffffffffffffffff", -1],
    ["ca3fc00000", 1.5],
    ["cf0000000000000001", 1],
    ["dd00000001c3", [true]],
    ["df00000001a16101", { a: 1 }],
    ["dc0001c2", [false]],
    ["de0001a16101", { a: 1 }],
  ] as const) {
    assert.deepEqual(unpack(Buffer.from(hex, "hex")), expected, hex);
  }
});

test("bytes that were unpacked are a copy", () => {
  const packed = Buffer.from(pack(new Uint8Array([1, 2])));
  const bytes = unpack(packed);
  packed.fill(0);
  assert.deepEqual(bytes, new Uint8Array([1, 2]));
});

test("whatever is no message of the protocol is refused with a MessageError", () => {
  const bytes = fc.oneof(
    fc.uint8Array(),
    fc.constantFrom("c1", "d40000", "8101c0", "a1ff", "cfffffffffffffffff", "9190"),
  );
  fc.assert(
    fc.property(bytes, (given) => {
      const payload = typeof given === "string" ? Buffer.from(given, "hex") : given;
      try {
        unpack(payload);
      } catch (error) {
        assert.ok(error instanceof MessageError, String(error));
      }
    }),
  );
  for (const hex of ["", "c1", "d40000", "8101c0", "a1ff", "cfffffffffffffffff", "91", "0000", "91".repeat(40)]) {
    assert.throws(() => unpack(Buffer.from(hex, "hex")), MessageError, hex);
  }
});

test("a key like __proto__ harms nothing", () => {
  const unpacked = unpack(pack(JSON.parse('{"__proto__": {"polluted": true}}')));
  assert.equal((unpacked as { polluted?: boolean }).polluted, undefined);
});

test("the transcript in MessagePack reads as it stands, and our bytes mean the same", () => {
  const lines = readFileSync(new URL("../../../transcripts/msgpack.jsonl", import.meta.url), "utf8")
    .trim()
    .split("\n");
  const shown = lines.map((line) => JSON.parse(line)).filter(({ hex }) => hex);
  assert.ok(shown.length > 10);
  for (const { hex, client, server } of shown) {
    const message = unpack(Buffer.from(hex, "hex"));
    if (!JSON.stringify(client ?? "").includes("float32")) assert.deepEqual(message, client ?? server);
    assert.deepEqual(unpack(pack(message as Packable)), message);
  }
});
