// One body as the replay log knows it: its newest checkpoint, and every message sent since.

import type { ClientMessage, Frame } from "./messages.ts";

/** Seconds that a service holds probabilities for, unless told otherwise. */
export const ANALYSER_TTL_S = 2;

/** The label of nobody knows what. */
const UNKNOWN = "unknown";

/** A label or a probability per emotion. */
export type Emotion = NonNullable<Frame["emotion"]>;

/** A label, and the time that it was given at. */
export interface Label {
  readonly emotion: Emotion;
  readonly given: number; // seconds
}

/** A message that was sent. */
export interface Entry {
  /** In the order sent. */
  readonly place: number;
  message: ClientMessage;
  /** Where it is a frame. */
  readonly seq?: number | undefined;
  answered: boolean;
  /** The label that it brought. */
  label?: Label | undefined;
  /** A frame after so long that the service had forgotten the body. */
  begins: boolean;
  /** The body is gone with it. */
  ends: boolean;
}

/** One body. */
export class Track {
  /** Since the checkpoint or, without one, since the body came. */
  entries: Entry[] = [];
  token = "";
  /** Newest frame that the checkpoint covers; without one, that the entries follow, where there is one. */
  seq = -1;
  /** When the checkpoint came, seconds. */
  since = 0;
  /** Checkpoint and entries are all there is to know; else entries are missing between the two. */
  whole = true;
  /** The service follows it. */
  here = false;
  newest = -1;
  /** Of the newest frame, seconds. */
  last = -Infinity;
  /** The service lost the label that answered frames left in force. */
  unlabelled = false;
  #endings = 0; // entries that end a life
  #label: Label | undefined;

  /** Nothing of it was answered: all of it is still to come. */
  get untouched(): boolean {
    return this.whole && this.token === "" && !this.entries.some((entry) => entry.answered);
  }

  /** The label in force at `time`, before any frame under way; undefined: the one that new bodies have. */
  labelAt(time: number, ttlS: number | null | undefined): Emotion | undefined {
    if (this.#label === undefined) return undefined;
    const { emotion, given } = this.#label;
    const held = ttlS || (typeof emotion === "string" ? Infinity : ANALYSER_TTL_S);
    return time <= given + held ? emotion : UNKNOWN;
  }

  /** A frame has its estimate. */
  answered(entry: Entry): void {
    entry.answered = true;
    this.#label = entry.label ?? (entry.begins ? undefined : this.#label);
    if (!this.whole) this.#dropBefore(entry);
  }

  /** A frame was refused; `forget` it where it left no trace. */
  refused(entry: Entry, forget: boolean): void {
    entry.answered = true;
    if (forget) this.entries = this.entries.filter((each) => each !== entry);
  }

  /** The frame that brought the label again may have been refused: the next one is to, if none did since. */
  remindAgain(): void {
    this.unlabelled = this.#label !== undefined && !this.entries.some(({ label }) => label);
  }

  /** The life that the service lost has ended: the next one has nothing of it. */
  forget(): void {
    this.#label = undefined;
    this.unlabelled = false;
    this.newest = -1;
    this.last = -Infinity;
  }

  /** A checkpoint covers all up to this entry. */
  dropThrough(entry: Entry): void {
    this.#drop(this.entries.indexOf(entry) + 1);
  }

  /** This body can't be resumed until its next checkpoint: only what that one may not cover is kept. */
  giveUp(): void {
    this.token = "";
    this.whole = false;
    const newest = this.entries.findLast((entry) => entry.answered);
    if (newest !== undefined) this.#dropBefore(newest);
  }

  /** The service knows nothing of this body: begin with its first frame, if incomplete with an unanswered one. */
  beginAnew(): void {
    const first = this.entries.findIndex((entry) => entry.seq !== undefined && (this.whole || !entry.answered));
    this.#drop(first < 0 ? this.entries.length : first);
    this.seq = -1;
    this.whole = true;
    this.here &&= this.entries.length > 0 && !this.entries.at(-1)?.ends;
    this.unlabelled = this.entries.length === 0 && this.#label !== undefined;
  }

  /** The body is gone with this entry, which is its last. */
  end(entry: Entry): void {
    entry.ends = true;
    this.here = false;
    this.newest = -1;
    this.last = -Infinity;
    this.#endings += 1;
  }

  /** Drop the lives of this body that have ended and whose frames are all answered; whether there was one. */
  bury(): boolean {
    let buried = false;
    while (this.#endings > 0) {
      const life = this.entries.findIndex((entry) => entry.ends) + 1;
      if (this.entries.slice(0, life).some((entry) => entry.seq !== undefined && !entry.answered)) break;
      buried = true;
      this.#drop(life);
      this.token = "";
      this.seq = -1;
      this.whole = true;
    }
    return buried;
  }

  /** Drop the oldest entries; where a life ends with them, only labels that were given since are in force. */
  #drop(count: number): void {
    const end = this.entries.findLastIndex((entry, place) => place < count && entry.ends);
    if (end >= 0)
      this.#label = this.entries.findLast((entry, place) => place > end && entry.answered && entry.label)?.label;
    const gone = this.entries.splice(0, count);
    this.#endings -= gone.filter((entry) => entry.ends).length;
  }

  /** Drop what stands before an answered entry, except frames under way. */
  #dropBefore(entry: Entry): void {
    const kept = this.entries.findIndex((each) => each === entry || (each.seq !== undefined && !each.answered));
    if (kept !== 0) this.seq = -1;
    this.#drop(kept < 0 ? this.entries.length : kept);
  }
}
