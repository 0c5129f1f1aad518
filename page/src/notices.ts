// Sentences on what went wrong, which stay until they are put away.

import { make } from "./elements.ts";

const MOST = 4;

export class Notices {
  readonly #place: HTMLElement;

  constructor(place: HTMLElement) {
    this.#place = place;
  }

  tell(problem: unknown): void {
    const sentence = problem instanceof Error ? problem.message : String(problem);
    const away = make("button", "", "Close");
    const notice = make("p", "notice", make("span", "", sentence), away);
    away.type = "button";
    away.onclick = () => notice.remove();
    this.#place.append(notice);
    while (this.#place.childElementCount > MOST) this.#place.firstElementChild?.remove();
  }
}
