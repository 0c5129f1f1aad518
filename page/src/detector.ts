// Runs in a frame of its own (pose.html): pictures come in, points of the body go out. MediaPipe Pose wants a document,
// WebAssembly and its own global names; here it has all of them, and the page needs none.

interface Landmark {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly visibility?: number;
}

interface Detector {
  setOptions(options: { modelComplexity: 0 | 1 | 2; smoothLandmarks: boolean }): void;
  onResults(listener: (results: { poseWorldLandmarks?: Landmark[] }) => void): void;
  initialize(): Promise<void>;
  send(input: { image: HTMLCanvasElement }): Promise<void>;
}

declare const Pose: new (options: { locateFile: (file: string) => string }) => Detector;

/** What the page sends: a picture, and when it was taken, seconds. */
export interface Picture {
  readonly t: number;
  readonly picture: ImageBitmap;
}

/** What comes back: points in metres (x right, y down, z away from the camera), null where they are not seen. */
export type Found =
  | { readonly kind: "ready" }
  | { readonly kind: "points"; readonly t: number; readonly points: ([number, number, number] | null)[] | null }
  | { readonly kind: "failed"; readonly message: string };

const SEEN = 0.5; // visibility from which a point counts as tracked
const SHOULDERS = [11, 12];
const HIPS = [23, 24];

const canvas = document.createElement("canvas");
const plane = canvas.getContext("2d");
const pose = new Pose({ locateFile: (file) => new URL(`pose/${file}`, location.href).href });
let taken = 0;

pose.setOptions({ modelComplexity: 0, smoothLandmarks: true });
pose.onResults(({ poseWorldLandmarks: found }) => {
  reply({ kind: "points", t: taken, points: found ? tracked(found) : null });
});

addEventListener("message", (event: MessageEvent<Picture>) => {
  if (event.origin !== location.origin) return;
  const { t, picture } = event.data;
  taken = t;
  [canvas.width, canvas.height] = [picture.width, picture.height];
  plane?.drawImage(picture, 0, 0);
  picture.close();
  pose.send({ image: canvas }).catch(failed);
});

pose.initialize().then(() => reply({ kind: "ready" }), failed);

/** Points that are seen. Who sits at a desk shows no hips: where shoulders are seen, the detector's guess will do. */
function tracked(found: readonly Landmark[]): ([number, number, number] | null)[] {
  const seen = (at: number) => (found[at]?.visibility ?? 1) >= SEEN;
  const upright = SHOULDERS.every(seen);
  return found.map(({ x, y, z }, at) => (seen(at) || (upright && HIPS.includes(at)) ? [x, y, z] : null));
}

function failed(error: unknown): void {
  reply({ kind: "failed", message: `the pose detector failed: ${error instanceof Error ? error.message : error}` });
}

function reply(found: Found): void {
  parent.postMessage(found, location.origin);
}
