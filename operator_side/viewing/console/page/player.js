// Controls of what is played again, a recording or a live run's last seconds: play and pause, position, and speed.
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
    section.append(this.#button, this.#speed, this.#slider, this.#where);
    this.show(null);
    this.#button.onclick = () => this.#state && this.#wish({ paused: !this.#state.paused });
    this.#speed.onchange = () => this.#wish({ speed: Number(this.#speed.value) });
    this.#slider.oninput = () => {
      this.#movedMs = performance.now();
      this.#wish({ at_s: Math.min(Number(this.#slider.value), this.#state?.length_s ?? 0) });
    };
  }

  // state: null while nothing is played again.
  show(state) {
    this.#state = state;
    const { at_s = 0, length_s = 0, speed = 1, paused = true } = state ?? {};
    for (const one of [this.#button, this.#slider, this.#speed]) one.disabled = state === null;
    this.#button.textContent = paused ? "▶ play" : "❚❚ pause";
    this.#where.textContent = state ? `${at_s.toFixed(1)} of ${length_s.toFixed(1)} s` : "";
    this.#slider.max = length_s;
    if (performance.now() - this.#movedMs > FOLLOWS_MS) this.#slider.value = at_s;
    const speeds = [...new Set([...SPEEDS, speed])].sort((a, b) => a - b);
    if (this.#speed.length !== speeds.length) {
      this.#speed.replaceChildren(...speeds.map((one) => new Option(`${one} ×`, one)));
    }
    if (document.activeElement !== this.#speed) this.#speed.value = speed;
  }

  #wish(play) {
    this.#send({ play });
  }
}
