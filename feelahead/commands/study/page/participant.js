// Page of the participant: what to do now. In a trial the console takes its place, and comes back here.
import { byId, connect, make, minutes } from "./shared.js";

const KEYS = {
  keyboard: [["Space", "hold it all the time: the arm moves only while it is held"], ["W, S", "forward, back"], ["A, D", "left, right"],
    ["R, F", "up, down"], ["C, O", "close, open the gripper"], ["1 … 9", "how fast"], ["Esc, then X", "stop the arm at once; go on"]],
  gamepad: [["L1", "hold it all the time: the arm moves only while it is held"], ["R2, L2", "forward, back"], ["left stick", "left, right, up, down"],
    ["cross, square", "close, open the gripper"], ["circle", "stop the arm at once"], ["options", "let it go on: release both triggers first"]],
};
KEYS.dualsense = KEYS.gamepad;
let state = null;
let key = ""; // of what is shown
let leaves = false;

const say = connect((newest) => {
  state = newest;
  if (state.console && !leaves) {
    leaves = true;
    location.replace(state.console);
  }
  const { participant, step, number, attempt, block, phase, ready } = state;
  forget();
  const shown = JSON.stringify([participant, step, number, attempt, block, phase, ready]);
  if (shown !== key) {
    key = shown;
    byId("card").replaceChildren(...card().filter(Boolean));
    byId("card").dataset.step = step;
  }
  if (step === "rest") showRest();
});

const title = (text) => make("h1", {}, text);
const words = (text) => make("p", {}, text);
const button = (text, onclick, more = {}) => make("button", { type: "button", className: "main", onclick, ...more }, text);

function instructions() {
  return [
    words("You see a robot arm through two cameras. Bring the gripper to the object that is outlined, close the gripper, lift the object, and set it down again so that it stands by itself. Then open the gripper."),
    words("Be as quick as you can without touching anything else. The pictures may come late."),
    make("dl", { className: "keys" }, ...KEYS[state.controller].flatMap(([name, does]) => [make("dt", {}, name), make("dd", {}, does)])),
    words("You may stop at any time, and need not say why: tell the experimenter."),
  ];
}

function trial() {
  const { step, number, of, phase, ready } = state;
  const name = step === "practice" ? `Practice ${number}` : `Trial ${number}${of ? ` of ${of}` : ""}`;
  if (phase === "starting" || phase === "up" || phase === "not heard") return [title(name), words("It begins in a moment. Take your hands off the keys.")];
  if (phase) return [title("Thank you"), words("One moment, please.")];
  const go = ready ? words("Ready. It is about to begin.") : button("I am ready", () => say("ready"), { id: "ready" });
  return [title(name), ...instructions(), go];
}

function card() {
  switch (state.step) {
    case "practice":
    case "trial": return trial();
    case "questions": return questions();
    case "rest": return [title("Time to rest"), words("Take your hands off the controller, and look away from the screen."),
      make("p", { id: "left", role: "timer" }), button("Go on", () => say("rested"), { id: "go_on", disabled: true })];
    case "pause": return [title("A short break"), words("The experimenter will say when it goes on.")];
    case "done": return [title("Thank you"), words("That was all. Please tell the experimenter.")];
    case "withdrawn": return [title("Thank you"), words("You have ended your part. Please tell the experimenter if you have any question.")];
    default: return [title("Welcome"), words("The experimenter will explain the study. Please wait.")];
  }
}

function showRest() {
  const left = state.rest_left_s ?? 0;
  byId("left").textContent = left ? minutes(left) : "0:00";
  byId("go_on").disabled = left > 0;
}

// Answers are kept by this tab until their step has changed, so that neither a reload nor a full disk loses any.
const kept = () => `answers ${state.study} ${state.participant} `;

function forget() {
  if (state.participant === undefined || ["questions", "pause"].includes(state.step)) return;
  for (const name of Object.keys(sessionStorage)) if (name.startsWith(kept())) sessionStorage.removeItem(name);
}

function questions() {
  const place = `${kept()}${state.block}`;
  const answers = JSON.parse(sessionStorage.getItem(place) ?? "{}");
  const missing = make("p", { id: "missing", role: "alert" });
  const fields = state.asked.map((question, k) => field(question, k, answers, () => sessionStorage.setItem(place, JSON.stringify(answers))));
  const form = make("form", { noValidate: true }, ...fields, missing, make("button", { type: "submit", className: "main" }, "Send my answers"));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const open = state.asked.map(({ name }) => !(name in answers));
    fields.forEach((one, k) => one.classList.toggle("open", open[k]));
    const count = open.filter(Boolean).length;
    missing.textContent = count ? `${count} ${count === 1 ? "question is" : "questions are"} still open.` : "";
    if (count) fields[open.indexOf(true)].querySelector("input").focus();
    else say("answered", { block: state.block, values: answers });
  });
  return [title("A few questions about the last trials"), words("There are no right or wrong answers."), form];
}

// A question of NASA-TLX is a line of gradations without a preset; one of few steps is a row of circles.
function field({ name, text, low, high, values }, number, answers, keep) {
  const set = (value) => {
    answers[name] = value;
    keep();
    whole.classList.remove("open");
  };
  const slider = values.length > 11;
  const inputs = slider ? [gradations(values, answers[name], set, `q${number}`)] : values.map((value) =>
    make("label", {}, make("input", { type: "radio", name: `q${number}`, checked: answers[name] === value, onchange: () => set(value) }), String(value)));
  const whole = make("fieldset", {}, make("legend", {}, text), make("div", { className: slider ? "line" : "steps" },
    make("span", {}, low), make("div", {}, ...inputs), make("span", {}, high)));
  return whole;
}

function gradations(values, before, set, name) {
  const most = values.length - 1;
  const input = make("input", { type: "range", name, min: 0, max: most, step: 1, value: before === undefined ? most / 2 : values.indexOf(before) });
  input.dataset.unset = before === undefined;
  const take = () => {
    input.dataset.unset = false;
    set(values[Number(input.value)]);
  };
  for (const event of ["input", "click"]) input.addEventListener(event, take);
  const marks = make("div", { className: "marks" }, ...values.map(() => make("i")));
  return make("div", { className: "scale" }, marks, input);
}
