// Controls of a replayed recording: play and pause, position, and speed.
import { make } from "./make.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const FOLLOWS_MS = 500; // after a move the slider stays for this time, then shows the actual moment

export class Player {
  #send;
  #state = null;
  #button; #slider; #where; #speed;
  #movedMs = -Infinity;

  constructor(section, send) {
    this.#send = send;
    this.#button = make("button", { type: "button", id: "play" });
    this.#slider = make("input", { type: "range", id: "moment", min: 0, max: 1, step: 0.1, value: 0 });
    this.#slider.setAttribute("aria-label", "Moment");
    this.#where = make("output", { htmlFor: "moment" });
    this.#speed = make("select", { id: "speed" });
    this.#speed.setAttribute("aria-label", "Speed");
    const first = make("div", {}, this.#button, this.#speed, this.#where);
    section.replaceChildren(make("h2", {}, "Recording"), first, make("div", {}, this.#slider));
    this.#button.onclick = () => this.#state && this.#wish({ paused: !this.#state.paused });
    this.#speed.onchange = () => this.#wish({ speed: Number(this.#speed.value) });
    this.#slider.oninput = () => {
      this.#movedMs = performance.now();
      this.#wish({ at_s: Math.min(Number(this.#slider.value), this.#state?.length_s ?? 0) });
    };
  }

  show(state) {
    this.#state = state;
    this.#button.textContent = state.paused ? "▶ play" : "❚❚ pause";
    this.#where.textContent = `${state.at_s.toFixed(1)} of ${state.length_s.toFixed(1)} s`;
    this.#slider.max = state.length_s;
    if (performance.now() - this.#movedMs > FOLLOWS_MS) this.#slider.value = state.at_s;
    const speeds = [...new Set([...SPEEDS, state.speed])].sort((a, b) => a - b);
    if (this.#speed.length !== speeds.length) {
      this.#speed.replaceChildren(...speeds.map((speed) => new Option(`${speed} ×`, speed)));
    }
    if (document.activeElement !== this.#speed) this.#speed.value = state.speed;
  }

  #wish(play) {
    this.#send({ play });
  }
}
