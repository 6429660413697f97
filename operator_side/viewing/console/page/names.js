// Codes and structs of ours, made by: python -m operator_side.viewing.console.names

export const VIEWS = ["overview", "first_person"]; // by their number on the wire

export const ShownKind = Object.freeze({
  RUN: "run",
  FACTS: "facts",
  SCENE: "scene",
  NOTE: "note",
  PLAYER: "player",
  END: "end",
});

export const LinkState = Object.freeze({
  WAITING: "waiting",
  UP: "up",
  OBSERVING: "observing",
  REFUSED: "refused",
  LOST: "lost",
});

export const SessionState = Object.freeze({
  UNKNOWN: "unknown",
  OBSERVING: "observing",
  DISARMED: "disarmed",
  READY: "ready",
  ARMED: "armed",
  STOPPED: "stopped",
  STOPPED_READY: "stopped_ready",
  AWAY: "away",
  ENDED: "ended",
});

export const Phase = Object.freeze({
  LINK_LOST: "link_lost",
  REFUSED: "refused",
  STOPPED: "stopped",
  CONTROLLER_LOST: "controller_lost",
  RELEASE_BOTH_TRIGGERS: "release_both_triggers",
  DISARMED: "disarmed",
  WAITING: "waiting",
  OBSERVING: "observing",
  NO_CONTROLLER: "no_controller",
  ARMED: "armed",
  BUSY: "busy",
  READY_TO_ARM: "ready_to_arm",
  STARTING: "starting",
});

export const Look = Object.freeze({
  LOST: "lost",
  STOPPED: "stopped",
  ARMED: "armed",
  DISARMED: "disarmed",
  STARTING: "starting",
});

export const Doing = Object.freeze({
  RESTING: "resting",
  ARMING: "arming",
  ADVANCING: "advancing",
  GRASPING: "grasping",
  RETREATING: "retreating",
  LIFTING: "lifting",
  CARRYING: "carrying",
  LOWERING: "lowering",
  LETTING_GO: "letting_go",
  DRAWING_BACK: "drawing_back",
  PULLING: "pulling",
  DONE: "done",
  NO_TARGET: "no_target",
  AT_REST_FIRST: "at_rest_first",
  NOBODY_DRIVES: "nobody_drives",
  ALL_KEYS_UP_FIRST: "all_keys_up_first",
  READY: "ready",
  RUNNING: "running",
});

export const Hands = Object.freeze({
  CONTROLLER: "controller",
  PERSON: "person",
  BROWSER: "browser",
});

export const Readiness = Object.freeze({
  NOBODY: "nobody_drives",
  RESTING: "all_keys_up_first",
  READY: "ready",
  RUNNING: "running",
});

export const MotionState = Object.freeze({
  DISARMED: "disarmed",
  ARMED: "armed",
  STOPPED: "stopped",
});

/**
 * @typedef {Object} OperatorStatus
 * @property {string} link
 * @property {string|null} state
 * @property {string|null} stopped_because
 * @property {string|null} owner
 * @property {number|null} L2
 * @property {number|null} R2
 * @property {number|null} L2_pulled
 * @property {number|null} R2_pulled
 * @property {number|null} delay_ms
 * @property {string|null} target
 * @property {boolean|null} stands
 * @property {number|null} rate_kbit_s
 * @property {number|null} queue_ms
 * @property {number|null} lost_percent
 * @property {string|null} pictures
 * @property {string|null} held_back
 * @property {number|null} offset_s
 * @property {string|null} link_reason
 * @property {number|null} place
 * @property {number|null} waiting
 * @property {boolean} haptics
 * @property {string|null} feel
 * @property {number|null} L2_free
 * @property {number|null} R2_free
 * @property {number|null} target_centre_mm
 * @property {boolean|null} holding
 * @property {string|null} controller
 * @property {boolean|null} triggers_released
 * @property {string|null} person
 * @property {number|null} motion_overruns
 * @property {number|null} queue_to_robot_ms
 */

/**
 * @typedef {Object} Header
 * @property {number} epoch
 * @property {number} sequence
 * @property {number} sent_s
 * @property {number|null} echo_sent_s
 * @property {number|null} echo_held_s
 * @property {number|null} last_sent_s
 * @property {number|null} last_held_s
 */

