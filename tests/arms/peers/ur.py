"""Stand-in for the controller of a UR arm, as far as ur_rtde's own clients speak with one: no URScript is run.

Arguments: HOST LOG. Serves dashboard (29999), scripts (30003), RTDE (30004) and the gripper's socket (63352). It does
with registers what ur_rtde's script does: a speed is repeated without end. Without a new register for two periods of
the watchdog the program ends in a protective stop, as people report of URSim. Orders on the standard input:
`safety MODE`, `mode MODE`, `between COUNTS` (what the gripper meets), `local`, `halt` (the program, at the pendant),
`silent` (no more data, the sockets stay), `drop` (the connection that commands).
"""

import asyncio
import struct
import sys
import time
from collections.abc import Awaitable, Callable

from tests.arms.peers.positions import hear_orders, log_positions

PERIOD_S, STOP_RAD_S2, ON, PROGRAM, NORMAL, PROTECTIVE, RUNNING = 0.004, 4.0, 1, 2, 1, 3, 7
PROTOCOL, VERSION, DATA, OUTPUTS, INPUTS, START = 86, 118, 85, 79, 73, 83
WHOLE = {"robot_mode": "i", "safety_mode": "i", "robot_status_bits": "I", "safety_status_bits": "I"}
WHOLE |= {"runtime_state": "I", "actual_q": "6d", "actual_qd": "6d", "external_force_torque": "6d"}
NAMES = {"i": "INT32", "I": "UINT32", "d": "DOUBLE", "6d": "VECTOR6D"}
Talk = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


def form(name: str) -> str:
    return WHOLE.get(name, "i" if "_int_register_" in name else "d")


class Controller:
    """Joints, program, safety and registers."""

    def __init__(self) -> None:
        self.q, self.qd, self.target, self.most = [0.0, -1.2, 1.5, -1.8, -1.57, 0.0], [0.0] * 6, [0.0] * 6, STOP_RAD_S2
        self.modes, self.flags = {"safety": NORMAL, "mode": RUNNING, "between": 255}, {""}
        self.program = self.busy = False
        self.registers: dict[str, float] = {}
        self.watchdog_hz = self.unwritten_s = self.grip = 0.0
        self.script_state = self.grip_goal = 0
        self.owner: asyncio.StreamWriter | None = None

    def order(self, words: list[str]) -> None:
        if len(words) == 2:
            self.modes[words[0]] = int(words[1])
        self.flags.add(words[0])
        if words[0] == "drop" and self.owner is not None:
            self.owner.transport.abort()
        self.program = self.program and words[0] != "halt" and self._drivable

    @property
    def _drivable(self) -> bool:
        return self.modes["safety"] == NORMAL and self.modes["mode"] == RUNNING

    def begin(self) -> None:
        """Begin the program that was sent, if the arm's mode allows."""
        self.program = self._drivable
        self.watchdog_hz, self.busy, self.target = 0.0, False, [0.0] * 6

    def turn(self, passed_s: float) -> None:
        self.unwritten_s += passed_s
        command = int(self.registers.get("input_int_register_0", 0))
        reals = [self.registers.get(f"input_double_register_{number}", 0.0) for number in range(8)]
        if self.program:
            self.script_state = 2 if command and self.busy else 1
            if command == 9:  # speedJ
                self.target, self.most = reals[:6], reals[6]
            elif command and not self.busy:
                self.busy, self.script_state = True, 2
                if command == 35:
                    self.watchdog_hz, self.unwritten_s = reals[0], 0.0
                elif command == 15:
                    self.target, self.most = [0.0] * 6, reals[0]
                elif command == 255:
                    self.program = False
            elif not command:
                self.busy = False
            if self.watchdog_hz and self.unwritten_s > 2.0 / self.watchdog_hz:
                self.program, self.modes["safety"] = False, PROTECTIVE
        if not self.program:
            self.target, self.most = [0.0] * 6, STOP_RAD_S2
        gaps = [aim - speed for aim, speed in zip(self.target, self.qd, strict=True)]
        share = min(1.0, self.most * passed_s / max(*map(abs, gaps), 1e-9))  # the leading axis has `most`
        self.qd = [speed + share * gap for speed, gap in zip(self.qd, gaps, strict=True)]
        self.q = [angle + speed * passed_s for angle, speed in zip(self.q, self.qd, strict=True)]
        step = min(max(self.grip_goal - self.grip, -200.0 * passed_s), 200.0 * passed_s)
        self.grip = min(self.grip + step, self.modes["between"])


