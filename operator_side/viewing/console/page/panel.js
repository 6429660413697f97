// Panel for driving: its texts, buttons and elements to hold.
import { KEYS, keyWords, MARKS } from "./inputs.js";
import { make } from "./make.js";
import { SOUND_KEY } from "./sound.js";
import { Doing, InputSource, LinkState, MotionState, SessionState } from "./names.js";

const FULL = "Travel of keys: 1 to 9";
const YIELDS = "Stiff zones stop the pull of keys, as they stop a finger of 2 N";

export class Panel {
  #document;
  #section;
  #places = {};
  #shown = new Map();

  constructor(document, { drive, stop, reset, giveBack }) {
    this.#document = document;
    const place = (name, element) => (this.#places[name] = element);
    this.#section = document.getElementById("hands");
    const stopButton = place("stop", make("button", { type: "button", id: "stop", title: "Esc" }, "STOP", make("small", {}, " Esc")));
    const resetButton = place("reset", make("button", { type: "button", id: "reset", onclick: reset, hidden: true },
      "RESET", make("small", {}, " X")));
    stopButton.addEventListener("pointerdown", () => stop(true));
    for (const end of ["pointerup", "pointercancel", "pointerleave"]) stopButton.addEventListener(end, () => stop(false));
    stopButton.addEventListener("click", () => (stop(true), stop(false)));
    const held = (name, text, label) => {
      const element = make("div", { className: "grip", id: `grip_${name}` }, text);
      element.setAttribute("role", "img");
      element.setAttribute("aria-label", label);
      return place(name, element);
    };
    const keys = place("keys", make("dl"));
    document.getElementById("stopping").replaceChildren(stopButton, resetButton);
    document.getElementById("driving").replaceChildren(
      place("drive", make("button", { type: "button", id: "drive", onclick: drive }, "Drive from here")),
      place("giveBack", make("button", { type: "button", id: "give_back", onclick: giveBack, hidden: true,
        title: "The scripted person goes on" }, "Hand back")),
      make("div", { className: "words" },
        place("stopped", make("p", { id: "hands_stopped", role: "alert" })),
        place("state", make("p", { id: "hands_state", tabIndex: -1, role: "status" })),
        place("rest", make("p", { id: "hands_rest" }))));
    this.#section.replaceChildren(
      make("h2", {}, "Hands"),
      place("level", make("p", { id: "hands_level" })),
      make("div", { className: "grips" },
        held("run", "hold to run", "Hold to run, with the pointer"),
        held("advance", "advance ↑", "Hold and drag up to advance"),
        held("retreat", "retreat ↓", "Hold and drag down to retreat"),
        held("across", "across ✥", "Hold and drag to move across"),
        held("turn", "turn ↻", "Hold and drag to turn"),
        held("close", "close", "Hold to close the gripper"),
        held("open", "open", "Hold to open the gripper"),
        held("next", "next target", "Hold to choose the next target")),
      place("pad", make("p", { id: "hands_gamepad" })),
      make("details", {}, make("summary", {}, "Keys"), keys));
    keyWords().then((word) => {
      keys.replaceChildren(...[...KEYS, ...MARKS].flatMap(([, codes, does]) => [
        make("dt", {}, ...codes.flatMap((code, k) => [k ? " or " : "", make("kbd", {}, word(code))])), make("dd", {}, does),
      ]), make("dt", {}, make("kbd", {}, "1"), " … ", make("kbd", {}, "9")), make("dd", {}, `travel of keys. ${YIELDS}`),
      make("dt", {}, make("kbd", {}, "Esc")), make("dd", {}, "emergency stop, for any driver"),
      make("dt", {}, make("kbd", {}, word("KeyX"))), make("dd", {}, "reset a stop"),
      make("dt", {}, make("kbd", {}, word(SOUND_KEY))), make("dd", {}, "sound on or off"));
    });
  }

