// Codes and structs of ours, made by: python -m operator_side.viewing.console.names

export const VIEWS = ["overview", "first_person"]; // by their number on the wire
export const ShownKind = Object.freeze({ RUN: "run", FACTS: "facts", SCENE: "scene", NOTE: "note", PLAYER: "player",
  END: "end" });
export const LinkState = Object.freeze({ WAITING: "waiting", UP: "up", OBSERVING: "observing", REFUSED: "refused",
  LOST: "lost" });
export const SessionState = Object.freeze({ UNKNOWN: "unknown", OBSERVING: "observing", DISARMED: "disarmed",
  READY: "ready", ARMED: "armed", STOPPED: "stopped", STOPPED_READY: "stopped_ready", AWAY: "away", ENDED: "ended" });
export const Phase = Object.freeze({ LINK_LOST: "link_lost", REFUSED: "refused", STOPPED: "stopped",
  CONTROLLER_LOST: "controller_lost", RELEASE_BOTH_TRIGGERS: "release_both_triggers", DISARMED: "disarmed",
  WAITING: "waiting", OBSERVING: "observing", NO_CONTROLLER: "no_controller", ARMED: "armed", BUSY: "busy",
  READY_TO_ARM: "ready_to_arm", STARTING: "starting" });
export const Look = Object.freeze({ LOST: "lost", STOPPED: "stopped", ARMED: "armed", DISARMED: "disarmed",
  STARTING: "starting" });
export const Doing = Object.freeze({ RESTING: "resting", ARMING: "arming", ADVANCING: "advancing", GRASPING: "grasping",
  RETREATING: "retreating", LIFTING: "lifting", CARRYING: "carrying", LOWERING: "lowering", LETTING_GO: "letting_go",
  DRAWING_BACK: "drawing_back", PULLING: "pulling", DONE: "done", NO_TARGET: "no_target",
  AT_REST_FIRST: "at_rest_first", NOBODY_DRIVES: "nobody_drives", ALL_KEYS_UP_FIRST: "all_keys_up_first",
  READY: "ready", RUNNING: "running" });
export const Hands = Object.freeze({ CONTROLLER: "controller", PERSON: "person", BROWSER: "browser" });
export const Readiness = Object.freeze({ NOBODY: "nobody_drives", RESTING: "all_keys_up_first", READY: "ready",
  RUNNING: "running" });
export const MotionState = Object.freeze({ DISARMED: "disarmed", ARMED: "armed", STOPPED: "stopped" });
/** @typedef {{ link: string, state: string|null, stopped_because: string|null, owner: string|null, L2: number|null,
 * R2: number|null, L2_pulled: number|null, R2_pulled: number|null, delay_ms: number|null, target: string|null,
 * stands: boolean|null, rate_kbit_s: number|null, queue_ms: number|null, lost_percent: number|null,
 * pictures: string|null, held_back: string|null, offset_s: number|null, link_reason: string|null, place: number|null,
 * waiting: number|null, haptics: boolean, feel: string|null, L2_free: number|null, R2_free: number|null,
 * target_centre_mm: number|null, holding: boolean|null, controller: string|null, triggers_released: boolean|null,
 * person: string|null, motion_overruns: number|null, queue_to_robot_ms: number|null }} OperatorStatus */
/** @typedef {{ travel: number|null, raw: number|null, zones: number[], meets: number, free: number,
 * stiffness: number|null, needed_m: number|null, fast_m: number[], slow_m: number[] }} TriggerFacts */
/** @typedef {{ asked: string, mean_ms: number|null, p99_ms: number|null, newest_ms: number|null }} DelayFacts */
/** @typedef {{ may_drive: boolean, driver: string|null, readiness: string, rest_s: number, person: boolean,
 * doing: string|null, tuning_refused: string, link_asked: string|null }} HandsFacts */
/** @typedef {{ overlap_mm3: number, tick_us: number, tick_p99_us: number, overruns: number }} SceneFacts */
/** @typedef {{ now_s: number, offset_s: number|null, status: OperatorStatus, screen: Object|null, l2: TriggerFacts,
 * r2: TriggerFacts, rumble: number, advancing: string, to_operator: DelayFacts, to_robot: DelayFacts,
 * round_trip_ms: number|null, field_age_ms: number|null, hands: string, may_tune: boolean, probability: number|null,
 * page: HandsFacts|null, scene: SceneFacts|null, robot: Object|null }} OperatorFacts */
/** @typedef {{ phase: string, doing: string|null, reason: string|null, alarm: boolean, look: string }} PhaseFacts */
/** @typedef {{ page: string, number: number, driving: boolean, run: boolean, l2: number, r2: number, lateral: number[],
 * turning: number[], gripper: number, next_target: boolean, hand_over: boolean, stop: boolean, give_back: boolean }}
 * PageHands */
/** @typedef {{ probability: number|null, link: string|null }} TuneWish */
/** @typedef {{ hands: PageHands|null, tune: TuneWish|null }} PageMessage */
