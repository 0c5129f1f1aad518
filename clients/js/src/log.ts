// What it takes to go on after a cut: per body the newest checkpoint, and every message sent since.
//
// Rules: a message is kept until a checkpoint covers it · what is sent again leaves in the order in which it was first
// sent · a body without a checkpoint goes on too, as long as all its messages are kept · beyond MOST_KEPT messages the
// longest log is given up: its body can't be resumed until the next checkpoint, and after a cut begins anew with its
// unanswered frames · a frame is kept until it is answered in any case · a service forgets bodies that fell idle when
// another appears; the same is done here, and repeated in a replay as `body.end`, so that the replay does the same.

import { Calibrations, type CalibrationWaiter } from "./calibrations.ts";
import type { InputError } from "./errors.ts";
import { type FrameKey, FrameMap } from "./frames.ts";
import type {
  BodyEnd,
  Checkpoint,
  ClientMessage,
  Frame,
  Resumed,
  SessionCalibrate,
  SessionCalibrated,
} from "./messages.ts";
import { type Entry, Track } from "./track.ts";

/** Messages kept over all bodies, beside unanswered frames: over a minute of two bodies at 30 Hz, about 8 MB. */
export const MOST_KEPT = 4096;

const MOST_TOKENS = 64;

/** Share of the largest message that the tokens of a `session.start` may take; the newest go first. */
const TOKEN_SHARE = 0.9;

/** A frame that is older than its body's newest by no more than this is late; by more, the clock was set. */
const STEP_BACK_S = 1;

/** How to keep the log. */
export interface LogOptions {
  readonly latest: boolean;
  /** Seconds that a label holds. */
  readonly emotionTtlS: number | null | undefined;
  /** Bodies without frames are forgotten, as under clock `time`. */
  readonly idles: boolean;
  /** Else it stays empty. */
  readonly keeps: boolean;
  readonly mostKept?: number | undefined;
  /** The monotonic clock, seconds. */
  readonly now: () => number;
  readonly warn: (sentence: string) => void;
}

/** What the service may have to be told again. */
export class Log {
  /** Client time without a frame after which the service may forget a body. */
  idleS = Infinity;
  /** Bodies that began anew and have no estimate yet. */
  readonly anew = new Set<string>();
  readonly calibrations: Calibrations;
  readonly #options: LogOptions;
  readonly #tracks = new Map<string, Track>();
  readonly #open = new FrameMap<Entry>(); // frames under way
  #place = 0;
  #stale: string[] = []; // bodies that the service resumed, and that are none any more

  constructor(options: LogOptions) {
    this.#options = options;
    this.calibrations = new Calibrations(options.idles);
  }

  // --- what is sent --------------------------------------------------------------------------------------------------

