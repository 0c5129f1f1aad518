// The live page of a fervor service.

import "uplot/dist/uPlot.min.css";
import "./style.css";

import { ask, keepToken } from "./access.ts";
import { Announcer } from "./announcer.ts";
import { Bodies, sessionRows } from "./bodies.ts";
import { byId, say } from "./elements.ts";
import type { Snapshot, WatchStarted } from "./messages.ts";
import { Notices } from "./notices.ts";
import { Streams } from "./streams.ts";
import { type LinkState, Watch } from "./watch.ts";

const PAGE = 12; // bodies in one snapshot

const notices = new Notices(byId("notices"));
const streams = new Streams(notices);
const bodies = new Bodies(new Announcer(byId("spoken")), look);
const watch = new Watch({ started, seen, link });
let first = 0;

function look(): void {
  watch.look({ first, by_emotion: bodies.asked });
}

function started(message: WatchStarted): void {
  const { model, version, workers } = message;
  byId("demo").hidden = model.purpose !== "demo";
  byId("stream").hidden = false;
  const one = workers > 1 ? `, one of ${workers} processes` : "";
  say(byId("about"), `model ${model.name} ${model.version}, fervor ${version}${one}`);
  bodies.start(message);
  void offer(model.emotions);
}

async function offer(emotions: readonly string[]): Promise<void> {
  // Who may only watch gets no list of sensors, and needs none.
  const skeletons = await ask("v1/skeletons").then((answer) => answer.json(), () => []);
  streams.offer(emotions, skeletons as { name: string; title: string }[]);
}

function seen(snapshot: Snapshot): void {
  const { bodies_total: total, sessions_total: sessions } = snapshot;
  bodies.show(snapshot);
  say(byId("count"), `${total} ${total === 1 ? "body" : "bodies"} in ${sessions} ${sessions === 1 ? "session" : "sessions"}`);
  sessionRows(snapshot.sessions, byId("sessions"));
  byId("leaf").hidden = total <= PAGE;
  say(byId("leaf-text"), `${snapshot.first + 1} to ${snapshot.first + snapshot.bodies.length}`);
  byId<HTMLButtonElement>("before").disabled = snapshot.first === 0;
  byId<HTMLButtonElement>("after").disabled = snapshot.first + PAGE >= total;
  first = snapshot.first;
}

function leaf(by: number): void {
  first = Math.max(first + by, 0);
  bodies.clear();
  look();
}

function link(state: LinkState, sentence: string): void {
  byId("link").dataset.state = state;
  say(byId("link-text"), state === "refused" ? "not let in" : sentence);
  const entry = byId("entry");
  const shut = state === "refused";
  entry.hidden = !shut;
  document.body.classList.toggle("shut", shut);
  if (!shut) return;
  say(byId("entry-why"), sentence);
  bodies.clear();
  byId("token").focus();
}

function enter(event: SubmitEvent): void {
  event.preventDefault();
  const field = byId<HTMLInputElement>("token");
  keepToken(field.value.trim());
  field.value = "";
  watch.connect();
}

/** Files may be dropped anywhere. */
function takeDrops(): void {
  const veil = byId("drop");
  const brings = (event: DragEvent) => event.dataTransfer?.types.includes("Files") ?? false;
  addEventListener("dragover", (event) => {
    if (!brings(event)) return;
    event.preventDefault();
    veil.hidden = false;
  });
  addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) veil.hidden = true;
  });
  addEventListener("drop", (event) => {
    veil.hidden = true;
    if (!brings(event)) return;
    event.preventDefault();
    streams.files(event.dataTransfer?.files ?? []);
  });
}

byId("entry").addEventListener("submit", enter);
byId("before").onclick = () => leaf(-PAGE);
byId("after").onclick = () => leaf(PAGE);
takeDrops();
watch.connect();
