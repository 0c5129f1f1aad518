// A client's core and the services that it meets, back to back. Messages wait between the two in both directions, and
// a cut loses those that wait.

import type { Encoding, Payload } from "../src/codec.ts";
import { Conversation, type News } from "../src/conversation.ts";
import { FervorError, Unreachable } from "../src/errors.ts";
import type { FrameOptions } from "../src/framer.ts";
import type { Estimate, SessionStart } from "../src/messages.ts";
import { type Reconnect, Retries } from "../src/retries.ts";
import { ServiceModel } from "./service_model.ts";

export const KEY = "one key for all";

export interface RobotOptions extends Partial<SessionStart> {
  encoding?: Encoding;
  retryForS?: number;
  mostKept?: number;
  resumes?: boolean;
}

export class Robot {
  now = 0;
  readonly errors: FervorError[] = [];
  readonly reconnects: Reconnect[] = [];
  readonly warnings: string[] = [];
  readonly conversation: Conversation;
  key = KEY;
  #service!: ServiceModel;
  #heard: Payload[] = [];
  readonly #encoding: Encoding;
  readonly #latest: boolean;

  constructor({ encoding = "json", retryForS = Infinity, mostKept, resumes = true, ...asked }: RobotOptions = {}) {
    this.#encoding = encoding;
    this.#latest = asked.delivery === "latest";
    const now = () => this.now;
    const retries = resumes ? new Retries(retryForS, now, () => 0.5) : undefined;
    const start: SessionStart = { type: "session.start", checkpoint_s: 0.5, ...asked };
    const warn = (sentence: string) => this.warnings.push(sentence);
    this.conversation = new Conversation({ start, encoding, url: "ws://x", retries, now, warn, mostKept });
    this.dial();
    this.settle();
  }

  dial(): void {
    this.#service = new ServiceModel(this.#encoding, this.key, this.#latest);
    this.#heard = [this.conversation.start()];
  }

  frame(x: number, options: FrameOptions): void {
    this.conversation.frame([[x, 0, 0, 1]], options);
  }

  /** A message leaves the client. */
  send(): void {
    this.now += this.conversation.pauseS;
    const payload = this.conversation.nextPayload();
    if (payload !== undefined) this.#heard.push(payload);
  }

  /** The service takes a message in. */
  listen(): void {
    const payload = this.#heard.shift();
    if (payload !== undefined) this.#service.hear(payload);
  }

  /** The client takes a message in. */
  hear(): void {
    const payload = this.#service.said.shift();
    if (payload === undefined) return;
    this.note(this.conversation.receive(payload));
    if (!this.conversation.linked && !this.conversation.linking) this.cut();
  }

  note(news: readonly News[]): void {
    for (const item of news) {
      if (item instanceof FervorError) this.errors.push(item);
      else this.reconnects.push(item);
    }
  }

  cut(failure: FervorError = new Unreachable("cut")): void {
    const plan = this.conversation.interrupted(failure);
    if (plan === undefined) return;
    this.note([plan]);
    this.now += plan.delayS ?? 0;
    this.dial();
  }

  /** Until nothing moves any more. */
  settle(): void {
    let moved = true;
    while (moved) {
      const { said } = this.#service;
      const before = this.#heard.length + said.length;
      this.send();
      moved = before + this.#heard.length > 0;
      this.listen();
      this.hear();
    }
  }

  read(): Estimate[] {
    const told: Estimate[] = [];
    for (let next = this.conversation.nextEstimate(); next; next = this.conversation.nextEstimate()) told.push(next);
    return told;
  }
}