class Sockets:
    """Ports of the controller."""

    def __init__(self, arm: Controller) -> None:
        self.arm = arm

    async def dashboard(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"Connected: Universal Robots Dashboard Server\n")
        while line := (await reader.readline()).decode().strip():
            if line == "stop":
                self.arm.program = False
            words = {"safetymode": f"Safetymode: {self.arm.modes['safety']}", "stop": "Stopped"}
            words |= {"robotmode": f"Robotmode: {self.arm.modes['mode']}", "get serial number": "20225500000"}
            words |= {"is in remote control": str("local" not in self.arm.flags).lower()}
            words |= {"PolyscopeVersion": "URSoftware 5.12.0.1101319"}
            writer.write((words.get(line, "done") + "\n").encode())

    async def script(self, reader: asyncio.StreamReader, _: asyncio.StreamWriter) -> None:
        while text := await reader.read(1 << 20):
            if b"NODE_CONTROL_LOOP_ENDS" in text:
                self.arm.begin()

    async def gripper(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        arm = self.arm
        while words := (await reader.readline()).decode().split():
            if words[0] == "SET":
                arm.grip_goal, answer = int(words[words.index("POS") + 1]), "ack"
            else:
                held = arm.grip >= arm.modes["between"] < arm.grip_goal
                answer = f"POS {round(arm.grip)}" if words[1] == "POS" else f"OBJ {2 if held else 3}"
            writer.write((answer + "\n").encode())

    async def rtde(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        inputs: list[list[str]] = []
        outputs: list[str] = []
        senders: list[asyncio.Task[None]] = []
        try:
            while True:
                size, kind = struct.unpack(">HB", await reader.readexactly(3))
                body = await reader.readexactly(size - 3)
                names = [name for name in body[8 if kind == OUTPUTS else 0 :].decode("latin-1").split(",") if name]
                answer = b"\x01"
                if kind == DATA:
                    self._write(inputs[body[0] - 1], body[1:])
                    continue
                if kind == VERSION:
                    answer = struct.pack(">4I", 5, 12, 0, 0)
                elif kind == OUTPUTS:
                    outputs, answer = names, b"\x01" + ",".join(NAMES[form(name)] for name in names).encode()
                elif kind == INPUTS:
                    free = self.arm.owner in (None, writer)
                    self.arm.owner = self.arm.owner or writer
                    inputs.append(names)
                    types = ",".join(NAMES[form(name)] if free else "IN_USE" for name in names)
                    answer = bytes([len(inputs)]) + types.encode()
                writer.write(struct.pack(">HB", 3 + len(answer), kind) + answer)
                if kind == START:
                    senders.append(asyncio.create_task(self._send(outputs, writer)))
        except (asyncio.IncompleteReadError, ConnectionError):
            self.arm.owner = None if self.arm.owner is writer else self.arm.owner
            for sender in senders:
                sender.cancel()
            writer.close()

    def _write(self, names: list[str], body: bytes) -> None:
        values = struct.unpack(">" + "".join(map(form, names)), body)
        self.arm.registers |= dict(zip(names, values, strict=False))
        self.arm.unwritten_s = 0.0

    async def _send(self, names: list[str], writer: asyncio.StreamWriter) -> None:
        while True:
            if "silent" not in self.arm.flags:
                body = b"\x01" + b"".join(struct.pack(">" + form(name), *self._say(name)) for name in names)
                writer.write(struct.pack(">HB", 3 + len(body), DATA) + body)
            await asyncio.sleep(PERIOD_S)

    def _say(self, name: str) -> list[float]:
        arm, safety = self.arm, self.arm.modes["safety"]
        bits = 1 if safety == NORMAL else 1 << 2 if safety == PROTECTIVE else 1 << 7
        whole = {"robot_mode": arm.modes["mode"], "safety_mode": safety, "safety_status_bits": bits}
        whole |= {"robot_status_bits": ON + PROGRAM * arm.program, "runtime_state": 2 if arm.program else 1}
        whole |= {"output_int_register_0": arm.script_state}
        lists = {"actual_q": arm.q, "actual_qd": arm.qd, "timestamp": [time.monotonic()]}
        return lists[name] if name in lists else [whole.get(name, 0)]


async def main(host: str, log: str) -> None:
    """Serve until a signal ends it."""
    arm = Controller()
    ports = Sockets(arm)
    served: dict[int, Talk] = {
        29999: ports.dashboard,
        30003: ports.script,
        30004: ports.rtde,
        63352: ports.gripper,
    }
    for port, talk in served.items():
        await asyncio.start_server(talk, host, port)
    log_positions(log, lambda: arm.q)
    hear_orders(arm.order)
    print("serves", flush=True)
    before_s = time.monotonic()
    while True:
        await asyncio.sleep(PERIOD_S)
        now_s = time.monotonic()
        arm.turn(min(now_s - before_s, 5.0 * PERIOD_S))  # a stand-in that did not get the processor saw no silence
        before_s = now_s


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
