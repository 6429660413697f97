// Camera views: the newest picture of each, with its age. The operator side decides whether it is old or dead.
import { PictureState } from "./names.js";

const DEAD_S = 0.5; // before the operator side's first word
const SETTLED_MS = 2000, SILENCES = 3; // what is seen here counts late, as the operator side's word comes sooner
const WORST = [PictureState.FRESH, PictureState.OLD, PictureState.DEAD];

// Estimate of the operator side's clock, from the message with the least delay.
export class Clock {
  live = true;
  #ahead = [];
  #nowS = 0;
  #offsetS = null;

  set(nowS, offsetS) {
    const aheadS = nowS - performance.now() / 1000;
    const jumped = this.#ahead.length && Math.abs(aheadS - this.#ahead.at(-1)) > 1;
    if (jumped) this.#ahead = [];
    this.#ahead.push(aheadS);
    if (this.#ahead.length > 300) this.#ahead.shift();
    [this.#nowS, this.#offsetS] = [nowS, offsetS];
  }

  // Present time for pictures and charts; in a replay it is the recording's.
  get nowMs() {
    return this.live ? performance.now() : 1000 * this.#nowS;
  }

  // Seconds since a time on the robot side's clock; null while the clock offset is unknown.
  ageS(robotS) {
    if (this.#offsetS === null || !this.#ahead.length) return null;
    const nowS = this.live ? performance.now() / 1000 + Math.max(...this.#ahead) : this.#nowS;
    return nowS - (robotS - this.#offsetS);
  }
}

export class View {
  capturedS = null; // of the picture shown, on the robot side's clock
  #place; #clock; #context; #age; #dead;
  #waiting = null;
  #busy = false;
  #shownMs = -Infinity;
  #beyond = false;
  #sinceMs = -Infinity;
  #old = false;

  constructor(place, clock) {
    this.#place = place;
    this.#clock = clock;
    this.#context = place.querySelector("canvas").getContext("2d");
    this.#age = place.querySelector(".age");
    this.#dead = place.querySelector(".dead");
  }

  receive(data) {
    this.#waiting = data;
    if (!this.#busy) this.#draw();
  }

  async #draw() {
    this.#busy = true;
    while (this.#waiting !== null) {
      const data = this.#waiting;
      this.#waiting = null;
      try {
        const picture = await createImageBitmap(new Blob([new Uint8Array(data, 9)], { type: "image/jpeg" }));
        const { canvas } = this.#context;
        if (canvas.width !== picture.width || canvas.height !== picture.height) {
          [canvas.width, canvas.height] = [picture.width, picture.height];
        }
        this.#context.drawImage(picture, 0, 0);
        picture.close();
        this.capturedS = new DataView(data).getFloat64(1, true);
        this.#shownMs = this.#clock.nowMs;
        this.#place.dataset.frames = Number(this.#place.dataset.frames ?? 0) + 1;
      } catch {
        continue; // ignore a broken picture
      }
    }
    this.#busy = false;
  }

  // beforeS: seconds from the picture that is played again to the end of what is.
  showReplay(beforeS) {
    this.#place.dataset.age = "replay";
    this.#age.textContent = `REPLAY, ${beforeS.toFixed(1)} s before`;
  }

  // state: of the pictures, as the operator side says; oldS: age from which they are old; null while unknown. deadS: silence.
  // The operator side knows of the driving page alone what it shows. So the worse counts of its word and what is seen here.
  showAge(state, oldS, deadS = DEAD_S) {
    if (this.capturedS === null) return;
    const silentS = (this.#clock.nowMs - this.#shownMs) / 1000;
    const ageS = this.#clock.ageS(this.capturedS);
    const beyond = oldS !== null && ageS !== null && ageS > oldS;
    if (beyond !== this.#beyond) [this.#beyond, this.#sinceMs] = [beyond, this.#clock.nowMs];
    if (this.#clock.nowMs - this.#sinceMs >= SETTLED_MS) this.#old = beyond;
    const here = silentS > SILENCES * deadS ? PictureState.DEAD : this.#old ? PictureState.OLD : PictureState.FRESH;
    const shown = WORST[Math.max(WORST.indexOf(state), WORST.indexOf(here))];
    const dead = shown === PictureState.DEAD;
    this.#place.dataset.age = shown;
    const ms = (seconds) => Math.max(0, 1000 * seconds).toFixed(0);
    this.#age.textContent = ageS === null ? "age unknown" : `${ms(ageS)} ms old`;
    this.#age.title = oldS === null ? "" : `amber beyond ${ms(oldS)} ms on this link`;
    this.#dead.hidden = !dead;
    if (dead) this.#dead.textContent = `NO NEW PICTURE for ${silentS.toFixed(1)} s`;
  }
}
