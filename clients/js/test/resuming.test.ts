// A stream that is cut, wherever that is, goes on as if nothing had happened.

import assert from "node:assert/strict";
import { test } from "node:test";
import fc from "fast-check";
import { CheckpointUnknown, Unreachable } from "../src/errors.ts";
import type { Estimate, SessionCalibrated } from "../src/messages.ts";
import { Robot, type RobotOptions } from "./robot.ts";

type Action =
  | { kind: "frame"; body: string; x: number; after: number; emotion?: string }
  | { kind: "reset" | "end" | "calibrate"; body: string }
  | { kind: "send" | "listen" | "hear" | "cut" };

const LONGEST = 150;

/** So brief that nobody is away for long in the longest story. */
const BRIEF = [0.02, 0.06]; // seconds; LONGEST of them are less than IDLE_S

/** How long a pose is held: short stories have such, and another may be asked for before. */
const HELD_S = 0.2;

const body = fc.constantFrom("ann", "bob", "cyd");

/** Frames, some of which are refused, late, or come after a body was away for long. */
const frames = (odd: { x: number[]; steps: number[]; after: number[] }) =>
  fc.record({
    kind: fc.constant("frame" as const),
    body,
    x: fc.oneof({ weight: 30, arbitrary: fc.integer({ min: 0, max: 8 }) }, ...odd.x.map((x) => fc.constant(x))),
    after: fc.oneof({ weight: 30, arbitrary: fc.constantFrom(...odd.steps) }, ...odd.after.map((s) => fc.constant(s))),
    emotion: fc.option(fc.constantFrom("joy", "fear"), { nil: undefined, freq: 6 }),
  });

const move = fc.record({ kind: fc.constantFrom("send" as const, "listen" as const, "hear" as const) });
const cut = fc.record({ kind: fc.constant("cut" as const) });
const goes = fc.record({ kind: fc.constantFrom("reset" as const, "end" as const), body });
const calibrate = fc.record({ kind: fc.constant("calibrate" as const), body });

/**
 * What happens beside, in stories of their own. With frames that are refused nobody is away: they are taken as frames
 * that made the service forget others (see Log).
 */
const kinds = {
  refused: [frames({ x: [9], steps: BRIEF, after: [-0.05] }), goes, calibrate],
  away: [frames({ x: [], steps: [0.1, 0.3], after: [11, -0.05] }), goes, calibrate],
  alone: [frames({ x: [9], steps: BRIEF, after: [-0.05] })],
} as const;
function actions(odd: keyof typeof kinds): fc.Arbitrary<Action[]> {
  const [frame, ...others] = kinds[odd];
  const action = fc.oneof(
    { weight: 10, arbitrary: frame },
    { weight: 20, arbitrary: move },
    { weight: 1, arbitrary: cut },
    ...others.map((arbitrary) => ({ weight: 1, arbitrary })),
  );
  return fc.array(action as fc.Arbitrary<Action>, { maxLength: LONGEST, size: "max" });
}

class Story {
  readonly robot: Robot;
  readonly #cuts: boolean;
  time = 0;
  /** What came of each calibration, in the order of requests. */
  readonly calibrated: string[] = [];

  constructor(options: RobotOptions, cuts: boolean) {
    this.robot = new Robot({ emotion: "joy", ...options });
    this.#cuts = cuts;
  }

  play(told: readonly Action[]): this {
    for (const action of told) this.#act(action);
    this.robot.settle();
    return this;
  }

  #act(action: Action): void {
    const { robot } = this;
    if (action.kind === "frame") {
      this.time = Math.max(this.time + action.after, 0);
      const { body, x, emotion } = action;
      robot.frame(x, { body, t: this.time, ...(emotion === undefined ? {} : { emotion }) });
    } else if (action.kind === "reset") robot.conversation.resetBody(action.body);
    else if (action.kind === "end") robot.conversation.endBody(action.body);
    else if (action.kind === "calibrate") {
      const number = this.calibrated.push("no answer") - 1;
      const came = (what: string) => this.calibrated.splice(number, 1, what);
      const resolve = (found: SessionCalibrated) => came(JSON.stringify(found));
      robot.conversation.calibrate({ body: action.body, seconds: HELD_S }, { resolve, reject: (e) => came(e.message) });
    } else if (action.kind !== "cut") robot[action.kind]();
    else if (this.#cuts && robot.conversation.linked) robot.cut();
  }

  /** What was told of each frame, in the order of frames; each once. */
  told(): Map<string, Partial<Estimate>[]> {
    const bodies = new Map<string, Partial<Estimate>[]>();
    for (const { body, seq, intensity, emotion, flags } of this.robot.read()) {
      bodies.set(body, [...(bodies.get(body) ?? []), { seq, intensity, emotion, flags }]);
    }
    for (const estimates of bodies.values()) estimates.sort((one, another) => one.seq! - another.seq!);
    return bodies;
  }
}

