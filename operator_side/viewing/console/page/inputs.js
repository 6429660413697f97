// Inputs of this page: keys, by their position on the keyboard, whatever its layout; pointers; gamepads in the standard
// mapping.

export const KEYS = [
  // action, codes of its keys, label
  ["run", ["Space"], "hold to run (arms, too)"],
  ["advance", ["KeyW", "ArrowUp"], "advance"],
  ["retreat", ["KeyS", "ArrowDown"], "retreat"],
  ["left", ["KeyA"], "across: left"],
  ["right", ["KeyD"], "right"],
  ["up", ["KeyR"], "up"],
  ["down", ["KeyF"], "down"],
  ["turn_left", ["KeyQ", "ArrowLeft"], "turn: left"],
  ["turn_right", ["KeyE", "ArrowRight"], "right"],
  ["turn_up", ["KeyI"], "up"],
  ["turn_down", ["KeyK"], "down"],
  ["close", ["KeyC"], "close the gripper"],
  ["open", ["KeyO"], "open it"],
  ["next_target", ["KeyT"], "next target"],
  ["next_speed", ["KeyV"], "speed scale: 100, 50, 25 %"],
  ["next_frame", ["KeyG"], "frame of the sticks: tool, base, camera"],
  ["home", ["KeyP"], "go home while held (all else at rest)"],
  ["hand_over", ["KeyH"], "hand the robot over"],
];
export const MARKS = [
  // mark, codes of its keys, label, button of a gamepad: directional pad and right stick, as on a DualSense
  ["start", ["KeyN"], "episode: start", 12],
  ["success", ["KeyY"], "success", 15],
  ["failure", ["KeyM"], "failure", 14],
  ["discard", ["KeyU"], "discard", 13],
  ["reset", ["KeyB"], "put the scene back", 11],
];
export const MARK_OF = new Map(MARKS.flatMap(([mark, codes]) => codes.map((code) => [code, mark])));
const DOES = new Map(KEYS.flatMap(([does, codes]) => codes.map((code) => [code, does])));
const WORDS = { Space: "Space", ArrowUp: "↑", ArrowDown: "↓", ArrowLeft: "←", ArrowRight: "→" };
const LEVEL = /^(?:Digit|Numpad)([1-9])$/;
const RAMP_S = 0.6;
const PULLED = 0.05; // dead zone of a gamepad's trigger
const DEFLECTED = 0.12; // dead zone of a gamepad's sticks

export const REST = Object.freeze({
  run: false, l2: 0, r2: 0, keyed: false, lateral: [0, 0], turning: [0, 0], gripper: 0, next_target: false,
  next_speed: false, next_frame: false, home: false, hand_over: false,
});

export const atRest = (hands) =>
  !hands.run && hands.l2 === 0 && hands.r2 === 0 && hands.gripper === 0 && !hands.next_target && !hands.next_speed &&
  !hands.next_frame && !hands.home && !hands.hand_over &&
  [...hands.lateral, ...hands.turning].every((part) => part === 0);

// Keys that are down, and the travel of each action, which rises over RAMP_S and falls to zero at once.
export class Keys {
  level = 4; // travel that a held key reaches, in ninths
  #down = new Set();
  #ways = new Map();

  press(code) {
    const digit = LEVEL.exec(code);
    if (digit) this.level = Number(digit[1]);
    else if (DOES.has(code)) this.#down.add(code);
    else return false;
    return true;
  }

  lift(code) {
    this.#down.delete(code);
  }

  clear() {
    this.#down.clear();
    this.#ways.clear();
  }

