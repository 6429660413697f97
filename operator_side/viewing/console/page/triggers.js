// One trigger: how stiff each tenth of its travel is, where the finger is, and what that meets.
const ZONES = 10;
const STRONGEST = 8;

export class Trigger {
  #name; #title; #meets; #bars; #finger; #words;

  constructor(place, name) {
    this.#name = name;
    const make = (tag, parent, kind = "") => Object.assign(parent.appendChild(document.createElement(tag)), { className: kind });
    const head = make("header", place);
    this.#title = make("h2", head);
    this.#meets = make("span", head, "meets");
    const zones = make("div", place, "zones");
    this.#bars = Array.from({ length: ZONES }, () => {
      const zone = make("div", zones);
      return [make("i", zone), make("b", zone)];
    });
    this.#finger = make("span", make("div", place, "travel"));
    this.#words = Array.from({ length: 2 }, () => make("p", place));
  }

  show(facts, finger, advances) {
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
    this.#words[0].textContent = `pulled ${percent(facts.travel)} · free to ${percent(facts.free)}`;
    const ahead = facts.needed_m === null ? "?" : `${Math.round(1000 * facts.needed_m) + 0} mm`; // no -0
    const stiffness = facts.stiffness === null ? "?" : facts.stiffness.toFixed(2);
    this.#words[1].textContent = `felt D = ${ahead} ahead · stiffness s(δ) ${stiffness}`;
  }
}
