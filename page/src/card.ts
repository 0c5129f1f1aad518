// One body: its figure, its numbers, its trace.

import { Emotions } from "./emotions.ts";
import { make, say } from "./elements.ts";
import { between, type Figure } from "./figure.ts";
import type { Quaternion, SeenBody, SeenSession, WatchStarted } from "./messages.ts";
import { Trace } from "./trace.ts";

const READ_EVERY_S = 0.25; // numbers that change faster can't be read
const STILL_S = 2;
const SMOOTH_S = 0.07;

const STATUSES: Readonly<Record<string, string>> = {
  warming_up: "warming up",
  ok: "ok",
  insufficient: "too few joints seen",
};

export class Card {
  readonly element = make("article", "body");
  readonly #canvas = make("canvas", "figure");
  readonly #intensity = make("span", "intensity", "–");
  readonly #level = make("span", "level", "no level");
  readonly #emotion = make("dd");
  readonly #status = make("dd");
  readonly #from = make("p", "from");
  readonly #turn = make("input");
  readonly #trace: Trace;
  readonly #emotions: Emotions;
  #body: SeenBody;
  #shown: readonly Quaternion[] = [];
  #changed = -Infinity; // seconds, when the newest estimate came
  #read = -Infinity;
  #drawn = -Infinity;
  #gone = false;

  constructor(body: SeenBody, started: WatchStarted, asked: () => void) {
    this.#body = body;
    const title = make("h3", "", body.body);
    title.id = `body-${body.session}-${body.body}`.replace(/\W/g, "-");
    this.element.setAttribute("aria-labelledby", title.id);
    this.#canvas.role = "img";
    this.#canvas.ariaLabel = `Figure of ${body.body}, moving`;
    const plot = make("div", "trace");
    plot.role = "img";
    plot.ariaLabel = `Intensity of ${body.body} over the last half minute, with the threshold between weak and strong`;
    this.#emotions = new Emotions(started.model.emotions, asked);
    const facts = make("dl", "facts");
    facts.append(fact("Emotion", this.#emotion), fact("Status", this.#status));
    const reading = make("p", "reading", make("span", "unseen", "Intensity "), this.#intensity, " ", this.#level);
    const parts = [
      make("div", "head", title, this.#from),
      make("div", "stage", this.#canvas, this.#view(body.body)),
      make("div", "numbers", reading, facts),
      plot,
      this.#emotions.element,
    ];
    this.element.append(make("div", "parts", ...parts));
    this.#trace = new Trace(plot, started.hysteresis);
    this.#pointer();
  }

  get wantsEmotions(): boolean {
    return this.#emotions.wanted && !this.#gone;
  }

  get body(): SeenBody {
    return this.#body;
  }

  /** What the service sees now, `now` in seconds. */
  show(body: SeenBody, session: SeenSession | undefined, now: number): void {
    this.#gone = false;
    if (body.seq !== this.#body.seq || this.#changed < 0) {
      this.#changed = now;
      this.#trace.add(body, now);
    }
    this.#body = body;
    this.#emotions.show(body);
    say(this.#from, `${session?.skeleton ?? "sensor"}, session ${body.session.slice(0, 6)}`);
  }

  /** The body is not there any more. */
  leave(): void {
    this.#gone = true;
  }

  /** Bring the numbers up to date. */
  write(now: number): void {
    if (now - this.#read < READ_EVERY_S) return;
    this.#read = now;
    this.#write(now);
  }

  /** Draw figure and trace; `now` in seconds. */
  draw(figure: Figure | undefined, now: number): void {
    const elapsed = now - this.#drawn;
    this.#drawn = now;
    const share = matchMedia("(prefers-reduced-motion: reduce)").matches ? 1 : 1 - Math.exp(-elapsed / SMOOTH_S);
    this.#shown = between(this.#shown, this.#body.q, share);
    const angle = (Number(this.#turn.value) * Math.PI) / 180;
    const { observed, level } = this.#body;
    figure?.draw(this.#canvas, { pose: this.#shown, observed, level, angle });
    this.#trace.draw(now);
  }

  #write(now: number): void {
    const { intensity, level, emotion, status, flags } = this.#body;
    const quiet = now - this.#changed;
    say(this.#intensity, intensity === null ? "–" : intensity.toFixed(2));
    say(this.#level, level ?? "no level");
    this.#level.dataset.level = level ?? "";
    say(this.#emotion, emotion);
    const told = [STATUSES[status] ?? status, ...flags.filter((flag) => flag === "held" || flag === "lost")].join(", ");
    say(this.#status, this.#gone ? "gone" : quiet > STILL_S ? `no frames for ${Math.floor(quiet)} s` : told);
    this.element.toggleAttribute("data-still", this.#gone || quiet > STILL_S);
  }

  #view(name: string): HTMLElement {
    Object.assign(this.#turn, { type: "range", min: "-180", max: "180", step: "5", value: "25" });
    this.#turn.ariaLabel = `Turn the figure of ${name}, degrees`;
    return make("label", "turn", "Turn", this.#turn);
  }

  /** Drag the figure to turn it; the slider does the same for keys. */
  #pointer(): void {
    this.#canvas.addEventListener("pointerdown", (event) => this.#canvas.setPointerCapture(event.pointerId));
    this.#canvas.addEventListener("pointermove", (event) => {
      if (!this.#canvas.hasPointerCapture(event.pointerId)) return;
      const angle = Number(this.#turn.value) - event.movementX;
      this.#turn.value = String(((((angle + 180) % 360) + 360) % 360) - 180);
    });
  }
}

function fact(name: string, value: HTMLElement): HTMLElement {
  return make("div", "", make("dt", "", name), value);
}
