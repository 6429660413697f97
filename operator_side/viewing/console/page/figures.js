// Figures in the bar: link, target, lease, what is held, whose hands count, and what the link carries.
import { make } from "./make.js";
import { LinkState } from "./names.js";

const FIGURES = {
  // id of the element, and title
  link: "Link",
  target: "Target",
  lease: "Lease",
  holding: "Holding",
  whose: "Hands",
  pictures: "Pictures",
  delay: "Delay there / back",
  rate: "Rate / queue / lost",
};
const LATE_MS = 200;
const QUEUED_MS = 50;

export function makeFigures(place) {
  for (const [id, title] of Object.entries(FIGURES)) {
    place.append(make("div", {}, make("dt", {}, title), make("dd", { id }, "–")));
  }
}

export function text(id, value, bad = false) {
  const place = document.getElementById(id);
  const shown = value ?? "–";
  if (place.textContent !== shown) place.textContent = shown;
  place.classList.toggle("bad", bad);
  if (place.tagName === "DD") place.title = shown;
}

// said: words of the console for the facts.
export function showFigures(facts, said) {
  const { status } = facts;
  text("link", said.link, status.link !== LinkState.UP);
  text("lease", said.lease);
  text("whose", said.whose);
  text("target", status.target ?? "none");
  text("holding", said.holding);
  const ms = (value) => (value === null ? "?" : value.toFixed(value < 10 ? 1 : 0));
  text("delay", `${ms(facts.to_robot.mean_ms)} / ${ms(facts.to_operator.mean_ms)} ms`, facts.field_age_ms > LATE_MS);
  showLink(status, facts.page?.fewer);
}

// Show rate and queueing delay as measured by the robot side, lost packets, and streams that are held back.
function showLink(status, because) {
  const figure = (value, digits = 0) => (value == null ? "?" : value.toFixed(digits));
  const rate = status.rate_kbit_s == null ? "?" : `${figure(status.rate_kbit_s / 1000, 1)} Mbit/s`;
  const queued = status.queue_ms > QUEUED_MS;
  text("rate", `${rate} / ${figure(status.queue_ms)} ms / ${figure(status.lost_percent, 1)} %`, queued);
  const held = status.held_back ? `; held back: ${status.held_back}` : "";
  const late = because ? `; fewer, as ${because}` : "";
  text("pictures", `${held ? "held back; " : late ? "fewer; " : ""}${status.pictures ?? "?"}`, Boolean(held || late));
  document.getElementById("pictures").title = `${status.pictures ?? "?"}${held}${late}`;
}
