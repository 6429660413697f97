// Answers to the console: the next batch may follow. An answer comes with the next frame that the page draws, so its age
// is the page's lateness. A window that is covered draws none, and says so.
const COVERED_MS = 1000; // without a frame for so long the window counts as covered
const LATE_MS = 200; // a timer later than this says that the page is late, and nothing of its window
const COVERED_PERIOD_MS = 100; // from one answer of a covered window to the next

export class Answers {
  #send;
  #covered = false;
  #timer = null;

  constructor(send) {
    this.#send = send;
  }

  // Whether what comes next waits for a frame.
  get waits() {
    return this.#timer !== null;
  }

  // The console asks once, and waits for the answer.
  answer() {
    if (document.hidden) {
      this.#send({ taken: true });
      return;
    }
    this.#wait(this.#covered ? COVERED_PERIOD_MS : COVERED_MS);
    requestAnimationFrame(() => {
      this.#covered = false; // also if the frame comes after the answer
      this.#say(true);
    });
  }

  #wait(delayMs) {
    const dueMs = performance.now() + delayMs;
    this.#timer = setTimeout(() => {
      if (performance.now() - dueMs > LATE_MS) this.#wait(COVERED_MS);
      else {
        this.#covered = true;
        this.#say(false);
      }
    }, delayMs);
  }

  #say(taken) {
    if (this.#timer === null) return; // answered already
    clearTimeout(this.#timer);
    this.#timer = null;
    this.#send({ taken });
  }
}
