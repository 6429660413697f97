// Main script of the page: shows the console's messages as they arrive.
import { Answers } from "./answers.js";
import { Chart } from "./charts.js";
import { makeFigures, showFigures, text } from "./figures.js";
import { Hands } from "./hands.js";
import { make } from "./make.js";
import { InputSource, MotionState, ShownKind, VIEWS } from "./names.js";
import { Overlay } from "./overlay.js";
import { Player } from "./player.js";
import { Replay } from "./replay.js";
import { Sound } from "./sound.js";
import { Clock, View } from "./views.js";
import { Trigger } from "./triggers.js";

const SILENCE_MS = 400; // facts come 30 times a second
const REFRESH_MS = 100;
const BACK_MS = 2000; // without a console for longer, a page of a study goes back
const SELDOM = 10; // refreshes from one drawing of a late page's charts to the next
const MOST_NOTES = 50;
const SHOWN = new Set([ShownKind.FACTS, ShownKind.SCENE, ...VIEWS.keys()]); // what can be played again
const byId = (id) => document.getElementById(id);

makeFigures(byId("figures"));
const clock = new Clock();
const views = VIEWS.map((name) => new View(byId(name), clock));
const overlay = new Overlay(VIEWS.map(byId), document.querySelector(".near"));
const sound = new Sound(byId("sound"));
const triggers = { l2: new Trigger(byId("l2"), "L2"), r2: new Trigger(byId("r2"), "R2") };
const charts = {
  delay: new Chart(byId("delay_chart"), "delay", "ms", [["to here", "--l2"], ["to the robot", "--r2", [5, 3]]]),
  overlap: new Chart(byId("overlap_chart"), "overlap", "mm³", [["L2", "--l2"], ["R2", "--r2", [5, 3]]]),
  stiffness: new Chart(byId("stiffness_chart"), "met", "of 8", [["L2", "--l2"], ["R2", "--r2", [5, 3]]], 8),
  tick: new Chart(byId("tick_chart"), "robot tick", "µs", [["p50", "--l2"], ["p99", "--r2", [5, 3]]]),
};
let open = false; // whether the console is connected
let refreshedMs = performance.now();
let heardMs = performance.now();
let openMs = performance.now(); // when the console was last connected
let everHeard = false;
let closedBecause = "";
let facts = null;
let chartsDue = 0; // refreshes until a late page's charts are drawn
let felt = null; // message of facts that views and triggers show: the newest, or one that is played again
let drawn = false;
const frame = document.querySelector("#scene iframe");
const slow = drawsSlowly();
let run = { title: "", live: true };
let ended = ""; // why the connection is expected to end
let began = false; // whether a page of a study has begun to drive by itself

const wire = new Worker("wire.js");
const say = (words) => wire.postMessage({ words, saidMs: performance.timeOrigin + performance.now() });
const send = (words) => (run.back && words.mark ? undefined : say(words)); // in a study nobody puts the scene back
const answers = new Answers(send);
const hands = new Hands(document, send, () => views[0].capturedS, () => answers.waits);
const replay = new Replay((kind, data) => show(typeof data === "string" ? JSON.parse(data) : { kind }, data));
const replayButton = make("button", { type: "button", id: "replay", onclick: () => (replay.open ? goLive() : playAgain()) });
byId("player").append(replayButton);
const player = new Player(byId("player"), ({ play }) => (run.live ? replay.wish(play, performance.now()) : send({ play })));
byId("drive").addEventListener("click", goLive);

function connect() {
  const address = new URL("live", location.href);
  address.protocol = "ws:";
  wire.onmessage = ({ data }) => {
    if (typeof data === "string") take(JSON.parse(data), data);
    else if (data instanceof ArrayBuffer) take({ kind: new DataView(data).getUint8(0) }, data);
    else {
      open = data.open;
      if (open) send({ slow, looks: !document.hidden });
      else closedBecause = data.reason || "its process has ended, or this page may not see it";
    }
  };
  wire.postMessage(address.href);
}

function take(message, data) {
  receive(message);
  if (run.live && SHOWN.has(message.kind)) replay.keep(message.kind, data, performance.now());
  if (!replay.open) show(message, data);
}

