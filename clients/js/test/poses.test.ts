import assert from "node:assert/strict";
import { test } from "node:test";
import fc from "fast-check";
import { FrameError } from "../src/errors.ts";
import { type Pose, toJoints } from "../src/poses.ts";

const JOINTS = ["waist", "chest"];

test("quaternions go to q and positions to p, from arrays and from flat ones", () => {
  const rows = [
    [0, 0, 0, 1],
    [0.5, 0.5, 0.5, 0.5],
  ];
  assert.deepEqual(toJoints(rows, JOINTS, "json"), { q: rows });
  assert.deepEqual(toJoints(new Float64Array(rows.flat()), JOINTS, "json"), { q: rows });
  assert.deepEqual(
    toJoints(
      rows.map((row) => new Float32Array(row)),
      JOINTS,
      "json",
    ),
    { q: rows },
  );
  assert.deepEqual(toJoints(new Float32Array(6), JOINTS, "json"), {
    p: [
      [0, 0, 0],
      [0, 0, 0],
    ],
  });
});

test("what is null or holds a NaN is untracked", () => {
  const nan = Number.NaN;
  assert.deepEqual(toJoints([null, [0, 0, 0, 1]], JOINTS, "json"), { q: [null, [0, 0, 0, 1]] });
  assert.deepEqual(
    toJoints(
      [
        [nan, 0, 0],
        [1, 2, 3],
      ],
      JOINTS,
      "json",
    ),
    { p: [null, [1, 2, 3]] },
  );
  assert.deepEqual(toJoints([undefined, null], JOINTS, "json", 3), { p: [null, null] });
});

test("MessagePack takes float32, little-endian; untracked are zeros in q and NaN in p", () => {
  const float = fc.float({ noNaN: true, noDefaultInfinity: true });
  const numbers = fc.array(fc.option(fc.tuple(float, float, float, float)), {
    minLength: 2,
    maxLength: 2,
  });
  fc.assert(
    fc.property(numbers, (rows) => {
      const { q } = toJoints(rows as Pose, JOINTS, "msgpack");
      const view = new DataView((q as Uint8Array).buffer);
      const read = Array.from({ length: 8 }, (_, index) => view.getFloat32(4 * index, true));
      assert.deepEqual(
        read,
        rows.flatMap((row) => row ?? [0, 0, 0, 0]).map((each) => each + 0),
      );
    }),
  );
  const { p } = toJoints([null, [1, 2, 3]], JOINTS, "msgpack");
  assert.ok(Number.isNaN(new DataView((p as Uint8Array).buffer).getFloat32(0, true)));
});

test("a pose is copied", () => {
  const row = [0, 0, 0, 1];
  const { q } = toJoints([row, row], JOINTS, "json");
  row[0] = 9;
  assert.deepEqual(q, [
    [0, 0, 0, 1],
    [0, 0, 0, 1],
  ]);
});

test("anything else is refused, and the sentence says what was expected", () => {
  const identity = [0, 0, 0, 1];
  for (const [pose, sentence] of [
    [[identity], /1 joints; expected \[2, 4\] \(quaternions\)/],
    [[identity, [1, 2, 3]], /joints of 4 and of 3 numbers/],
    [[identity, [Infinity, 0, 0, 1]], /joint 1 \(chest\) holds an infinite number/],
    [
      [
        [1, 2],
        [1, 2],
      ],
      /joints of 2 numbers/,
    ],
    [new Float32Array(7), /7 numbers; expected \[2, 4\]/],
    [["x", identity], /not an array of numbers/],
    [[["x", 0, 0, 1], identity], /not an array of numbers/],
  ] as const) {
    assert.throws(() => toJoints(pose as unknown as Pose, JOINTS, "json"), sentence);
    assert.throws(() => toJoints(pose as unknown as Pose, JOINTS, "json"), FrameError);
  }
  assert.throws(() => toJoints([identity, [1e39, 0, 0, 1]], JOINTS, "msgpack"), /float32 can't hold/);
});
