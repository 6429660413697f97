// Keyboard, pointer and gamepad of this page, used as a controller; and the emergency stop.
//
// watching ─▶ resting ─▶ ready ─▶ running       resting: all keys up for a second; ready: hold-to-run counts
//     ▲          ▲         │         │
//     └──────────┴─────────┴─────────┘  on hold-to-run released, a blurred or hidden page, a stop, silence
//
// The operator side decides by the same rules whether inputs move the arm (operator_side/viewing/pages/driving_page.py);
// the state here is only for display.
import { atRest, both, Grips, Keys, MARK_OF, readGamepads, REST } from "./inputs.js";
import { Doing, MotionState } from "./names.js";
import { Panel } from "./panel.js";
import { Tuning } from "./tuning.js";

const PERIOD_MS = 20;
const REST_MS = 1000;
const HELD_UP_MS = 1000; // a page that was late by more releases all inputs; the operator side does the same
const SILENCE_MS = 500; // without facts for longer the arm's state is unknown
const AGREES_MS = 500; // time until the facts reflect our messages
const STOP_MS = 200;
const STOP_TRIES_MS = 5000;
const RESET_TRIES_MS = 1000; // the operator side takes no reset until the stop was released for a while
const EDITS = "input:not([type=button]), select, textarea, [contenteditable=true]";

export class Hands {
  #send;
  #document;
  #panel;
  #tuning;
  #keys = new Keys();
  #grips = new Grips(() => this.#step());
  #page = crypto.getRandomValues(new Uint32Array(2)).join("-");
  #state = "watching";
  #sinceMs = 0; // start of this state
  #drivingSinceMs = null;
  #upSinceMs = null;
  #steppedMs = performance.now();
  #sent = "";
  #sentMs = 0;
  #facts = null;
  #factsMs = 0;
  #stopMs = null; // time of the last press of the stop
  #stopHeld = new Set();
  #confirmed = false; // since that press, the arm was stopped: the same press stops it no second time
  #giveBack = false;
  #resetMs = null; // time of the last press of the reset, until it counts
  #marked = null; // mark whose button of a gamepad is held
  #why = "";

  #shownS;
  #undrawn;

  // shownS(): capture time of the first view's picture, on the robot side's clock; null without one. undrawn(): whether
  // the next facts wait for the browser to draw this page.
  constructor(document, send, shownS = () => null, undrawn = () => false) {
    this.#document = document;
    this.#send = send;
    this.#shownS = shownS;
    this.#undrawn = undrawn;
    this.#panel = new Panel(document, {
      drive: () => (this.#state === "watching" ? this.#begin() : this.#end("You stopped driving.")),
      stop: (held) => this.#stop("pointer", held),
      reset: () => this.#resetNow(),
      giveBack: () => this.#giveBackNow(),
    });
    this.#panel.grip(this.#grips);
    this.#tuning = new Tuning(document, send);
    const view = document.defaultView;
    view.addEventListener("keydown", (event) => this.#keyDown(event), true);
    view.addEventListener("keyup", (event) => this.#keyUp(event), true);
    view.addEventListener("blur", () => this.#left());
    view.addEventListener("pagehide", () => this.#end("The page was left."));
    document.addEventListener("visibilitychange", () => {
      if (document.visibilityState === "hidden") this.#release("The tab was hidden.");
    });
    document.addEventListener("focusin", ({ target }) => {
      if (target.matches?.(EDITS)) this.#release("A field has the focus.");
    });
    setInterval(() => this.#step(), PERIOD_MS);
  }

  show(facts) {
    this.#facts = facts;
    this.#factsMs = performance.now();
    const reached = this.#factsMs - this.#stopMs >= (facts.round_trip_ms ?? 0); // a state from before tells nothing
    this.#confirmed ||= facts.status.state === MotionState.STOPPED && reached;
    if (!this.#hands?.reset_first) this.#resetMs = null;
    this.#agree();
    this.#tuning.show(facts);
    this.#draw();
  }

  leave(why) {
    this.#end(why);
  }

  get #hands() {
    return this.#facts?.page ?? null;
  }

  get #armed() {
    return this.#facts?.status.state === MotionState.ARMED;
  }

  // Whether our inputs move the arm: it is armed, and the operator side lets inputs count (perhaps a little later).
  get #moves() {
    return this.#armed && this.#facts.status.person === Doing.RUNNING;
  }

  #keyDown(event) {
    if (event.code === "Escape") {
      event.preventDefault();
      this.#stop("Escape", true);
      return;
    }
    if (event.target.matches?.(EDITS)) return;
    if (event.ctrlKey || event.altKey || event.metaKey) {
      this.#release("A browser shortcut was pressed."); // the browser may not report its release
      return;
    }
    if (event.code === "KeyX" && !event.repeat) this.#resetNow();
    if (MARK_OF.has(event.code) && !event.repeat) this.#send({ mark: MARK_OF.get(event.code) });
    // Also while watching: a key that is already down when driving begins must come up first.
    if (!this.#keys.press(event.code) || this.#state === "watching") return;
    event.preventDefault(); // keys must not scroll the page, nor Space press a button
    if (!event.repeat) this.#step();
  }

  #keyUp(event) {
    if (event.code === "Escape") this.#stop("Escape", false);
    if (this.#state !== "watching" && event.code === "Space" && !event.target.matches?.(EDITS)) event.preventDefault();
    this.#keys.lift(event.code);
    this.#step();
  }

  // The window has lost the focus. If the scene's frame has it, take it back: another site's keys never reach us.
  #left() {
    this.#release("The page lost the focus.");
    this.#stopHeld.delete("Escape");
    setTimeout(() => {
      const active = this.#document.activeElement;
      if (active?.tagName === "IFRAME") active.blur();
      if (active?.tagName === "IFRAME") this.#document.defaultView.focus();
    });
  }

  #begin() {
    this.#drivingSinceMs = performance.now();
    this.#enter("resting", "");
    this.#panel.focus();
    this.#step();
  }