/**
 * @typedef {Object} Telemetry
 * @property {Header} header
 * @property {string} state
 * @property {number[]} tool_position_m
 * @property {number} tool_speed_m_s
 * @property {string|null} target
 * @property {number[]|null} target_in_tool_m
 * @property {number[]} up_in_tool
 * @property {number} gripper_opening_m
 * @property {boolean} holding
 * @property {number} enlargement_m
 * @property {number} l2
 * @property {number} r2
 */

/**
 * @typedef {Object} TriggerFacts
 * @property {number|null} travel
 * @property {number|null} raw
 * @property {number[]} zones
 * @property {number} meets
 * @property {number} free
 * @property {number|null} stiffness
 * @property {number|null} needed_m
 * @property {number[]} fast_m
 * @property {number[]} slow_m
 */

/**
 * @typedef {Object} DelayFacts
 * @property {string} asked
 * @property {number|null} mean_ms
 * @property {number|null} p99_ms
 * @property {number|null} newest_ms
 */

/**
 * @typedef {Object} HandsFacts
 * @property {boolean} may_drive
 * @property {string|null} driver
 * @property {string} readiness
 * @property {number} rest_s
 * @property {boolean} person
 * @property {string|null} doing
 * @property {string} tuning_refused
 * @property {string|null} link_asked
 */

/**
 * @typedef {Object} SceneFacts
 * @property {number} overlap_mm3
 * @property {number} tick_us
 * @property {number} tick_p99_us
 * @property {number} overruns
 */

/**
 * @typedef {Object} RobotStatus
 * @property {string} link
 * @property {string|null} state
 * @property {string|null} stopped_because
 * @property {string|null} owner
 * @property {number|null} L2
 * @property {number|null} R2
 * @property {number|null} L2_pulled
 * @property {number|null} R2_pulled
 * @property {number|null} delay_ms
 * @property {string|null} target
 * @property {boolean|null} stands
 * @property {number|null} rate_kbit_s
 * @property {number|null} queue_ms
 * @property {number|null} lost_percent
 * @property {string|null} pictures
 * @property {string|null} held_back
 * @property {number|null} offset_s
 * @property {number} observers
 * @property {number} refused
 * @property {number|null} loop_age_ms
 * @property {number|null} enlargement_mm
 * @property {string|null} holding
 * @property {string|null} nearest
 * @property {number|null} nearest_mm
 * @property {number|null} target_mm
 * @property {number|null} tick_us
 * @property {number|null} tick_p99_us
 * @property {number|null} overruns
 * @property {number|null} late_us
 * @property {number|null} real_time
 */

/**
 * @typedef {Object} OperatorFacts
 * @property {number} now_s
 * @property {number|null} offset_s
 * @property {OperatorStatus} status
 * @property {Telemetry|null} screen
 * @property {TriggerFacts} l2
 * @property {TriggerFacts} r2
 * @property {number} rumble
 * @property {string} advancing
 * @property {DelayFacts} to_operator
 * @property {DelayFacts} to_robot
 * @property {number|null} round_trip_ms
 * @property {number|null} field_age_ms
 * @property {string} hands
 * @property {boolean} may_tune
 * @property {number|null} probability
 * @property {HandsFacts|null} page
 * @property {SceneFacts|null} scene
 * @property {RobotStatus|null} robot
 */

/**
 * @typedef {Object} PhaseFacts
 * @property {string} phase
 * @property {string|null} doing
 * @property {string|null} reason
 * @property {boolean} alarm
 * @property {string} look
 */

/**
 * @typedef {Object} PageHands
 * @property {string} page
 * @property {number} number
 * @property {boolean} driving
 * @property {boolean} run
 * @property {number} l2
 * @property {number} r2
 * @property {number[]} lateral
 * @property {number[]} turning
 * @property {number} gripper
 * @property {boolean} next_target
 * @property {boolean} hand_over
 * @property {boolean} stop
 * @property {boolean} give_back
 */

/**
 * @typedef {Object} TuneWish
 * @property {number|null} probability
 * @property {string|null} link
 */

/**
 * @typedef {Object} PageMessage
 * @property {PageHands|null} hands
 * @property {TuneWish|null} tune
 */
