// The webcam as a sensor: pictures to the detector's frame, points of the body to whoever wants them. One picture is
// under way at a time, so that a slow machine sends fewer points and always new ones.

import type { Found, Picture } from "./detector.ts";

const LONGEST_WAIT_MS = 250; // for a new picture: browsers tell of none while the page is hidden

/** Points of one instant: `t` in seconds, one [x, y, z] in metres a landmark, null where not seen. */
export type TakePoints = (t: number, points: ([number, number, number] | null)[]) => void;

export class Webcam {
  readonly #video: HTMLVideoElement;
  readonly #take: TakePoints;
  readonly #failed: (problem: unknown) => void;
  readonly #frame = document.createElement("iframe");
  #camera: MediaStream | undefined;
  #running = true;
  #empty = 0;
  /** Pictures in a row in which nobody was found. */
  get empty(): number {
    return this.#empty;
  }

  private constructor(video: HTMLVideoElement, take: TakePoints, failed: (problem: unknown) => void) {
    this.#video = video;
    this.#take = take;
    this.#failed = failed;
  }

  /** Starts camera and detector; throws where the browser lets nobody use a camera. */
  static async open(video: HTMLVideoElement, take: TakePoints, failed: (problem: unknown) => void): Promise<Webcam> {
    if (!navigator.mediaDevices) {
      throw new Error("browsers give cameras only to pages of this machine (localhost) or of https addresses");
    }
    const webcam = new Webcam(video, take, failed);
    try {
      await webcam.#start();
    } catch (error) {
      webcam.close();
      throw error;
    }
    return webcam;
  }

  close(): void {
    this.#running = false;
    removeEventListener("message", this.#hear);
    for (const track of this.#camera?.getTracks() ?? []) track.stop();
    this.#video.srcObject = null;
    this.#frame.remove();
  }

  async #start(): Promise<void> {
    const wanted = { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } };
    this.#camera = await navigator.mediaDevices.getUserMedia({ video: wanted, audio: false });
    this.#camera.getVideoTracks()[0]?.addEventListener("ended", () => {
      if (this.#running) this.#failed(new Error("the camera is gone"));
    });
    this.#video.srcObject = this.#camera;
    await this.#video.play();
    addEventListener("message", this.#hear);
    this.#frame.src = "page/pose.html";
    this.#frame.title = "Pose detector";
    this.#frame.className = "detector";
    this.#frame.tabIndex = -1;
    this.#frame.setAttribute("aria-hidden", "true");
    document.body.append(this.#frame);
  }

  readonly #hear = (event: MessageEvent<Found>): void => {
    if (event.source !== this.#frame.contentWindow || event.origin !== location.origin || !this.#running) return;
    const found = event.data;
    if (found.kind === "failed") {
      this.#failed(new Error(found.message));
      return;
    }
    if (found.kind === "points") {
      this.#empty = found.points ? 0 : this.#empty + 1;
      if (found.points) this.#take(found.t, found.points);
    }
    void this.#next();
  };

  async #next(): Promise<void> {
    await new Promise<void>((resolve) => {
      this.#video.requestVideoFrameCallback(() => resolve());
      setTimeout(resolve, LONGEST_WAIT_MS);
    });
    if (!this.#running) return;
    try {
      const picture = await createImageBitmap(this.#video);
      const message: Picture = { t: performance.now() / 1000, picture };
      this.#frame.contentWindow?.postMessage(message, location.origin, [picture]);
    } catch (error) {
      if (this.#running) this.#failed(error);
    }
  }
}