  /** The frame with its body's label, where it brings none and the service has lost the one in force. */
  remind(frame: Frame & FrameKey): Frame & FrameKey {
    const track = this.#tracks.get(frame.body);
    if (!track?.unlabelled || (frame.emotion ?? null) !== null || this.#away(track, timeOf(frame))) return frame;
    return { ...frame, emotion: track.labelAt(timeOf(frame), this.#options.emotionTtlS) ?? null };
  }

  /** A frame was sent. */
  addFrame(frame: Frame & FrameKey): void {
    if (this.#options.keeps) this.#keep(frame);
    this.calibrations.sent(frame, timeOf(frame)); // of a body that may be gone and back with it
  }

  #keep(frame: Frame & FrameKey): void {
    const track = this.#tracks.get(frame.body) ?? new Track();
    this.#tracks.set(frame.body, track);
    const begins = this.#away(track, timeOf(frame));
    this.#follow(track, frame, begins && track.here);
    const entry = this.#append(track, frame, frame.seq);
    entry.begins = begins;
    track.unlabelled = false;
    if ((frame.emotion ?? null) !== null) entry.label = { emotion: frame.emotion!, given: timeOf(frame) };
    this.#open.set(frame, entry);
    const kept = [...this.#tracks.values()].reduce((sum, each) => sum + each.entries.length, 0);
    const most = this.#options.mostKept ?? MOST_KEPT;
    if (kept > most + this.#open.size) this.#giveUpLongest(most);
  }

  /** A body was reset; whether to tell the service, which has nothing to reset of a body that it lost. */
  addReset(body: string, message: ClientMessage): boolean {
    const track = this.#tracks.get(body);
    if (track?.here) this.#append(track, message);
    return !this.#lost(body);
  }

  /** A body has gone; whether to tell the service, which knows no more of a body that it lost. */
  addEnd(body: string, message: ClientMessage): boolean {
    const track = this.#tracks.get(body);
    const lost = this.#lost(body);
    if (track?.here) this.#end(body, track, message);
    else if (track !== undefined && lost) {
      track.forget();
      this.#bury(body, track);
    }
    if (lost) this.anew.delete(body);
    return !lost;
  }

  /** A calibration was asked for. */
  addCalibrate(message: SessionCalibrate, waiter: CalibrationWaiter): void {
    this.calibrations.ask(message, this.#entry(message), waiter);
    this.#buryAll();
  }

  // --- what comes ----------------------------------------------------------------------------------------------------

  /** These frames have their estimates; a late one changed nothing, and a duplicate's may come before its turn. */
  answered(keys: readonly FrameKey[], flags: readonly string[]): void {
    const [late, repeated] = [flags.includes("late"), flags.includes("duplicate")];
    for (const key of keys) {
      if (!repeated) this.calibrations.estimated(key);
      const entry = this.#open.take(key);
      const track = this.#tracks.get(key.body);
      if (entry === undefined || track === undefined) continue;
      if (late) entry.label = undefined;
      track.answered(entry);
      this.#bury(key.body, track);
    }
  }

  /** A frame was refused; `forget` it unless another try may give an estimate that later ones rest on. */
  refused(key: FrameKey, forget: boolean): void {
    const entry = this.#open.take(key);
    const track = this.#tracks.get(key.body);
    if (entry === undefined || track === undefined) return;
    track.refused(entry, forget);
    if (forget && this.anew.has(key.body)) track.remindAgain();
    this.#bury(key.body, track);
  }

  /** A checkpoint covers a body's messages up to its frame `seq`; whether it is of such a body. */
  checkpoint(message: Checkpoint): boolean {
    const track = this.#tracks.get(message.body);
    if (track === undefined) return false;
    if (message.seq !== track.seq) {
      const { latest } = this.#options;
      const covered = track.entries.find((entry) => entry.seq === message.seq && (entry.answered || latest));
      if (covered === undefined) return false;
      track.dropThrough(covered);
    }
    Object.assign(track, { token: message.token, seq: message.seq, since: this.#options.now(), whole: true });
    this.#bury(message.body, track);
    return true;
  }

  /** Whether the first estimate comes of a body that the service had lost; asked once for each. */
  beginsAnew(body: string): boolean {
    return this.anew.delete(body);
  }

  /** New terms are in force, and the bodies were reset: these checkpoints take the place of all before. */
  calibrated(message: SessionCalibrated): void {
    this.calibrations.calibrated(message);
    this.#buryAll();
    const renewed = new Set(message.checkpoints.filter((each) => this.checkpoint(each)).map(({ body }) => body));
    for (const [name, track] of this.#tracks) if (!renewed.has(name) && !track.untouched) track.giveUp();
  }

  /** Nothing came of one; whether there was one. */
  calibrationFailed(body: string | null | undefined, error: InputError): boolean {
    const failed = this.calibrations.failed(body, error);
    this.#buryAll();
    return failed;
  }

  // --- going on ------------------------------------------------------------------------------------------------------

  /** The checkpoints to resume from; those that find no room in a message are given up. */
  tokens(mostBytes: number): string[] {
    const chosen: string[] = [];
    let left = TOKEN_SHARE * mostBytes;
    const known = [...this.#tracks.values()].filter((track) => track.token !== "");
    for (const track of known.sort((one, other) => other.since - one.since)) {
      left -= track.token.length;
      if (left < 0 || chosen.length === MOST_TOKENS) track.giveUp();
      else chosen.push(track.token);
    }
    return chosen;
  }

  /** The service takes no checkpoints, or none that came before `olderThan` (seconds); whether that's any. */
  refuseTokens(olderThan = Infinity): boolean {
    const refused = [...this.#tracks.values()].filter((track) => track.token !== "" && track.since < olderThan);
    for (const track of refused) track.giveUp();
    return refused.length > 0;
  }

  /** The service goes on with these bodies only; those that ended, or were given up, since it was asked must end there. */
  resumed(bodies: readonly Resumed[]): void {
    for (const [name, track] of this.#tracks) {
      const known = bodies.some(({ body, seq }) => body === name && seq === track.seq);
      if (track.token !== "" && !known) track.giveUp();
    }
    this.#stale = bodies.map(({ body }) => body).filter((body) => !this.#tracks.get(body)?.token);
  }

  /** What to send again, in order, and which of it are frames that were answered before. */
  replay(): { messages: ClientMessage[]; echoes: FrameKey[] } {
    for (const [name, track] of this.#tracks) this.#prepare(name, track);
    const again = [...this.#tracks].flatMap(([body, track]) => track.entries.map((entry) => ({ entry, body })));
    again.push(...this.calibrations.entries.map((entry) => ({ entry, body: "" })));
    again.sort((one, other) => one.entry.place - other.entry.place);
    const echoes = again.flatMap(({ entry: { seq, answered }, body }) =>
      answered && seq !== undefined ? [{ body, seq }] : [],
    );
    const ends = this.#stale.map((body): BodyEnd => ({ type: "body.end", body }));
    return { messages: [...ends, ...again.map(({ entry }) => entry.message)], echoes };
  }

  /** Drop what a service without this body's checkpoint has no use for. */
  #prepare(name: string, track: Track): void {
    if (track.whole && track.token !== "") return;
    if (!track.whole) this.anew.add(name);
    track.beginAnew();
    const first = track.entries[0];
    if (first !== undefined && !first.begins && this.anew.has(name)) this.#bringLabel(track, first);
  }

  /** Let a body's first frame bring the label that was in force before it. */
  #bringLabel(track: Track, entry: Entry): void {
    const frame = entry.message as Frame; // a body begins with a frame
    const emotion = track.labelAt(timeOf(frame), this.#options.emotionTtlS);
    if ((frame.emotion ?? null) !== null || emotion === undefined) return;
    entry.message = { ...frame, emotion };
    entry.label = { emotion, given: timeOf(frame) };
  }

  // --- bookkeeping ---------------------------------------------------------------------------------------------------

  #entry(message: ClientMessage, seq?: number): Entry {
    this.#place += 1;
    return { place: this.#place, message, seq, answered: false, begins: false, ends: false };
  }

  #append(track: Track, message: ClientMessage, seq?: number): Entry {
    const entry = this.#entry(message, seq);
    track.entries.push(entry);
    return entry;
  }

  /** Whether the service lost a body, and nothing of it was sent since. */
  #lost(body: string): boolean {
    return this.anew.has(body) && !this.#tracks.get(body)?.here;
  }

  /** Whether a body's last frame is so long ago that the service has forgotten it. */
  #away(track: Track, time: number): boolean {
    return this.#options.idles && track.last > -Infinity && time - track.last > this.idleS;
  }

  /**
   * Note where a body stands, and which others the service forgets for it; `back`: it was forgotten itself.
   *
   * A frame that is refused later counts here too: only if it is the first of a body that was away, and the stream is
   * then cut before the next, can a flag `gap_reset` differ.
   */
  #follow(track: Track, frame: Frame & FrameKey, back: boolean): void {
    const time = timeOf(frame);
    if (back) {
      this.calibrations.gone(frame.body);
      Object.assign(track, { newest: -1, last: -Infinity });
    }
    if (this.#options.idles && (back || !track.here)) this.#forgetIdle(track, time);
    track.here = true;
    const late = track.last - time >= 0 && track.last - time <= STEP_BACK_S;
    if (frame.seq > track.newest && !late) track.last = time;
    track.newest = Math.max(track.newest, frame.seq);
  }

  #forgetIdle(newcomer: Track, time: number): void {
    for (const [body, track] of this.#tracks) {
      const gone: BodyEnd = { type: "body.end", body };
      if (track !== newcomer && track.here && time - track.last > this.idleS) this.#end(body, track, gone);
    }
  }

  #end(name: string, track: Track, message: ClientMessage): void {
    this.calibrations.gone(name);
    track.end(this.#append(track, message));
    this.#bury(name, track);
  }

  #buryAll(): void {
    for (const [name, track] of this.#tracks) this.#bury(name, track);
  }

  #bury(name: string, track: Track): void {
    if (this.calibrations.holds(name)) return; // it rests on them, even if the body has gone
    if (track.bury()) this.anew.delete(name);
    if (track.entries.length === 0 && !track.here && track.token === "" && !track.unlabelled) this.#tracks.delete(name);
  }

  #giveUpLongest(most: number): void {
    const whole = [...this.#tracks].filter(([, track]) => track.whole);
    whole.sort(([, one], [, other]) => other.entries.length - one.entries.length);
    const longest = whole[0];
    if (longest === undefined) return;
    this.#options.warn(`no checkpoint of body '${longest[0]}' in ${most} messages; a cut would start it anew`);
    longest[1].giveUp();
  }
}

/** Client time of a frame, seconds; frames without one are steps. */
function timeOf(frame: Frame): number {
  return frame.t ?? frame.seq;
}
