// Poses as callers have them to the joints of a frame.
//
// A joint of four numbers is a quaternion, one of three a position, as landmark sensors give it. A joint that is null
// or holds a NaN counts as untracked, and so does a quaternion that is all zero (the service sees to that). An infinite
// number is a bug of the caller and refused, and so is any other shape.

import type { Encoding } from "./codec.ts";
import { FrameError } from "./errors.ts";
import type { Frame } from "./messages.ts";

/** One joint; null where it is untracked. */
export type Joint = ArrayLike<number> | null | undefined;

/** [joint][4] or [joint][3], or the same numbers in one flat typed array. */
export type Pose = readonly Joint[] | Float32Array | Float64Array;

/** Numbers a joint has: quaternions 4, positions 3. */
export type Width = 3 | 4;

/** The field of a frame that a pose goes into. */
export type JointsField = Pick<Frame, "q" | "p">;

/**
 * What to send for a pose of `joints`; a copy, so that the caller may use theirs again.
 *
 * Throws FrameError for another shape, or an infinite number. `width` is for a pose in which no joint is tracked.
 */
export function toJoints(pose: Pose, joints: readonly string[], encoding: Encoding, width: Width = 4): JointsField {
  const rows = ArrayBuffer.isView(pose) ? rowsOf(pose, joints.length) : Array.from(pose, copied);
  const found = widthOf(rows, joints) ?? width;
  const field = encoding === "msgpack" ? toFloat32(rows, joints, found) : rows;
  return found === 4 ? { q: field as NonNullable<Frame["q"]> } : { p: field as NonNullable<Frame["p"]> };
}

type Row = number[] | null; // null: untracked

function rowsOf(flat: Float32Array | Float64Array, count: number): Row[] {
  const width = flat.length / count;
  if (width !== 3 && width !== 4) throw wrongShape(`${flat.length} numbers`, count);
  return Array.from({ length: count }, (_, joint) => copied(flat.subarray(joint * width, (joint + 1) * width)));
}

function copied(joint: Joint): Row {
  if (joint === null || joint === undefined) return null;
  if (typeof joint !== "object" || typeof joint.length !== "number") throw notNumbers();
  const numbers = Array.from(joint, (value) => value + 0); // a negative zero is one that JSON does not know
  if (!numbers.every((value) => typeof value === "number")) throw notNumbers();
  return numbers.length === 0 || numbers.some(Number.isNaN) ? nothing(numbers) : numbers;
}

/** An untracked joint counts for no width, except where it has none that could be right. */
function nothing(numbers: number[]): null {
  if (numbers.length !== 3 && numbers.length !== 4) throw notNumbers();
  return null;
}

/** Numbers that every tracked joint has; undefined where none is tracked. */
function widthOf(rows: readonly Row[], joints: readonly string[]): Width | undefined {
  if (rows.length !== joints.length) throw wrongShape(`${rows.length} joints`, joints.length);
  const width = rows.find((row) => row !== null)?.length;
  if (width === undefined) return undefined;
  if (width !== 3 && width !== 4) throw wrongShape(`joints of ${width} numbers`, joints.length);
  for (const [index, row] of rows.entries()) {
    if (row === null) continue;
    if (row.length !== width) throw wrongShape(`joints of ${width} and of ${row.length} numbers`, joints.length);
    if (!row.every(Number.isFinite)) throw infinite(index, joints, "an infinite number");
  }
  return width;
}

/** Raw joints as MessagePack sends them: little-endian float32; untracked are zeros in q, NaN in p. */
function toFloat32(rows: readonly Row[], joints: readonly string[], width: Width): Uint8Array {
  const bytes = new Uint8Array(4 * width * rows.length);
  const view = new DataView(bytes.buffer);
  const gap = width === 4 ? 0 : Number.NaN;
  for (const [joint, row] of rows.entries()) {
    for (let axis = 0; axis < width; axis++) {
      const value = Math.fround(row === null ? gap : (row[axis] ?? gap));
      if (Math.abs(value) === Infinity) throw infinite(joint, joints, "a number that float32 can't hold");
      view.setFloat32(4 * (width * joint + axis), value, true);
    }
  }
  return bytes;
}

function infinite(index: number, joints: readonly string[], what: string): FrameError {
  return new FrameError(`joint ${index} (${joints[index]}) holds ${what}; untracked joints are null or NaN`);
}

function wrongShape(came: string, count: number): FrameError {
  return new FrameError(`the pose has ${came}; expected [${count}, 4] (quaternions) or [${count}, 3] (positions)`);
}

function notNumbers(): FrameError {
  return new FrameError("the pose is not an array of numbers; expected [joint, 4] or [joint, 3]");
}
