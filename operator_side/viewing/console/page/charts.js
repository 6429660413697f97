// Chart with a line for each series over the last 20 seconds; series differ by dashes, not by colour alone.
const SPAN_MS = 20000;
const GAP_MS = 1000; // a longer gap interrupts the line
const FONT = "system-ui, sans-serif";

function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((step) => step * power).find((step) => step >= value);
}

export class Chart {
  said = "";
  #canvas; #title; #unit; #series; #full;
  #samples = [];

  constructor(canvas, title, unit, series, full = null) {
    this.#canvas = canvas;
    [this.#title, this.#unit, this.#series, this.#full] = [title, unit, series, full];
  }

  // A time before the newest sample means that the recording was moved back: begin anew.
  add(nowMs, values) {
    if (this.#samples.at(-1)?.[0] > nowMs) this.#samples = [];
    this.#samples.push([nowMs, values]);
    while (this.#samples[0][0] < nowMs - SPAN_MS) this.#samples.shift();
  }

  #fitting(context, words, width) {
    let shown = words;
    while (shown && context.measureText(`${shown}…`).width > width) shown = shown.slice(0, -1);
    return shown === words ? words : `${shown}…`;
  }

  // atMs: moment of a line across the chart; null for none.
  draw(nowMs, atMs = null) {
    const ratio = devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    if (!width || !height) return;
    if (this.#canvas.width !== Math.round(width * ratio) || this.#canvas.height !== Math.round(height * ratio)) {
      this.#canvas.width = Math.round(width * ratio);
      this.#canvas.height = Math.round(height * ratio);
    }
    const context = this.#canvas.getContext("2d");
    const style = getComputedStyle(document.documentElement);
    const color = (name) => style.getPropertyValue(name);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const known = this.#samples.flatMap(([, values]) => values).filter((value) => Number.isFinite(value));
    const top = this.#full ?? roundUp(Math.max(1, ...known));
    const [left, right, upper, lower] = [4, width - 36, 36, height - 6];
    const y = (value) => lower - ((lower - upper) * Math.min(Math.max(value, 0), top)) / top;
    const x = (atMs) => right - ((right - left) * (nowMs - atMs)) / SPAN_MS;

    context.strokeStyle = color("--line");
    context.lineWidth = 1;
    context.font = `12px ${FONT}`;
    context.fillStyle = color("--weak");
    for (const value of [0, top / 2, top]) {
      context.beginPath();
      context.moveTo(left, y(value));
      context.lineTo(right, y(value));
      context.stroke();
      context.fillText(value < 1000 ? `${value}` : `${value / 1000}k`, right + 4, y(value) + 4);
    }
    if (atMs !== null && atMs > nowMs - SPAN_MS) {
      context.fillStyle = color("--again");
      context.fillRect(x(atMs) - 1, upper, 3, lower - upper);
    }
    context.font = `600 12px ${FONT}`;
    context.fillStyle = color("--text");
    const title = this.#unit ? `${this.#title}, ${this.#unit}` : this.#title;
    context.fillText(title, left, 13);
    if (this.said) {
      const beside = left + context.measureText(title).width + 8;
      context.font = `12px ${FONT}`;
      context.fillStyle = color("--weak");
      context.fillText(this.#fitting(context, this.said, width - beside), beside, 13);
    }
    this.#canvas.title = this.said;
    let along = left;
    this.#series.forEach(([name, hue, dash = []], index) => {
      context.strokeStyle = context.fillStyle = color(hue);
      context.lineWidth = 2;
      context.setLineDash(dash);
      context.beginPath();
      context.moveTo(along, 23);
      context.lineTo(along + 18, 23);
      context.stroke();
      const newest = this.#samples.at(-1)?.[1][index];
      context.font = `12px ${FONT}`;
      const words = `${name} ${Number.isFinite(newest) ? newest.toFixed(newest < 10 ? 2 : 0) : "?"}`;
      context.fillText(words, along + 22, 27);
      along += 32 + context.measureText(words).width;
      context.beginPath();
      let drawing = false, beforeMs = -Infinity;
      for (const [atMs, values] of this.#samples) {
        const value = values[index];
        if (atMs - beforeMs > GAP_MS) drawing = false;
        beforeMs = atMs;
        if (!Number.isFinite(value)) drawing = false;
        else if (drawing) context.lineTo(x(atMs), y(value));
        else {
          context.moveTo(x(atMs), y(value));
          drawing = true;
        }
      }
      context.stroke();
      context.setLineDash([]);
    });
  }
}