  // moves: whether inputs move the arm now; travels grow only then. Held keys count as pressed in any case.
  read(passed_s, moves) {
    const held = new Set([...this.#down].map((code) => DOES.get(code)));
    const most = this.level / 9;
    const way = (does, against) => {
      const before = this.#ways.get(does) ?? 0;
      const now = !held.has(does) || held.has(against) || !moves ? 0 : Math.min(most, before + (most * passed_s) / RAMP_S);
      this.#ways.set(does, now);
      return now;
    };
    const axis = (plus, minus) => way(plus, minus) - way(minus, plus);
    const hands = {
      keyed: true,
      run: held.has("run"),
      r2: way("advance", "retreat"),
      l2: way("retreat", "advance"),
      lateral: [axis("right", "left"), axis("up", "down")],
      turning: [axis("turn_right", "turn_left"), axis("turn_up", "turn_down")],
      gripper: Number(held.has("close")) - Number(held.has("open")),
      next_target: held.has("next_target"),
      next_speed: held.has("next_speed"),
      next_frame: held.has("next_frame"),
      home: held.has("home"),
      hand_over: held.has("hand_over"),
    };
    return { hands, pressed: held.size > 0 };
  }
}

export async function keyWords() {
  // The key's label on this keyboard if the browser knows the layout, else its label on a US keyboard.
  const layout = await navigator.keyboard?.getLayoutMap?.().catch(() => null);
  return (code) => WORDS[code] ?? (layout?.get(code) ?? code.replace("Key", "")).toUpperCase();
}

const beyond = (value, dead) => Math.max(0, Math.min(1, (value - dead) / (1 - dead)));

function stick(x, y) {
  const length = Math.hypot(x, y);
  const part = length ? beyond(length, DEFLECTED) / length : 0;
  return [x * part + 0, -y * part + 0]; // a gamepad's y points down
}

// swapped: exchange left and right, as --swap-sides does for a controller.
export function readGamepads(swapped) {
  const found = [...(navigator.getGamepads?.() ?? [])].filter((pad) => pad?.connected);
  const known = found.filter((pad) => pad.mapping === "standard");
  let hands = REST, stop = false, reset = false, mark = null;
  for (const pad of known) {
    const value = (number) => pad.buttons[number]?.value ?? 0;
    const pressed = (number) => pad.buttons[number]?.pressed ?? false;
    const [left, right] = [beyond(value(6), PULLED), beyond(value(7), PULLED)];
    const sticks = [stick(pad.axes[0] ?? 0, pad.axes[1] ?? 0), stick(pad.axes[2] ?? 0, pad.axes[3] ?? 0)];
    if (swapped) sticks.reverse();
    stop ||= pressed(1);
    reset ||= pressed(9);
    mark ??= MARKS.find(([, , , button]) => pressed(button))?.[0] ?? null;
    hands = both(hands, {
      keyed: false,
      run: pressed(swapped ? 5 : 4),
      l2: swapped ? right : left,
      r2: swapped ? left : right,
      lateral: sticks[0],
      turning: sticks[1],
      gripper: Number(pressed(0)) - Number(pressed(2)),
      next_target: pressed(3),
      next_speed: pressed(10),
      next_frame: pressed(17),
      home: false,
      hand_over: pressed(8),
    });
  }
  return { hands, stop, reset, mark: stop ? null : mark, name: known[0]?.id ?? null, unknown: known.length ? null : found[0]?.id ?? null };
}

// Merge two sets of inputs: the larger value of each input.
export function both(one, other) {
  const farther = (a, b) => (Math.hypot(...a) >= Math.hypot(...b) ? a : b);
  return {
    run: one.run || other.run,
    l2: Math.max(one.l2, other.l2),
    r2: Math.max(one.r2, other.r2),
    keyed: Math.max(one.l2, one.r2) >= Math.max(other.l2, other.r2) ? one.keyed : other.keyed,
    lateral: farther(one.lateral, other.lateral),
    turning: farther(one.turning, other.turning),
    gripper: Math.sign(one.gripper + other.gripper),
    next_target: one.next_target || other.next_target,
    next_speed: one.next_speed || other.next_speed,
    next_frame: one.next_frame || other.next_frame,
    home: one.home || other.home,
    hand_over: one.hand_over || other.hand_over,
  };
}

// Elements held with a pointer. Each counts as hold-to-run, too; its value grows with the distance from the press.
export class Grips {
  #held = new Map();

  constructor(changed) {
    this.changed = changed;
  }

  // says(right, up): returns the inputs for a pointer moved right and up by these shares of `reach` pixels.
  add(element, says, reach = 90) {
    const share = (pixels) => Math.max(-1, Math.min(1, pixels / reach));
    element.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      element.setPointerCapture(event.pointerId);
      this.#held.set(event.pointerId, { element, says, from: [event.clientX, event.clientY], hands: says(0, 0) });
      element.dataset.held = "";
      this.changed();
    });
    element.addEventListener("pointermove", (event) => {
      const grip = this.#held.get(event.pointerId);
      if (grip?.element !== element) return;
      grip.hands = says(share(event.clientX - grip.from[0]), share(grip.from[1] - event.clientY));
      this.changed();
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"])
      element.addEventListener(end, (event) => this.#lift(event.pointerId));
  }

  #lift(pointer) {
    const grip = this.#held.get(pointer);
    if (!grip) return;
    this.#held.delete(pointer);
    delete grip.element.dataset.held;
    this.changed();
  }

  clear() {
    for (const pointer of [...this.#held.keys()]) this.#lift(pointer);
  }

  read() {
    return [...this.#held.values()].reduce((hands, grip) => both(hands, { ...REST, run: true, ...grip.hands }), REST);
  }
}
