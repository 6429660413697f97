// Tuning during a run, if the run permits it: probability P of eq. 10, and the emulated link.
import { make } from "./make.js";
import { LinkState, SessionState } from "./names.js";

const PROBABILITIES = [0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.998, 0.999];
const PAUSE_MS = 250; // a slider's value is sent once it rests
const FOLLOWS_MS = 2000; // for this time after a request the slider shows the requested value, then the actual one
const UNITS = { us: 1e-3, ms: 1, s: 1e3 };

const nearest = (value) =>
  PROBABILITIES.reduce((best, one, k) => (Math.abs(one - value) < Math.abs(PROBABILITIES[best] - value) ? k : best), 0);

// Read delay and jitter in ms, and loss in per cent, from a link profile in netem's words.
export function readWords(words) {
  const [, delay = "0", unit = "ms", jitter = "0", jitterUnit = "ms"] =
    /delay ([\d.]+)(us|ms|s)(?: ([\d.]+)(us|ms|s))?/.exec(words)?.map((part) => part ?? undefined) ?? [];
  const loss = /loss ([\d.]+)%/.exec(words)?.[1] ?? "0";
  return { delay: Number(delay) * UNITS[unit], jitter: Number(jitter) * UNITS[jitterUnit], loss: Number(loss) };
}

export function toWords({ delay, jitter, loss }) {
  const shape = jitter > 0 ? ` ${jitter}ms distribution normal` : "";
  return [delay > 0 || jitter > 0 ? `delay ${delay}ms${shape}` : "", loss > 0 ? `loss ${loss}%` : ""].filter(Boolean).join(" ");
}

export class Tuning {
  #send;
  #reason;
  #sliders = {};
  #wishedMs = { probability: -Infinity, link: -Infinity };
  #timers = {};

  constructor(document, send) {
    this.#send = send;
    const section = document.getElementById("tuning");
    this.#reason = make("p", { id: "tuning_reason" });
    const row = (name, label, most, step, words) => {
      const slider = make("input", { type: "range", id: `tune_${name}`, min: 0, max: most, step, value: 0, disabled: true });
      const now = make("output", { id: `tune_${name}_now`, htmlFor: slider.id });
      slider.setAttribute("aria-describedby", now.id);
      slider.addEventListener("input", () => this.#wish(name));
      this.#sliders[name] = { slider, now, words };
      return make("div", { className: "tune" }, make("label", { htmlFor: slider.id }, label), slider, now);
    };
    section.replaceChildren(
      make("div", { className: "head" }, make("h2", {}, "Tuning"), this.#reason),
      row("probability", "P: warned in time", PROBABILITIES.length - 1, 1, (value) => `${PROBABILITIES[value]}`),
      row("delay", "Delay, each way", 400, 5, (value) => `${value} ms`),
      row("jitter", "Jitter", 50, 1, (value) => `${value} ms`),
      row("loss", "Loss", 10, 0.5, (value) => `${value} %`));
  }

  show(facts) {
    const asked = [facts.to_robot.asked, facts.to_operator.asked || facts.page?.link_asked || ""];
    const owns = facts.status.owner !== SessionState.OBSERVING;
    const lost = facts.status.link !== LinkState.UP;
    const reason = owns && lost ? "The robot is not heard: nothing can be tuned." : !owns ? "Only the owner may tune; this operator observes."
      : !facts.may_tune ? "This run does not permit tuning (robot side: --permit-tuning)."
      : facts.page?.tuning_refused ?? "";
    if (this.#reason.textContent !== reason) this.#reason.textContent = reason;
    const link = readWords(asked[0]);
    const holds = { probability: facts.probability === null ? null : nearest(facts.probability), ...link };
    for (const [name, { slider, now, words }] of Object.entries(this.#sliders)) {
      slider.disabled = lost || !(owns && facts.may_tune);
      const wishedMs = this.#wishedMs[name === "probability" ? name : "link"];
      const follows = performance.now() - wishedMs > FOLLOWS_MS && this.#timers[name === "probability" ? name : "link"] == null;
      if (follows && holds[name] !== null) slider.value = holds[name];
      const value = Number(slider.value);
      slider.setAttribute("aria-valuetext", words(value));
      const has = name === "probability" ? facts.probability === null ? "?" : `${facts.probability}` : words(holds[name]);
      const said = slider.disabled || has === words(value) ? has : `${words(value)}; the run has ${has}`;
      if (now.textContent !== said) now.textContent = said;
    }
  }

  #wish(name) {
    const about = name === "probability" ? name : "link";
    this.#wishedMs[about] = performance.now();
    clearTimeout(this.#timers[about]);
    this.#timers[about] = setTimeout(() => {
      this.#timers[about] = null;
      this.#wishedMs[about] = performance.now();
      const value = (one) => Number(this.#sliders[one].slider.value);
      const link = { delay: value("delay"), jitter: value("jitter"), loss: value("loss") };
      this.#send({ tune: about === "probability" ? { probability: PROBABILITIES[value(name)] } : { link: toWords(link) } });
    }, PAUSE_MS);
    const { slider, now, words } = this.#sliders[name];
    slider.setAttribute("aria-valuetext", words(Number(slider.value)));
    now.textContent = `${words(Number(slider.value))} requested`;
  }
}