for (const encoding of ["json", "msgpack"] as const) {
  for (const odd of ["refused", "away"] as const) {
    test(`cuts change nothing, in ${encoding}, with frames that are ${odd}`, () => {
      fc.assert(
        fc.property(actions(odd), (told) => {
          const whole = new Story({ encoding }, false).play(told);
          const torn = new Story({ encoding }, true).play(told);
          assert.deepEqual(torn.told(), whole.told());
          assert.deepEqual(torn.calibrated, whole.calibrated);
          assert.equal(torn.robot.conversation.inFlight, 0);
          assert.equal(torn.robot.conversation.state, "open");
        }),
        { numRuns: 150 },
      );
    });
  }
}

test("under delivery latest every frame counts as answered, and the newest is told of each body", () => {
  fc.assert(
    fc.property(actions("alone"), (told) => {
      const whole = new Story({}, false).play(told).told();
      const torn = new Story({ delivery: "latest" }, true).play(told);
      assert.equal(torn.robot.conversation.inFlight, 0);
      for (const [name, estimates] of torn.told()) {
        const all = whole.get(name)!;
        assert.deepEqual(estimates.at(-1), all.at(-1));
        for (const estimate of estimates)
          assert.deepEqual(
            estimate,
            all.find(({ seq }) => seq === estimate.seq),
          );
      }
    }),
    { numRuns: 150 },
  );
});

test("a service with another key begins bodies anew, with their label, and says so", () => {
  const robot = new Robot();
  for (let seq = 0; seq < 20; seq++) robot.frame(seq % 7, { t: seq / 10, ...(seq === 0 ? { emotion: "fear" } : {}) });
  robot.settle();
  robot.key = "another one";
  robot.cut();
  robot.settle();
  for (let seq = 20; seq < 25; seq++) robot.frame(1, { t: seq / 10 });
  robot.settle();
  const told = robot.read();
  assert.deepEqual(
    told.map(({ seq }) => seq),
    Array.from({ length: 25 }, (_, seq) => seq),
  );
  assert.deepEqual(
    told.filter(({ flags }) => flags.includes("reset")).map(({ seq }) => seq),
    [20],
  );
  assert.deepEqual(new Set(told.map(({ emotion }) => emotion)), new Set(["fear"]));
  assert.deepEqual(robot.reconnects.at(-1)?.anew, ["0"]);
  assert.ok(robot.reconnects.some(({ reason }) => reason instanceof CheckpointUnknown));
});

test("a cut right after session.calibrated leaves every body where it was", () => {
  const robot = new Robot();
  for (const seq of [4, 6, 5]) robot.frame(1, { body: "bob", seq, t: seq / 100, emotion: "fear" });
  let calibrated = false;
  robot.conversation.calibrate({ body: "ann", seconds: 0.2 }, { resolve: () => (calibrated = true), reject: () => {} });
  for (const t of [0.1, 0.2, 0.31]) robot.frame(1, { body: "ann", t });
  for (let moves = 0; !calibrated; moves++) {
    assert.ok(moves < 50);
    robot.send();
    robot.listen();
    robot.hear();
  }
  robot.cut();
  robot.frame(1, { body: "bob", seq: 3, t: 0.4 });
  robot.frame(1, { body: "bob", seq: 7, t: 0.5 });
  robot.settle();
  const told = robot.read().filter(({ body }) => body === "bob");
  assert.deepEqual(
    told.map(({ seq, emotion, flags }) => [seq, emotion, ...flags]),
    [
      [4, "fear"],
      [6, "fear"],
      [5, "fear", "late"],
      [3, "fear", "late"],
      [7, "fear", "reset"],
    ],
  );
  assert.deepEqual(robot.reconnects.at(-1)?.anew, []);
});

test("a checkpoint may pass over a life that a calibration keeps from being forgotten", () => {
  const [whole, torn] = [false, true].map((cut) => {
    const robot = new Robot();
    const waiter = { resolve: () => {}, reject: () => {} };
    robot.frame(1, { body: "ann", t: 0 });
    robot.conversation.endBody("ann");
    robot.frame(2, { body: "ann", t: 0.1 }); // a new life, with a checkpoint
    robot.conversation.calibrate({ body: "ann" }, waiter);
    robot.settle();
    robot.conversation.calibrate({ body: "bob" }, waiter);
    if (cut) robot.cut();
    robot.frame(3, { body: "ann", t: 0.2 });
    robot.settle();
    assert.equal(robot.conversation.reconnects, Number(cut));
    return robot.read();
  });
  assert.deepEqual(torn, whole);
});

