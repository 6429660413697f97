// In the camera views: the target's outline, and a line from the gripper's point down to what lies below, with the height.
// Beside the gripper in the first-person view: what is near, ahead and held.
import { make } from "./make.js";

const EIGHTHS = 8;
const TOUCHED_M = 0.0005;
const SVG = "http://www.w3.org/2000/svg";
const mm = (metres) => (1000 * metres).toFixed(0);
const far = (metres) => (metres === null ? "beyond 3 m" : metres < TOUCHED_M ? "TOUCHED" : `${mm(metres)} mm`);
const SIDES = [["left", "right"], ["down", "up"], ["behind", "ahead"]]; // by the keys that move the gripper there

// Places are in half heights from the picture's centre, right and up.
class Marks {
  #canvas; #outline; #name; #drop; #line; #foot; #height;

  constructor(place) {
    this.#canvas = place.querySelector("canvas");
    this.#name = make("b");
    this.#outline = make("div", { className: "outline", hidden: true }, this.#name);
    const drawn = (tag, parent) => parent.appendChild(document.createElementNS(SVG, tag));
    this.#drop = drawn("svg", place);
    this.#drop.classList.add("drop");
    this.#line = [drawn("line", this.#drop), drawn("line", this.#drop)];
    this.#line[0].classList.add("under");
    this.#foot = drawn("ellipse", this.#drop);
    this.#height = make("b", { className: "height", hidden: true });
    place.append(this.#outline, this.#height);
  }

  get #half() {
    const { width, height, clientWidth, clientHeight } = this.#canvas;
    const half = Math.min(clientHeight, (clientWidth * height) / width) / 2;
    return { half, wide: (half * width) / height, centre: [clientWidth / 2, clientHeight / 2] };
  }

  // Return whether any of the target is in the picture. box: left, low, right and high edge; null without one.
  outline(name, box) {
    const { half, wide, centre } = this.#half;
    const [left, low, right, high] = box?.map((edge) => edge * half) ?? [];
    const sees = Boolean(box) && left < wide && right > -wide && low < half && high > -half;
    this.#outline.hidden = !sees;
    if (!sees) return false;
    const within = (value, most) => Math.max(-most, Math.min(most, value));
    const [x0, x1, y0, y1] = [within(left, wide), within(right, wide), within(high, half), within(low, half)];
    const style = { left: centre[0] + x0, top: centre[1] - y0, width: x1 - x0, height: y0 - y1 };
    for (const [key, pixels] of Object.entries(style)) this.#outline.style[key] = `${pixels.toFixed(0)}px`;
    if (this.#name.textContent !== name) this.#name.textContent = name;
    return true;
  }

  // line: the gripper's point, and the place below; null without one.
  drop(height, line) {
    this.#drop.toggleAttribute("hidden", !line);
    this.#height.hidden = !line;
    if (!line) return;
    const { half, centre } = this.#half;
    const [x1, y1, x2, y2] = line.map((value, k) => (centre[k % 2] + (k % 2 ? -1 : 1) * value * half).toFixed(1));
    for (const part of this.#line) for (const [key, value] of Object.entries({ x1, y1, x2, y2 })) part.setAttribute(key, value);
    for (const [key, value] of Object.entries({ cx: x2, cy: y2, rx: half / 18, ry: half / 45 })) this.#foot.setAttribute(key, value);
    this.#height.style.left = `${x2}px`;
    this.#height.style.top = `${Math.min(Number(y2), centre[1] + half - 24)}px`;
    if (this.#height.textContent !== height) this.#height.textContent = height;
  }
}

export class Overlay {
  #marks; #lines;
  #shown = "";

  // places: the views, the first-person one last.
  constructor(places) {
    this.#marks = places.map((place) => new Marks(place));
    this.#lines = make("dl", { className: "near", hidden: true });
    places.at(-1).append(this.#lines);
  }

  show(scene, facts) {
    const { near, drop } = scene;
    if (!near || !facts) return;
    const seen = this.#marks.map((marks, k) => marks.outline(scene.target?.name, scene.target?.boxes[k] ?? null));
    this.#marks.forEach((marks, k) => marks.drop(drop && `${mm(drop.height_m)} mm`, drop?.lines[k] ?? null));
    const { target } = facts.status;
    const column = facts.advancing === "R2" ? 1 : 0;
    const most = [...scene.objects].sort((a, b) => b.overlap_mm3[column] - a.overlap_mm3[column])[0];
    const rumble = Math.ceil(EIGHTHS * facts.rumble);
    const touched = near.nearest_m !== null && near.nearest_m < TOUCHED_M;
    const way = scene.target?.way_m.map((metres, k) => `${mm(Math.abs(metres))} ${SIDES[k][Number(metres > 0)]}`).join(", ");
    const aims = target && target !== near.held;
    const rows = [
      !(aims && near.nearest === target) && ["nearest", near.nearest === null ? "nothing" : `${near.nearest} ${far(near.nearest_m)}`, touched],
      aims && ["target", `${target} ${far(near.target_m)}${seen.at(-1) ? "" : ", out of view"}`, touched && near.nearest === target],
      aims && way && ["middle", way],
      drop && ["height", `${mm(drop.height_m)} mm over ${drop.name}`],
      most?.overlap_mm3[column] > 0 && ["ahead", most.name, true],
      near.held !== null && ["holding", near.held + (facts.status.stands ? ", it stands" : "")],
      facts.status.speed_scale < 1 && ["speed", `${(100 * facts.status.speed_scale).toFixed(0)} %`],
      facts.status.stick_frame !== "tool" && ["sticks", `as the ${facts.status.stick_frame} sees it`],
      facts.status.hindrance && ["arm", facts.status.hindrance, true],
      rumble > 0 && ["rumble", `${rumble} of ${EIGHTHS}: near where the stick leads`, true],
    ].filter(Boolean);
    const text = JSON.stringify(rows);
    if (text === this.#shown) return;
    this.#shown = text;
    this.#lines.hidden = false;
    this.#lines.replaceChildren(...rows.flatMap(([title, words, warns]) => [
      make("dt", {}, title), make("dd", { className: warns ? "warns" : "" }, words),
    ]));
  }
}
