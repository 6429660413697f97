// The last 20 seconds of what this page received, as received, to be played again slowly. While they are open nothing is kept.
const SPAN_MS = 20000;
const MOST_BYTES = 64 << 20; // pictures of 640x480 at 30 Hz take half of it
const SLOWLY = 0.5;

const sizeOf = (data) => (typeof data === "string" ? 2 * data.length : data.byteLength);

export class Replay {
  open = false;
  atMs = null; // moment that is shown, and the last one, on the page's clock
  untilMs = null;
  #kept = new Map(); // kind → [[time in ms, data]], oldest first
  #bytes = 0;
  #show;
  #shown = new Map(); // kind → entry that is shown
  #fromMs = 0;
  #steppedMs = 0;
  #speed = SLOWLY;
  #paused = false;

  // show(kind, data): called with the newest of each kind, where it changes.
  constructor(show) {
    this.#show = show;
  }

  keep(kind, data, nowMs) {
    if (this.open || sizeOf(data) > MOST_BYTES) return;
    if (!this.#kept.has(kind)) this.#kept.set(kind, []);
    this.#kept.get(kind).push([nowMs, data]);
    this.#bytes += sizeOf(data);
    while (this.#bytes > MOST_BYTES || this.#oldest()[0][0] < nowMs - SPAN_MS) this.#bytes -= sizeOf(this.#oldest().shift()[1]);
  }

  #oldest() {
    const some = [...this.#kept.values()].filter((entries) => entries.length);
    return some.reduce((first, entries) => (entries[0][0] < first[0][0] ? entries : first));
  }

  get has() {
    return [...this.#kept.values()].some((entries) => entries.length);
  }

  forget() {
    this.open = false;
    this.#kept.clear();
    this.#bytes = 0;
  }

  begin(nowMs) {
    if (!this.has) return;
    this.open = true;
    this.untilMs = Math.max(...[...this.#kept.values()].map((entries) => entries.at(-1)?.[0] ?? 0));
    this.#fromMs = Math.max(this.#oldest()[0][0], this.untilMs - SPAN_MS);
    [this.#speed, this.#paused, this.#steppedMs, this.atMs] = [SLOWLY, false, nowMs, this.#fromMs];
    this.#shown.clear();
    this.step(nowMs);
  }

  end() {
    this.open = false;
    this.atMs = null;
  }

  // As a recording's player: paused, speed and at_s, each where it is to change.
  wish({ paused, speed, at_s }, nowMs) {
    if (!this.open) return;
    this.step(nowMs);
    this.#paused = paused ?? this.#paused;
    this.#speed = speed ?? this.#speed;
    if (paused === false && this.atMs >= this.untilMs) this.atMs = this.#fromMs; // from the end: once more
    if (at_s !== undefined) this.atMs = this.#fromMs + 1000 * at_s;
    this.step(nowMs);
  }

  // Go on to the present time; show what is new there.
  step(nowMs) {
    if (!this.open) return;
    if (!this.#paused) this.atMs += this.#speed * (nowMs - this.#steppedMs);
    this.#steppedMs = nowMs;
    this.atMs = Math.min(Math.max(this.atMs, this.#fromMs), this.untilMs);
    this.#paused ||= this.atMs === this.untilMs;
    for (const [kind, entries] of this.#kept) {
      const entry = entries.findLast(([ms]) => ms <= this.atMs);
      if (!entry || this.#shown.get(kind) === entry) continue;
      this.#shown.set(kind, entry);
      this.#show(kind, entry[1]);
    }
  }

  get state() {
    if (!this.open) return null;
    const seconds = (ms) => (ms - this.#fromMs) / 1000;
    return { at_s: seconds(this.atMs), length_s: seconds(this.untilMs), speed: this.#speed, paused: this.#paused };
  }
}