test("a label given while a calibration waited outlives the checkpoint", () => {
  const robot = new Robot();
  robot.frame(1, { body: "ann", t: 0 });
  robot.settle();
  robot.conversation.calibrate({ body: "ann", seconds: 0.2 }, { resolve: () => {}, reject: () => {} });
  robot.conversation.endBody("ann");
  robot.frame(1, { body: "ann", t: 0.1, emotion: "fear" });
  for (const t of [0.2, 0.3]) robot.frame(1, { body: "ann", t });
  robot.settle();
  robot.key = "another one";
  robot.cut();
  robot.settle();
  robot.frame(1, { body: "ann", t: 0.4 });
  robot.settle();
  const { emotion, flags } = robot.read().at(-1)!;
  assert.deepEqual([emotion, flags], ["fear", ["reset"]]);
});

test("calibrations are told apart, and those that another took the place of are told so", () => {
  const robot = new Robot();
  const came: string[] = [];
  const ask = (body: string) => {
    const resolve = () => void came.push(`${body} is calibrated`);
    robot.conversation.calibrate({ body, seconds: 0.2 }, { resolve, reject: ({ message }) => void came.push(message) });
  };
  ask("nobody");
  ask("ann");
  assert.deepEqual(came, ["another calibration took the place of this one"]);
  for (const t of [0.1, 0.31]) robot.frame(1, { body: "ann", t });
  ask("bob");
  robot.cut(); // before any answer: both are asked again
  for (const t of [0.4, 0.61]) robot.frame(1, { body: "bob", t });
  robot.settle();
  assert.deepEqual(came.slice(1), ["ann is calibrated", "bob is calibrated"]);
});

test("a lost body that ends and comes back is a new one, and no end is told to a service that knows of none", () => {
  const robot = new Robot({ emotion: "joy" });
  for (const t of [0, 0.1, 0.2]) robot.frame(1, { body: "ann", t, emotion: "fear" });
  robot.settle();
  robot.key = "another one";
  robot.cut();
  robot.settle();
  assert.deepEqual(robot.reconnects.at(-1)?.anew, ["ann"]);
  robot.conversation.resetBody("ann");
  robot.conversation.endBody("ann");
  robot.frame(1, { body: "ann", t: 0.3 });
  robot.settle();
  const { emotion, flags } = robot.read().at(-1)!;
  assert.deepEqual([emotion, flags, robot.errors], ["joy", [], []]);
});

test("a lost body that comes back after long is a new one", () => {
  const robot = new Robot({ emotion: "joy" });
  robot.frame(1, { body: "ann", t: 0, emotion: "fear" });
  robot.settle();
  robot.key = "another one";
  robot.cut();
  robot.settle();
  robot.frame(1, { body: "ann", t: 30 });
  robot.settle();
  assert.equal(robot.read().at(-1)!.emotion, "joy");
});

test("beyond the most that is kept a body is given up, with a warning, and goes on from its next checkpoint", () => {
  const robot = new Robot({ mostKept: 8 });
  for (let seq = 0; seq < 20; seq++) {
    robot.frame(1, { t: seq / 1000 }); // one checkpoint, of the first frame
    robot.settle();
  }
  assert.match(robot.warnings[0] ?? "", /no checkpoint of body '0' in 8 messages/);
  robot.cut();
  robot.settle();
  robot.frame(1, { t: 0.1 });
  robot.settle();
  assert.deepEqual(robot.reconnects.at(-1)?.anew, ["0"]);
  assert.deepEqual(robot.read().at(-1)?.flags, ["reset"]);
});

test("a conversation that does not resume is lost with the first cut", () => {
  const robot = new Robot({ resumes: false });
  robot.frame(1, { t: 0 });
  robot.cut(new Unreachable("the line is dead"));
  assert.equal(robot.conversation.state, "closed");
  assert.throws(() => robot.frame(1, { t: 1 }), /the line is dead/);
});

test("once nobody has answered for long enough it is over, with a sentence that says all of it", () => {
  const robot = new Robot({ retryForS: 3 });
  robot.settle();
  robot.cut(new Unreachable("the line is dead"));
  while (robot.conversation.state === "open") robot.cut(new Unreachable("nobody answers"));
  const { message } = robot.conversation.failure!;
  assert.match(message, /^the line is dead; tried to reconnect \d+ times in 3 s, the last time: nobody answers$/);
});

test("a goodbye that only the service has heard ends the session well", () => {
  const robot = new Robot();
  robot.frame(1, { t: 0 });
  robot.settle();
  robot.conversation.end();
  robot.cut();
  assert.equal(robot.conversation.state, "closed");
  assert.equal(robot.conversation.totals?.estimates, 1);
  assert.equal(robot.conversation.failure, undefined);
});
