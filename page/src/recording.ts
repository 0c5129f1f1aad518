// A file that was dropped: the service reads it, whatever its kind, and gives its frames on the rig.

import { ask } from "./access.ts";

export interface TimedPose {
  /** Seconds from the beginning. */
  readonly t: number;
  /** Local rotations of the rig, null where not observed. */
  readonly q: readonly (readonly [number, number, number, number] | null)[];
}

export interface Recording {
  readonly name: string;
  readonly frames: readonly TimedPose[];
  readonly seconds: number;
}

/** Throws what the service says of a file it can't read. */
export async function readRecording(file: File, skeleton: string): Promise<Recording> {
  const query = new URLSearchParams({ filename: file.name });
  if (skeleton && !/\.(bvh|mvnx)$/i.test(file.name)) query.set("skeleton", skeleton);
  const answer = await ask(`v1/convert?${query}`, { method: "POST", body: file });
  const [, ...lines] = (await answer.text()).trimEnd().split("\n");
  const frames = lines.map((line) => JSON.parse(line) as TimedPose);
  const [first, last] = [frames[0]?.t ?? 0, frames.at(-1)?.t ?? 0];
  return { name: file.name, frames, seconds: last - first };
}
