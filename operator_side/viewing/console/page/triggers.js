// View of one trigger: the strength of each of its ten zones, its present travel, and the strength there.
import { make } from "./make.js";

const ZONES = 10;
export const STRONGEST = 8;

// Strength that a trigger meets, and the strongest up to one zone farther: there a key's pull stops. finger: its place in the
// zones, 0 to 1; null without one.
export function strengths(facts, finger) {
  if (finger === null) return { meets: 0, ahead: 0 };
  const zone = Math.min(Math.floor(ZONES * finger), ZONES - 1);
  return { meets: facts.meets, ahead: Math.max(facts.meets, ...facts.zones.slice(zone, zone + 2)) };
}

export class Trigger {
  #name; #title; #meets; #bars; #finger; #words;

  constructor(place, name) {
    this.#name = name;
    const add = (tag, parent, className = "") => parent.appendChild(make(tag, { className }));
    const head = add("header", place);
    this.#title = add("h2", head);
    this.#meets = add("span", head, "meets");
    const zones = add("div", place, "zones");
    this.#bars = Array.from({ length: ZONES }, () => {
      const zone = add("div", zones);
      return [add("i", zone), add("b", zone)];
    });
    this.#finger = add("span", add("div", place, "travel"));
    this.#words = Array.from({ length: 2 }, () => add("p", place));
  }

  // yields: whether the pull of a key yields to the zones.
  show(facts, finger, advances, yields) {
    this.#title.textContent = advances ? `▲ ${this.#name} advances` : `▼ ${this.#name} retreats`;
    this.#meets.textContent = `meets ${facts.meets} of ${STRONGEST}`;
    facts.zones.forEach((strength, zone) => {
      const [bar, number] = this.#bars[zone];
      bar.style.height = `${(100 * strength) / STRONGEST}%`;
      number.textContent = strength || "";
    });
    this.#finger.textContent = finger === null ? "no finger" : "▲";
    this.#finger.style.left = `${100 * Math.min(Math.max(finger ?? 0.1, 0.02), 0.98)}%`;
    const percent = (value) => (value === null ? "?" : `${Math.round(100 * value)} %`);
    const until = yields ? "yields: a 2 N finger" : `free to ${percent(facts.free)}`;
    this.#words[0].textContent = `pulled ${percent(facts.travel)} · ${until}`;
    this.#words[0].classList.toggle("yields", Boolean(yields));
    const mm = facts.needed_m === null ? null : Math.round(1000 * facts.needed_m);
    const ahead = mm === null ? "?" : `${Math.abs(mm)} mm ${mm < 0 ? "behind" : "ahead"}`;
    const leads = facts.course_stiffness === null ? "?" : Math.round(STRONGEST * facts.course_stiffness);
    this.#words[1].textContent = `D = ${ahead} · course leads to ${leads}`;
  }
}