  #end(why) {
    this.#clear();
    if (this.#state === "watching") return;
    this.#enter("watching", why);
    this.#say(REST);
  }

  // Release all held inputs; a second of rest follows.
  #release(why) {
    this.#clear();
    if (this.#state === "watching") return;
    if (this.#state !== "resting") this.#enter("resting", why);
    this.#upSinceMs = null;
    this.#say(REST);
  }

  #clear() {
    this.#keys.clear();
    this.#grips.clear();
  }

  #enter(state, why) {
    if (state !== "ready") this.#upSinceMs = null;
    this.#state = state;
    this.#sinceMs = performance.now();
    this.#why = why;
    this.#draw();
  }

  #stop(by, held) {
    if (held && !this.#stopHeld.has(by)) {
      this.#stopHeld.add(by);
      this.#stopMs = performance.now();
      this.#confirmed = false;
      this.#resetMs = null;
      this.#release("You pressed the emergency stop.");
      this.#step();
    } else if (!held) this.#stopHeld.delete(by);
  }

  #giveBackNow() {
    this.#end("The scripted person continues.");
    this.#giveBack = true;
    this.#say(REST);
    this.#giveBack = false;
    this.#say(REST);
  }

  #resetNow() {
    if (this.#unconfirmed || !this.#hands?.reset_first) return;
    this.#resetMs = performance.now();
    this.#release("The stop was reset.");
    this.#say(REST);
  }

  // A controller that the operator side reads itself may be a gamepad of this browser, too: it marks once.
  #markNow(mark) {
    const before = this.#marked;
    this.#marked = mark;
    if (mark !== null && mark !== before && this.#hands?.may_drive) this.#send({ mark });
  }

  #within(sinceMs, forMs) {
    return sinceMs !== null && performance.now() - sinceMs < forMs;
  }

  get #unconfirmed() {
    return !this.#confirmed && this.#within(this.#stopMs, STOP_TRIES_MS);
  }

  get #stops() {
    return this.#stopHeld.size > 0 || this.#within(this.#stopMs, STOP_MS) || this.#unconfirmed;
  }

  #step() {
    const nowMs = performance.now();
    const passedMs = nowMs - this.#steppedMs;
    this.#steppedMs = nowMs;
    const pads = readGamepads(this.#facts?.advancing === "L2");
    const there = this.#document.hasFocus();
    this.#stop("gamepad", there && pads.stop);
    if (there && pads.reset) this.#resetNow();
    this.#markNow(there ? pads.mark : null);
    this.#panel.showGamepad(pads, there);
    if (this.#state !== "watching") {
      this.#factsMs = Math.min(nowMs, this.#factsMs + Math.max(0, passedMs - PERIOD_MS)); // facts may have come that this page has not taken yet
      if (passedMs > HELD_UP_MS) this.#release(`This page was late by ${passedMs.toFixed(0)} ms.`);
      const silentMs = nowMs - this.#factsMs;
      const silence = silentMs.toFixed(0);
      if (silentMs > SILENCE_MS) this.#release(this.#undrawn() ? `The browser drew nothing of this page for ${silence} ms.` : `Nothing came from the operator side for ${silence} ms.`);
    }
    const moves = this.#state === "running" && this.#moves;
    const keys = this.#keys.read(passedMs / 1000, moves);
    let hands = both(keys.hands, this.#grips.read());
    if (there) hands = both(hands, pads.hands);
    // Without the focus it is unknown which keys are up.
    this.#follow(hands, there && atRest(hands) && !keys.pressed && !this.#stops, nowMs);
    this.#say(this.#state === "running" ? hands : REST);
    this.#draw();
  }

  #follow(hands, allUp, nowMs) {
    if (this.#state === "resting") {
      this.#upSinceMs = allUp && !this.#hands?.reset_first ? this.#upSinceMs ?? nowMs : null;
      const agreed = this.#hands?.driver === this.#page && this.#facts.status.person === Doing.READY;
      if (allUp && agreed && nowMs - this.#upSinceMs >= REST_MS) this.#enter("ready", "");
    } else if (this.#state === "ready" && !allUp) {
      if (hands.run && !this.#stops) this.#enter("running", "");
      else this.#enter("resting", "Hold-to-run comes first.");
    } else if (this.#state === "running" && (!hands.run || this.#stops)) {
      this.#enter("resting", "Hold-to-run was released.");
    }
  }

  // Follow the operator side where its state differs from ours.
  #agree() {
    const known = this.#hands;
    if (this.#state === "watching" || known === null) return;
    const nowMs = performance.now();
    if (!known.may_drive) this.#end("A real controller drives.");
    else if (known.driver !== null && known.driver !== this.#page && nowMs - this.#drivingSinceMs > AGREES_MS)
      this.#end("Another page drives.");
    else if (this.#facts.status.person === Doing.ALL_KEYS_UP_FIRST && this.#state !== "resting" && nowMs - this.#sinceMs > AGREES_MS) {
      this.#enter("resting", this.#armed ? known.released : "The arm was disarmed or stopped.");
    }
  }

  // Send at once on any change, and 50 times a second while we drive, stop or reset; wire.js numbers it.
  #say(hands) {
    const stop = this.#stops;
    const driving = this.#state !== "watching";
    const reset = !stop && this.#within(this.#resetMs, RESET_TRIES_MS);
    const said = { ...hands, driving, stop, reset, give_back: this.#giveBack };
    const text = JSON.stringify(said);
    const nowMs = performance.now();
    const changed = text !== this.#sent;
    if (!changed && (!(driving || stop || reset) || nowMs - this.#sentMs < PERIOD_MS - 2)) return;
    if (this.#sent === "" && !driving && !stop && !reset && !this.#giveBack) return; // nothing to send yet
    this.#sent = text;
    this.#sentMs = nowMs;
    this.#send({ hands: { page: this.#page, shown_s: this.#shownS(), ...said } });
  }

  #draw() {
    const restMs = this.#upSinceMs === null ? REST_MS : Math.max(0, REST_MS - (performance.now() - this.#upSinceMs));
    this.#panel.show({
      state: this.#state, why: this.#why, restMs, moves: this.#moves, facts: this.#facts, hands: this.#hands,
      mine: this.#hands?.driver === this.#page, level: this.#keys.level,
      stop: this.#stopMs === null ? null
        : { sinceMs: performance.now() - this.#stopMs, goesOn: this.#unconfirmed, confirmed: this.#confirmed },
    });
  }
}