function receive(message) {
  if (message.kind === ShownKind.END) answers.answer();
  else if (message.kind === ShownKind.FACTS) showFacts(message);
  else if (message.kind === ShownKind.NOTE) showNote(message.text);
  else if (message.kind === ShownKind.ENDED) ended ||= "THE RUN HAS ENDED";
  else if (message.kind === ShownKind.RUN) {
    run = message;
    ended = "";
    byId("again").hidden = !run.may_run_again;
    clock.live = run.live;
    document.title = `feelahead: ${run.title}`;
    document.body.classList.toggle("replay", !run.live);
    replayButton.hidden = !run.live;
    document.body.classList.toggle("study", Boolean(run.back));
    if (run.back) draw(false);
    replay.forget();
    goLive();
  } else if (message.kind === ShownKind.PLAYER) {
    player.show(message);
    if (!facts) goWithoutFacts(message.at_s);
  }
}

// Show what can be played again: views, scene and triggers.
function show(message, data) {
  if (message.kind === ShownKind.FACTS) showFelt(message);
  else if (message.kind === ShownKind.SCENE) showScene(message);
  else views[message.kind]?.receive(data);
}

// A real controller is not released here: who holds it must see what is.
function mayPlayAgain() {
  return !(facts?.hands === InputSource.CONTROLLER && facts.status.state === MotionState.ARMED);
}

function playAgain() {
  if (!replay.has || !mayPlayAgain()) return;
  hands.leave("The last seconds are played again.");
  replay.begin(performance.now());
  stepReplay();
}

function goLive() {
  replay.end();
  stepReplay();
}

function stepReplay() {
  replay.step(performance.now());
  document.body.classList.toggle("again", replay.open);
  const words = replay.open ? "Back to live" : "Play 20 s again";
  if (replayButton.textContent !== words) replayButton.textContent = words;
  if (run.live) player.show(replay.state);
}

// Show a recording made by a robot side alone: it has pictures and a scene, but no facts of an operator side.
function goWithoutFacts(atS) {
  everHeard = true;
  clock.set(atS, null);
  text("state", "RECORDED");
  text("why", "the robot side alone · replay");
}

function showFacts(message) {
  heardMs = performance.now();
  everHeard = true;
  facts = message.facts;
  clock.set(facts.now_s, facts.offset_s);
  const { said } = message;
  document.body.dataset.state = said.border;
  text("state", said.state);
  byId("state").classList.toggle("long", said.state.length > 9);
  text("why", [...said.why, run.live ? null : "replay"].filter(Boolean).join(" · "));
  showFigures(facts, said);
  addTo(charts.delay, [facts.to_operator.newest_ms, facts.to_robot.newest_ms]);
  const asked = [["robot", facts.to_robot.asked], ["operator", facts.to_operator.asked]].filter(([, words]) => words);
  charts.delay.said = asked.map(([side, words]) => `emulated to the ${side}: ${words}`).join("; ");
  addTo(charts.stiffness, [facts.l2.meets, facts.r2.meets]);
  hands.show(facts);
  if (run.back && facts.page?.may_drive && !facts.page.driver && !began) {
    began = true;
    byId("drive").click();
  }
  showCounts(facts);
  if (replay.open && !mayPlayAgain()) goLive();
  replayButton.disabled = !mayPlayAgain();
  replayButton.title = replayButton.disabled ? "not while a controller drives the armed arm" : "";
}

function showFelt(message) {
  felt = message;
  const { facts: { l2, r2, advancing, page }, fingers } = message;
  triggers.l2.show(l2, fingers[0], advancing === "L2", page?.yields?.[0]);
  triggers.r2.show(r2, fingers[1], advancing === "R2", page?.yields?.[1]);
  if (!run.back) sound.play(message.facts, fingers); // a tone would tell the condition
}

// While the last seconds are played again, the charts show these, and a line through them.
function addTo(chart, values) {
  if (!replay.open) chart.add(clock.nowMs, values);
}

// The operator side lets a page's hands fade while the pictures are old or the page is late, and says so.
function showCounts({ page, hands: whose, status }) {
  const drives = run.live && whose === InputSource.BROWSER && page?.driver && status.state === MotionState.ARMED;
  const off = drives && page.counts < 1;
  document.body.classList.toggle("hands_off", Boolean(off));
  byId("hands_off").hidden = !off;
  const share = off && page.counts > 0 ? `hands at ${Math.round(100 * page.counts)} %` : "hands off";
  if (off) text("hands_off", `${share.toUpperCase()}: ${page.because}`);
}

byId("again").onclick = () => {
  send({ again: true });
  ended = "STARTING AGAIN";
};

function draw(wanted) {
  drawn = wanted;
  byId("drawn").textContent = `3-D drawing: ${drawn ? "on" : slow ? "off, as this browser has no graphics processor" : "off"}`;
  byId("drawn").setAttribute("aria-pressed", drawn);
  frame.hidden = true;
  if (!drawn) frame.removeAttribute("src");
}
byId("drawn").onclick = () => draw(!drawn);
draw(!slow);

