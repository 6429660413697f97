// In the camera views: the target's outline and name, a line from the gripper's point down to what lies below, with the height,
// and beside that point an arc for each trigger. Nothing that is written covers the target or its name.
// Below the views: what is near, ahead and held.
import { make } from "./make.js";
import { strengths, STRONGEST } from "./triggers.js";

const EIGHTHS = 8;
const TOUCHED_M = 0.0005;
const SVG = "http://www.w3.org/2000/svg";
const mm = (metres) => (1000 * metres).toFixed(0);
const far = (metres) => (metres === null ? "beyond 3 m" : metres < TOUCHED_M ? "TOUCHED" : `${mm(metres)} mm`);
const SIDES = [["left", "right"], ["down", "up"], ["behind", "ahead"]]; // by the keys that move the gripper there
const GAUGES = { l2: -1, r2: 1 }; // side of the gripper's point on which each trigger's arc stands
const RADII = [0.2, 0.5]; // of these arcs in each view, in half heights of the picture
const ARC_PX = 10; // between an arc and what it stands beside
const [LABEL_PX, PAD_PX, SIGN_PX] = [20, 12, 11]; // height of a label; most width of its padding, and of a character
const UNSEEN = { up: 3, left: 1, ahead: 0, right: 2, down: 4 }; // place in the scene's `unseen` of each side, as laid out
const PLACES = ["nearest", "target", "middle", "height", "ahead", "holding", "rumble", "also"];

const meet = (a, b) => a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;

// Places are in half heights from the picture's centre, right and up.
class Marks {
  #canvas; #outline; #name; #drawing; #line; #foot; #height; #radius; #to;
  #arcs = {};
  #whole = [0, 0]; // width and height of the view in pixels, measured when they change
  #last = null; // what is shown
  #free = []; // boxes in which nothing may be written: the outline, and what is written already

