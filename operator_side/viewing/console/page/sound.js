// Sound for those without a controller, off until it is switched on: a tone for each trigger, as loud as the stiffness ahead
// is strong, R2 high and on the right, L2 low and on the left; and a click when what is held comes to stand.
import { MotionState } from "./names.js";
import { strengths, STRONGEST } from "./triggers.js";

export const SOUND_KEY = "KeyL";
const TONES = { l2: [330, -1], r2: [660, 1] }; // frequency in Hz, and side
const LOUDEST = 0.25;
const FOLLOWS_S = 0.03;
const LASTS_S = 0.4; // a tone ends that long after the last news
const CLICK_HZ = 1800, CLICK_S = 0.03;

export class Sound {
  #button; #makeContext;
  #context = null;
  #gains = {};
  #stood = false;

  constructor(button, makeContext = () => new AudioContext()) {
    [this.#button, this.#makeContext] = [button, makeContext];
    button.onclick = () => this.switch();
    button.ownerDocument.addEventListener("keydown", (event) => {
      const free = !event.repeat && !event.ctrlKey && !event.altKey && !event.metaKey;
      if (event.code === SOUND_KEY && free && !event.target.matches?.("input:not([type=range]), select, textarea")) this.switch();
    });
    this.#name();
  }

  #name() {
    this.#button.textContent = `Sound: ${this.#context ? "on" : "off"}`;
    this.#button.setAttribute("aria-pressed", this.#context !== null);
    this.#button.title = "L: a tone for the stiffness ahead, R2 high and right, L2 low and left; a click when what is held stands";
  }

  switch() {
    this.#context?.close?.();
    this.#context = this.#context ? null : this.#makeContext();
    for (const [side, [hertz, to]] of this.#context ? Object.entries(TONES) : []) {
      this.#gains[side] = this.#tone(hertz, to);
    }
    this.#name();
  }

  // Return its loudness, at first 0. forS: seconds until it ends.
  #tone(hertz, to, forS = null) {
    const context = this.#context;
    const [tone, gain, pan] = [context.createOscillator(), context.createGain(), context.createStereoPanner()];
    [tone.frequency.value, gain.gain.value, pan.pan.value] = [hertz, 0, to];
    tone.connect(gain).connect(pan).connect(context.destination);
    tone.start();
    if (forS !== null) tone.stop(context.currentTime + forS);
    return gain.gain;
  }

  // fingers: place of each trigger's finger in its zones, 0 to 1; null without one.
  play(facts, fingers) {
    const stands = Boolean(facts.status.stands);
    const comes = stands && !this.#stood;
    this.#stood = stands;
    if (!this.#context) return;
    const now = this.#context.currentTime;
    const armed = facts.status.state === MotionState.ARMED;
    Object.keys(TONES).forEach((side, k) => {
      const { ahead } = strengths(facts[side], fingers[k]);
      const gain = this.#gains[side];
      gain.cancelScheduledValues(now);
      gain.setTargetAtTime(armed ? (LOUDEST * ahead) / STRONGEST : 0, now, FOLLOWS_S);
      gain.setTargetAtTime(0, now + LASTS_S, FOLLOWS_S);
    });
    if (!comes) return;
    const click = this.#tone(CLICK_HZ, 0, 10 * CLICK_S);
    click.setValueAtTime(LOUDEST, now);
    click.setTargetAtTime(0, now + CLICK_S, CLICK_S / 3);
  }
}
