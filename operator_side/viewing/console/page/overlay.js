// Beside the gripper in the first-person view: what is near, ahead and held; and the target's outline.
import { make } from "./make.js";

const EIGHTHS = 8;
const TOUCHED_M = 0.0005;
const far = (metres) => (metres === null ? "beyond 3 m" : metres < TOUCHED_M ? "TOUCHED" : `${(1000 * metres).toFixed(0)} mm`);

export class Overlay {
  #canvas; #outline; #name; #lines;
  #shown = "";

  constructor(place) {
    this.#canvas = place.querySelector("canvas");
    this.#name = make("b");
    this.#outline = make("div", { className: "outline", hidden: true }, this.#name);
    this.#lines = make("dl", { className: "near", hidden: true });
    place.append(this.#outline, this.#lines);
  }

  show(scene, facts) {
    const { near } = scene;
    if (!near || !facts) return;
    const sees = this.#showOutline(scene.target);
    const { target } = facts.status;
    const column = facts.advancing === "R2" ? 1 : 0;
    const most = [...scene.objects].sort((a, b) => b.overlap_mm3[column] - a.overlap_mm3[column])[0];
    const rumble = Math.ceil(EIGHTHS * facts.rumble);
    const touched = near.nearest_m !== null && near.nearest_m < TOUCHED_M;
    const rows = [
      ["nearest", near.nearest === null ? "nothing" : `${near.nearest} ${far(near.nearest_m)}`, touched],
      target && target !== near.held && ["target", `${target} ${far(near.target_m)}${sees ? "" : ", out of view"}`],
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

  // Return whether any of the target is in the picture. box: in half heights from the centre.
  #showOutline(target) {
    const { width, height, clientWidth, clientHeight } = this.#canvas;
    const half = Math.min(clientHeight, (clientWidth * height) / width) / 2;
    const wide = (half * width) / height;
    const [left, low, right, high] = target?.box.map((edge) => edge * half) ?? [];
    const sees = Boolean(target) && left < wide && right > -wide && low < half && high > -half;
    this.#outline.hidden = !sees;
    if (!sees) return false;
    const within = (value, most) => Math.max(-most, Math.min(most, value));
    const [x0, x1, y0, y1] = [within(left, wide), within(right, wide), within(high, half), within(low, half)];
    const style = { left: clientWidth / 2 + x0, top: clientHeight / 2 - y0, width: x1 - x0, height: y0 - y1 };
    for (const [name, pixels] of Object.entries(style)) this.#outline.style[name] = `${pixels.toFixed(0)}px`;
    if (this.#name.textContent !== target.name) this.#name.textContent = target.name;
    return true;
  }
}
