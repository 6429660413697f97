"""Join an arm and a hand, each an MJCF file such as robosuite's, into one model with absolute paths to its meshes.

python docs/robots/compose.py ARM.xml HAND.xml OUT.xml [--pin=LINK,LINK,X,Y,Z ...] [BODY [ANGLE...]]

BODY: the arm's body that carries the hand; right_hand unless given. ANGLE: the arm's joints in the keyframe `home`,
then the hand's, if its parts collide at 0. --pin: joins two links of the hand, at X, Y, Z (m) in the first one's frame,
in place of their contacts, by which a linkage that is open jams. robosuite's 2F-85 gets its two pins by itself.
"""

import re
import sys
from pathlib import Path

import mujoco  # type: ignore[import-untyped]

PIN_OF_2F85 = "--pin={side}_inner_finger,{side}_inner_knuckle,0,-0.0179,0.0065"


def read(path: Path) -> mujoco.MjSpec:
    """Read a file whose meshes may be declared twice, or whose default classes have a stray group, as robosuite's."""
    seen: set[str] = set()

    def once(found: re.Match[str]) -> str:
        name = re.search(r'name="([^"]+)"', found[0])
        again = name is not None and name[1] in seen
        seen.update([name[1]] if name else [])
        return "" if again else found[0]

    text = re.sub(r"<mesh [^>]*/>", once, path.read_text())
    text = re.sub(r'(<default class="[^"]*") group="\d"', r"\1", text)
    return mujoco.MjSpec.from_string(re.sub(r'file="(?=[^/])', f'file="{path.parent.resolve()}/', text))


def main(arm_path: str, hand_path: str, out_path: str, *more: str) -> None:
    """Write the joined model, with robosuite's contacts, and steps of 1 ms: at 2 ms, linkages without dampers break."""
    pins = [word for word in more if word.startswith("--pin=")]
    carrier, *angles = [word for word in more if word not in pins] or ["right_hand"]
    arm, hand = read(Path(arm_path)), read(Path(hand_path))
    if arm.body(carrier) is None:
        bodies = ", ".join(body.name for body in arm.bodies if body.name)
        raise ValueError(f"the arm has no body {carrier!r}; valid: {bodies}")
    links = {f"{side}_inner_{link}_joint" for side in ("left", "right") for link in ("finger", "knuckle")}
    # Equalities couple these joints in robosuite's 2F-140.
    if not pins and not hand.equalities and links <= {joint.name for joint in hand.joints}:
        pins = [PIN_OF_2F85.format(side=side) for side in ("left", "right")]
        print("the hand is a 2F-85 whose linkage is open, and gets", *pins)
    if 'angle="' not in Path(hand_path).read_text():
        hand.compiler.degree = arm.compiler.degree
    arm.attach(hand, frame=arm.body(carrier).add_frame(), prefix="g_")
    arm.option.timestep, arm.option.integrator = 0.001, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # As in robosuite's base.xml, which a robot's own file leaves out.
    arm.option.cone, arm.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 20.0
    for pin in pins:
        if pin.count(",") != 4:
            raise ValueError(f"{pin}; valid: --pin=LINK,LINK,X,Y,Z")
        one, other, *place = pin.removeprefix("--pin=").split(",")
        names = f"g_{one}", f"g_{other}"
        arm.add_exclude(bodyname1=names[0], bodyname2=names[1])
        joined = arm.add_equality(type=mujoco.mjtEq.mjEQ_CONNECT, objtype=mujoco.mjtObj.mjOBJ_BODY)
        joined.name1, joined.name2 = names
        joined.data[:3] = [float(part) for part in place]
    model = arm.compile()
    chain, body = set(), model.body(carrier).id
    while body:
        chain.add(body)
        body = model.body_parentid[body]
    if angles:
        joints = [joint for joint in range(model.njnt) if model.jnt_bodyid[joint] in chain]
        joints += [joint for joint in range(model.njnt) if model.joint(joint).name.startswith("g_")]
        start = model.qpos0.copy()
        start[model.jnt_qposadr[joints[: len(angles)]]] = [float(angle) for angle in angles]
        arm.add_key(name="home", qpos=start)
        arm.compile()
    Path(out_path).write_text(arm.to_xml())


if __name__ == "__main__":
    if len(sys.argv) < 4:
        print(__doc__, end="", file=sys.stderr)
        sys.exit(0 if "--help" in sys.argv else 2)
    try:
        main(*sys.argv[1:])
    except (OSError, ValueError) as error:
        print("compose:", *str(error).split(), file=sys.stderr)
        sys.exit(2)
