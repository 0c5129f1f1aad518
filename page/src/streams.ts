// The streams of this page itself: files and the webcam, each an ordinary session of the service.

import type { Session } from "../../clients/js/src/index.ts";
import { byId, make, say } from "./elements.ts";
import type { Notices } from "./notices.ts";
import { readRecording } from "./recording.ts";
import { open } from "./session.ts";
import { Player } from "./player.ts";
import { Webcam } from "./webcam.ts";

const MOST_UNDER_WAY = 30; // frames of the webcam
const LONGEST_NAME = 64; // characters of a body's name

export class Streams {
  readonly #list = byId("own");
  readonly #emotion = byId<HTMLSelectElement>("emotion");
  readonly #skeleton = byId<HTMLSelectElement>("skeleton");
  readonly #repeat = byId<HTMLInputElement>("repeat");
  readonly #button = byId<HTMLButtonElement>("webcam");
  readonly #notices: Notices;
  #camera: { webcam: Webcam; session: Session } | undefined;
  #opening = false;

  constructor(notices: Notices) {
    this.#notices = notices;
    this.#button.onclick = () => void this.#turnWebcam().catch((error) => this.#notices.tell(error));
    const file = byId<HTMLInputElement>("file");
    file.onchange = () => {
      this.files(file.files ?? []);
      file.value = "";
    };
  }

  /** Emotions that can be shown, and sensors that tables may be of. */
  offer(emotions: readonly string[], skeletons: readonly { name: string; title: string }[]): void {
    const chosen = this.#emotion.value;
    this.#emotion.replaceChildren(...["unknown", ...emotions].map((emotion) => new Option(emotion)));
    this.#emotion.value = chosen || "joy";
    this.#skeleton.replaceChildren(new Option("as the file says", ""), ...skeletons.map(({ name, title }) => new Option(title, name)));
  }

  files(files: Iterable<File>): void {
    for (const file of files) void this.#play(file).catch((error) => this.#notices.tell(error));
  }

  async #play(file: File): Promise<void> {
    const text = make("span", "", `${file.name}: reading`);
    const bar = make("progress");
    const stop = make("button", "", "Stop");
    stop.type = "button";
    stop.ariaLabel = `Stop ${file.name}`;
    bar.ariaLabel = file.name;
    const row = make("li", "", text, bar, stop);
    this.#list.append(row);
    try {
      const recording = await readRecording(file, this.#skeleton.value);
      const session = await open("c13", (news) => this.#notices.tell(news));
      const player = new Player(recording, session, file.name.slice(0, LONGEST_NAME), () => this.#emotion.value || "unknown");
      stop.onclick = () => player.stop();
      await player.run(this.#repeat, (seconds) => {
        bar.max = recording.seconds || 1;
        bar.value = seconds;
        say(text, `${file.name}: ${seconds.toFixed(0)} of ${recording.seconds.toFixed(0)} s`);
      });
    } finally {
      row.remove();
    }
  }

  async #turnWebcam(): Promise<void> {
    if (this.#opening) return;
    if (this.#camera) {
      await this.#closeWebcam();
      return;
    }
    this.#opening = true;
    try {
      await this.#openWebcam();
    } finally {
      this.#opening = false;
    }
  }

  async #openWebcam(): Promise<void> {
    const text = byId("camera-text");
    byId("preview").hidden = false;
    say(text, "starting the pose detector");
    let session: Session | undefined;
    let count = 0;
    const failed = (error: unknown) => {
      this.#notices.tell(error);
      void this.#closeWebcam();
    };
    try {
      session = await open("mediapipe", (news) => this.#notices.tell(news));
      const live = session;
      const webcam = await Webcam.open(byId<HTMLVideoElement>("camera"), (t, points) => {
        if (live.inFlight > MOST_UNDER_WAY) return; // newest wins
        live.send(points, { t, body: "webcam", emotion: this.#emotion.value || "unknown" }).catch(failed);
        count += 1;
        say(text, `${count} poses sent`);
      }, failed);
      this.#camera = { webcam, session };
      this.#button.setAttribute("aria-pressed", "true");
      say(this.#button, "Stop the webcam");
    } catch (error) {
      byId("preview").hidden = true;
      void session?.end();
      throw error;
    }
  }

  async #closeWebcam(): Promise<void> {
    const camera = this.#camera;
    this.#camera = undefined;
    byId("preview").hidden = true;
    this.#button.setAttribute("aria-pressed", "false");
    say(this.#button, "Use the webcam");
    camera?.webcam.close();
    await camera?.session.end();
  }
}
