// What the service says on /v1/watch, and what is said to it: see watch_messages.py, which docs/reference/page.md tells.

export type Point = readonly [number, number, number];
/** x, y, z, w. */
export type Quaternion = readonly [number, number, number, number];
export type Level = "weak" | "strong";

export interface ModelInfo {
  readonly name: string;
  readonly version: string;
  readonly purpose: "demo" | "research";
  readonly emotions: readonly string[];
  readonly thresholds: Readonly<Record<string, number>>;
}

export interface WatchStarted {
  readonly type: "watch.started";
  readonly version: string;
  readonly model: ModelInfo;
  readonly hysteresis: number;
  readonly joints: readonly string[];
  readonly parents: readonly number[];
  readonly pelvis: Point;
  readonly offsets: readonly Point[];
  readonly tips: readonly (Point | null)[];
  readonly workers: number;
  readonly rate_hz: number;
}

export interface SeenSession {
  readonly session: string;
  readonly skeleton: string | null;
  readonly bodies: number;
  readonly frames: number;
}

export interface SeenBody {
  readonly session: string;
  readonly body: string;
  readonly seq: number;
  readonly t: number;
  readonly intensity: number | null;
  readonly level: Level | null;
  readonly emotion: string;
  readonly status: string;
  readonly flags: readonly string[];
  readonly threshold: number;
  readonly q: readonly Quaternion[];
  readonly observed: readonly boolean[];
  readonly by_emotion: Readonly<Record<string, number>> | null;
}

export interface Snapshot {
  readonly type: "snapshot";
  readonly sessions: readonly SeenSession[];
  readonly sessions_total: number;
  readonly bodies: readonly SeenBody[];
  readonly bodies_total: number;
  readonly first: number;
}

export interface BodyName {
  readonly session: string;
  readonly body: string;
}

export interface Look {
  readonly first: number;
  readonly by_emotion: readonly BodyName[];
}
