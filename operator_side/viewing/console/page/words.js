// Codes in words: the only place of the page that makes sentences of them.
import { LinkState, Phase } from "./names.js";

export const WORDS = Object.freeze({
  none: "none",
  nothing: "nothing",
  person: "scripted person",
  recorded: "RECORDED",
  replay: "replay",
  robotAlone: "the robot side alone · replay",
});

export const words = (code) => code?.replaceAll("_", " ");

export function linkWords(status) {
  if (status.link === LinkState.WAITING) return "waiting for the robot side";
  if (status.link === LinkState.OBSERVING) return `observing (${status.place} of ${status.waiting} waiting)`;
  return words(status.link);
}

export function phaseWords({ phase, doing }, status) {
  return phase === Phase.WAITING || phase === Phase.OBSERVING ? linkWords(status) : words(doing ?? phase);
}

export function reasonWords({ phase, reason }) {
  return phase === Phase.LINK_LOST ? reason ?? "nothing heard from the robot" : reason;
}

export function holdingWords({ holding, stands }) {
  if (holding === null) return null;
  return !holding ? WORDS.nothing : stands ? "something, it stands" : "something";
}
