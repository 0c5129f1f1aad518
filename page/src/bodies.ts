// The bodies on the page: a card each, drawn as often as the screen shows pictures, but no faster than eyes need.

import type { Announcer } from "./announcer.ts";
import { Card } from "./card.ts";
import { byId, make, say } from "./elements.ts";
import { Figure } from "./figure.ts";
import type { BodyName, SeenSession, Snapshot, WatchStarted } from "./messages.ts";

const KEPT_S = 12; // a body that left stays readable for so long
const PICTURE_S = 1 / 31;
const BUDGET_MS = 20; // for drawing at once; where that is too little, bodies take turns
const REST = 3; // a machine that draws slowly has better things to do for most of its time

export class Bodies {
  readonly #cards = new Map<string, Card>();
  readonly #left = new Map<string, number>();
  readonly #place = byId("bodies");
  readonly #changed: () => void;
  readonly #announcer: Announcer;
  #started: WatchStarted | undefined;
  #figure: Figure | undefined;
  #due = 0; // seconds
  #turn = 0; // whose turn it is to be drawn

  /** `changed`: what is to be asked of the service may be another. */
  constructor(announcer: Announcer, changed: () => void) {
    this.#announcer = announcer;
    this.#changed = changed;
    requestAnimationFrame((time) => this.#draw(time / 1000));
  }

  start(started: WatchStarted): void {
    this.#started = started;
    this.clear();
    try {
      this.#figure ??= new Figure(started);
    } catch {
      this.#place.before(make("p", "nobody", "This browser has no WebGL, so figures can't be drawn."));
    }
  }

  clear(): void {
    this.#cards.clear();
    this.#left.clear();
    this.#place.replaceChildren();
  }

  /** The bodies whose intensity under every emotion is open. */
  get asked(): BodyName[] {
    const open = [...this.#cards.values()].filter((card) => card.wantsEmotions);
    return open.map(({ body: { session, body } }) => ({ session, body }));
  }

  show(snapshot: Snapshot): void {
    const now = performance.now() / 1000;
    const sessions = new Map(snapshot.sessions.map((session) => [session.session, session]));
    for (const body of snapshot.bodies) this.#put(keyOf(body), body, sessions.get(body.session), now);
    const here = new Set(snapshot.bodies.map(keyOf));
    for (const [key, card] of this.#cards) if (!here.has(key)) this.#leave(key, card, now);
    byId("nobody").hidden = this.#cards.size > 0;
    this.#place.dataset.bodies = String(Math.min(this.#cards.size, 3));
  }

  #put(key: string, body: Snapshot["bodies"][number], session: SeenSession | undefined, now: number): void {
    let card = this.#cards.get(key);
    if (!card && this.#started) {
      card = new Card(body, this.#started, this.#changed);
      this.#cards.set(key, card);
      this.#place.append(card.element);
    }
    this.#left.delete(key);
    card?.show(body, session, now);
    this.#announcer.tell(key, body);
  }

  #leave(key: string, card: Card, now: number): void {
    const since = this.#left.get(key) ?? now;
    this.#left.set(key, since);
    card.leave();
    if (now - since < KEPT_S) return;
    card.element.remove();
    this.#cards.delete(key);
    this.#left.delete(key);
    this.#changed();
  }

  #draw(now: number): void {
    requestAnimationFrame((time) => this.#draw(time / 1000));
    if (now < this.#due) return;
    const began = performance.now();
    const cards = [...this.#cards.values()];
    for (const card of cards) card.write(now);
    const visible = cards.filter(({ element }) => isVisible(element));
    for (let count = 0; count < visible.length && performance.now() < began + BUDGET_MS; count++) {
      this.#turn = (this.#turn + 1) % visible.length;
      visible[this.#turn]?.draw(this.#figure, now);
    }
    this.#due = now + Math.max(PICTURE_S, (REST * (performance.now() - began)) / 1000);
  }
}

export function sessionRows(sessions: readonly SeenSession[], table: HTMLElement): void {
  while (table.childElementCount > sessions.length) table.lastElementChild?.remove();
  sessions.forEach((session, at) => {
    const row = table.children[at] ?? table.appendChild(make("tr", "", make("td"), make("td"), make("td"), make("td")));
    const told = [session.session, session.skeleton ?? "not started", session.bodies, session.frames];
    told.forEach((text, column) => {
      const cell = row.children[column];
      if (cell) say(cell, String(text));
    });
  });
}

function keyOf({ session, body }: BodyName): string {
  return `${session}\n${body}`;
}

function isVisible(element: HTMLElement): boolean {
  const { top, bottom } = element.getBoundingClientRect();
  return bottom > 0 && top < innerHeight;
}
