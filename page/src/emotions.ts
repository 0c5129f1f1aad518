// The intensity of one motion under every emotion, as bars; asked of the service while it is open.

import { make, say } from "./elements.ts";
import type { SeenBody } from "./messages.ts";

export class Emotions {
  readonly element = make("details", "emotions", make("summary", "", "Under every emotion"));
  readonly #rows = new Map<string, { row: HTMLElement; bar: HTMLElement; number: HTMLElement }>();
  readonly #list = make("ul");

  constructor(emotions: readonly string[], changed: () => void) {
    for (const emotion of emotions) {
      const [bar, number] = [make("span", "bar"), make("span", "number")];
      Object.assign(bar, { role: "meter", ariaLabel: emotion, ariaValueMin: "0", ariaValueMax: "1" });
      const row = make("li", "", make("span", "name", emotion), bar, number);
      this.#rows.set(emotion, { row, bar, number });
      this.#list.append(row);
    }
    this.element.append(this.#list);
    this.element.addEventListener("toggle", changed);
  }

  get wanted(): boolean {
    return this.element.open;
  }

  show(body: SeenBody): void {
    if (!body.by_emotion) return;
    for (const [emotion, value] of Object.entries(body.by_emotion)) {
      const parts = this.#rows.get(emotion);
      if (!parts) continue;
      parts.bar.style.setProperty("--value", String(value));
      parts.bar.ariaValueNow = value.toFixed(2);
      say(parts.number, value.toFixed(2));
      parts.row.toggleAttribute("data-shown", emotion === body.emotion);
    }
  }
}