  constructor(place, radius, toRight) {
    this.#canvas = place.querySelector("canvas");
    this.#radius = radius;
    this.#to = toRight ? [1, -1] : [-1, 1]; // sides on which the height may stand, the better one first
    new ResizeObserver(([{ contentRect }]) => {
      this.#whole = [contentRect.width, contentRect.height];
      if (this.#last) this.show(this.#last);
    }).observe(this.#canvas);
    const parent = place.querySelector(".picture");
    this.#name = make("b");
    this.#outline = make("div", { className: "outline", hidden: true }, this.#name);
    const drawn = (tag, inside, kind) => {
      const element = inside.appendChild(document.createElementNS(SVG, tag));
      element.classList.add(kind);
      return element;
    };
    this.#drawing = drawn("svg", parent, "drop");
    this.#line = [drawn("line", this.#drawing, "under"), drawn("line", this.#drawing, "over")];
    this.#foot = drawn("ellipse", this.#drawing, "foot");
    this.#height = make("b", { className: "height", hidden: true });
    parent.append(this.#outline, this.#height);
    for (const side of Object.keys(GAUGES)) {
      const group = drawn("g", this.#drawing, side);
      const words = make("b", { className: `gauge ${side}`, hidden: true });
      this.#arcs[side] = { group, parts: ["under", "ahead", "meets"].map((kind) => drawn("path", group, kind)), words };
      parent.append(words);
    }
  }

  get #size() {
    const [{ width, height }, whole] = [this.#canvas, this.#whole];
    const half = Math.min(whole[1], (whole[0] * height) / width) / 2;
    return { half, wide: (half * width) / height, centre: [whole[0] / 2, whole[1] / 2], whole };
  }

  // Write into the first of these places, upper left corners, that is in the view and covers nothing; return the place.
  #write(element, words, places, whole) {
    const width = PAD_PX + SIGN_PX * words.length;
    if (element.textContent !== words) element.textContent = words;
    const box = places.map(([x, y]) => ({ x: Math.round(x), y: Math.round(y), width, height: LABEL_PX })).find((one) =>
      one.x >= 0 && one.y >= 0 && one.x + width <= whole[0] && one.y + LABEL_PX <= whole[1] && !this.#free.some((other) => meet(one, other)));
    element.hidden = !box;
    if (!box) return null;
    [element.style.left, element.style.top] = [`${box.x}px`, `${box.y}px`];
    this.#free.push(box);
    return box;
  }

  // name: the target's; box: its left, low, right and high edge, null without one. line: the gripper's point, and the place
  // below. felt: strengths of both triggers at the gripper's point `tool`. Return whether any of the target is in the picture.
  show(what) {
    this.#last = what;
    const { name, box, height, line, tool, felt } = what;
    const size = this.#size;
    this.#free = [];
    const sees = this.#showTarget(name, box, size);
    this.#showDrop(height, line, size);
    for (const side of Object.keys(GAUGES)) this.#showArc(side, tool, felt?.[side], size);
    return sees;
  }

  #showTarget(name, box, { half, wide, centre, whole }) {
    const [left, low, right, high] = box?.map((edge) => edge * half) ?? [];
    const sees = Boolean(box) && left < wide && right > -wide && low < half && high > -half;
    this.#outline.hidden = !sees;
    if (!sees) return false;
    const within = (value, most) => Math.max(-most, Math.min(most, value));
    const [x0, x1, y0, y1] = [within(left, wide), within(right, wide), within(high, half), within(low, half)];
    const at = { x: centre[0] + x0, y: centre[1] - y0, width: x1 - x0, height: y0 - y1 };
    for (const [key, pixels] of Object.entries({ left: at.x, top: at.y, width: at.width, height: at.height }))
      this.#outline.style[key] = `${pixels.toFixed(0)}px`;
    const width = PAD_PX + SIGN_PX * name.length;
    const x = Math.max(0, Math.min(at.x, whole[0] - width));
    const beside = [[x, at.y - LABEL_PX], [x, at.y + at.height], [at.x + at.width, at.y], [at.x - width, at.y]];
    const label = this.#write(this.#name, name, [...beside, [x, Math.max(at.y, 0)]], whole);
    if (label) [this.#name.style.left, this.#name.style.top] = [`${label.x - at.x - 2}px`, `${label.y - at.y - 2}px`];
    this.#free.push(at);
    return true;
  }

  #showDrop(height, line, { half, centre, whole }) {
    for (const part of [...this.#line, this.#foot]) part.toggleAttribute("hidden", !line);
    if (!line) {
      this.#height.hidden = true;
      return;
    }
    const [x1, y1, x2, y2] = line.map((value, k) => centre[k % 2] + (k % 2 ? -1 : 1) * value * half);
    const set = (part, values) => Object.entries(values).forEach(([key, value]) => part.setAttribute(key, value.toFixed(1)));
    for (const part of this.#line) set(part, { x1, y1, x2, y2 });
    set(this.#foot, { cx: x2, cy: y2, rx: half / 18, ry: half / 45 });
    const y = Math.max(0, Math.min(y2 - LABEL_PX / 2, centre[1] + half - LABEL_PX - 2));
    const width = PAD_PX + SIGN_PX * height.length;
    const beside = [{ x: x2, width: 0 }, ...this.#free].flatMap((box) => this.#to.map((to) =>
      [to > 0 ? box.x + box.width + 14 : box.x - width - 14, y]));
    this.#write(this.#height, height, [[x2 - width / 2, y2 + half / 45 + 2], ...beside], whole);
  }

  // Return where the middle of an arc round (x, y) must be for it to stand outside the target, as far as the view allows.
  #besideAll(x, y, to, radius, reach, whole) {
    const inner = x + to * reach;
    const arc = { x: Math.min(inner, x + to * radius), y: y - reach, width: radius - reach, height: 2 * reach };
    const shifts = this.#free.filter((box) => meet(arc, box)).map((box) => to * ((to > 0 ? box.x + box.width : box.x) - inner) + ARC_PX);
    const most = (to > 0 ? whole[0] - x : x) - radius - ARC_PX;
    return x + to * Math.max(0, Math.min(most, Math.max(0, ...shifts)));
  }

  // Track in black, up to it the strength that lies ahead, thin, and the strength that the trigger meets, thick.
  #showArc(side, tool, felt, { half, centre, whole }) {
    const { group, parts, words } = this.#arcs[side];
    const shown = tool && felt && felt.ahead > 0;
    group.toggleAttribute("hidden", !shown);
    words.hidden = true;
    if (!shown) return;
    const [to, y, radius] = [GAUGES[side], centre[1] - tool[1] * half, this.#radius * half];
    const reach = radius * Math.SQRT1_2;
    const x = this.#besideAll(centre[0] + tool[0] * half, y, to, radius, reach, whole);
    const path = `M${(x + to * reach).toFixed(1)} ${(y + reach).toFixed(1)}A${radius.toFixed(1)} ${radius.toFixed(1)} 0 0 ${to > 0 ? 0 : 1} ` +
      `${(x + to * reach).toFixed(1)} ${(y - reach).toFixed(1)}`;
    [STRONGEST, felt.ahead, felt.meets].forEach((strength, k) => {
      parts[k].setAttribute("d", path);
      parts[k].setAttribute("pathLength", STRONGEST);
      parts[k].setAttribute("stroke-dasharray", `${strength} ${2 * STRONGEST}`);
      parts[k].toggleAttribute("hidden", strength === 0);
    });
    const said = `${side.toUpperCase()} ${felt.meets} of ${STRONGEST}`;
    const width = PAD_PX + SIGN_PX * said.length;
    const from = to > 0 ? x + radius + 8 : x - radius - 8 - width;
    this.#write(words, said, [[from, y - LABEL_PX / 2], [from, y - reach - LABEL_PX], [from, y + reach]], whole);
  }
}

export class Overlay {
  #marks; #slots; #unseen;
  #shown = new Map();

  // places: the views, the first-person one last. lines: the list below them.
  constructor(places, lines) {
    this.#marks = places.map((place, k) => new Marks(place, RADII[k], k === 0));
    this.#slots = Object.fromEntries(PLACES.map((name) => [name, make("div", { id: `near_${name}` })]));
    this.#unseen = make("div", { id: "near_unseen", hidden: true }, make("span", {}, "unseen, %"),
      ...Object.keys(UNSEEN).map((side) => make("i", { className: side })));
    lines.replaceChildren(...Object.values(this.#slots), this.#unseen);
  }

  // Each figure has its own place, so that none moves when another comes or goes.
  #write(place, rows) {
    const known = rows.filter(Boolean);
    const text = JSON.stringify(known);
    if (this.#shown.get(place) === text) return;
    this.#shown.set(place, text);
    this.#slots[place].title = known.map(([title, words]) => `${title} ${words}`).join(" · ");
    this.#slots[place].replaceChildren(...known.flatMap(([title, words, warns]) => [
      make("dt", {}, title), make("dd", { className: warns ? "warns" : "" }, words),
    ]));
  }

  // Shares of the space on each side of the gripper that no depth camera has seen; null without such cameras.
  #showUnseen(shares) {
    this.#unseen.hidden = !shares;
    const said = Object.entries(UNSEEN).map(([side, k]) => [side, Math.round(100 * (shares?.[k] ?? 0))]);
    const shown = said.map(([side, part]) => `${side} ${part} %`).join(", ");
    if (this.#shown.get("unseen") === shown) return;
    this.#shown.set("unseen", shown);
    this.#unseen.title = `Space that no depth camera has seen: ${shown}`;
    for (const [side, part] of said) {
      const place = this.#unseen.querySelector(`.${side}`);
      place.textContent = part;
      place.style.setProperty("--part", `${part}%`);
    }
  }

  // fingers: place of each trigger's finger in its zones, 0 to 1; null without one.
  show(scene, facts, fingers) {
    const { near, drop } = scene;
    if (!near || !facts) return;
    this.#showUnseen(scene.unseen);
    const felt = Object.fromEntries(Object.keys(GAUGES).map((side, k) => [side, strengths(facts[side], fingers[k])]));
    const seen = this.#marks.map((marks, k) => marks.show({
      name: scene.target?.name, box: scene.target?.boxes[k] ?? null, height: drop && `${mm(drop.height_m)} mm`,
      line: drop?.lines[k] ?? null, tool: scene.tool?.[k] ?? null, felt,
    }));
    const { target, stands, speed_scale: speed, stick_frame: frame, hindrance } = facts.status;
    const column = facts.advancing === "R2" ? 1 : 0;
    const most = [...scene.objects].sort((a, b) => b.overlap_mm3[column] - a.overlap_mm3[column])[0];
    const rumble = Math.ceil(EIGHTHS * facts.rumble);
    const touched = near.nearest_m !== null && near.nearest_m < TOUCHED_M;
    const way = scene.target?.way_m.map((metres, k) => `${mm(Math.abs(metres))} ${SIDES[k][Number(metres > 0)]}`).join(", ");
    const aims = target && target !== near.held;
    const rows = {
      nearest: [!(aims && near.nearest === target) && ["nearest", near.nearest === null ? "nothing" : `${near.nearest} ${far(near.nearest_m)}`, touched]],
      target: [aims && ["target", `${target} ${far(near.target_m)}${seen.at(-1) ? "" : ", unseen"}`, touched && near.nearest === target]],
      middle: [aims && way && ["middle", way]],
      height: [drop && ["height", `${mm(drop.height_m)} mm over ${drop.name}`]],
      ahead: [most?.overlap_mm3[column] > 0 && ["ahead", most.name, true]],
      holding: [near.held !== null && ["holding", near.held + (stands ? ", it stands" : "")]],
      rumble: [
        hindrance && ["arm", hindrance, true],
        rumble > 0 && ["rumble", `${rumble} of ${EIGHTHS}, where the stick leads`, true],
      ],
      also: [
        speed < 1 && ["speed", `${(100 * speed).toFixed(0)} %`],
        frame !== "tool" && ["sticks", `as the ${frame} sees it`],
      ],
    };
    for (const place of PLACES) this.#write(place, rows[place]);
  }
}
