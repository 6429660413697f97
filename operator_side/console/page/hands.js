// Hands that a browser has: see operator_side/console/page/app.js for what they are given.
export class Hands {
  show(facts) {}
}
