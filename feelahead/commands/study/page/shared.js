// What both pages share: their connection to the study, and making elements.
const RETRY_MS = 500;

export const byId = (id) => document.getElementById(id);

export function make(tag, properties = {}, ...content) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...content);
  return element;
}

export function write(id, text) {
  const place = byId(id);
  if (place.textContent !== text) place.textContent = text;
  place.hidden = text === "";
}

// Call show(state) with each new state. Return the function that says something to the study.
export function connect(show) {
  const address = new URL("live", location.href);
  address.protocol = "ws:";
  let socket = null;
  const open = () => {
    socket = new WebSocket(address);
    socket.onopen = () => (byId("lost").hidden = true);
    socket.onmessage = ({ data }) => {
      const message = JSON.parse(data);
      if (message.state) show(message.state);
      else write("refused", message.refused);
    };
    socket.onclose = () => {
      byId("lost").hidden = false;
      setTimeout(open, RETRY_MS);
    };
  };
  open();
  return (event, fields = {}) => socket.readyState === WebSocket.OPEN && socket.send(JSON.stringify({ event, ...fields }));
}

export const minutes = (seconds) => `${Math.floor(seconds / 60)}:${String(Math.ceil(seconds) % 60).padStart(2, "0")}`;
