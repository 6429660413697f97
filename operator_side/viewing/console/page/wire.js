// Worker that holds the page's WebSocket: what comes goes to the page, what the page says to the console.
//
// While the page drives or stops, it repeats the page's newest inputs, with the time since the page confirmed them: so
// a page whose drawing is late is heard all the same. The operator side decides how long unconfirmed inputs count.
const PERIOD_MS = 20;
const MISSED_MS = 30; // without inputs from the page for so long, the last ones are repeated
const RETRY_MS = 500;

let address = "";
let socket = null;
let inputs = null; // newest of the page
let number = 0; // of the newest inputs sent
let confirmedMs = 0;
let sentMs = 0;

const send = (object) => {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(object));
};

function sayHands() {
  const nowMs = performance.now();
  sentMs = nowMs;
  send({ hands: { ...inputs, number: number++, age_s: (nowMs - confirmedMs) / 1000 } });
}

function connect() {
  socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => postMessage(data, typeof data === "string" ? [] : [data]);
  socket.onopen = () => postMessage({ open: true });
  socket.onclose = ({ reason }) => {
    postMessage({ open: false, reason });
    setTimeout(connect, RETRY_MS);
  };
}

// The page says first its console's address, then what it sends, with the time by both threads' common clock: what
// waited for this thread is that much older.
onmessage = ({ data }) => {
  if (!address) {
    address = data;
    connect();
  } else if (data.words.hands) {
    inputs = data.words.hands;
    const nowMs = performance.now();
    confirmedMs = nowMs - Math.max(0, performance.timeOrigin + nowMs - data.saidMs);
    sayHands();
    inputs = { ...inputs, reset: false, give_back: false }; // pressed once
  } else send(data.words);
};

setInterval(() => {
  if ((inputs?.driving || inputs?.stop) && performance.now() - sentMs >= MISSED_MS) sayHands();
}, PERIOD_MS);