// Whether the browser draws without a graphics processor: the scene then takes much processor time, so it is drawn only
// on request, and updated less often.
function drawsSlowly() {
  const context = document.createElement("canvas").getContext("webgl");
  const renderer = context?.getParameter(context.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL ?? 0);
  return /swiftshader|llvmpipe|software|basic render/i.test(renderer ?? "software");
}

// Address of the scene under our other host name (localhost or 127.0.0.1). The browser treats that as another site,
// in a process of its own, so that drawing the scene does not slow this page.
function sceneAddress() {
  const address = new URL("scene/", location.href);
  address.hostname = location.hostname === "localhost" ? "127.0.0.1" : "localhost";
  if (matchMedia("(prefers-color-scheme: dark)").matches) address.search = "darkMode";
  return address.href;
}

function showScene(scene) {
  // Only now, as viser has no camera position before the first scene.
  if (drawn && !frame.src) frame.src = sceneAddress();
  frame.hidden = !drawn;
  if (felt) overlay.show(scene, felt.facts, felt.fingers);
  addTo(charts.overlap, scene.overlap_mm3);
  addTo(charts.tick, scene.tick_us);
  const rows = scene.objects.map(({ name, role, overlap_mm3: [l2, r2] }) => {
    const row = document.createElement("tr");
    for (const [content, kind, small] of [[name, "", role], [l2, "l2"], [r2, "r2"]]) {
      const cell = row.insertCell();
      cell.className = kind;
      cell.textContent = kind ? (content ? content.toFixed(0) : "–") : content;
      if (small) cell.append(" ", make("small", {}, small));
    }
    return row;
  });
  byId("objects").replaceChildren(...rows);
  const [l2, r2] = scene.sigma_mm;
  const left = scene.left_out ? ` ${scene.left_out} objects are felt but not drawn.` : "";
  text("terms", `enlarged by D_σ: L2 ${l2.toFixed(1)} mm, R2 ${r2.toFixed(1)} mm.${left}`);
}

function showNote(note) {
  const item = make("li", {}, note);
  byId("notes").append(item);
  while (byId("notes").childElementCount > MOST_NOTES) byId("notes").firstChild.remove();
  byId("notes").scrollTop = byId("notes").scrollHeight;
}

function refresh() {
  const nowMs = performance.now();
  heardMs = Math.min(nowMs, heardMs + Math.max(0, nowMs - refreshedMs - REFRESH_MS)); // something may have come that this page has not taken yet
  refreshedMs = nowMs;
  const silentMs = nowMs - heardMs;
  const lost = !open || ((run.live || !everHeard) && silentMs > SILENCE_MS);
  byId("lost").hidden = !lost || Boolean(ended && replay.open);
  if (open) openMs = nowMs;
  if (run.back && (ended || nowMs - openMs > BACK_MS)) {
    goBack(run.back);
    run.back = null; // once
  }
  if (lost) {
    const [word, because] = byId("lost").children;
    word.textContent = ended || (open ? (everHeard ? "NOTHING HEARD" : "WAITING FOR THE OPERATOR SIDE") : "CONNECTION LOST");
    const old = everHeard ? `What you see is ${(silentMs / 1000).toFixed(1)} s old. ` : "";
    const silent = answers.waits ? "The browser draws nothing of this page." : "Nothing comes from the operator side.";
    because.textContent = ended ? "" : old + (open ? silent : `The console: ${closedBecause || "not reached yet"}.`);
  }
  const limits = facts?.pictures;
  if (replay.open) views.forEach((view) => view.showReplay((replay.untilMs - replay.atMs) / 1000));
  else views.forEach((view, k) => view.showAge(limits?.states[k] ?? null, limits?.old_s[k] ?? null, limits?.dead_s[k]));
}

// Leave for the page of the study once it answers, whatever it answers: it may have to be started again first.
async function goBack(to) {
  try {
    await fetch(new URL("/", to), { mode: "no-cors" });
    location.replace(to);
  } catch {
    setTimeout(() => goBack(to), 500);
  }
}

// A late page draws its charts seldom.
function drawCharts() {
  chartsDue -= 1;
  if (chartsDue > 0 && facts?.page?.seldom) return;
  chartsDue = SELDOM;
  Object.values(charts).forEach((chart) => chart.draw(replay.open ? replay.untilMs : clock.nowMs, replay.atMs));
}

document.addEventListener("visibilitychange", () => send({ looks: !document.hidden }));
connect();
setInterval(refresh, REFRESH_MS);
setInterval(drawCharts, REFRESH_MS);
setInterval(() => replay.open && stepReplay(), 30);
