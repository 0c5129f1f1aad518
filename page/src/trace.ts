// The intensity of one body over the last half minute, with the band in which its level stays, drawn by uPlot.

import uPlot from "uplot";
import { colour } from "./elements.ts";
import type { SeenBody } from "./messages.ts";

const SHOWN_S = 30;
const GAP_S = 2; // without estimates: the line breaks

export class Trace {
  readonly #plot: uPlot;
  #times: number[] = []; // seconds, the page's clock
  #values: (number | null)[] = [];
  #threshold = 0.5;
  readonly #hysteresis: number;

  constructor(place: HTMLElement, hysteresis: number) {
    this.#hysteresis = hysteresis;
    this.#plot = new uPlot(this.#options(), [[], []], place);
    new ResizeObserver(() => this.#plot.setSize(sizeOf(place))).observe(place);
  }

  /** A new estimate came, `now` in seconds. */
  add(body: SeenBody, now: number): void {
    const last = this.#times.at(-1);
    if (last !== undefined && now - last > GAP_S) {
      this.#times.push(last + 0.01); // a gap is no line
      this.#values.push(null);
    }
    this.#threshold = body.threshold;
    this.#times.push(now);
    this.#values.push(body.intensity);
    const old = this.#times.findIndex((time) => time >= now - SHOWN_S - 2);
    if (old > 64) {
      this.#times = this.#times.slice(old);
      this.#values = this.#values.slice(old);
    }
  }

  draw(now: number): void {
    this.#plot.batch(() => {
      this.#plot.setData([this.#times, this.#values], false);
      this.#plot.setScale("x", { min: now - SHOWN_S, max: now });
    });
  }

  #options(): uPlot.Options {
    const ink = () => colour("muted");
    const font = "12px system-ui, sans-serif";
    const line = { stroke: () => colour("line"), width: 1 };
    return {
      width: 100,
      height: 100,
      legend: { show: false },
      cursor: { show: false },
      padding: [8, 18, 0, 0],
      scales: { x: { time: false }, y: { range: [0, 1] } },
      axes: [
        {
          stroke: ink,
          font,
          size: 26,
          grid: { show: false },
          ticks: { show: false },
          splits: (plot) => [20, 10, 0].map((ago) => (plot.scales.x?.max ?? 0) - ago),
          values: (plot, at) => at.map((time) => ago((plot.scales.x?.max ?? 0) - time)),
        },
        { stroke: ink, font, size: 36, grid: line, ticks: { show: false }, splits: () => [0, 0.5, 1] },
      ],
      series: [{}, { stroke: () => colour("trace"), width: 2, points: { show: false } }],
      hooks: { drawAxes: [(plot) => this.#band(plot)] },
    };
  }

  #band(plot: uPlot): void {
    const { ctx, bbox } = plot;
    const height = (value: number) => plot.valToPos(value, "y", true);
    const top = height(this.#threshold + this.#hysteresis);
    ctx.save();
    ctx.fillStyle = colour("band");
    ctx.fillRect(bbox.left, top, bbox.width, height(this.#threshold - this.#hysteresis) - top);
    ctx.strokeStyle = colour("strong");
    ctx.setLineDash([6 * devicePixelRatio, 5 * devicePixelRatio]);
    ctx.lineWidth = devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(bbox.left, height(this.#threshold));
    ctx.lineTo(bbox.left + bbox.width, height(this.#threshold));
    ctx.stroke();
    ctx.restore();
  }
}

function ago(seconds: number): string {
  return seconds < 0.5 ? "now" : `${Math.round(seconds)} s ago`;
}

function sizeOf(place: HTMLElement): { width: number; height: number } {
  return { width: Math.max(place.clientWidth, 60), height: Math.max(place.clientHeight, 60) };
}