  grip(grips) {
    const part = (value) => Math.max(0, value);
    grips.add(this.#places.run, () => ({}));
    grips.add(this.#places.advance, (right, up) => ({ r2: part(up) }));
    grips.add(this.#places.retreat, (right, up) => ({ l2: part(-up) }));
    grips.add(this.#places.across, (right, up) => ({ lateral: [right, up] }), 60);
    grips.add(this.#places.turn, (right, up) => ({ turning: [right, up] }), 60);
    grips.add(this.#places.close, () => ({ gripper: 1 }));
    grips.add(this.#places.open, () => ({ gripper: -1 }));
    grips.add(this.#places.next, () => ({ next_target: true }));
  }

  focus() {
    this.#places.state.focus({ preventScroll: true });
    this.#document.getElementById("overview")?.scrollIntoView({ block: "nearest" }); // in a small window
  }

  #text(name, text) {
    if (this.#shown.get(name) === text) return;
    this.#shown.set(name, text);
    this.#places[name].textContent = text;
    this.#places[name].hidden = text === "";
  }

  showGamepad({ name, unknown }, there) {
    if (unknown) this.#text("pad", `Gamepad not used, as its mapping is unknown: ${unknown}`);
    else this.#text("pad", name ? `Gamepad: ${name}${there ? "" : " (unused: the page has no focus)"}` : "");
  }

  show({ state, why, restMs, moves, facts, hands, mine, level, stop }) {
    const { drive, reset, giveBack } = this.#places;
    for (const id of ["hands", "driving"]) this.#document.getElementById(id).dataset.state = state;
    const cannot = hands === null ? "No robot to drive yet."
      : !hands.may_drive ? "A real controller drives here; this page can stop the robot."
      : facts.status.owner === SessionState.OBSERVING ? "Another operator owns the robot; this one observes."
      : facts.status.link !== LinkState.UP ? "The robot is not heard: nothing can be driven." : "";
    const taken = hands?.driver && !mine && state === "watching" ? "Another page drives." : "";
    const words = state === "watching" ? "Drive from here" : "Stop driving";
    if (drive.textContent !== words) drive.textContent = words;
    drive.disabled = state === "watching" && (hands === null || !hands.may_drive || taken !== "");
    const may = mine || !hands?.driver; // nobody resets or hands back for another page
    reset.hidden = !(hands?.reset_first && may && !stop?.goesOn);
    giveBack.hidden = !(hands?.person && facts.hands === InputSource.BROWSER && may && !hands.reset_first);
    this.#text("state", {
      watching: [why, taken, cannot || (taken ? "" : "You are watching.")].filter(Boolean).join(" "),
      resting: [why, cannot || (hands?.reset_first ? "Reset the stop first." : "Release all keys for a second.")].filter(Boolean).join(" "),
      ready: cannot || "Ready: hold Space to arm and run.",
      running: hands?.counts < 1 ? `Your keys fade: ${hands.because}.` : moves ? "You drive." : facts?.status.person === Doing.AT_REST_FIRST ? "Release all but hold-to-run." : "Arming: keep holding.",
    }[state]);
    this.#text("rest", state === "resting" && !hands?.reset_first ? `still ${(restMs / 1000).toFixed(1)} s` : "");
    this.#text("level", state === "watching" ? "" : `${FULL}; now ${level}. ${YIELDS}.`);
    this.#text("stopped", this.#aboutStop(stop, facts, hands));
  }

  #aboutStop(stop, facts, hands) {
    if (facts?.status.state === MotionState.STOPPED) {
      return hands?.reset_first ? "STOPPED: X resets."
        : hands?.may_drive ? "The stop was reset: hold Space to arm." : "STOPPED. The controller arms again.";
    }
    if (stop === null || stop.confirmed) return "";
    if (facts?.status.owner === SessionState.OBSERVING) return "Only the owner can stop the robot: this operator observes.";
    if (stop.goesOn) return "Stop sent; the robot side has not confirmed it yet.";
    return stop.sinceMs < 10_000 ? "THE STOP WAS NOT CONFIRMED by the robot side." : "";
  }
}
