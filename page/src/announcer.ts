// Says to screen readers what changes: who is there, and whose level turned. Rarely enough to be listened to.

import { say } from "./elements.ts";
import type { SeenBody } from "./messages.ts";

const EVERY_MS = 3000;

export class Announcer {
  readonly #place: HTMLElement;
  readonly #told = new Map<string, string>();
  readonly #waiting = new Map<string, string>();

  constructor(place: HTMLElement) {
    this.#place = place;
    setInterval(() => this.#speak(), EVERY_MS);
  }

  tell(key: string, { body, emotion, level, intensity }: SeenBody): void {
    const state = `${emotion} ${level}`;
    if (this.#told.get(key) === state || level === null || intensity === null) return;
    this.#told.set(key, state);
    this.#waiting.set(key, `${body}: ${emotion}, ${level}, ${intensity.toFixed(2)}.`);
  }

  #speak(): void {
    if (!this.#waiting.size) return;
    say(this.#place, [...this.#waiting.values()].join(" "));
    this.#waiting.clear();
  }
}
