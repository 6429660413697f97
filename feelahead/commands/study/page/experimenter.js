// Page of the experimenter: who is here, what comes next, and what can be done about it. It never knows the condition.
import { byId, connect, make, minutes, write } from "./shared.js";

const NEXT = { enrol: ["enrolled", "Give the number"], consent: ["consented", "Consent is signed"], practice: ["begun", "Begin practice"],
  trial: ["begun", "Begin trial"], pause: ["resumed", "Resume"] };
const PHASES = { starting: "Both sides start.", stopping: "The sides are being stopped.", saving: "The end is being written down.",
  "not heard": "The robot side is not heard." };
let state = null;
let chosen = false; // whether a number was typed

const say = connect((newest) => {
  state = newest;
  show();
});

function stepWords({ step, number, of, attempt, rest_left_s: left }) {
  const again = attempt > 1 ? `, attempt ${attempt}` : "";
  return {
    choose: "Take a participant by number.", enrol: "Give the participant the number.", consent: "Explain the study, and let them sign.",
    practice: `Practice ${number}${of ? `, at most ${of}` : ""}${again}`, trial: `Trial ${number}${of ? ` of ${of}` : ""}${again}`,
    questions: "The participant answers the questions.", rest: left ? `Rest: ${minutes(left)} left` : "Rest is over: the participant goes on.",
    pause: "Paused", done: "All done. Thank the participant.", withdrawn: "The participant has withdrawn.",
  }[step];
}

function phaseWords({ phase, step, running_s: since, limit_s: limit, ready }) {
  if (phase === "up") return since === null ? "Waiting until the participant arms the arm." : `Runs for ${since.toFixed(0)} s of ${limit.toFixed(0)} s.`;
  if (phase) return PHASES[phase];
  return step === "trial" || step === "practice" ? (ready ? "The participant is ready." : "The participant is not ready yet.") : "";
}

function show() {
  const { step, phase, may_repeat: repeat, open } = state;
  const here = step !== "choose", gone = step === "done" || step === "withdrawn" || !here;
  write("study", state.study);
  write("trouble", state.trouble ? `Not written yet: ${state.trouble}. Make room; it is tried again by itself.` : "");
  write("who", here ? `Participant ${state.participant}` : "Nobody is here");
  write("step", stepWords(state));
  write("phase", phaseWords(state));
  const next = NEXT[step];
  byId("next").hidden = !next;
  if (next) byId("next").textContent = next[1];
  byId("next").disabled = phase !== null;
  byId("end").hidden = byId("at_once").parentElement.hidden = gone;
  byId("end").disabled = !["starting", "up", "not heard"].includes(phase);
  byId("pause").hidden = gone || step === "enrol" || step === "pause";
  byId("pause").textContent = state.paused ? "Pause comes after this trial" : "Pause";
  byId("pause").disabled = Boolean(state.paused);
  byId("at_once").checked = state.at_once;
  byId("fault").hidden = !here || !(phase || repeat);
  byId("fault").lastElementChild.textContent = phase ? "Stop: repeat this trial" : "Repeat the last trial";
  byId("leave").hidden = gone || step === "enrol";
  byId("choose").querySelector("button").disabled = phase !== null;
  if (!chosen) byId("number").value = state.proposed;
  const practised = { true: "yes", false: "no: too few successes in a row" }[state.practised] ?? "not yet";
  const rows = {
    "Trials done": here ? state.trials_done : "–",
    "Practised": here ? practised : "–",
    "Minutes left, at most": state.minutes_left === undefined ? "–" : Math.ceil(state.minutes_left),
    "Participant's page": open.participant ? "open" : phase === "up" ? "shows the trial" : "NOT OPEN",
    "Both sides": phase ?? "not running",
    "Controller": state.controller_state ? `${state.controller}: ${state.controller_state}` : state.controller,
  };
  byId("facts").replaceChildren(...Object.entries(rows).flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, String(value))]));
  byId("faults").replaceChildren(...(state.faults ?? []).map((reason) => make("li", {}, reason)));
  byId("participants").replaceChildren(...state.participants.map((row) => {
    const line = make("tr", { className: row.number === state.participant ? "here" : "" });
    for (const value of [row.number, `${row.trials_done} of ${row.of}`, row.faults, row.step]) line.append(make("td", {}, String(value)));
    return line;
  }));
}

function submits(id, send) {
  byId(id).addEventListener("submit", (event) => {
    event.preventDefault();
    send(byId(id).querySelector("input"));
  });
}

byId("next").onclick = () => say(NEXT[state.step][0]);
byId("end").onclick = () => say("end");
byId("pause").onclick = () => say("paused");
byId("at_once").onchange = ({ target }) => say("at_once", { value: target.checked });
byId("number").oninput = () => (chosen = true);
submits("fault", (input) => {
  say("failed", { reason: input.value });
  input.value = "";
});
submits("withdraw", (input) => {
  say("withdrew", { reason: input.value });
  input.value = "";
  byId("leave").open = false;
});
submits("choose", (input) => {
  say("choose", { participant: Number(input.value) });
  chosen = false;
});
