"""Driver of a Franka FR3 or Panda and its hand by franky 2 (libfranka), in an environment with pyzmq and msgpack.

Usage: python franka_arm.py ADDRESS-OF-THE-ROBOT [tcp://127.0.0.1:5601]. Each turn replaces the running motion: hold
the commanded velocities until they expire, then brake. libfranka's thread does so even if this process stalls.
"""

import math
import sys
import threading
import time

try:
    import franky
    import msgpack
    import zmq
except ImportError as error:
    print(f"{error}; valid: pip install franky-control pyzmq msgpack", file=sys.stderr)
    sys.exit(2)

PERIOD_S, WIDEST_M, FASTEST_M_S, GRIP_N = 0.01, 0.08, 0.05, 30.0
MOST = {"velocity_rad_s": [2.0] * 7, "acceleration_rad_s2": [7.0] * 7, "jerk_rad_s3": [3000.0] * 7, "latency_s": 0.02}
CONDITION = {"Idle": "ready", "Move": "ready", "UserStopped": "emergency_stop", "Other": "fault"}
BROKEN = (franky.Exception, RuntimeError)  # franky raises either when the connection breaks


def serve_hand(address: str, shared: dict) -> None:
    """Move the hand by shared["newest"], put its state into shared["hand"]; each reading waits for the next state."""
    while True:
        try:
            gripper, before = franky.Gripper(address), 0.0
            while True:
                shared["hand"], newest = gripper.state, shared["newest"]
                closing = newest["closing"] if time.monotonic() < newest["valid_until_s"] else 0.0
                if closing > 0.0 >= before:
                    gripper.grasp_async(0.0, FASTEST_M_S, GRIP_N, WIDEST_M, WIDEST_M)
                elif closing < 0.0 <= before:
                    gripper.move_async(WIDEST_M, FASTEST_M_S)
                elif closing == 0.0 != before and not shared["hand"].is_grasped:  # what is held stays held
                    gripper.stop_async()
                before = closing
        except BROKEN:
            shared["hand"] = time.sleep(1.0)


def main(robot_address: str, address: str = "tcp://127.0.0.1:5601") -> None:
    """Drive until a signal ends it."""
    socket, robot, sequence, mode, clock_ms = zmq.Context().socket(zmq.DEALER), None, 0, "", -1
    socket.sndhwm, socket.linger = 2, 0  # old states are useless
    socket.connect(address)
    nothing = {"sent_s": None, "joint_velocities": [0.0] * 7, "closing": 0.0, "valid_until_s": -math.inf}
    shared, read_s = {"newest": nothing, "hand": None}, time.monotonic()
    threading.Thread(target=serve_hand, args=(robot_address, shared), daemon=True).start()
    while True:
        while socket.poll(0):  # read all, obey the newest
            message = msgpack.unpackb(socket.recv())
            if "refused" in message:
                print("refused:", message["refused"], flush=True)
            else:
                shared["newest"], read_s = message, time.monotonic()
        try:
            if robot is None:
                robot = franky.Robot(robot_address, realtime_config=franky.RealtimeConfig.Ignore)
                robot.joint_velocity_limit.set(MOST["velocity_rad_s"])
                robot.joint_acceleration_limit.set(MOST["acceleration_rad_s2"])
                robot.joint_jerk_limit.set(MOST["jerk_rad_s3"])
            measured_s, seen, newest, told = time.monotonic(), robot.state, shared["newest"], mode
            left_s, mode, hand = newest["valid_until_s"] - measured_s, seen.robot_mode.name, shared["hand"]
            if robot.is_in_control or (left_s > 0.0 and any(newest["joint_velocities"])):
                way, hold = franky.JointVelocityWaypoint, franky.Duration(int(1e3 * max(left_s, 1e-3)))
                ways = [way(newest["joint_velocities"], hold_target_duration=hold)] if left_s > 0.0 else []
                robot.move(franky.JointVelocityWaypointMotion([*ways, way([0.0] * 7)]), asynchronous=True)
            elif mode == told == "Reflex":  # the robot side has been told, and nobody drives
                robot.recover_from_errors()
            robot.poll_motion()  # raises what ended the last motion
        except BROKEN as error:
            print("franka:", error, flush=True)
            robot = robot if isinstance(error, franky.ControlException) else time.sleep(0.5)  # reflexes break nothing
        if robot and seen.time.to_msec() != clock_ms:  # the state of a lost robot stays the last one for a second
            clock_ms, sequence, sent_s = seen.time.to_msec(), sequence + 1, time.monotonic()
            state = {"version": 1, "sequence": sequence, "sent_s": sent_s, "measured_s": measured_s, "limits": MOST}
            state |= {"echo_s": newest["sent_s"], "held_s": sent_s - read_s, "joint_positions": seen.q.tolist()}
            state |= {"joint_velocities": seen.dq.tolist(), "joint_loads": seen.tau_ext_hat_filtered.tolist()}
            state["condition"] = CONDITION.get(mode, "protective_stop")
            state["condition_text"] = f"{mode} {seen.current_errors}"[:200]
            if hand:
                state |= {"opening_m": hand.width, "finger_positions": [hand.width / 2.0] * 2}
                state |= {"holding": hand.is_grasped and hand.width > 0.002}
            if socket.poll(0, zmq.POLLOUT):  # there is a robot side
                socket.send(msgpack.packb(state))
        time.sleep(PERIOD_S)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        print("valid: franka_arm.py ADDRESS-OF-THE-ROBOT [tcp://127.0.0.1:5601]", file=sys.stderr)
        sys.exit(2)
    try:
        main(*sys.argv[1:])
    except KeyboardInterrupt:
        pass
    except zmq.ZMQError as error:
        print(f"{error}; valid: tcp://127.0.0.1:5601", file=sys.stderr)
        sys.exit(2)
