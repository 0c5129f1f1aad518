// Plays a recording into a session, as a sensor would send it: each frame when it is due.

import type { Session } from "../../clients/js/src/index.ts";
import type { Recording } from "./recording.ts";

const SEAM_S = 0.2; // between the end of a repeated recording and its next beginning: short enough to be interpolated
const LOOK_MS = 8;

export class Player {
  readonly #recording: Recording;
  readonly #session: Session;
  readonly #body: string;
  readonly #emotion: () => string;
  #stopped = false;

  constructor(recording: Recording, session: Session, body: string, emotion: () => string) {
    this.#recording = recording;
    this.#session = session;
    this.#body = body;
    this.#emotion = emotion;
  }

  stop(): void {
    this.#stopped = true;
  }

  /** Play to the end, or over and over while `repeat` is ticked; the session is ended in any case. */
  async run(repeat: { readonly checked: boolean }, progress: (seconds: number) => void): Promise<void> {
    let shift = 0;
    try {
      do {
        await this.#once(performance.now() / 1000, shift, progress);
        shift += this.#recording.seconds + SEAM_S;
      } while (repeat.checked && !this.#stopped);
    } finally {
      await this.#session.end();
    }
  }

  /** `begin`: seconds, when the first frame is due; `shift`: seconds, what is added to the frames' times. */
  async #once(begin: number, shift: number, progress: (seconds: number) => void): Promise<void> {
    const { frames } = this.#recording;
    const first = frames[0]?.t ?? 0;
    let at = 0;
    while (at < frames.length && !this.#stopped) {
      const played = performance.now() / 1000 - begin;
      for (let frame = frames[at]; frame && frame.t - first <= played; frame = frames[++at]) {
        await this.#session.send(frame.q, { t: frame.t + shift, body: this.#body, emotion: this.#emotion() });
      }
      progress(Math.min(played, this.#recording.seconds));
      await new Promise((resolve) => setTimeout(resolve, LOOK_MS));
    }
  }
}
